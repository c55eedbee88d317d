// From a splat's parameters to its covariance in the image. Needs common/real.cl, splat.cl, columns.cl and view.cl
// before it.

// Everything between a splat's parameters and its 2D covariance. The covariance is A A^T with A = J W R(q) S (2x3) and
// is kept divided by unit^2, where unit is A's largest entry (at least 1), so that squares of huge scales stay finite;
// its determinant is |a0 x a1|^2 by Lagrange's identity, which loses nothing for tiny ones.
typedef struct {
  REALV z, true_x, true_y, ratio_x, ratio_y;  // depth; x / z and y / z, and both clamped to the limits
  REALV along_x, along_y;                     // focal lengths / z
  REALV w, i, j, k, inverse_norm;              // normalised quaternion
  REALV log_scale[3], scale[3];
  REALV r[9], p[6], a[6];  // R(q), J W, A / unit
  REALV unit, xx, xy, yy, bare_determinant, blurred_xx, blurred_yy, determinant;
  REALV compensation_squared;
} Footprint;

inline Footprint footprint(global const View* view, global const REAL* positions, global const REAL* rotations,
                           global const REAL* log_scales, const long first, const long count) {
  Footprint f;
  REALV position[3], q[4];
  gather_rows(positions, first, 3, count, position);
  gather_rows(rotations, first, 4, count, q);
  gather_rows(log_scales, first, 3, count, f.log_scale);
  // From the camera's centre, then turned: near it the difference is exact, however far the world's origin is.
  REALV in_camera[3];
  for (int c = 0; c < 3; ++c) position[c] = (position[c] - view->center_whole[c]) - view->center_rest[c];
  for (int row = 0; row < 3; ++row) {
    in_camera[row] = view->rotation[3 * row] * position[0] + view->rotation[3 * row + 1] * position[1] +
                     view->rotation[3 * row + 2] * position[2];
  }
  // Divided rather than multiplied by 1 / z: all pixels of a splat share these roundings, so that sums keep them.
  f.z = in_camera[2];
  f.true_x = in_camera[0] / f.z;
  f.true_y = in_camera[1] / f.z;
  f.ratio_x = fmin(fmax(f.true_x, view->left), view->right);
  f.ratio_y = fmin(fmax(f.true_y, view->top), view->bottom);
  f.along_x = view->fx / f.z;
  f.along_y = view->fy / f.z;

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

  f.unit = 1;
  for (int c = 0; c < 3; ++c) {
    f.p[c] = f.along_x * (view->rotation[c] - f.ratio_x * view->rotation[6 + c]);
    f.p[3 + c] = f.along_y * (view->rotation[3 + c] - f.ratio_y * view->rotation[6 + c]);
  }
  for (int c = 0; c < 3; ++c) {
    f.scale[c] = exp_clamped(f.log_scale[c]);
    f.a[c] = (f.p[0] * f.r[c] + f.p[1] * f.r[3 + c] + f.p[2] * f.r[6 + c]) * f.scale[c];
    f.a[3 + c] = (f.p[3] * f.r[c] + f.p[4] * f.r[3 + c] + f.p[5] * f.r[6 + c]) * f.scale[c];
    f.unit = fmax(f.unit, fmax(fabs(f.a[c]), fabs(f.a[3 + c])));
  }
  const REALV inverse_unit = 1 / f.unit;
  for (int c = 0; c < 6; ++c) f.a[c] *= inverse_unit;
  const REALV blur = view->blur * inverse_unit * inverse_unit;
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
