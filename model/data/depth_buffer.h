#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

/// A vertex as a camera sees it: where it lies in the buffer, samples, and its depth, metres.
struct ScreenVertex {
  float x, y, z;
};

/// Vertices of the world in a buffer of `supersampling` samples a pixel on each axis.
std::vector<ScreenVertex> project(const std::vector<Eigen::Vector3f>& positions, const Camera& camera,
                                  int supersampling);

/// The nearest triangle at every sample of a picture.
struct DepthBuffer {
  int width = 0, height = 0;
  std::vector<float> inverse_depth;  ///< width x height, 1 / metres; 0: nothing there
  std::vector<int> triangle;         ///< width x height; -1: nothing there

  DepthBuffer(int width, int height);
  /// Draws triangles that are counter-clockwise seen from outside; back faces are culled, and triangles that reach
  /// within 5 cm of the camera's plane are left out.
  void draw(const std::vector<ScreenVertex>& vertices, const std::vector<Eigen::Vector3i>& triangles);
};

}  // namespace degas
