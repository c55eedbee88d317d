// EWA projection of 3D Gaussians: camera transform, Jacobian of the perspective, 2D covariance with its blur, culling.
// Forward writes a record per splat (common/splat.cl) and the depth's sort key; backward sums a splat's gradient slots
// in their order and takes the sum to positions, rotations, log-scales, opacities and colours.
// Arrays: positions (N,3), rotations (N,4) wxyz, log_scales (N,3), opacities (N), colors (N,3), records
// (N,RECORD_SIZE), depth_keys (N) uint, slot_counts and slot_offsets (N) uint, slots (M,SLOT_SIZE).
// -D ANTIALIAS=0|1: opacity is multiplied by sqrt(det / det with blur), at least COMPENSATION_MIN.
// Launch: one item per V consecutive splats; local size free. Deterministic: every element has one writer, sums go in
// order.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/columns.cl"
#include "common/prefetch.cl"

#define COMPENSATION_MIN ((REAL)0.005)
#define QUATERNION_MIN ((REAL)1e-6)
#define LOG_SCALE_MAX ((REAL)80)
#define LARGEST ((REAL)3e38)
#define CULLED_KEY 0xFFFFFFFFu

typedef struct {
  REAL rotation[9], translation[3];
  REAL fx, fy, cx, cy;
  REAL left, right, top, bottom;  // limits of x/z and y/z where the Jacobian is taken
  REAL width, height, near_plane, blur;
} View;

// Everything between a splat's parameters and its 2D covariance. The covariance is A A^T with A = J W R(q) S (2x3) and
// is kept divided by unit^2, where unit is A's largest entry (at least 1), so that squares of huge scales stay finite;
// its determinant is |a0 x a1|^2 by Lagrange's identity, which loses nothing for tiny ones.
typedef struct {
  REALV x, y, z, inverse_z, ratio_x, ratio_y;  // camera space; ratios clamped to the limits
  REALV w, i, j, k, inverse_norm;              // normalised quaternion
  REALV log_scale[3], scale[3];
  REALV r[9], p[6], a[6];  // R(q), J W, A / unit
  REALV unit, xx, xy, yy, bare_determinant, blurred_xx, blurred_yy, determinant;
  REALV compensation_squared;
} Footprint;

inline Footprint footprint(const View view, global const REAL* positions, global const REAL* rotations,
                           global const REAL* log_scales, const long first, const long count) {
  Footprint f;
  REALV position[3], q[4];
  gather_rows(positions, first, 3, count, position);
  gather_rows(rotations, first, 4, count, q);
  gather_rows(log_scales, first, 3, count, f.log_scale);
  REALV in_camera[3];
  for (int row = 0; row < 3; ++row) {
    in_camera[row] = view.rotation[3 * row] * position[0] + view.rotation[3 * row + 1] * position[1] +
                     view.rotation[3 * row + 2] * position[2] + view.translation[row];
  }
  f.x = in_camera[0];
  f.y = in_camera[1];
  f.z = in_camera[2];
  f.inverse_z = 1 / f.z;
  f.ratio_x = fmin(fmax(f.x * f.inverse_z, view.left), view.right);
  f.ratio_y = fmin(fmax(f.y * f.inverse_z, view.top), view.bottom);

  f.inverse_norm = 1 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  f.w = q[0] * f.inverse_norm;
  f.i = q[1] * f.inverse_norm;
  f.j = q[2] * f.inverse_norm;
  f.k = q[3] * f.inverse_norm;
  f.r[0] = 1 - 2 * (f.j * f.j + f.k * f.k);
  f.r[1] = 2 * (f.i * f.j - f.w * f.k);
  f.r[2] = 2 * (f.i * f.k + f.w * f.j);
  f.r[3] = 2 * (f.i * f.j + f.w * f.k);
  f.r[4] = 1 - 2 * (f.i * f.i + f.k * f.k);
  f.r[5] = 2 * (f.j * f.k - f.w * f.i);
  f.r[6] = 2 * (f.i * f.k - f.w * f.j);
  f.r[7] = 2 * (f.j * f.k + f.w * f.i);
  f.r[8] = 1 - 2 * (f.i * f.i + f.j * f.j);

  const REALV along_x = view.fx * f.inverse_z, along_y = view.fy * f.inverse_z;
  f.unit = 1;
  for (int c = 0; c < 3; ++c) {
    f.p[c] = along_x * (view.rotation[c] - f.ratio_x * view.rotation[6 + c]);
    f.p[3 + c] = along_y * (view.rotation[3 + c] - f.ratio_y * view.rotation[6 + c]);
  }
  for (int c = 0; c < 3; ++c) {
    f.scale[c] = exp_clamped(f.log_scale[c]);
    f.a[c] = (f.p[0] * f.r[c] + f.p[1] * f.r[3 + c] + f.p[2] * f.r[6 + c]) * f.scale[c];
    f.a[3 + c] = (f.p[3] * f.r[c] + f.p[4] * f.r[3 + c] + f.p[5] * f.r[6 + c]) * f.scale[c];
    f.unit = fmax(f.unit, fmax(fabs(f.a[c]), fabs(f.a[3 + c])));
  }
  const REALV inverse_unit = 1 / f.unit;
  for (int c = 0; c < 6; ++c) f.a[c] *= inverse_unit;
  const REALV blur = view.blur * inverse_unit * inverse_unit;
  f.xx = f.a[0] * f.a[0] + f.a[1] * f.a[1] + f.a[2] * f.a[2];
  f.xy = f.a[0] * f.a[3] + f.a[1] * f.a[4] + f.a[2] * f.a[5];
  f.yy = f.a[3] * f.a[3] + f.a[4] * f.a[4] + f.a[5] * f.a[5];
  const REALV n0 = f.a[1] * f.a[5] - f.a[2] * f.a[4], n1 = f.a[2] * f.a[3] - f.a[0] * f.a[5],
              n2 = f.a[0] * f.a[4] - f.a[1] * f.a[3];
  f.bare_determinant = n0 * n0 + n1 * n1 + n2 * n2;
  f.blurred_xx = f.xx + blur;
  f.blurred_yy = f.yy + blur;
  f.determinant = f.bare_determinant + blur * (f.xx + f.blurred_yy);
  f.compensation_squared = f.bare_determinant / f.determinant;
  return f;
}

kernel void project_forward(global const REAL* positions, global const REAL* rotations, global const REAL* log_scales,
                            global const REAL* opacities, global const REAL* colors, global REAL* records,
                            global uint* depth_keys, const View view, const long count) {
  const long first = get_global_id(0) * (long)V;
  if (first >= count) return;
  const Footprint f = footprint(view, positions, rotations, log_scales, first, count);
  REALV opacity = gather(opacities, first, 1, 0, count);
  const REALV given_opacity = opacity;
#if ANTIALIAS
  opacity *= fmax(sqrt(f.compensation_squared), COMPENSATION_MIN);
#endif
  const REALV u = view.fx * f.x * f.inverse_z + view.cx, v = view.fy * f.y * f.inverse_z + view.cy;
  const REALV log2_opacity = log2(opacity);
  const REALV reach = sqrt(fmax((log2_opacity - LOG2_ALPHA_MIN) * (2 / LOG2_E), (REALV)0));
  const REALV deviation_x = f.unit * sqrt(f.blurred_xx), deviation_y = f.unit * sqrt(f.blurred_yy);
  const REALV width = reach * deviation_x, height = reach * deviation_y;
  REALV color[3];
  gather_rows(colors, first, 3, count, color);

  // Every guard states what a visible splat satisfies: a NaN fails it.
  const REALV visible =
      (f.z >= view.near_plane && f.z <= LARGEST && f.inverse_norm <= 1 / sqrt(QUATERNION_MIN) && f.inverse_norm > 0 &&
       given_opacity <= 1 && opacity >= ALPHA_MIN && fabs(color[0]) <= LARGEST && fabs(color[1]) <= LARGEST &&
       fabs(color[2]) <= LARGEST && fabs(f.log_scale[0]) <= LOG_SCALE_MAX && fabs(f.log_scale[1]) <= LOG_SCALE_MAX &&
       fabs(f.log_scale[2]) <= LOG_SCALE_MAX && width <= LARGEST && height <= LARGEST && f.determinant >= (REAL)1e-37 &&
       u + width > 0 && u - width < view.width && v + height > 0 && v - height < view.height)
          ? (REALV)1
          : (REALV)-1;

  REALV fields[RECORD_COLOR + 3];
  fields[RECORD_U] = u;
  fields[RECORD_V] = v;
  fields[RECORD_SHARPNESS_X] = sqrt(LOG2_E / 2 * f.blurred_yy / f.determinant) / f.unit;
  fields[RECORD_SLOPE] = f.xy / f.blurred_yy;
  fields[RECORD_SHARPNESS_Y] = LOG2_E / 2 / f.blurred_yy / f.unit / f.unit;
  fields[RECORD_LOG2_OPACITY] = log2_opacity;
  fields[RECORD_WIDTH] = visible > 0 ? width : (REALV)-1;
  fields[RECORD_HEIGHT] = height;
  fields[RECORD_TILT] = reach * f.unit * f.xy / sqrt(f.blurred_xx);
  for (int c = 0; c < 3; ++c) fields[RECORD_COLOR + c] = color[c];
  const int lanes = lanes_from(first, count);
  for (int field = 0; field < RECORD_COLOR + 3; ++field)
    scatter(fields[field], records, first, RECORD_SIZE, field, lanes);

  // Positive floats order as their bits do.
  REAL depth[V], seen[V];
  STORE_VECTOR(f.z, 0, depth);
  STORE_VECTOR(visible, 0, seen);
  for (int lane = 0; lane < lanes; ++lane)
    depth_keys[first + lane] = seen[lane] > 0 ? as_uint((float)depth[lane]) : CULLED_KEY;
}

// Absent (null) outputs are skipped.
kernel void project_backward(global const REAL* positions, global const REAL* rotations, global const REAL* log_scales,
                             global const REAL* opacities, global const uint* slot_counts,
                             global const uint* slot_offsets, global const REAL* slots, global REAL* d_positions,
                             global REAL* d_rotations, global REAL* d_log_scales, global REAL* d_opacities,
                             global REAL* d_colors, const View view, const long count) {
  const long first = get_global_id(0) * (long)V;
  if (first >= count) return;
  const int lanes = lanes_from(first, count);

  // Sums of the slots, in the order of the tiles.
  REAL sums[SLOT_USED * V];
  REAL touched[V];
  int any_touched = 0;
  for (int field = 0; field < SLOT_USED * V; ++field) sums[field] = 0;
  for (int lane = 0; lane < V; ++lane) {
    // Slots lie in the order of depth: those of the next item are called for while these are added.
    PREFETCH(slots + (long)slot_offsets[min(first + V + lane, count - 1)] * SLOT_SIZE);
    const uint slot_count = lane < lanes ? slot_counts[first + lane] : 0;
    touched[lane] = slot_count ? 1 : -1;
    if (!slot_count) continue;
    any_touched = 1;
    global const REAL* slot = slots + (long)slot_offsets[first + lane] * SLOT_SIZE;
#if V == SLOT_SIZE
    REALV total = 0;
    for (uint s = 0; s < slot_count; ++s) total += LOAD_VECTOR(s, slot);
    REAL fields[V];
    STORE_VECTOR(total, 0, fields);
    for (int field = 0; field < SLOT_USED; ++field) sums[field * V + lane] = fields[field];
#else
    for (uint s = 0; s < slot_count; ++s, slot += SLOT_SIZE) {
      for (int field = 0; field < SLOT_USED; ++field) sums[field * V + lane] += slot[field];
    }
#endif
  }
  REALV position[3], rotation[4], log_scale[3], color[3], opacity = 0;
  for (int c = 0; c < 3; ++c) position[c] = log_scale[c] = rotation[c] = 0;
  rotation[3] = 0;
  if (any_touched) {
    const Footprint f = footprint(view, positions, rotations, log_scales, first, count);
    const REALV m = LOAD_VECTOR(0, sums), mx = LOAD_VECTOR(1, sums), my = LOAD_VECTOR(2, sums);
    const REALV inverse_unit = 1 / f.unit;
    const REALV mxx = LOAD_VECTOR(3, sums) * inverse_unit * inverse_unit,
                mxy = LOAD_VECTOR(4, sums) * inverse_unit * inverse_unit,
                myy = LOAD_VECTOR(5, sums) * inverse_unit * inverse_unit;
    opacity = m / gather(opacities, first, 1, 0, count);

    // ln(alpha) = -1/2 d^T C d with C the inverse covariance: its gradient is C (w d d^T) C / 2, and C w d to the
    // centre.
    const REALV cxx = f.blurred_yy / f.determinant, cxy = -f.xy / f.determinant, cyy = f.blurred_xx / f.determinant;
    const REALV hxx = cxx * mxx + cxy * mxy, hxy = cxx * mxy + cxy * myy;
    const REALV hyx = cxy * mxx + cyy * mxy, hyy = cxy * mxy + cyy * myy;
    REALV gxx = (hxx * cxx + hxy * cxy) / 2, gxy = (hxx * cxy + hxy * cyy) / 2, gyy = (hyx * cxy + hyy * cyy) / 2;
#if ANTIALIAS
    const REALV ratio = f.compensation_squared;
    const REALV factor = ratio > COMPENSATION_MIN * COMPENSATION_MIN ? m / (2 * ratio * f.determinant) : (REALV)0;
    gxx += factor * (f.yy - ratio * f.blurred_yy);
    gyy += factor * (f.xx - ratio * f.blurred_xx);
    gxy -= factor * f.xy * (1 - ratio);
#endif
    REALV d_p[6], d_r[9];
    for (int c = 0; c < 6; ++c) d_p[c] = 0;
    for (int c = 0; c < 3; ++c) {
      const REALV d_a0 = 2 * (gxx * f.a[c] + gxy * f.a[3 + c]), d_a1 = 2 * (gxy * f.a[c] + gyy * f.a[3 + c]);
      log_scale[c] = d_a0 * f.a[c] + d_a1 * f.a[3 + c];
      const REALV d_b0 = d_a0 * (f.scale[c] * inverse_unit), d_b1 = d_a1 * (f.scale[c] * inverse_unit);
      for (int row = 0; row < 3; ++row) {
        d_p[row] += d_b0 * f.r[3 * row + c];
        d_p[3 + row] += d_b1 * f.r[3 * row + c];
        d_r[3 * row + c] = f.p[row] * d_b0 + f.p[3 + row] * d_b1;
      }
    }

    // J = [fx/z, 0, -fx ratio_x/z; 0, fy/z, -fy ratio_y/z]. A clamped ratio is constant: it passes nothing to x, y, z.
    const REALV d_j00 = d_p[0] * view.rotation[0] + d_p[1] * view.rotation[1] + d_p[2] * view.rotation[2];
    const REALV d_j02 = d_p[0] * view.rotation[6] + d_p[1] * view.rotation[7] + d_p[2] * view.rotation[8];
    const REALV d_j11 = d_p[3] * view.rotation[3] + d_p[4] * view.rotation[4] + d_p[5] * view.rotation[5];
    const REALV d_j12 = d_p[3] * view.rotation[6] + d_p[4] * view.rotation[7] + d_p[5] * view.rotation[8];
    const REALV along_x = view.fx * f.inverse_z, along_y = view.fy * f.inverse_z;
    const REALV true_x = f.x * f.inverse_z, true_y = f.y * f.inverse_z;
    const REALV centre_x = (cxx * mx + cxy * my) * inverse_unit * inverse_unit * view.fx;
    const REALV centre_y = (cxy * mx + cyy * my) * inverse_unit * inverse_unit * view.fy;
    const REALV d_ratio_x = centre_x - (true_x == f.ratio_x ? along_x * d_j02 : (REALV)0);
    const REALV d_ratio_y = centre_y - (true_y == f.ratio_y ? along_y * d_j12 : (REALV)0);
    const REALV d_x = d_ratio_x * f.inverse_z, d_y = d_ratio_y * f.inverse_z;
    const REALV d_z = -(d_ratio_x * true_x + d_ratio_y * true_y + along_x * (d_j00 - f.ratio_x * d_j02) +
                        along_y * (d_j11 - f.ratio_y * d_j12)) *
                      f.inverse_z;
    for (int c = 0; c < 3; ++c) {
      position[c] = view.rotation[c] * d_x + view.rotation[3 + c] * d_y + view.rotation[6 + c] * d_z;
    }

    const REALV d_w = 2 * (f.i * (d_r[7] - d_r[5]) + f.j * (d_r[2] - d_r[6]) + f.k * (d_r[3] - d_r[1]));
    const REALV d_i =
        2 * (f.w * (d_r[7] - d_r[5]) + f.j * (d_r[1] + d_r[3]) + f.k * (d_r[2] + d_r[6]) - 2 * f.i * (d_r[4] + d_r[8]));
    const REALV d_j =
        2 * (f.w * (d_r[2] - d_r[6]) + f.i * (d_r[1] + d_r[3]) + f.k * (d_r[5] + d_r[7]) - 2 * f.j * (d_r[0] + d_r[8]));
    const REALV d_k =
        2 * (f.w * (d_r[3] - d_r[1]) + f.i * (d_r[2] + d_r[6]) + f.j * (d_r[5] + d_r[7]) - 2 * f.k * (d_r[0] + d_r[4]));
    const REALV radial = f.w * d_w + f.i * d_i + f.j * d_j + f.k * d_k;
    rotation[0] = (d_w - f.w * radial) * f.inverse_norm;
    rotation[1] = (d_i - f.i * radial) * f.inverse_norm;
    rotation[2] = (d_j - f.j * radial) * f.inverse_norm;
    rotation[3] = (d_k - f.k * radial) * f.inverse_norm;
  }

  // Untouched splats get exact zeros, and so does what overflowed.
  const REALV live = LOAD_VECTOR(0, touched);
#define FINITE_OR_ZERO(value) (live > 0 && fabs(value) <= LARGEST ? (value) : (REALV)0)
  for (int c = 0; c < 3; ++c) {
    const REALV summed = LOAD_VECTOR(6 + c, sums);
    position[c] = FINITE_OR_ZERO(position[c]);
    log_scale[c] = FINITE_OR_ZERO(log_scale[c]);
    color[c] = FINITE_OR_ZERO(summed);
  }
  for (int c = 0; c < 4; ++c) rotation[c] = FINITE_OR_ZERO(rotation[c]);
  if (d_positions) scatter_rows(position, d_positions, first, 3, lanes);
  if (d_log_scales) scatter_rows(log_scale, d_log_scales, first, 3, lanes);
  if (d_colors) scatter_rows(color, d_colors, first, 3, lanes);
  if (d_rotations) scatter_rows(rotation, d_rotations, first, 4, lanes);
  if (d_opacities) scatter(FINITE_OR_ZERO(opacity), d_opacities, first, 1, 0, lanes);
}
