#include "model/train/boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/loss/metrics.h"

namespace degas {

namespace {

std::vector<Eigen::Vector3d> posed_points(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                          const std::vector<int>& chosen) {
  const std::vector<Eigen::Vector3d> vertices = body.posed_vertices(pose, betas, true);
  std::vector<Eigen::Vector3d> points;
  for (const int vertex : chosen) points.push_back(vertices[static_cast<size_t>(vertex)]);
  return points;
}

/// Grown by its size over `part` on every side, and cut to the picture.
std::optional<Rectangle> grown(const std::optional<Rectangle>& box, int part, const Camera& camera) {
  if (!box) return box;
  const int x = box->width / part, y = box->height / part;
  return clipped({box->left - x, box->top - y, box->width + 2 * x, box->height + 2 * y}, camera.width, camera.height);
}

}  // namespace

std::vector<Eigen::Vector3d> head_points(const BodyModel& body, const Pose& pose, const std::vector<double>& betas) {
  return posed_points(body, pose, betas, body.head_vertices());
}

std::optional<Rectangle> head_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera) {
  return projected_box(head_points(body, pose, betas), camera);
}

std::optional<Rectangle> projected_box(const std::vector<Eigen::Vector3d>& points, const Camera& camera) {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d pixel = camera.project(point);
    if (!(pixel.z() > 0)) return std::nullopt;
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  // Also false when there is no point at all, or a coordinate is not finite.
  if (!(right > 0 && left < camera.width && bottom > 0 && top < camera.height)) return std::nullopt;
  const auto pixel_of = [](double value, int limit) { return static_cast<int>(std::clamp<double>(value, 0, limit)); };
  const int x0 = pixel_of(std::floor(left), camera.width), x1 = pixel_of(std::ceil(right), camera.width);
  const int y0 = pixel_of(std::floor(top), camera.height), y1 = pixel_of(std::ceil(bottom), camera.height);
  return Rectangle{x0, y0, x1 - x0, y1 - y0};
}

std::optional<Rectangle> face_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera) {
  return grown(head_box(body, pose, betas, camera), 8, camera);
}

std::optional<Rectangle> mouth_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                   const Camera& camera) {
  return grown(projected_box(posed_points(body, pose, betas, body.jaw_vertices()), camera), 4, camera);
}

}  // namespace degas
