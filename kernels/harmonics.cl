// Colours as cameras see them: real spherical harmonics of degrees 1 .. DEGREE over the direction from the camera to
// each Gaussian, in the Gaussian's own axes, on top of a colour that is the same from everywhere; and the way back.
// Order and signs of the harmonics are those of 3DGS. All cameras at once, because the coefficients are most of what is
// read and written.
// Shapes: positions, base_colors (N,3); rotations (N,4) w x y z; harmonics (N, COEFFICIENTS, 3); cameras (C,3):
// centres; colors (C,N,3).
// Defines: DEGREE 1 .. 3. Launch: one item per Gaussian, local size free. Deterministic: no element is written twice.
#include "common/real.cl"
#include "common/quaternion.cl"

#define COEFFICIENTS ((DEGREE + 1) * (DEGREE + 1) - 1)

#define GAUSSIAN_OR_RETURN        \
  const int i = get_global_id(0); \
  if (i >= count) return

#define C1 ((REAL)0.4886025119029199)
#define C20 ((REAL)1.0925484305920792)
#define C22 ((REAL)0.31539156525252005)
#define C24 ((REAL)0.5462742152960396)
#define C30 ((REAL)0.5900435899266435)
#define C31 ((REAL)2.890611442640554)
#define C32 ((REAL)0.4570457994644658)
#define C33 ((REAL)0.3731763325901154)
#define C35 ((REAL)1.445305721320277)

// The harmonics at the unit direction (x, y, z).
inline void basis_at(const REAL x, const REAL y, const REAL z, REAL basis[COEFFICIENTS]) {
  basis[0] = -C1 * y;
  basis[1] = C1 * z;
  basis[2] = -C1 * x;
#if DEGREE >= 2
  basis[3] = C20 * x * y;
  basis[4] = -C20 * y * z;
  basis[5] = C22 * (2 * z * z - x * x - y * y);
  basis[6] = -C20 * x * z;
  basis[7] = C24 * (x * x - y * y);
#endif
#if DEGREE >= 3
  basis[8] = -C30 * y * (3 * x * x - y * y);
  basis[9] = C31 * x * y * z;
  basis[10] = -C32 * y * (4 * z * z - x * x - y * y);
  basis[11] = C33 * z * (2 * z * z - 3 * x * x - 3 * y * y);
  basis[12] = -C32 * x * (4 * z * z - x * x - y * y);
  basis[13] = C35 * z * (x * x - y * y);
  basis[14] = -C30 * x * (x * x - 3 * y * y);
#endif
}

// Sum of weights[j] times the gradient of harmonic j, as a polynomial in x, y and z.
inline REAL3 basis_gradient(const REAL x, const REAL y, const REAL z, const REAL weights[COEFFICIENTS]) {
  REAL3 sum = C1 * (REAL3)(-weights[2], -weights[0], weights[1]);
#if DEGREE >= 2
  sum += weights[3] * C20 * (REAL3)(y, x, 0) - weights[4] * C20 * (REAL3)(0, z, y) +
         weights[5] * C22 * 2 * (REAL3)(-x, -y, 2 * z) - weights[6] * C20 * (REAL3)(z, 0, x) +
         weights[7] * C24 * 2 * (REAL3)(x, -y, 0);
#endif
#if DEGREE >= 3
  sum += -weights[8] * C30 * 3 * (REAL3)(2 * x * y, x * x - y * y, 0) +
         weights[9] * C31 * (REAL3)(y * z, x * z, x * y) -
         weights[10] * C32 * (REAL3)(-2 * x * y, 4 * z * z - x * x - 3 * y * y, 8 * y * z) +
         weights[11] * C33 * 3 * (REAL3)(-2 * x * z, -2 * y * z, 2 * z * z - x * x - y * y) -
         weights[12] * C32 * (REAL3)(4 * z * z - 3 * x * x - y * y, -2 * x * y, 8 * x * z) +
         weights[13] * C35 * (REAL3)(2 * x * z, -2 * y * z, x * x - y * y) -
         weights[14] * C30 * 3 * (REAL3)(x * x - y * y, -2 * x * y, 0);
#endif
  return sum;
}

typedef struct {
  REAL4 rotation;          // unit
  REAL4 row0, row1, row2;  // of its matrix
  REAL inverse_norm;
} Axes;

inline Axes axes_of(global const REAL* rotations, const int i) {
  Axes axes;
  const REAL4 rotation = vload4(i, rotations);
  const REAL norm = dot(rotation, rotation);
  axes.inverse_norm = norm == 0 ? 0 : 1 / sqrt(norm);
  axes.rotation = rotation * axes.inverse_norm;
  quaternion_to_rows(axes.rotation, &axes.row0, &axes.row1, &axes.row2);
  return axes;
}

typedef struct {
  REAL3 direction;      // unit, from the camera to the Gaussian
  REAL3 own_direction;  // the same in the Gaussian's axes
  REAL inverse_distance;
} Sight;

// A Gaussian at the camera's very centre is seen from no direction: from 0, where degree 1 adds nothing.
inline Sight sight_of(const REAL3 position, const REAL3 camera, const Axes* axes) {
  Sight sight;
  const REAL3 from_camera = position - camera;
  const REAL square = dot(from_camera, from_camera);
  sight.inverse_distance = square == 0 ? 0 : 1 / sqrt(square);
  sight.direction = from_camera * sight.inverse_distance;
  sight.own_direction =
      sight.direction.x * axes->row0.xyz + sight.direction.y * axes->row1.xyz + sight.direction.z * axes->row2.xyz;
  return sight;
}

kernel void colors_forward(global const REAL* positions, global const REAL* rotations, global const REAL* base_colors,
                           global const REAL* harmonics, global const REAL* cameras, global REAL* colors,
                           const int camera_count, const int count) {
  GAUSSIAN_OR_RETURN;
  const Axes axes = axes_of(rotations, i);
  const REAL3 position = vload3(i, positions), base_color = vload3(i, base_colors);
  for (int k = 0; k < camera_count; ++k) {
    const REAL3 own = sight_of(position, vload3(k, cameras), &axes).own_direction;
    REAL basis[COEFFICIENTS];
    basis_at(own.x, own.y, own.z, basis);
    REAL3 color = base_color;
    for (int j = 0; j < COEFFICIENTS; ++j) color += basis[j] * vload3((long)i * COEFFICIENTS + j, harmonics);
    // Not fmax, which would turn a NaN into black.
    vstore3(select(color, (REAL3)(0), color <= (REAL3)(0)), (long)k * count + i, colors);
  }
}

// No gradient through a colour that the clamp holds at 0.
inline REAL3 through_clamp(const REAL3 d_color, const REAL3 color) {
  return select((REAL3)(0), d_color, color > (REAL3)(0));
}

// The gradients of all that colors_forward read. Where a splat is not drawn it has no gradient, even if its position is
// not finite.
kernel void colors_backward(global const REAL* d_colors, global const REAL* colors, global const REAL* positions,
                            global const REAL* rotations, global const REAL* harmonics, global const REAL* cameras,
                            global REAL* d_positions, global REAL* d_rotations, global REAL* d_base_colors,
                            global REAL* d_harmonics, const int camera_count, const int count) {
  GAUSSIAN_OR_RETURN;
  const Axes axes = axes_of(rotations, i);
  const REAL3 position = vload3(i, positions);
  REAL3 d_position = 0, d_base_color = 0, d_coefficients[COEFFICIENTS];
  REAL4 d_rotation = 0;
  bool seen = false;
  for (int j = 0; j < COEFFICIENTS; ++j) d_coefficients[j] = 0;
  for (int k = 0; k < camera_count; ++k) {
    const long at = (long)k * count + i;
    const REAL3 d_color = through_clamp(vload3(at, d_colors), vload3(at, colors));
    if (!any(d_color != (REAL3)(0))) continue;
    seen = true;
    const Sight sight = sight_of(position, vload3(k, cameras), &axes);
    REAL basis[COEFFICIENTS], weights[COEFFICIENTS];
    basis_at(sight.own_direction.x, sight.own_direction.y, sight.own_direction.z, basis);
    d_base_color += d_color;
    for (int j = 0; j < COEFFICIENTS; ++j) {
      weights[j] = dot(d_color, vload3((long)i * COEFFICIENTS + j, harmonics));
      d_coefficients[j] += basis[j] * d_color;
    }
    const REAL3 own =
        basis_gradient(sight.own_direction.x, sight.own_direction.y, sight.own_direction.z, weights);
    const REAL3 world = (REAL3)(dot(axes.row0.xyz, own), dot(axes.row1.xyz, own), dot(axes.row2.xyz, own));
    d_position += sight.inverse_distance * (world - dot(world, sight.direction) * sight.direction);
    const REAL4 turn = (REAL4)(own, 0);
    d_rotation += quaternion_from_row_gradients(axes.rotation, sight.direction.x * turn, sight.direction.y * turn,
                                                sight.direction.z * turn);
  }
  vstore3(d_position, i, d_positions);
  d_rotation = axes.inverse_norm * (d_rotation - dot(d_rotation, axes.rotation) * axes.rotation);
  vstore4(seen ? d_rotation : (REAL4)(0), i, d_rotations);
  vstore3(d_base_color, i, d_base_colors);
  for (int j = 0; j < COEFFICIENTS; ++j) vstore3(d_coefficients[j], (long)i * COEFFICIENTS + j, d_harmonics);
}
