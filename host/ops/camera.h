#pragma once

#include <Eigen/Core>

namespace degas {

/// A pinhole camera with OpenCV axes (x right, y down, z forward) and no distortion. x_camera = rotation x_world +
/// translation (metres); u = fx x/z + cx, v = fy y/z + cy in pixels whose centres lie at +0.5. The principal point
/// may lie anywhere, outside the image too.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d center() const { return -rotation.transpose() * translation; }
  /// Pixel coordinates (u, v) and depth z of a world point; u and v are meaningless for z <= 0.
  Eigen::Vector3d project(const Eigen::Vector3d& world) const {
    const Eigen::Vector3d c = rotation * world + translation;
    return {fx * c.x() / c.z() + cx, fy * c.y() / c.z() + cy, c.z()};
  }
  /// The camera of the sub-image that starts at pixel (left, top).
  Camera cropped(int left, int top, int new_width, int new_height) const {
    Camera camera = *this;
    camera.width = new_width;
    camera.height = new_height;
    camera.cx -= left;
    camera.cy -= top;
    return camera;
  }
  /// The camera of the image resized by `factor` on both axes (sizes rounded).
  Camera scaled(double factor) const {
    Camera camera = *this;
    camera.width = static_cast<int>(width * factor + 0.5);
    camera.height = static_cast<int>(height * factor + 0.5);
    const double x = static_cast<double>(camera.width) / width, y = static_cast<double>(camera.height) / height;
    camera.fx *= x;
    camera.cx *= x;
    camera.fy *= y;
    camera.cy *= y;
    return camera;
  }
};

}  // namespace degas
