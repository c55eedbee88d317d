#include "model/data/mannequin_texture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector4f;
using std::numbers::pi;

struct Paint {
  Vector3d color;  // linear
  double gloss = 0;
};

Vector3d srgb(double red, double green, double blue) {
  const auto linear = [](double value) {
    const double s = value / 255;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  };
  return {linear(red), linear(green), linear(blue)};
}

Vector3d mix(const Vector3d& a, const Vector3d& b, double t) {
  return (1 - t) * a + t * b;
}

/// 1 within `half` of 0, fading over `soft`.
double band(double x, double half, double soft) {
  return 1 - smoothstep(half - soft, half + soft, std::abs(x));
}

/// Place on the head's grid: rows and columns of mannequin_head.cpp from the texture coordinate.
struct HeadPlace {
  double row_from_lids, column_from_front;
};

Paint paint_face(const Vector3d& p, const HeadPlace& place) {
  const double x = std::abs(p.x()), front = smoothstep(0.02, 0.06, p.z());
  Vector3d color = srgb(216, 168, 141) * (1 + 0.035 * value_noise(p / 0.012) + 0.025 * value_noise(p / 0.004));
  color = mix(color, srgb(214, 138, 118), 0.40 * front * bell(x - 0.044, 0.018) * bell(p.y() - 1.603, 0.016));
  color = mix(color, srgb(212, 140, 120), 0.35 * front * bell(x, 0.012) * bell(p.y() - 1.604, 0.010));
  const double beard = front * smoothstep(1.607, 1.585, p.y()) * smoothstep(1.515, 1.535, p.y());
  color = mix(color, srgb(150, 118, 104), 0.30 * beard * (0.8 + 0.4 * value_noise(p / 0.0025)));
  // Sockets a little darker, lips, nostrils, brows, lashes.
  color = mix(color, srgb(176, 122, 102), 0.35 * front * bell(x - 0.030, 0.017) * bell(p.y() - 1.642, 0.012));
  const double from_mouth = p.y() - mouth_height, edge = std::max(0.0, 1 - x * x / (0.0275 * 0.0275));
  const double lip_half =
      (from_mouth > 0 ? 0.0092 : 0.0112) * std::sqrt(edge) - (from_mouth > 0 ? 0.0016 * bell(x, 0.004) : 0);
  const double lips =
      front * (1 - smoothstep(lip_half - 0.0012, lip_half + 0.0012, std::abs(from_mouth))) * (edge > 0 ? 1 : 0);
  color = mix(color, srgb(176, 92, 86), 0.85 * lips);
  color = mix(color, srgb(70, 30, 28), 0.8 * front * band(from_mouth, 0.0007, 0.0007) * band(x, 0.027, 0.001));
  color = mix(color, srgb(60, 30, 24), 0.8 * front * bell(x - 0.0078, 0.0034) * bell(p.y() - 1.5975, 0.0022));
  const double arch = 1.6605 + 0.0045 * bell(x - 0.036, 0.014) - 0.003 * smoothstep(0.040, 0.054, x);
  const double brow_half = 0.0042 * (1 - 0.55 * smoothstep(0.028, 0.054, x));
  const double brow = front * (1 - smoothstep(brow_half - 0.001, brow_half + 0.0015, std::abs(p.y() - arch))) *
                      smoothstep(0.0105, 0.0135, x) * (1 - smoothstep(0.051, 0.054, x));
  color = mix(color, srgb(58, 40, 30), brow * (0.85 + 0.15 * value_noise(Vector3d(p.x() / 0.001, p.y() / 0.006, 0))));
  const double column = std::abs(place.column_from_front);
  const double on_lids = band(column - 7, 2.9, 0.3);
  color = mix(
      color, srgb(36, 24, 20),
      0.9 * on_lids * smoothstep(-0.05, 0.05, place.row_from_lids) * (1 - smoothstep(0.35, 0.60, place.row_from_lids)));
  color = mix(color, srgb(130, 84, 72), 0.7 * on_lids * band(place.row_from_lids + 0.2, 0.2, 0.15));
  return {color, 0.035 + 0.05 * lips};
}

Paint paint_hair(const Vector3d& p) {
  const double around = std::atan2(p.x(), p.z());
  const double strand = value_noise(Vector3d(around / 0.035, p.y() / 0.06, p.z() / 0.05));
  const double fine = value_noise(Vector3d(around / 0.012, p.y() / 0.03, 7));
  return {srgb(74, 50, 34) * std::max(0.25, 1 + 0.45 * strand + 0.25 * fine), 0.05};
}

/// Plaid from two lengths in metres along the cloth.
Vector3d plaid(double across, double along) {
  constexpr double period = 0.052;
  const auto broad = [](double s) { return band(std::remainder(s, period), 0.0115, 0.0015); };
  const auto thin = [](double s) { return band(std::remainder(s + period / 2, period), 0.0030, 0.0012); };
  Vector3d color = srgb(86, 128, 150);
  color = mix(color, srgb(36, 58, 92), 0.5 * broad(across));
  color = mix(color, srgb(36, 58, 92), 0.5 * broad(along));
  color = mix(color, srgb(206, 196, 172), 0.5 * thin(across));
  return mix(color, srgb(206, 196, 172), 0.5 * thin(along));
}

Paint paint_shirt(MannequinChart chart, const Vector3d& p, double column) {
  const double weave = 1 + 0.06 * value_noise(p / 0.003) + 0.04 * value_noise(p / 0.03);
  if (chart != MannequinChart::Torso) {
    const double along = along_arm(p);
    const Vector3d color = along > 0.455 ? srgb(52, 80, 108) : plaid((column - 0.25) * 0.29, along);
    return {color * weave, 0};
  }
  const double across = (column - 0.5) * 0.98;
  Vector3d color = plaid(across, p.y());
  if (p.y() > 1.486) return {srgb(52, 80, 108) * weave, 0};
  if (p.z() > 0) {
    color = mix(color, srgb(66, 100, 126), band(across, 0.017, 0.001));
    color = mix(color, srgb(30, 46, 70), 0.7 * band(std::abs(across) - 0.017, 0.0014, 0.0006));
    const double button = std::hypot(across, std::remainder(p.y() - 0.02, 0.085));
    color = mix(color, srgb(232, 226, 210), p.y() < 1.455 ? 1 - smoothstep(0.0062, 0.0078, button) : 0);
    const double box = std::max(std::abs(across - 0.088) - 0.042, std::abs(p.y() - 1.305) - 0.048);
    color = mix(color, srgb(30, 46, 70), 0.75 * band(box, 0.0018, 0.0008));
  }
  color = mix(color, srgb(30, 46, 70), 0.6 * band(p.y() - 0.934, 0.0015, 0.0008));
  return {color * weave, 0};
}

Paint paint_trousers(MannequinChart chart, const Vector3d& p, double column) {
  const double weave =
      1 + 0.12 * value_noise(Vector3d(p.x() / 0.002, p.y() / 0.008, p.z() / 0.002)) + 0.10 * value_noise(p / 0.05);
  Vector3d color = srgb(58, 72, 104);
  const double thigh = bell(p.y() - 0.68, 0.14) + 0.8 * bell(p.y() - 0.48, 0.06);
  color = mix(color, srgb(122, 138, 164), 0.5 * thigh * smoothstep(0.0, 0.08, p.z()));
  if (chart != MannequinChart::Torso) {
    color = mix(color, srgb(176, 138, 84), 0.6 * band(std::abs(column - 0.25) - 0.012, 0.0025, 0.001));
    color = mix(color, srgb(34, 42, 64), 0.7 * band(column - 0.25, 0.004, 0.002));
    color = mix(color, srgb(34, 42, 64), 0.6 * band(p.y() - 0.128, 0.0015, 0.001));
  }
  return {color * weave, 0};
}

Paint paint_shoe(const Vector3d& p) {
  if (p.y() < 0.018) return {srgb(222, 214, 200) * (1 + 0.05 * value_noise(p / 0.01)), 0.02};
  Vector3d color = srgb(112, 70, 44) * (1 + 0.10 * value_noise(p / 0.02));
  const double x = std::abs(p.x()) - 0.124;
  const bool instep = p.z() > 0.025 && p.z() < 0.105 && std::abs(x) < 0.018 && p.y() > 0.045;
  if (instep) color = mix(color, srgb(232, 224, 206), band(std::remainder(p.z(), 0.017), 0.0032, 0.001));
  color = mix(color, srgb(70, 42, 26), 0.6 * band(p.z() - 0.125, 0.002, 0.001));
  return {color, 0.08};
}

Paint paint_eye(const Vector3d& p) {
  Vector3d center = left_eye_center();
  center.x() = std::copysign(center.x(), p.x());
  const Vector3d out = (p - center).normalized();
  const double angle = std::acos(std::clamp(out.z(), -1.0, 1.0)) * 180 / pi;
  const double spoke = value_noise(Vector3d(std::atan2(out.x(), out.y()) * 9, angle / 8, 3));
  Vector3d color = mix(srgb(236, 231, 226), srgb(214, 160, 148), 0.6 * smoothstep(38, 62, angle));
  color = mix(color, srgb(92, 74, 44) * (1 + 0.35 * spoke), 1 - smoothstep(27, 29.5, angle));
  color = mix(color, srgb(36, 28, 22), bell(angle - 27.5, 2.5));
  color = mix(color, srgb(10, 8, 8), 1 - smoothstep(11, 13, angle));
  return {color, 0.8};
}

Paint paint(MannequinChart chart, const Vector3d& p, double column, double row) {
  switch (mannequin_material(chart, p)) {
    case MannequinMaterial::Hair:
      return paint_hair(p);
    case MannequinMaterial::Shirt:
      return paint_shirt(chart, p, column);
    case MannequinMaterial::Trousers:
      return paint_trousers(chart, p, column);
    case MannequinMaterial::Shoe:
      return paint_shoe(p);
    case MannequinMaterial::Eye:
      return paint_eye(p);
    case MannequinMaterial::Teeth: {
      const double gap = band(std::remainder(p.x(), 0.0062), 0.0004, 0.0004);
      const double gum = chart == MannequinChart::UpperTeeth ? smoothstep(0.0065, 0.0075, p.y() - mouth_height)
                                                             : smoothstep(-0.0070, -0.0080, p.y() - mouth_height);
      return {mix(mix(srgb(236, 228, 210), srgb(150, 130, 112), 0.6 * gap), srgb(176, 84, 84), gum), 0.12};
    }
    case MannequinMaterial::Mouth:
      return {mix(srgb(128, 48, 46), srgb(26, 8, 8), smoothstep(0.1, 0.6, row)), 0.02};
    case MannequinMaterial::Skin:
      break;
  }
  if (chart == MannequinChart::Head) return paint_face(p, {row * 49 - 29, (column - 0.5) * torso_columns});
  if (chart == MannequinChart::LeftEyeRim || chart == MannequinChart::RightEyeRim) return {srgb(96, 52, 44), 0.05};
  Vector3d skin = srgb(212, 163, 137) * (1 + 0.03 * value_noise(p / 0.012));
  if (chart == MannequinChart::LeftFingers || chart == MannequinChart::RightFingers) {
    skin = mix(skin, srgb(206, 140, 120), 0.35);
    // Nails: the last fifth of the finger, on the back.
    skin = mix(skin, srgb(232, 190, 176),
               smoothstep(0.74, 0.78, row) * (1 - smoothstep(0.90, 0.94, row)) * band(column - 0.15, 0.13, 0.04));
  }
  return {skin, 0.03};
}

}  // namespace

MannequinTexture paint_mannequin(const MannequinBody& body, int size) {
  MannequinTexture texture;
  texture.size = size;
  texture.texels.assign(static_cast<size_t>(size) * size, Vector4f::Zero());
  std::vector<uint8_t> covered(texture.texels.size(), 0);
  const MannequinMesh& mesh = body.mesh;
  // Charts are rectangles: the place within one follows from its bounds.
  std::array<Eigen::AlignedBox2d, 15> bounds;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      bounds[static_cast<int>(mesh.triangle_charts[t])].extend(mesh.texture_vertices[mesh.texture_triangles[t][k]]);
    }
  }
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const MannequinChart chart = mesh.triangle_charts[t];
    std::array<Eigen::Vector2d, 3> corner;
    Eigen::AlignedBox2d box;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d uv = mesh.texture_vertices[mesh.texture_triangles[t][k]];
      corner[k] = Eigen::Vector2d(uv.x() * size, (1 - uv.y()) * size);
      box.extend(corner[k]);
    }
    const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
    const double area = cross(corner[1] - corner[0], corner[2] - corner[0]);
    for (int y = static_cast<int>(box.min().y()); y <= std::min(size - 1, static_cast<int>(box.max().y())); ++y) {
      for (int x = static_cast<int>(box.min().x()); x <= std::min(size - 1, static_cast<int>(box.max().x())); ++x) {
        const Eigen::Vector2d at(x + 0.5, y + 0.5);
        const double a = cross(corner[1] - at, corner[2] - at) / area, b = cross(corner[2] - at, corner[0] - at) / area;
        if (a < -1e-9 || b < -1e-9 || a + b > 1 + 1e-9) continue;
        const auto& triangle = mesh.triangles[t];
        const Vector3d p =
            a * mesh.vertices[triangle[0]] + b * mesh.vertices[triangle[1]] + (1 - a - b) * mesh.vertices[triangle[2]];
        const auto& rect = bounds[static_cast<int>(chart)];
        Eigen::Vector2d place =
            (Eigen::Vector2d(at.x() / size, 1 - at.y() / size) - rect.min()).cwiseQuotient(rect.sizes());
        if (chart == MannequinChart::LeftFingers || chart == MannequinChart::RightFingers) {
          place.x() = std::fmod((at.x() / size - 0.829) / 0.034, 1.0) * 0.034 / 0.027;
        }
        const Paint result = paint(chart, p, place.x(), place.y());
        const size_t index = static_cast<size_t>(y) * size + x;
        texture.texels[index] << result.color.cast<float>(), static_cast<float>(result.gloss);
        covered[index] = 1;
      }
    }
  }
  // Grow the charts into the gutters: bilinear look-ups at their borders see only painted texels.
  for (int round = 0; round < 4; ++round) {
    const std::vector<uint8_t> before = covered;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const size_t index = static_cast<size_t>(y) * size + x;
        if (before[index]) continue;
        for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= size || ny >= size) continue;
          const size_t neighbor = static_cast<size_t>(ny) * size + nx;
          if (!before[neighbor]) continue;
          texture.texels[index] = texture.texels[neighbor];
          covered[index] = 1;
          break;
        }
      }
    }
  }
  return texture;
}

}  // namespace degas
