// Which tiles a projected splat touches: those with a pixel centre inside its ellipse alpha >= ALPHA_MIN, by the
// ellipse's exact reach within the tile's rows, grown by MARGIN for rounding. For V splats at a time.
// -D TILE_WIDTH, TILE_HEIGHT: pixels of a tile. Needs common/real.cl and common/splat.cl before it.

// The same tiles wherever the compiler inlines this.
#pragma OPENCL FP_CONTRACT OFF

#define TILE_MARGIN ((REAL)0.01)
#define NOWHERE ((REAL)-1e6)
#define TO_REALV JOIN(convert_, REALV)
#define TO_INTV JOIN(convert_, INTV)

// What V splats have of their records; reach is log2(opacity / ALPHA_MIN). Culled splats lie outside the image.
typedef struct {
  REALV u, v, sharpness_x, slope, sharpness_y, reach, width, height, tilt;
} Ellipses;

typedef struct {
  INTV first, last;
} Spans;

// The splat of one record in every lane.
inline Ellipses ellipse_of(global const REAL* record) {
  const int culled = !(record[RECORD_WIDTH] >= 0);
  const Ellipses e = {record[RECORD_U],
                      culled ? NOWHERE : record[RECORD_V],
                      record[RECORD_SHARPNESS_X],
                      record[RECORD_SLOPE],
                      record[RECORD_SHARPNESS_Y],
                      record[RECORD_LOG2_OPACITY] - LOG2_ALPHA_MIN,
                      record[RECORD_WIDTH],
                      culled ? 0 : record[RECORD_HEIGHT],
                      record[RECORD_TILT]};
  return e;
}

// Tiles of `size` pixels that hold a pixel centre of [low, high], of `pixels` pixels in all; empty when first > last.
// Bounds beyond the image are cut before they become integers, by cutting off the fractions of positive numbers.
inline Spans tiles_between(const REALV low, const REALV high, const int size, const int pixels) {
  const REALV before = fmin(fmax(pixels - (low - TILE_MARGIN - (REAL)0.5), (REALV)0), (REALV)pixels);
  const REALV until = fmin(fmax(high + TILE_MARGIN + (REAL)0.5, (REALV)0), (REALV)pixels);
  const INTV first = pixels - TO_INTV(before), last = TO_INTV(until) - 1;
  const Spans spans = {first / size, first <= last ? last / size : first / size - 1};
  return spans;
}

inline Spans rows_of(const Ellipses* e, const int height) {
  return tiles_between(e->v - e->height, e->v + e->height, TILE_HEIGHT, height);
}

inline Spans columns_of(const Ellipses* e, const int width) {
  return tiles_between(e->u - e->width, e->u + e->width, TILE_WIDTH, width);
}

inline REALV squared(const REALV x) { return x * x; }

// Tile columns of the ellipses between the first and last pixel centres of a tile row. `box` is their reach over all
// rows, which is the answer already when it has but one row or one column.
inline Spans columns_in_row(const Ellipses* e, const Spans rows, const Spans box, const INTV row, const int width) {
  const REALV center = TO_REALV(row * TILE_HEIGHT) - e->v;
  const REALV top = fmax(center + (REAL)0.5, -e->height);
  const REALV bottom = fmin(center + (TILE_HEIGHT - (REAL)0.5), e->height);
  // An ellipse is widest to the right at d.y = tilt and to the left at -tilt; elsewhere its edge is monotonic.
  const REALV right_at = fmin(fmax(e->tilt, top), bottom), left_at = fmin(fmax(-e->tilt, top), bottom);
  const REALV half_right = sqrt(fmax(e->reach - squared(e->sharpness_y * right_at), (REALV)0)) / e->sharpness_x;
  const REALV half_left = sqrt(fmax(e->reach - squared(e->sharpness_y * left_at), (REALV)0)) / e->sharpness_x;
  const REALV right = right_at == e->tilt ? e->width : fmin(e->slope * right_at + half_right, e->width);
  const REALV left = left_at == -e->tilt ? -e->width : fmax(e->slope * left_at - half_left, -e->width);
  const Spans exact = tiles_between(e->u + left, e->u + right, TILE_WIDTH, width);
  const INTV boxed = rows.first == rows.last || box.first >= box.last;
  const INTV present = row <= rows.last;
  const INTV first = boxed ? box.first : exact.first;
  const Spans spans = {first, present ? (boxed ? box.last : exact.last) : first - 1};
  return spans;
}

#pragma OPENCL FP_CONTRACT ON
