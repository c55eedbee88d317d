#include "model/inspect/camera_plan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "model/train/html.h"

namespace degas {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double side = 520, margin = 40;

struct Line {
  Vector3d from, to;
  const char* style;
};

/// The pyramid of a camera, `length` metres deep.
void add_pyramid(const Camera& camera, double length, std::vector<Line>& lines) {
  const Vector3d apex = camera.center();
  std::array<Vector3d, 4> corners;
  for (size_t k = 0; k < 4; ++k) {
    const double u = k == 1 || k == 2 ? camera.width : 0, v = k >= 2 ? camera.height : 0;
    const Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
    corners[k] = apex + camera.rotation.transpose() * (length * ray);
  }
  constexpr const char* thin = "stroke=\"#1b6ca8\" stroke-width=\"1\"";
  for (size_t k = 0; k < 4; ++k) {
    lines.push_back({apex, corners[k], thin});
    lines.push_back({corners[k], corners[(k + 1) % 4], thin});
  }
  lines.push_back({corners[0], corners[1], "stroke=\"#c8553d\" stroke-width=\"2\""});  // the picture's upper edge
}

/// 1, 2 or 5 times a power of ten, about a quarter of the extent.
double ruler_length(double extent) {
  const double power = std::pow(10, std::floor(std::log10(extent / 4)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= extent / 4) return factor * power;
  }
  return power;
}

/// Lines and names seen along `view`'s third row: x to the right by its first, y up by its second.
std::string drawing(const CameraPlan& plan, const std::vector<Line>& lines, const Eigen::Matrix3d& view,
                    const char* title) {
  Vector2d low(1e30, 1e30), high = -low;
  const auto flat = [&](const Vector3d& point) { return Vector2d((view * point).head<2>()); };
  for (const Line& line : lines) {
    for (const Vector3d& point : {line.from, line.to}) {
      low = low.cwiseMin(flat(point));
      high = high.cwiseMax(flat(point));
    }
  }
  const double extent = std::max({(high - low).maxCoeff(), 1e-6});
  const double scale = (side - 2 * margin) / extent;
  const Vector2d middle = (low + high) / 2;
  const auto place = [&](const Vector3d& point) {
    const Vector2d from_middle = scale * (flat(point) - middle);
    return Vector2d(side / 2 + from_middle.x(), side / 2 - from_middle.y());
  };
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {0}\" width=\"{0}\" height=\"{0}\" "
      "font-family=\"system-ui,sans-serif\" font-size=\"11\"><text x=\"10\" y=\"18\" font-size=\"13\" "
      "font-weight=\"600\">{1}</text>",
      side, title);
  for (const Line& line : lines) {
    const Vector2d from = place(line.from), to = place(line.to);
    svg += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>", from.x(), from.y(), to.x(),
                       to.y(), line.style);
  }
  for (size_t i = 0; i < plan.cameras.size(); ++i) {
    const Vector2d at = place(plan.cameras[i].center());
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>", at.x() + 4, at.y() - 4, escape(plan.names[i]));
  }
  const double ruler = ruler_length(extent);
  return svg + fmt::format(
                   "<line x1=\"10\" y1=\"{0}\" x2=\"{1:.1f}\" y2=\"{0}\" stroke=\"#222\" stroke-width=\"2\"/>"
                   "<text x=\"10\" y=\"{2}\">{3:g} m</text></svg>",
                   side - 10, 10 + scale * ruler, side - 16, ruler);
}

}  // namespace

std::string camera_plan_svg(const CameraPlan& plan) {
  if (plan.cameras.empty()) return "";
  Vector3d middle = Vector3d::Zero();
  for (const Camera& camera : plan.cameras) middle += camera.center() / static_cast<double>(plan.cameras.size());
  double reach = 0;
  for (const Camera& camera : plan.cameras) reach = std::max(reach, (camera.center() - middle).norm());
  std::vector<Line> lines;
  for (const auto& [from, to] : plan.bones) lines.push_back({from, to, "stroke=\"#444\" stroke-width=\"2\""});
  for (const Camera& camera : plan.cameras) add_pyramid(camera, 0.12 * std::max(reach, 1e-3), lines);

  const Vector3d right = plan.up.unitOrthogonal();
  const auto seen_from = [&](double height, double turn) {
    const Vector3d ahead = Eigen::AngleAxisd(turn, plan.up) * right;  // horizontal, away from the viewer
    Eigen::Matrix3d view;
    view.row(2) = (std::cos(height) * ahead - std::sin(height) * plan.up).transpose();
    view.row(0) = ahead.cross(plan.up).transpose();
    view.row(1) = view.row(0).cross(view.row(2));
    return view;
  };
  constexpr double degrees = std::numbers::pi / 180;
  return "<div class=\"charts\">" + drawing(plan, lines, seen_from(90 * degrees, 0), "from above") +
         drawing(plan, lines, seen_from(25 * degrees, 30 * degrees), "in space") + "</div>";
}

}  // namespace degas
