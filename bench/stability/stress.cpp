#include "bench/stability/stress.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>

#include "bench/stability/textbook_splats.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "host/ops/skinning.h"
#include "host/ops/splat.h"

namespace degas::bench {
namespace {

constexpr double pi = 3.14159265358979323846;

/// A stressed scene and its camera.
struct Stressed {
  StressedScene scene;
  Camera camera;
};

Camera stress_camera() {
  Camera camera;
  camera.width = 48;
  camera.height = 32;
  camera.fx = camera.fy = 40;
  camera.cx = 24;
  camera.cy = 16;
  return camera;
}

constexpr int draws = 8;

/// Three splats of 5 to 10 cm one behind the other, 2 m away. draw: 0 .. draws - 1, each a little different.
Stressed usual(int draw) {
  Stressed usual = {{-0.21, 0.11,  2.1, 0.8, 0.1,  -0.3, 0.4,  -2.4, -2.9, -2.7, 0.8, 0.9, 0.3, 0.2,  //
                     0.13,  -0.07, 2.3, 0.5, 0.6,  0.2,  -0.1, -2.2, -3.0, -2.5, 0.6, 0.2, 0.7, 0.4,  //
                     0.02,  0.05,  1.9, 0.9, -0.2, 0.1,  0.3,  -2.8, -2.3, -2.6, 0.7, 0.1, 0.4, 0.8},
                    stress_camera()};
  std::mt19937 random(static_cast<unsigned>(draw));
  for (double& number : usual.scene) number += draw == 0 ? 0 : (random() * 0x1p-32 - 0.5) * 0.1;
  return usual;
}

double& number(Stressed& stressed, int splat, int index) {
  return stressed.scene[static_cast<size_t>(splat * numbers_of_splat + index)];
}

std::vector<double> loss_weights(const Camera& camera) {
  std::vector<double> weights(static_cast<size_t>(3 * camera.width * camera.height));
  uint32_t state = 7;
  for (double& weight : weights) {
    state = state * 1664525u + 1013904223u;
    weight = static_cast<int32_t>(state) * 0x1p-31;
  }
  return weights;
}

/// The same as textbook_splats of this project's kernels.
TextbookResult our_splats(Device& device, const Stressed& stressed, const std::vector<double>& weights) {
  constexpr std::pair<int, int> fields[] = {{0, 3}, {3, 4}, {7, 3}, {10, 1}, {11, 3}};  // first number and how many
  std::vector<Tensor> tensors;
  for (const auto& [first, count] : fields) {
    std::vector<double> values;
    for (int splat = 0; splat < splats_of_scene; ++splat) {
      const auto from = stressed.scene.begin() + splat * numbers_of_splat + first;
      values.insert(values.end(), from, from + count);
    }
    const Shape shape = count == 1 ? Shape{splats_of_scene} : Shape{splats_of_scene, count};
    tensors.push_back(Tensor::from(device, shape, std::span<const double>(values)).set_requires_gradient());
  }
  Tape tape(device);
  SplatWorkspace workspace;
  SplatOptions options;
  options.smooth_cutoff = true;
  const SplatImage image = splat(tape, workspace, {tensors[0], tensors[1], tensors[2], tensors[3], tensors[4], {}},
                                 stressed.camera, {0, 0, 0}, options);
  const Tensor weight = Tensor::from(device, image.color.shape(), std::span<const double>(weights));
  TextbookResult result;
  const Tensor loss = sum(tape, multiply(tape, image.color, weight));
  result.color = image.color.to_host<double>();
  tape.backward(loss);
  for (size_t field = 0; field < tensors.size(); ++field) {
    const std::vector<double> values = tensors[field].gradient().to_host<double>();
    const auto [first, count] = fields[field];
    for (int i = 0; i < splats_of_scene * count; ++i) {
      result.gradient[static_cast<size_t>(i / count * numbers_of_splat + first + i % count)] =
          values[static_cast<size_t>(i)];
    }
  }
  return result;
}

/// The largest difference over the largest number of the reference; 0 where both are nothing.
template <typename Numbers>
double relative_error(const Numbers& found, const Numbers& reference) {
  double difference = 0, largest = 0;
  for (size_t i = 0; i < reference.size(); ++i) {
    if (!std::isfinite(reference[i])) throw std::logic_error("[stability_bench] the reference is not finite");
    if (!std::isfinite(found[i])) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, std::abs(found[i] - reference[i]));
    largest = std::max(largest, std::abs(reference[i]));
  }
  return difference == 0 ? 0 : difference / largest;
}

/// Of gradients field by field, since their units differ.
double error_of(const TextbookResult& found, const TextbookResult& reference) {
  double error = relative_error(found.color, reference.color);
  for (const auto& [first, count] : {std::pair{0, 3}, {3, 4}, {7, 3}, {10, 1}, {11, 3}}) {
    std::vector<double> of_found, of_reference;
    for (int i = 0; i < numbers_of_scene; ++i) {
      if (i % numbers_of_splat < first || i % numbers_of_splat >= first + count) continue;
      of_found.push_back(found.gradient[static_cast<size_t>(i)]);
      of_reference.push_back(reference.gradient[static_cast<size_t>(i)]);
    }
    error = std::max(error, relative_error(of_found, of_reference));
  }
  return error;
}

struct Fault {
  const char* name;
  TextbookFaults faults;
};

/// Each error is the worst of all draws: that of a single scene is chance. put_under: changes a usual scene.
StressAxis splat_axis(Device& device, StressAxis axis, const std::vector<double>& stresses,
                      const std::vector<Fault>& faults,
                      const std::function<void(Stressed& usual, double stress)>& put_under) {
  axis.series = {{"degas", true, {}}, {"textbook in float32", false, {}}};
  for (const Fault& fault : faults) axis.series.push_back({fault.name, false, {}});
  for (const double stress : stresses) {
    std::vector<double> worst(axis.series.size(), -1);
    for (int draw = 0; draw < draws; ++draw) {
      Stressed stressed = usual(draw);
      put_under(stressed, stress);
      const std::vector<double> weights = loss_weights(stressed.camera);
      const TextbookResult reference = textbook_splats<double>(stressed.scene, stressed.camera, weights);
      if (std::all_of(reference.color.begin(), reference.color.end(), [](double value) { return value == 0; }))
        continue;
      const auto add = [&](size_t series, const TextbookResult& found) {
        worst[series] = std::max(worst[series], error_of(found, reference));
      };
      add(0, our_splats(device, stressed, weights));
      for (size_t i = 1; i < worst.size(); ++i) {
        TextbookFaults usual_faults = i == 1 ? TextbookFaults{} : faults[i - 2].faults;
        usual_faults.sum_order = static_cast<unsigned>(draw + 1);
        add(i, textbook_splats<float>(stressed.scene, stressed.camera, weights, usual_faults));
      }
    }
    if (worst[0] < 0) continue;  // nothing to be seen
    for (size_t i = 0; i < worst.size(); ++i) axis.series[i].points.emplace_back(stress, worst[i]);
  }
  return axis;
}

Eigen::Matrix3d covariance(const Eigen::Matrix3d& turn, const Eigen::Vector3d& scales) {
  const Eigen::Matrix3d m = turn * scales.asDiagonal();
  return m * m.transpose();
}

/// A Gaussian half-way between two joints, of which one is twisted: how far its covariance is from that of a Gaussian
/// turned by half the angle, or, as 180 degrees may be halved either way round, by 180 degrees less.
StressAxis twist_axis(Device& device) {
  StressAxis axis{"twist between two joints", "degrees", 0, 180, {}};
  axis.series = {{"degas", true, {}}, {"blended matrices", false, {}}};
  const Eigen::Vector3d scales(0.02, 0.1, 0.05);
  const Eigen::Quaterniond own = Eigen::Quaterniond(0.8, 0.3, -0.2, 0.4).normalized();
  for (double degrees = 0; degrees <= 180; degrees += 7.5) {
    const double angle = degrees * pi / 180;
    const auto turned = [&](double by) -> Eigen::Matrix3d {
      return Eigen::AngleAxisd(by, Eigen::Vector3d::UnitX()).toRotationMatrix() * own.toRotationMatrix();
    };
    const auto error = [&](const Eigen::Matrix3d& found, double by) {
      const Eigen::Matrix3d reference = covariance(turned(by), scales);
      return (found - reference).cwiseAbs().maxCoeff() / reference.cwiseAbs().maxCoeff();
    };
    const auto add = [&](size_t series, const Eigen::Matrix3d& found) {
      double least = error(found, angle / 2);
      if (degrees == 180) least = std::min(least, error(found, angle / 2 - pi));
      axis.series[series].points.emplace_back(degrees, least);
    };
    Tape tape(device, false);
    const auto tensor = [&](const Shape& shape, const std::vector<double>& values) {
      return Tensor::from(device, shape, std::span<const double>(values));
    };
    const std::vector<int32_t> parents = {-1, 0}, joints = {0, 1};
    const JointTransforms transforms =
        kinematics(tape, tensor({2, 3}, {0, 0, 0, angle, 0, 0}), tensor({3}, {0, 0, 0}),
                   tensor({2, 3}, {0, 0, 0, 0.3, 0, 0}), Tensor::from(device, {2}, std::span<const int32_t>(parents)));
    const SkinningWeights weights{Tensor::from(device, {1, 2}, std::span<const int32_t>(joints)),
                                  tensor({1, 2}, {0.5, 0.5})};
    const std::vector<double> q =
        skin_rotations(tape, tensor({1, 4}, {own.w(), own.x(), own.y(), own.z()}), weights, transforms)
            .to_host<double>();
    add(0, covariance(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix(), scales));
    const Eigen::Matrix3d blend = 0.5 * (turned(0) + turned(angle));
    add(1, covariance(blend, scales));
  }
  return axis;
}

/// low, low + step, ..., high.
std::vector<double> steps(double low, double high, double step) {
  std::vector<double> values;
  for (int i = 0; low + i * step <= high + 1e-9; ++i) values.push_back(low + i * step);
  return values;
}

}  // namespace

std::vector<StressAxis> measure_stress(Device& device) {
  std::vector<StressAxis> axes;
  axes.push_back(splat_axis(device, {"size of a Gaussian", "log10 of metres, 2 m away", -7, 4, {}}, steps(-7, 4, 0.5),
                            {}, [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                for (int i = 7; i < 10; ++i)
                                  number(stressed, splat, i) += 2.6 + stress * std::log(10.0);
                              }
                            }));
  axes.push_back(splat_axis(device,
                            {"needle", "log10 of the ratio of the longest to the shortest axis", 0.25, 3, {}},
                            steps(0.25, 6, 0.25), {}, [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) = -5.3;
                                number(stressed, splat, 7) += stress * std::log(10.0);
                              }
                            }));
  TextbookFaults through_alpha, through_frustum;
  through_alpha.ignores_alpha_clamp = true;
  through_frustum.ignores_frustum_clamp = true;
  std::vector<double> opacities = steps(0.05, 0.95, 0.05);
  opacities.insert(opacities.end(), {0.97, 0.98, 0.985, 0.9875, 0.9925, 0.995, 0.9975, 1});
  axes.push_back(splat_axis(device, {"opacity", "of all Gaussians", 0.05, 1, {}}, opacities,
                            {{"alpha's clamp ignored", through_alpha}}, [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                number(stressed, splat, 10) = stress;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += 1.5;
                              }
                            }));
  axes.push_back(splat_axis(device, {"depth range", "log10 of the ratio of the farthest to the nearest", 0, 6, {}},
                            steps(0, 6, 0.25), {}, [](Stressed& stressed, double stress) {
                              const double near_depth = 0.06;
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                const double depth = near_depth * std::pow(10, stress * splat / (splats_of_scene - 1));
                                const double factor = depth / number(stressed, splat, 2);
                                for (int i = 0; i < 3; ++i) number(stressed, splat, i) *= factor;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += std::log(factor);
                              }
                            }));
  axes.push_back(splat_axis(device, {"distance from the world's origin", "log10 of metres", -1, 1.5, {}},
                            steps(-1, 5, 0.25), {}, [](Stressed& stressed, double stress) {
                              const Eigen::Vector3d way =
                                  std::pow(10, stress) * Eigen::Vector3d(0.6, 0.48, 0.64).normalized();
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                for (int i = 0; i < 3; ++i) number(stressed, splat, i) += way[i];
                              }
                              stressed.camera.translation = -way;
                            }));
  axes.push_back(splat_axis(device, {"place beside the image", "half widths from its middle", 0, 3, {}},
                            steps(0, 3, 0.125), {{"frustum's clamp ignored", through_frustum}},
                            [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                const double depth = number(stressed, splat, 2);
                                number(stressed, splat, 0) = stress * depth * stressed.camera.cx / stressed.camera.fx;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += 2;
                              }
                            }));
  axes.push_back(twist_axis(device));
  return axes;
}

std::vector<std::string> broken_promises(const std::vector<StressAxis>& axes) {
  constexpr double alike = 1.25;  // errors of one rounding more or less
  std::vector<std::string> broken;
  for (const StressAxis& axis : axes) {
    const StressSeries& ours = axis.series[0];
    const auto in_range = [&](double stress) { return stress >= axis.range_low && stress <= axis.range_high; };
    constexpr int fewest = 10;
    if (std::count_if(ours.points.begin(), ours.points.end(), [&](auto& p) { return in_range(p.first); }) < fewest)
      broken.push_back(
          fmt::format("{}: fewer than {} stresses in the working range have a picture", axis.name, fewest));
    for (size_t i = 0; i < ours.points.size(); ++i) {
      const auto [stress, error] = ours.points[i];
      if (error <= promised_error) continue;
      if (!std::isfinite(error))
        broken.push_back(fmt::format("{}: not finite at {:g} {}", axis.name, stress, axis.unit));
      if (in_range(stress)) {
        broken.push_back(
            fmt::format("{}: {:.1e} at {:g} {}, within the working range", axis.name, error, stress, axis.unit));
      }
      for (const StressSeries& other : axis.series) {
        if (!other.is_ours && alike * other.points[i].second < error) {
          broken.push_back(fmt::format("{}: {:.1e} at {:g} {}, where '{}' has {:.1e}", axis.name, error, stress,
                                       axis.unit, other.name, other.points[i].second));
        }
      }
    }
  }
  return broken;
}

}  // namespace degas::bench
