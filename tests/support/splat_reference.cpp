#include "tests/support/splat_reference.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace degas::test {
namespace {

struct Ellipse {
  double depth;
  Eigen::Vector2d center;
  Eigen::Matrix2d inverse_covariance;
  double opacity;
  Eigen::Vector3d color;
};

/// False when the splat is culled.
bool project(const SplatScene& scene, int64_t n, const Camera& camera, const SplatOptions& options, Ellipse& ellipse) {
  const Eigen::Map<const Eigen::Vector3d> position(&scene.positions[3 * n]), log_scale(&scene.log_scales[3 * n]);
  const Eigen::Vector3d p = camera.rotation * position + camera.translation;
  const double* q = &scene.rotations[4 * n];
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(p.z() >= options.near_plane) || !(rotation.squaredNorm() >= 1e-6)) return false;
  const double beyond_x = 0.15 * camera.width, beyond_y = 0.15 * camera.height;
  const double x =
      std::clamp(p.x() / p.z(), (-beyond_x - camera.cx) / camera.fx, (camera.width + beyond_x - camera.cx) / camera.fx);
  const double y = std::clamp(p.y() / p.z(), (-beyond_y - camera.cy) / camera.fy,
                              (camera.height + beyond_y - camera.cy) / camera.fy);
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << camera.fx / p.z(), 0, -camera.fx * x / p.z(), 0, camera.fy / p.z(), -camera.fy * y / p.z();
  const Eigen::Matrix3d m = rotation.normalized().toRotationMatrix() * log_scale.array().exp().matrix().asDiagonal();
  const Eigen::Matrix2d bare =
      jacobian * camera.rotation * (m * m.transpose()) * camera.rotation.transpose() * jacobian.transpose();
  const Eigen::Matrix2d blurred = bare + options.blur * Eigen::Matrix2d::Identity();
  ellipse.opacity = scene.opacities[n];
  if (options.antialias) {
    ellipse.opacity *= std::max(0.005, std::sqrt(std::max(0.0, bare.determinant() / blurred.determinant())));
  }
  ellipse.depth = p.z();
  ellipse.center = camera.project(position).head<2>();
  ellipse.inverse_covariance = blurred.inverse();
  ellipse.color = Eigen::Map<const Eigen::Vector3d>(&scene.colors[3 * n]);
  return true;
}

}  // namespace

Splats SplatScene::upload(Device& device) const {
  const auto tensor = [&](const std::vector<double>& values, Shape shape) {
    return Tensor::from(device, std::move(shape), std::span<const double>(values)).set_requires_gradient();
  };
  const int64_t n = count();
  return {tensor(positions, {n, 3}), tensor(rotations, {n, 4}), tensor(log_scales, {n, 3}), tensor(opacities, {n}),
          tensor(colors, {n, 3}), {}};
}

void SplatScene::add(std::array<double, 3> position, std::array<double, 4> rotation, std::array<double, 3> log_scale,
                     double opacity, std::array<double, 3> color) {
  positions.insert(positions.end(), position.begin(), position.end());
  rotations.insert(rotations.end(), rotation.begin(), rotation.end());
  log_scales.insert(log_scales.end(), log_scale.begin(), log_scale.end());
  opacities.push_back(opacity);
  colors.insert(colors.end(), color.begin(), color.end());
}

void SplatScene::append(const SplatScene& other) {
  positions.insert(positions.end(), other.positions.begin(), other.positions.end());
  rotations.insert(rotations.end(), other.rotations.begin(), other.rotations.end());
  log_scales.insert(log_scales.end(), other.log_scales.begin(), other.log_scales.end());
  opacities.insert(opacities.end(), other.opacities.begin(), other.opacities.end());
  colors.insert(colors.end(), other.colors.begin(), other.colors.end());
}

SplatScene SplatScene::permuted(const std::vector<int>& order) const {
  SplatScene result;
  for (int n : order) {
    result.add({positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]},
               {rotations[4 * n], rotations[4 * n + 1], rotations[4 * n + 2], rotations[4 * n + 3]},
               {log_scales[3 * n], log_scales[3 * n + 1], log_scales[3 * n + 2]}, opacities[n],
               {colors[3 * n], colors[3 * n + 1], colors[3 * n + 2]});
  }
  return result;
}

SplatScene random_scene(int count, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  SplatScene scene;
  for (int n = 0; n < count; ++n) {
    const double z = uniform(2, 6);
    scene.add({z * uniform(-0.55, 0.55), z * uniform(-0.55, 0.55), z},
              {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)},
              {uniform(-4.5, -1.2), uniform(-4.5, -1.2), uniform(-4.5, -1.2)}, uniform(0.05, 0.95),
              {uniform(0, 1), uniform(0, 1), uniform(0, 1)});
  }
  return scene;
}

Camera test_camera(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = width;
  camera.fy = 1.05 * width;
  camera.cx = 0.53 * width;
  camera.cy = 0.46 * height;
  camera.rotation = (Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.2, 1, 0).normalized()) *
                     Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()))
                        .toRotationMatrix();
  camera.translation = {0.05, -0.1, 0.2};
  return camera;
}

ReferenceImage reference_render(const SplatScene& scene, const Camera& camera, const std::array<double, 3>& background,
                                const SplatOptions& options) {
  std::vector<Ellipse> ellipses;
  for (int64_t n = 0; n < scene.count(); ++n) {
    Ellipse ellipse;
    if (project(scene, n, camera, options, ellipse)) ellipses.push_back(ellipse);
  }
  std::stable_sort(ellipses.begin(), ellipses.end(),
                   [](const Ellipse& a, const Ellipse& b) { return a.depth < b.depth; });
  ReferenceImage image;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      double transmittance = 1;
      Eigen::Vector3d color = Eigen::Vector3d::Zero();
      for (const Ellipse& ellipse : ellipses) {
        const Eigen::Vector2d d = Eigen::Vector2d(column + 0.5, row + 0.5) - ellipse.center;
        double alpha = ellipse.opacity * std::exp(-0.5 * d.dot(ellipse.inverse_covariance * d));
        if (alpha < 1.0 / 255) continue;
        alpha = std::min(alpha, 0.99);
        if (options.smooth_cutoff) {
          const double t = std::clamp(255 * alpha - 1, 0.0, 1.0);
          alpha *= t * t * (3 - 2 * t);
        }
        color += transmittance * alpha * ellipse.color;
        transmittance *= 1 - alpha;
        if (transmittance < 1e-4) break;
      }
      for (int c = 0; c < 3; ++c) image.color.push_back(color(c) + transmittance * background[c]);
      image.alpha.push_back(1 - transmittance);
    }
  }
  return image;
}

}  // namespace degas::test
