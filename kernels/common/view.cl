// A camera as the kernels see it, filled by host/ops/splat_views.cpp. Several views of the same splats are drawn
// together: splat n of view k is number k N + n, and the views' tiles are numbered through.
typedef struct {
  REAL rotation[9];
  REAL center_whole[3], center_rest[3];  // the camera's centre: whole metres, and what is left
  REAL fx, fy, cx, cy;
  REAL left, right, top, bottom;  // limits of x/z and y/z where the Jacobian is taken
  REAL near_plane, blur;
  int width, height, grid_columns, first_tile;
} View;
