#pragma once

#include "model/body/uv_atlas.h"

namespace degas {

/// The square of half the UV atlas' side that the network's face map covers, placed on a grid of sixteenths of the
/// atlas so that it falls on whole texels at every resolution from 16 up.
struct FaceRegion {
  int row = 0, column = 0;  ///< of its upper left corner, sixteenths of the side, 0 .. 8
  double head_share = 1;    ///< part of the head's texels within

  static constexpr int grid = 16;
  int top(int side) const { return row * side / grid; }
  int left(int side) const { return column * side / grid; }
  bool is_smplx() const { return row == 0 && column == 0; }
};

/// The part of the head's texels in the region from which on the layout counts as SMPL-X's (there 88 % are).
inline constexpr double head_share_of_smplx = 0.75;

/// Of each triangle: do all its vertices belong to the head?
std::vector<bool> head_triangles(const BodyModel& body);

/// Where the head lies in the body's layout: the top-left quarter (SMPL-X's) where head_share_of_smplx of its texels
/// are there or no head is found, else the place that holds the most, the uppermost and leftmost of equals.
FaceRegion find_face_region(const BodyModel& body);

}  // namespace degas
