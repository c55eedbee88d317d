// Rotations as quaternions (w, x, y, z), kept in a REAL4 whose component .x holds w. Needs common/real.cl before it.
#define REAL16 JOIN(REAL, 16)

// The rotation b followed by a.
REAL4 quaternion_multiply(const REAL4 a, const REAL4 b) {
  return (REAL4)(a.x * b.x - a.y * b.y - a.z * b.z - a.w * b.w, a.x * b.y + a.y * b.x + a.z * b.w - a.w * b.z,
                 a.x * b.z - a.y * b.w + a.z * b.x + a.w * b.y, a.x * b.w + a.y * b.z - a.z * b.y + a.w * b.x);
}

// The inverse of a unit quaternion. Multiplying by it, on either side, is also the transpose of multiplying by q: so
// c = a b has the gradients da = dc conj(b) and db = conj(a) dc, whatever the norms.
REAL4 quaternion_conjugate(const REAL4 q) { return (REAL4)(q.x, -q.y, -q.z, -q.w); }

// Rows of the rotation matrix of a unit quaternion.
void quaternion_to_rows(const REAL4 q, REAL4* row0, REAL4* row1, REAL4* row2) {
  const REAL w = q.x, x = q.y, y = q.z, z = q.w;
  *row0 = (REAL4)(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 0);
  *row1 = (REAL4)(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 0);
  *row2 = (REAL4)(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), 0);
}

// Gradient of quaternion_to_rows: a, b, c are the gradients of the three rows (their .w is ignored).
REAL4 quaternion_from_row_gradients(const REAL4 q, const REAL4 a, const REAL4 b, const REAL4 c) {
  const REAL w = q.x, x = q.y, y = q.z, z = q.w;
  return 2 * (REAL4)(z * (b.x - a.y) + y * (a.z - c.x) + x * (c.y - b.z),
                     y * (a.y + b.x) + z * (a.z + c.x) + w * (c.y - b.z) - 2 * x * (b.y + c.z),
                     x * (a.y + b.x) + z * (b.z + c.y) + w * (a.z - c.x) - 2 * y * (a.x + c.z),
                     x * (a.z + c.x) + y * (b.z + c.y) + w * (b.x - a.y) - 2 * z * (a.x + b.y));
}
