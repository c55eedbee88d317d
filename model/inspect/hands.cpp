#include "model/inspect/hands.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace degas {
namespace {

/// Mean overlap within a hand's box that the other way must add.
constexpr double clear_hand_gain = 0.03;

/// The box around a hand's vertices in both surfaces, a quarter larger; nothing where it reaches out of the picture.
std::optional<Rectangle> hand_box(const BodyModel& body, int first_joint, const BodySurface& a, const BodySurface& b,
                                  const Camera& view) {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
  for (int vertex = 0; vertex < body.vertex_count(); ++vertex) {
    double weight = 0;
    for (const JointWeight& share : body.skinning_weights(vertex)) {
      if (share.joint >= first_joint && share.joint < first_joint + joints_per_hand) weight += share.weight;
    }
    if (weight < 0.5) continue;
    for (const BodySurface* surface : {&a, &b}) {
      const Eigen::Vector3d pixel = view.project(surface->vertices[static_cast<size_t>(vertex)].cast<double>());
      if (!(pixel.z() > 0)) return std::nullopt;
      left = std::min(left, pixel.x());
      right = std::max(right, pixel.x());
      top = std::min(top, pixel.y());
      bottom = std::max(bottom, pixel.y());
    }
  }
  const double more = std::max(right - left, bottom - top) / 8;
  if (!(left - more >= 0 && top - more >= 0 && right + more <= view.width && bottom + more <= view.height)) return {};
  const int x = static_cast<int>(left - more), y = static_cast<int>(top - more);
  return Rectangle{x, y, static_cast<int>(right + more) - x, static_cast<int>(bottom + more) - y};
}

}  // namespace

HandFit& HandFit::operator+=(const HandFit& more) {
  hands += more.hands;
  as_registered += more.as_registered;
  otherwise += more.otherwise;
  return *this;
}

std::optional<std::string> HandFit::verdict(bool flat_hand_mean) const {
  if (hands == 0 || (otherwise - as_registered) / hands < clear_hand_gain) return std::nullopt;
  return fmt::format(
      "flat_hand_mean: finger angles seem to be relative to the {} hand, but the capture says the {} one (hands "
      "overlap "
      "by {:.2f} as read, {:.2f} otherwise)",
      flat_hand_mean ? "mean" : "flat", flat_hand_mean ? "flat" : "mean", as_registered / hands, otherwise / hands);
}

HandFit compare_hands(const BodyModel& body, const BodySurface& as_registered, const BodySurface& otherwise,
                      const Camera& view, const Image8& mask) {
  const Image8 covered = silhouette(as_registered, view), covered_otherwise = silhouette(otherwise, view);
  HandFit fit;
  for (const int hand : {LeftHandJoint, RightHandJoint}) {
    const std::optional<Rectangle> box = hand_box(body, hand, as_registered, otherwise, view);
    if (!box) continue;
    fit.as_registered += overlap(covered, mask, box);
    fit.otherwise += overlap(covered_otherwise, mask, box);
    ++fit.hands;
  }
  return fit;
}

}  // namespace degas
