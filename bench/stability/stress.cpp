#include "bench/stability/stress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>

#include "bench/stability/textbook_splats.h"
#include "bench/stability/twist.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "host/ops/splat.h"

namespace degas::bench {
namespace {

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

constexpr int draws = 32;

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
    weight = static_cast<float>(static_cast<int32_t>(state)) * 0x1p-31;
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

/// put_under: changes a usual scene.
StressAxis splat_axis(const std::vector<StressedDevice>& devices, StressAxis axis, const std::vector<double>& stresses,
                      const std::vector<Fault>& faults,
                      const std::function<void(Stressed& usual, double stress)>& put_under) {
  for (const StressedDevice& ours : devices) axis.series.push_back({ours.name, true, {}});
  axis.series.push_back({"textbook in float32", false, {}});
  for (const Fault& fault : faults) axis.series.push_back({fault.name, false, {}});
  for (const double stress : stresses) {
    std::vector<std::vector<double>> errors(axis.series.size());
    for (int draw = 0; draw < draws; ++draw) {
      Stressed stressed = usual(draw);
      put_under(stressed, stress);
      // What is stored in single precision is: the reference has the same numbers.
      for (double& number : stressed.scene) number = static_cast<float>(number);
      const std::vector<double> weights = loss_weights(stressed.camera);
      const TextbookResult reference = textbook_splats<double>(stressed.scene, stressed.camera, weights);
      if (std::all_of(reference.color.begin(), reference.color.end(), [](double value) { return value == 0; }))
        continue;
      auto series = errors.begin();
      const auto add = [&](const TextbookResult& found) { (series++)->push_back(error_of(found, reference)); };
      for (const StressedDevice& ours : devices) add(our_splats(ours.device, stressed, weights));
      const auto add_textbook = [&](TextbookFaults usual_faults) {
        usual_faults.sum_order = static_cast<unsigned>(draw + 1);
        add(textbook_splats<float>(stressed.scene, stressed.camera, weights, usual_faults));
      };
      add_textbook({});
      for (const Fault& fault : faults) add_textbook(fault.faults);
    }
    for (size_t i = 0; i < errors.size(); ++i) {
      if (errors[i].empty()) continue;  // nothing to be seen
      std::sort(errors[i].begin(), errors[i].end());
      axis.series[i].points.push_back({stress, errors[i][errors[i].size() / 2], errors[i].back()});
    }
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

std::vector<StressAxis> measure_stress(const std::vector<StressedDevice>& devices) {
  std::vector<StressAxis> axes;
  axes.push_back(splat_axis(devices, {"size of a Gaussian", "log10 of metres, 2 m away", -7, 4, {}}, steps(-7, 4, 0.5),
                            {}, [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                for (int i = 7; i < 10; ++i)
                                  number(stressed, splat, i) += 2.6 + stress * std::log(10.0);
                              }
                            }));
  axes.push_back(splat_axis(devices,
                            {"needle", "log10 of the ratio of the longest to the shortest axis", 0.25, 2.5, {}},
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
  axes.push_back(splat_axis(devices, {"opacity", "of all Gaussians", 0.05, 1, {}}, opacities,
                            {{"alpha's clamp ignored", through_alpha}}, [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                number(stressed, splat, 10) = stress;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += 1.5;
                              }
                            }));
  axes.push_back(splat_axis(devices, {"depth range", "log10 of the ratio of the farthest to the nearest", 0, 6, {}},
                            steps(0, 6, 0.25), {}, [](Stressed& stressed, double stress) {
                              const double near_depth = 0.06;
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                const double depth = near_depth * std::pow(10, stress * splat / (splats_of_scene - 1));
                                const double factor = depth / number(stressed, splat, 2);
                                for (int i = 0; i < 3; ++i) number(stressed, splat, i) *= factor;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += std::log(factor);
                              }
                            }));
  axes.push_back(splat_axis(devices, {"distance from the world's origin", "log10 of metres", -1, 5, {}},
                            steps(-1, 5, 0.25), {}, [](Stressed& stressed, double stress) {
                              const Eigen::Vector3d way =
                                  std::pow(10, stress) * Eigen::Vector3d(0.61, 0.47, 0.64).normalized();
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                for (int i = 0; i < 3; ++i) number(stressed, splat, i) += way[i];
                              }
                              stressed.camera.translation = -way;
                            }));
  axes.push_back(splat_axis(devices, {"place beside the image", "half widths from its middle", 0, 3, {}},
                            steps(0, 3, 0.125), {{"frustum's clamp ignored", through_frustum}},
                            [](Stressed& stressed, double stress) {
                              for (int splat = 0; splat < splats_of_scene; ++splat) {
                                const double depth = number(stressed, splat, 2);
                                number(stressed, splat, 0) = stress * depth * stressed.camera.cx / stressed.camera.fx;
                                for (int i = 7; i < 10; ++i) number(stressed, splat, i) += 2;
                              }
                            }));
  axes.push_back(twist_axis(devices));
  return axes;
}

std::vector<std::string> broken_promises(const std::vector<StressAxis>& axes) {
  constexpr double alike = 1.25, rounding = 2e-6;
  std::vector<std::string> broken;
  const auto tell = [&](const StressAxis& axis, const StressSeries& ours, const StressPoint& at,
                        const std::string& what) {
    broken.push_back(fmt::format("{}, {}: at {:g} {} {}", axis.name, ours.name, at.stress, axis.unit, what));
  };
  for (const StressAxis& axis : axes) {
    for (const StressSeries& ours : axis.series) {
      if (!ours.is_ours) continue;
      const auto in_range = [&](const StressPoint& p) {
        return p.stress >= axis.range_low && p.stress <= axis.range_high;
      };
      constexpr int fewest = 10;
      if (std::count_if(ours.points.begin(), ours.points.end(), in_range) < fewest)
        broken.push_back(fmt::format("{}, {}: fewer than {} stresses in the working range have a picture", axis.name,
                                     ours.name, fewest));
      for (size_t i = 0; i < ours.points.size(); ++i) {
        const StressPoint& at = ours.points[i];
        if (!std::isfinite(at.worst)) tell(axis, ours, at, "a result is not finite");
        if (in_range(at) && at.worst > promised_error)
          tell(axis, ours, at, fmt::format("the error is {:.1e}, within the working range", at.worst));
        for (const StressSeries& other : axis.series) {
          if (other.is_ours || at.error <= std::max(rounding, alike * other.points[i].error)) continue;
          tell(axis, ours, at,
               fmt::format("the error is {:.1e}, where '{}' has {:.1e}", at.error, other.name, other.points[i].error));
        }
      }
    }
  }
  return broken;
}

}  // namespace degas::bench
