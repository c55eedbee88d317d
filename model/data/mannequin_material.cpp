#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"
#include "model/data/mannequin_texture.h"

namespace degas {

using Eigen::Vector3d;

double value_noise(const Vector3d& position) {
  const auto lattice = [](int64_t x, int64_t y, int64_t z) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^ static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
                 static_cast<uint64_t>(z) * 0x165667B19E3779F9ULL;
    h ^= h >> 31;
    h *= 0xBF58476D1CE4E5B9ULL;
    h ^= h >> 29;
    return static_cast<double>(h >> 11) / 4503599627370496.0 - 1;  // 53 bits to -1..1
  };
  const Vector3d base = position.array().floor();
  const auto x = static_cast<int64_t>(base.x()), y = static_cast<int64_t>(base.y()), z = static_cast<int64_t>(base.z());
  Eigen::Array3d t = (position - base).array();
  t = t * t * (3 - 2 * t);
  double value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    value += (i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]) * lattice(x + i, y + j, z + k);
  }
  return value;
}

double along_arm(const Vector3d& rest) {
  static const ArmFrame arm = mannequin_arm_frame();
  const Vector3d p(std::abs(rest.x()), rest.y(), rest.z());
  const double upper = (p - arm.shoulder).dot(arm.along);
  return upper < arm.upper_length ? upper : arm.upper_length + std::max(0.0, (p - arm.elbow()).dot(arm.fore_along));
}

double hair_amount(const Vector3d& rest) {
  // Angle from the front (degrees), height of the hairline.
  static const std::vector<std::array<double, 2>> hairline{{0, 1.7080},  {25, 1.7120}, {42, 1.7060}, {58, 1.684},
                                                           {72, 1.6560}, {84, 1.6520}, {95, 1.6620}, {106, 1.650},
                                                           {116, 1.615}, {132, 1.575}, {150, 1.560}, {180, 1.554}};
  // The mean over neighbouring angles keeps the line smooth where it is steep and the mesh coarse.
  const double angle = std::atan2(std::abs(rest.x()), rest.z()) * 180 / std::numbers::pi;
  double amount = 0;
  for (const double offset : {-10.0, -5.0, 0.0, 5.0, 10.0}) {
    const double line = interpolate_keys(hairline, std::abs(angle + offset))[1];
    amount += 0.2 * smoothstep(line - 0.010, line + 0.010, rest.y());
  }
  return amount;
}

MannequinMaterial mannequin_material(MannequinChart chart, const Vector3d& rest) {
  switch (chart) {
    case MannequinChart::Head:
      return hair_amount(rest) > 0.5 ? MannequinMaterial::Hair : MannequinMaterial::Skin;
    case MannequinChart::MouthBag:
      return MannequinMaterial::Mouth;
    case MannequinChart::UpperTeeth:
    case MannequinChart::LowerTeeth:
      return MannequinMaterial::Teeth;
    case MannequinChart::LeftEye:
    case MannequinChart::RightEye:
      return MannequinMaterial::Eye;
    case MannequinChart::Torso:
      return rest.y() > 0.918 ? MannequinMaterial::Shirt : MannequinMaterial::Trousers;
    case MannequinChart::LeftArm:
    case MannequinChart::RightArm:
      return along_arm(rest) < 0.506 ? MannequinMaterial::Shirt : MannequinMaterial::Skin;
    case MannequinChart::LeftLeg:
    case MannequinChart::RightLeg:
      return rest.y() > 0.104 ? MannequinMaterial::Trousers : MannequinMaterial::Shoe;
    default:
      return MannequinMaterial::Skin;
  }
}

}  // namespace degas
