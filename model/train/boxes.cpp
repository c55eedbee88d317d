#include "model/train/boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/loss/metrics.h"

namespace degas {

std::vector<Eigen::Vector3d> head_points(const BodyModel& body, const Pose& pose, const std::vector<double>& betas) {
  const std::vector<Eigen::Vector3d> vertices = body.posed_vertices(pose, betas, true);
  std::vector<Eigen::Vector3d> points;
  for (const int vertex : body.head_vertices()) points.push_back(vertices[static_cast<size_t>(vertex)]);
  return points;
}

std::optional<Rectangle> head_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera) {
  return head_box(head_points(body, pose, betas), camera);
}

std::optional<Rectangle> head_box(const std::vector<Eigen::Vector3d>& head_points, const Camera& camera) {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
  for (const Eigen::Vector3d& point : head_points) {
    const Eigen::Vector3d pixel = camera.project(point);
    if (!(pixel.z() > 0)) return std::nullopt;
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  // Also false when there is no head vertex at all, or a coordinate is not finite.
  if (!(right > 0 && left < camera.width && bottom > 0 && top < camera.height)) return std::nullopt;
  const auto pixel_of = [](double value, int limit) { return static_cast<int>(std::clamp<double>(value, 0, limit)); };
  const int x0 = pixel_of(std::floor(left), camera.width), x1 = pixel_of(std::ceil(right), camera.width);
  const int y0 = pixel_of(std::floor(top), camera.height), y1 = pixel_of(std::ceil(bottom), camera.height);
  return Rectangle{x0, y0, x1 - x0, y1 - y0};
}

std::optional<Rectangle> face_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera) {
  const std::optional<Rectangle> head = head_box(body, pose, betas, camera);
  if (!head) return head;
  const int x = head->width / 8, y = head->height / 8;
  return clipped({head->left - x, head->top - y, head->width + 2 * x, head->height + 2 * y}, camera.width,
                 camera.height);
}

}  // namespace degas
