// EWA projection of 3D Gaussians: camera transform, Jacobian of the perspective, 2D covariance with its blur, culling.
// Forward writes a record per splat and view (common/splat.cl), the depth's sort key and, for CPUs, the tiles that the
// splat touches; backward sums a splat's gradient slots in their order and takes the sums of all views to positions,
// rotations, log-scales, opacities and colours.
// Arrays: positions (N,3), rotations (N,4) wxyz, log_scales (N,3), opacities (N), colors (N,3), or (views,N,3) with
// colors_by_view; records (views N,RECORD_SIZE), depth_keys (views N) uint, boxes (views N) uint4 (common/tile_box.cl;
// wide set only), views, slots_of (views N) uint2: first slot and number of slots, slots (M,SLOT_SIZE).
// -D ANTIALIAS=0|1: opacity is multiplied by sqrt(det / det with blur), at least COMPENSATION_MIN; TILE_WIDTH,
// TILE_HEIGHT: pixels of a tile.
// Launch: one item per V consecutive splats, forward of each view; local size free. Deterministic: every element has
// one writer, sums go in the order of the slots and the views.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/columns.cl"
#include "common/prefetch.cl"
#include "common/view.cl"
#include "common/footprint.cl"
#if WIDE
#include "common/tiles.cl"
#include "common/tile_box.cl"
#endif

#define COMPENSATION_MIN ((REAL)0.005)
#define QUATERNION_MIN ((REAL)1e-6)
#define LOG_SCALE_MAX ((REAL)80)
#define LARGEST ((REAL)3e38)
#define CULLED_KEY 0xFFFFFFFFu
#define BLOCK_HALF ((REAL)1.5)
#define BLOCK_MARGIN ((REAL)0.01)  // for rounding

kernel void project_forward(global const REAL* positions, global const REAL* rotations, global const REAL* log_scales,
                            global const REAL* opacities, global const REAL* colors, global REAL* records,
                            global uint* depth_keys, global uint4* boxes, global const View* views,
                            const int view_count, const int colors_by_view, const long count) {
  // The views of the same splats follow each other, so that what they share is fetched once.
  const int k = get_global_id(0) % view_count;
  const long first = get_global_id(0) / view_count * (long)V;
  if (first >= count) return;
  global const View* view = views + k;
  const Footprint f = footprint(view, positions, rotations, log_scales, first, count);
  REALV opacity = gather(opacities, first, 1, 0, count);
  const REALV given_opacity = opacity;
#if ANTIALIAS
  opacity *= fmax(sqrt(f.compensation_squared), COMPENSATION_MIN);
#endif
  const REALV u = view->fx * f.true_x + view->cx, v = view->fy * f.true_y + view->cy;
  const REALV log2_opacity = log2(opacity);
  const REALV log2_reach = sqrt(fmax(log2_opacity - LOG2_ALPHA_MIN, (REALV)0));
  const REALV reach = sqrt(2 / LOG2_E) * log2_reach;
  const REALV deviation_x = f.unit * sqrt(f.blurred_xx), deviation_y = f.unit * sqrt(f.blurred_yy);
  const REALV width = reach * deviation_x, height = reach * deviation_y;
  REALV color[3];
  gather_rows(colors_by_view ? colors + k * count * 3 : colors, first, 3, count, color);

  // Every guard states what a visible splat satisfies: a NaN fails it.
  const REALV visible =
      (f.z >= view->near_plane && f.z <= LARGEST && f.inverse_norm <= 1 / sqrt(QUATERNION_MIN) && f.inverse_norm > 0 &&
       given_opacity <= 1 && opacity >= ALPHA_MIN && fabs(color[0]) <= LARGEST && fabs(color[1]) <= LARGEST &&
       fabs(color[2]) <= LARGEST && fabs(f.log_scale[0]) <= LOG_SCALE_MAX && fabs(f.log_scale[1]) <= LOG_SCALE_MAX &&
       fabs(f.log_scale[2]) <= LOG_SCALE_MAX && width <= LARGEST && height <= LARGEST && f.determinant >= (REAL)1e-37 &&
       u + width > 0 && u - width < view->width && v + height > 0 && v - height < view->height)
          ? (REALV)1
          : (REALV)-1;

  const REALV sharpness_x = sqrt(LOG2_E / 2 * f.blurred_yy / f.determinant) / f.unit,
              sharpness_y = sqrt(LOG2_E / 2 / f.blurred_yy) / f.unit, slope = f.xy / f.blurred_yy;
  // Between a block's centre and the centres of its outermost pixels.
  const REALV block_s = BLOCK_HALF * (sharpness_x + fabs(sharpness_x * slope)), block_t = BLOCK_HALF * sharpness_y;
  REALV fields[RECORD_SIZE];
  fields[RECORD_U] = u;
  fields[RECORD_V] = v;
  fields[RECORD_SHARPNESS_X] = sharpness_x;
  fields[RECORD_SLOPE] = slope;
  fields[RECORD_SHARPNESS_Y] = sharpness_y;
  fields[RECORD_LOG2_OPACITY] = log2_opacity;
  fields[RECORD_WIDTH] = visible > 0 ? width : (REALV)-1;
  fields[RECORD_HEIGHT] = height;
  fields[RECORD_TILT] = reach * f.unit * f.xy / sqrt(f.blurred_xx);
  for (int c = 0; c < 3; ++c) fields[RECORD_COLOR + c] = color[c];
  fields[RECORD_BLOCK_REACH] = log2_reach + block_s + BLOCK_MARGIN;
  fields[RECORD_BLOCK_RADIUS] = log2_reach + sqrt(block_s * block_s + block_t * block_t) + BLOCK_MARGIN;
  for (int field = RECORD_USED; field < RECORD_SIZE; ++field) fields[field] = 0;
  const int lanes = lanes_from(first, count);
  const long record = k * count + first;
#if WIDE
  const Ellipses ellipses = {u,
                             visible > 0 ? v : (REALV)NOWHERE,
                             sharpness_x,
                             slope,
                             sharpness_y,
                             log2_opacity - LOG2_ALPHA_MIN,
                             fields[RECORD_WIDTH],
                             visible > 0 ? height : (REALV)0,
                             fields[RECORD_TILT]};
  store_tile_boxes(ellipses, view, boxes + record, lanes);
#endif
  scatter_rows_of_16(fields, records + record * RECORD_SIZE, lanes);

  // Positive floats order as their bits do.
  REAL depth[V], seen[V];
  STORE_VECTOR(f.z, 0, depth);
  STORE_VECTOR(visible, 0, seen);
  for (int lane = 0; lane < lanes; ++lane)
    depth_keys[record + lane] = seen[lane] > 0 ? as_uint((float)depth[lane]) : CULLED_KEY;
}

// Adds up the slots of V splats of a view, in their order: sums[field]. touched: 1 for splats that have any, else -1.
// Returns whether one has.
inline int sum_slots(global const uint2* slots_of, global const REAL* slots, const long first, const long count,
                     REALV sums[SLOT_SIZE], REALV* touched) {
  REAL marks[V];
  int any_touched = 0;
  for (int lane = 0; lane < V; ++lane) {
    // Slots lie in the order of depth: those of the next item are called for while these are added.
    PREFETCH(slots + (long)slots_of[min(first + V + lane, count - 1)].x * SLOT_SIZE);
    const uint2 own = first + lane < count ? slots_of[first + lane] : (uint2)(0);
    global const REAL* slot = slots + (long)own.x * SLOT_SIZE;
    marks[lane] = own.y ? 1 : -1;
    any_touched |= own.y != 0;
#if V == SLOT_SIZE
    REALV total = 0;
    for (uint n = 0; n < own.y; ++n) total += LOAD_VECTOR(n, slot);
    sums[lane] = total;
  }
  transpose_16(sums);
#else
    for (int field = 0; field < SLOT_USED; ++field) sums[field] = 0;
    for (uint n = 0; n < own.y; ++n, slot += SLOT_SIZE) {
      for (int field = 0; field < SLOT_USED; ++field) sums[field] += slot[field];
    }
  }
#endif
  *touched = LOAD_VECTOR(0, marks);
  return any_touched;
}

typedef struct {
  REALV position[3], rotation[4], log_scale[3], opacity;
} Gradients;

// What the sums of a view's slots say of the splats they came from.
inline Gradients gradients_of(global const View* view, global const REAL* positions, global const REAL* rotations,
                              global const REAL* log_scales, global const REAL* opacities, const REALV sums[SLOT_SIZE],
                              const long first, const long count) {
  const Footprint f = footprint(view, positions, rotations, log_scales, first, count);
  const REALV m = sums[0], ms = sums[1], mt = sums[2], mss = sums[3], mst = sums[4], mtt = sums[5];
  Gradients g;
  const REALV inverse_unit = 1 / f.unit;
  g.opacity = m / gather(opacities, first, 1, 0, count);

  // ln(alpha) = -1/2 d^T C d with C the inverse covariance: its gradient is C (w d d^T) C / 2, and C w d to the
  // centre. C = W^T W with W d linear in s and t. What the covariance passes on to an axis `a` of the ellipsoid is
  // W^T M (W a), M the sums over s and t, and to its log-scale (W a)^T M (W a): W a is never much longer than 1, where
  // a and the elements of C would nearly cancel for needles.
  const REALV s_to_x = sqrt(2 / LOG2_E * f.blurred_yy / f.determinant), slope = f.xy / f.blurred_yy;
  const REALV s_to_y = -s_to_x * slope, t_to_y = sqrt(2 / LOG2_E / f.blurred_yy);
#if ANTIALIAS
  const REALV ratio = f.compensation_squared;
  const REALV factor = ratio > COMPENSATION_MIN * COMPENSATION_MIN ? m / (ratio * f.determinant) : (REALV)0;
  const REALV by_xx = factor * (f.yy - ratio * f.blurred_yy), by_yy = factor * (f.xx - ratio * f.blurred_xx);
  const REALV by_xy = -factor * f.xy * (1 - ratio);
#endif
  REALV d_p[6], d_r[9];
  for (int c = 0; c < 6; ++c) d_p[c] = 0;
  for (int c = 0; c < 3; ++c) {
    const REALV s = s_to_x * (f.a[c] - slope * f.a[3 + c]), t = t_to_y * f.a[3 + c];
    const REALV d_s = mss * s + mst * t, d_t = mst * s + mtt * t;
    REALV d_a0 = s_to_x * d_s, d_a1 = s_to_y * d_s + t_to_y * d_t;
    g.log_scale[c] = s * d_s + t * d_t;
#if ANTIALIAS
    const REALV more_a0 = by_xx * f.a[c] + by_xy * f.a[3 + c], more_a1 = by_xy * f.a[c] + by_yy * f.a[3 + c];
    d_a0 += more_a0;
    d_a1 += more_a1;
    g.log_scale[c] += more_a0 * f.a[c] + more_a1 * f.a[3 + c];
#endif
    const REALV d_b0 = d_a0 * (f.scale[c] * inverse_unit), d_b1 = d_a1 * (f.scale[c] * inverse_unit);
    for (int row = 0; row < 3; ++row) {
      d_p[row] += d_b0 * f.r[3 * row + c];
      d_p[3 + row] += d_b1 * f.r[3 * row + c];
      d_r[3 * row + c] = f.p[row] * d_b0 + f.p[3 + row] * d_b1;
    }
  }

  // J = [fx/z, 0, -fx ratio_x/z; 0, fy/z, -fy ratio_y/z]. A clamped ratio is constant: it passes nothing to x, y, z.
  const REALV d_j00 = d_p[0] * view->rotation[0] + d_p[1] * view->rotation[1] + d_p[2] * view->rotation[2];
  const REALV d_j02 = d_p[0] * view->rotation[6] + d_p[1] * view->rotation[7] + d_p[2] * view->rotation[8];
  const REALV d_j11 = d_p[3] * view->rotation[3] + d_p[4] * view->rotation[4] + d_p[5] * view->rotation[5];
  const REALV d_j12 = d_p[3] * view->rotation[6] + d_p[4] * view->rotation[7] + d_p[5] * view->rotation[8];
  const REALV centre_x = s_to_x * ms * inverse_unit * view->fx;
  const REALV centre_y = (s_to_y * ms + t_to_y * mt) * inverse_unit * view->fy;
  const REALV d_ratio_x = centre_x - (f.true_x == f.ratio_x ? f.along_x * d_j02 : (REALV)0);
  const REALV d_ratio_y = centre_y - (f.true_y == f.ratio_y ? f.along_y * d_j12 : (REALV)0);
  const REALV d_x = d_ratio_x / f.z, d_y = d_ratio_y / f.z;
  const REALV d_z = -(d_ratio_x * f.true_x + d_ratio_y * f.true_y + f.along_x * (d_j00 - f.ratio_x * d_j02) +
                      f.along_y * (d_j11 - f.ratio_y * d_j12)) /
                    f.z;
  for (int c = 0; c < 3; ++c) {
    g.position[c] = view->rotation[c] * d_x + view->rotation[3 + c] * d_y + view->rotation[6 + c] * d_z;
  }

  const REALV d_w = 2 * (f.i * (d_r[7] - d_r[5]) + f.j * (d_r[2] - d_r[6]) + f.k * (d_r[3] - d_r[1]));
  const REALV d_i =
      2 * (f.w * (d_r[7] - d_r[5]) + f.j * (d_r[1] + d_r[3]) + f.k * (d_r[2] + d_r[6]) - 2 * f.i * (d_r[4] + d_r[8]));
  const REALV d_j =
      2 * (f.w * (d_r[2] - d_r[6]) + f.i * (d_r[1] + d_r[3]) + f.k * (d_r[5] + d_r[7]) - 2 * f.j * (d_r[0] + d_r[8]));
  const REALV d_k =
      2 * (f.w * (d_r[3] - d_r[1]) + f.i * (d_r[2] + d_r[6]) + f.j * (d_r[5] + d_r[7]) - 2 * f.k * (d_r[0] + d_r[4]));
  const REALV radial = f.w * d_w + f.i * d_i + f.j * d_j + f.k * d_k;
  g.rotation[0] = (d_w - f.w * radial) * f.inverse_norm;
  g.rotation[1] = (d_i - f.i * radial) * f.inverse_norm;
  g.rotation[2] = (d_j - f.j * radial) * f.inverse_norm;
  g.rotation[3] = (d_k - f.k * radial) * f.inverse_norm;
  return g;
}

// Absent (null) outputs are skipped.
kernel void project_backward(global const REAL* positions, global const REAL* rotations, global const REAL* log_scales,
                             global const REAL* opacities, global const uint2* slots_of, global const REAL* slots,
                             global REAL* d_positions, global REAL* d_rotations, global REAL* d_log_scales,
                             global REAL* d_opacities, global REAL* d_colors, global const View* views,
                             const int view_count, const int colors_by_view, const long count) {
  const long first = get_global_id(0) * (long)V;
  if (first >= count) return;
  const int lanes = lanes_from(first, count);
  REALV position[3], rotation[4], log_scale[3], color[3], opacity = 0;
  for (int c = 0; c < 3; ++c) position[c] = log_scale[c] = rotation[c] = color[c] = 0;
  rotation[3] = 0;
  for (int k = 0; k < view_count; ++k) {
    REALV sums[SLOT_SIZE], touched;
    const int any_touched = sum_slots(slots_of + k * count, slots, first, count, sums, &touched);
    if (any_touched) {
      const Gradients g = gradients_of(views + k, positions, rotations, log_scales, opacities, sums, first, count);
      // Untouched splats get exact zeros, and so does what overflowed.
#define FINITE_OR_ZERO(value) (touched > 0 && fabs(value) <= LARGEST ? (value) : (REALV)0)
      for (int c = 0; c < 3; ++c) {
        position[c] += FINITE_OR_ZERO(g.position[c]);
        log_scale[c] += FINITE_OR_ZERO(g.log_scale[c]);
        color[c] += FINITE_OR_ZERO(sums[6 + c]);
      }
      for (int c = 0; c < 4; ++c) rotation[c] += FINITE_OR_ZERO(g.rotation[c]);
      opacity += FINITE_OR_ZERO(g.opacity);
    }
    if (d_colors && colors_by_view) {
      scatter_rows(color, d_colors + k * count * 3, first, 3, lanes);
      for (int c = 0; c < 3; ++c) color[c] = 0;
    }
  }
  if (d_positions) scatter_rows(position, d_positions, first, 3, lanes);
  if (d_log_scales) scatter_rows(log_scale, d_log_scales, first, 3, lanes);
  if (d_colors && !colors_by_view) scatter_rows(color, d_colors, first, 3, lanes);
  if (d_rotations) scatter_rows(rotation, d_rotations, first, 4, lanes);
  if (d_opacities) scatter(opacity, d_opacities, first, 1, 0, lanes);
}
