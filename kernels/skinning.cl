// Linear blend skinning of positions and rotations, and the gradients to both and to the joints.
//   positions:  output_i = sum_k w_ik M_jik (p_i, 1)
//   rotations:  u_i = normalise(sum_k w_ik s_ik r_jik), output_i = u_i q_i; s_ik = +-1 puts every joint's quaternion on
//               the side of the first influence's. As that is the heaviest, |sum| >= w_i0 >= 1 / K in every pose
// Shapes: influence_joints Int32 (N,K) and influence_weights (N,K), heaviest first; matrices (J,3,4); joint_rotations
// (J,4) and rotations (N,4) as w x y z; positions (N,3).
// Launch: one item per Gaussian, local size free, except for the partial sums over Gaussians (below). No local memory.
// Deterministic: partial sums of fixed blocks of Gaussians, added in order.
#include "common/real.cl"
#include "common/quaternion.cl"

#define GAUSSIAN_OR_RETURN                                                      \
  const int i = get_global_id(0);                                               \
  if (i >= count) return;                                                       \
  global const int* joints = influence_joints + (long)i * influences;           \
  global const REAL* weights = influence_weights + (long)i * influences

void blend_rows(global const int* joints, global const REAL* weights, global const REAL* matrices, const int influences,
                REAL4* row0, REAL4* row1, REAL4* row2) {
  *row0 = 0;
  *row1 = 0;
  *row2 = 0;
  for (int k = 0; k < influences; ++k) {
    global const REAL* rows = matrices + joints[k] * 12;
    const REAL weight = weights[k];
    *row0 += weight * vload4(0, rows);
    *row1 += weight * vload4(1, rows);
    *row2 += weight * vload4(2, rows);
  }
}

kernel void skin_positions_forward(global const REAL* positions, global const int* influence_joints,
                                   global const REAL* influence_weights, global const REAL* matrices,
                                   global REAL* output, const int count, const int influences) {
  GAUSSIAN_OR_RETURN;
  REAL4 row0, row1, row2;
  blend_rows(joints, weights, matrices, influences, &row0, &row1, &row2);
  const REAL4 point = (REAL4)(vload3(i, positions), 1);
  vstore3((REAL3)(dot(row0, point), dot(row1, point), dot(row2, point)), i, output);
}

// d_positions = (blended 3x3 part)^T d_output
kernel void skin_positions_backward(global const REAL* d_output, global const int* influence_joints,
                                    global const REAL* influence_weights, global const REAL* matrices,
                                    global REAL* d_positions, const int count, const int influences) {
  GAUSSIAN_OR_RETURN;
  REAL4 row0, row1, row2;
  blend_rows(joints, weights, matrices, influences, &row0, &row1, &row2);
  const REAL3 d = vload3(i, d_output);
  vstore3((d.x * row0 + d.y * row1 + d.z * row2).xyz, i, d_positions);
}

REAL side_of(const REAL4 quaternion, const REAL4 reference) {
  return dot(quaternion, reference) < 0 ? (REAL)-1 : (REAL)1;
}

REAL4 blend_quaternions(global const int* joints, global const REAL* weights, global const REAL* joint_rotations,
                        const int influences) {
  const REAL4 reference = vload4(joints[0], joint_rotations);
  REAL4 blend = 0;
  for (int k = 0; k < influences; ++k) {
    const REAL4 quaternion = vload4(joints[k], joint_rotations);
    blend += weights[k] * side_of(quaternion, reference) * quaternion;
  }
  return blend;
}

kernel void skin_rotations_forward(global const REAL* rotations, global const int* influence_joints,
                                   global const REAL* influence_weights, global const REAL* joint_rotations,
                                   global REAL* output, const int count, const int influences) {
  GAUSSIAN_OR_RETURN;
  const REAL4 blend = blend_quaternions(joints, weights, joint_rotations, influences);
  const REAL scale = 1 / sqrt(dot(blend, blend));
  vstore4(quaternion_multiply(scale * blend, vload4(i, rotations)), i, output);
}

// d_rotations (N,4) and d_blend (N,4), the gradient of the blend before its normalisation.
kernel void skin_rotations_backward(global const REAL* d_output, global const REAL* rotations,
                                    global const int* influence_joints, global const REAL* influence_weights,
                                    global const REAL* joint_rotations, global REAL* d_rotations, global REAL* d_blend,
                                    const int count, const int influences) {
  GAUSSIAN_OR_RETURN;
  const REAL4 blend = blend_quaternions(joints, weights, joint_rotations, influences);
  const REAL scale = 1 / sqrt(dot(blend, blend));
  const REAL4 unit = scale * blend;
  const REAL4 d = vload4(i, d_output);
  vstore4(quaternion_multiply(quaternion_conjugate(unit), d), i, d_rotations);
  const REAL4 d_unit = quaternion_multiply(d, quaternion_conjugate(vload4(i, rotations)));
  vstore4(scale * (d_unit - dot(d_unit, unit) * unit), i, d_blend);
}

// Sums over the Gaussians of a block, one array of (J, 12 or 4) per block: partial (blocks, J, 12 or 4).
// WIDE: launch one item per block, which owns the whole array. Else: (J rounded up, blocks) items; each owns one joint
// of one block and keeps its sum in registers, so that nothing is shared between items.
#if WIDE
#define OWN_JOINTS                                                        \
  const int block = get_global_id(0);                                     \
  const int first = block * block_size, last = min(first + block_size, count); \
  if (first >= count) return
#else
#define OWN_JOINTS                                                        \
  const int own = get_global_id(0), block = get_global_id(1);             \
  const int first = block * block_size, last = min(first + block_size, count); \
  if (own >= joints || first >= count) return
#endif

// Gradient of the joint matrices: sum_i w_ij d_output_i (p_i, 1)^T
kernel void skin_matrices_partial(global const REAL* d_output, global const REAL* positions,
                                  global const int* influence_joints, global const REAL* influence_weights,
                                  global REAL* partial, const int count, const int influences, const int joints,
                                  const int block_size) {
  OWN_JOINTS;
#if WIDE
  global REAL* sums = partial + (long)block * joints * 12;
  for (int n = 0; n < joints * 3; ++n) vstore4((REAL4)(0), n, sums);
#else
  REAL4 row0 = 0, row1 = 0, row2 = 0;
#endif
  for (int i = first; i < last; ++i) {
    const REAL4 point = (REAL4)(vload3(i, positions), 1);
    const REAL3 d = vload3(i, d_output);
    for (int k = 0; k < influences; ++k) {
      const int joint = influence_joints[(long)i * influences + k];
      const REAL weight = influence_weights[(long)i * influences + k];
#if WIDE
      if (weight == 0) break;  // heaviest first: what follows is zero too
      global REAL* rows = sums + joint * 12;
      vstore4(vload4(0, rows) + weight * d.x * point, 0, rows);
      vstore4(vload4(1, rows) + weight * d.y * point, 1, rows);
      vstore4(vload4(2, rows) + weight * d.z * point, 2, rows);
#else
      const REAL share = joint == own ? weight : 0;
      row0 += share * d.x * point;
      row1 += share * d.y * point;
      row2 += share * d.z * point;
#endif
    }
  }
#if !WIDE
  global REAL* sums = partial + ((long)block * joints + own) * 12;
  vstore4(row0, 0, sums);
  vstore4(row1, 1, sums);
  vstore4(row2, 2, sums);
#endif
}

// Gradient of the joint rotations: sum_i w_ij s_ij d_blend_i
kernel void skin_rotations_partial(global const REAL* d_blend, global const REAL* joint_rotations,
                                   global const int* influence_joints, global const REAL* influence_weights,
                                   global REAL* partial, const int count, const int influences, const int joints,
                                   const int block_size) {
  OWN_JOINTS;
#if WIDE
  global REAL* sums = partial + (long)block * joints * 4;
  for (int n = 0; n < joints; ++n) vstore4((REAL4)(0), n, sums);
#else
  REAL4 sum = 0;
  const REAL4 own_rotation = vload4(own, joint_rotations);
#endif
  for (int i = first; i < last; ++i) {
    const REAL4 reference = vload4(influence_joints[(long)i * influences], joint_rotations);
    const REAL4 d = vload4(i, d_blend);
    for (int k = 0; k < influences; ++k) {
      const int joint = influence_joints[(long)i * influences + k];
      const REAL weight = influence_weights[(long)i * influences + k];
#if WIDE
      if (weight == 0) break;
      const REAL side = side_of(vload4(joint, joint_rotations), reference);
      vstore4(vload4(joint, sums) + weight * side * d, joint, sums);
#else
      sum += (joint == own ? weight * side_of(own_rotation, reference) : 0) * d;
#endif
    }
  }
#if !WIDE
  vstore4(sum, (long)block * joints + own, partial);
#endif
}

// output[e] = sum over blocks of partial[block][e], in order; one item per element.
kernel void skin_sum_partials(global const REAL* partial, global REAL* output, const int elements, const int blocks) {
  const int e = get_global_id(0);
  if (e >= elements) return;
  REAL total = 0;
  for (int block = 0; block < blocks; ++block) total += partial[(long)block * elements + e];
  output[e] = total;
}
