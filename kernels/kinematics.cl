// Forward kinematics of a tree of joints, and its gradient to the joint rotations and the root translation.
//   local    l_j = exp(axis_angle_j / 2) as a unit quaternion: smooth at every angle, so 0, pi and 2 pi are no special
//            places; only sin(x)/x needs its series near 0
//   global   q_j = q_parent l_j;   t_j = t_parent + R(q_parent) (rest_j - rest_parent)
//   root     t_0 = rest_0 + translation
//   output   rotations_j = q_j;    matrices_j = [R(q_j) | t_j - R(q_j) rest_j]  (posed * inverse(canonical))
// Shapes: axis_angles (J,3) radians, translation (3) and rest (J,3) metres, parents (J) with parents[0] < 0 and
// parents[j] < j, matrices (J,3,4), rotations (J,4) as w x y z.
// Launch: one item in all; the tree is a short serial chain. Deterministic.
#include "common/real.cl"
#include "common/quaternion.cl"

// Taylor series of half_sine_ratio and its slope below: the first term left out is less than 2e-14 at the border.
#define SERIES_BORDER ((REAL)0.25)
#define SERIES(x, a, b, c, d, e) \
  ((REAL)(a) + (x) * ((REAL)(b) + (x) * ((REAL)(c) + (x) * ((REAL)(d) + (x) * (REAL)(e)))))

// sin(angle / 2) / angle as a function of angle^2.
REAL half_sine_ratio(const REAL squared) {
  if (squared < SERIES_BORDER) {
    return SERIES(squared, 0.5, -1.0 / 48, 1.0 / 3840, -1.0 / 645120, 1.0 / 185794560);
  }
  const REAL angle = sqrt(squared);
  return sin((REAL)0.5 * angle) / angle;
}

// d half_sine_ratio / d axis_angle_i = axis_angle_i * this.
REAL half_sine_ratio_slope(const REAL squared, const REAL cosine, const REAL ratio) {
  if (squared < SERIES_BORDER) {
    return SERIES(squared, -1.0 / 24, 1.0 / 960, -1.0 / 107520, 1.0 / 23224320, -1.0 / 8174960640);
  }
  return ((REAL)0.5 * cosine - ratio) / squared;
}

REAL4 local_rotation(global const REAL* axis_angles, const int joint) {
  const REAL3 a = vload3(joint, axis_angles);
  const REAL squared = dot(a, a);
  return (REAL4)(cos((REAL)0.5 * sqrt(squared)), half_sine_ratio(squared) * a);
}

kernel void kinematics_forward(global const REAL* axis_angles, global const REAL* translation, global const REAL* rest,
                               global const int* parents, global REAL* matrices, global REAL* rotations,
                               const int joints) {
  if (get_global_id(0) > 0) return;
  for (int j = 0; j < joints; ++j) {
    const int parent = parents[j];
    const REAL3 rest_j = vload3(j, rest);
    REAL4 q = local_rotation(axis_angles, j);
    REAL3 t = rest_j + vload3(0, translation);
    if (parent >= 0) {
      q = quaternion_multiply(vload4(parent, rotations), q);
      // t_parent + R (rest_j - rest_parent) is the parent's own output matrix applied to rest_j.
      const REAL4 point = (REAL4)(rest_j, 1);
      global const REAL* rows = matrices + parent * 12;
      t = (REAL3)(dot(vload4(0, rows), point), dot(vload4(1, rows), point), dot(vload4(2, rows), point));
    }
    vstore4(q, j, rotations);
    REAL4 row0, row1, row2;
    quaternion_to_rows(q, &row0, &row1, &row2);
    const REAL4 negative_rest = (REAL4)(-rest_j, 0);
    row0.w = t.x + dot(row0, negative_rest);
    row1.w = t.y + dot(row1, negative_rest);
    row2.w = t.z + dot(row2, negative_rest);
    vstore4(row0, j * 3, matrices);
    vstore4(row1, j * 3 + 1, matrices);
    vstore4(row2, j * 3 + 2, matrices);
  }
}

// d_matrices, d_rotations: gradients of the outputs, overwritten while children add theirs to their parents'.
// d_axis_angles (J,3), d_translation (3): written.
kernel void kinematics_backward(global const REAL* axis_angles, global const REAL* rest, global const int* parents,
                                global const REAL* rotations, global REAL* d_matrices, global REAL* d_rotations,
                                global REAL* d_axis_angles, global REAL* d_translation, const int joints) {
  if (get_global_id(0) > 0) return;
  for (int j = joints - 1; j >= 0; --j) {
    const int parent = parents[j];
    const REAL3 rest_j = vload3(j, rest);
    const REAL4 negative_rest = (REAL4)(-rest_j, 0);
    REAL4 row0 = vload4(j * 3, d_matrices), row1 = vload4(j * 3 + 1, d_matrices), row2 = vload4(j * 3 + 2, d_matrices);
    const REAL3 dt = (REAL3)(row0.w, row1.w, row2.w);
    row0 += dt.x * negative_rest;
    row1 += dt.y * negative_rest;
    row2 += dt.z * negative_rest;
    REAL4 dq = vload4(j, d_rotations) + quaternion_from_row_gradients(vload4(j, rotations), row0, row1, row2);
    if (parent >= 0) {
      const REAL4 local_j = local_rotation(axis_angles, j);
      const REAL4 share = quaternion_multiply(dq, quaternion_conjugate(local_j));
      vstore4(vload4(parent, d_rotations) + share, parent, d_rotations);
      dq = quaternion_multiply(quaternion_conjugate(vload4(parent, rotations)), dq);
      // t_j is the parent's matrix applied to (rest_j, 1).
      const REAL4 point = (REAL4)(rest_j, 1);
      vstore4(vload4(parent * 3, d_matrices) + dt.x * point, parent * 3, d_matrices);
      vstore4(vload4(parent * 3 + 1, d_matrices) + dt.y * point, parent * 3 + 1, d_matrices);
      vstore4(vload4(parent * 3 + 2, d_matrices) + dt.z * point, parent * 3 + 2, d_matrices);
    } else {
      vstore3(dt, 0, d_translation);
    }
    const REAL3 a = vload3(j, axis_angles);
    const REAL squared = dot(a, a), ratio = half_sine_ratio(squared);
    const REAL slope = half_sine_ratio_slope(squared, cos((REAL)0.5 * sqrt(squared)), ratio);
    const REAL3 dv = dq.yzw;
    vstore3(ratio * dv + a * (slope * dot(dv, a) - (REAL)0.5 * ratio * dq.x), j, d_axis_angles);
  }
}
