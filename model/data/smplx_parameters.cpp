#include "model/data/smplx_parameters.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "host/error.h"
#include "host/io/npz.h"
#include "model/body/body_model.h"

namespace degas {
namespace {

/// A (rows, columns) array of finite numbers.
std::vector<double> finite_rows(const NpzFile& file, const char* key, const Shape& expected) {
  const NpyArray array = file.read(key, expected);
  std::vector<double> values = array.doubles();
  const size_t columns = static_cast<size_t>(array.shape.back());
  for (size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    throw Error::format("{}: '{}' holds {} in row {}; repair that row or take it out of every array",
                        file.path().string(), key, values[i], i / columns);
  }
  return values;
}

std::vector<int64_t> read_frame_numbers(const NpzFile& file, int64_t rows) {
  if (!file.contains("frames")) {
    std::vector<int64_t> numbers(static_cast<size_t>(rows));
    std::iota(numbers.begin(), numbers.end(), 0);
    return numbers;
  }
  std::vector<int64_t> numbers = file.read("frames", {rows}).integers();
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] < 0 || numbers[i] > 100'000'000 || (i > 0 && numbers[i] <= numbers[i - 1])) {
      throw Error::format("{}: 'frames' must rise from 0 or more, but row {} is {}", file.path().string(), i,
                          numbers[i]);
    }
  }
  return numbers;
}

bool read_flat_hand_mean(const NpzFile& file, std::optional<bool> convention) {
  if (file.contains("smplx_kwargs")) {
    const auto arguments = nlohmann::json::parse(file.read("smplx_kwargs").text(), nullptr, false);
    if (arguments.is_discarded()) throw Error::format("{}: 'smplx_kwargs' is no JSON", file.path().string());
    const auto found = arguments.is_object() ? arguments.find("flat_hand_mean") : arguments.end();
    if (found != arguments.end() && found->is_boolean()) return found->get<bool>();
  }
  if (file.contains("flat_hand_mean")) {
    const std::vector<int64_t> value = file.read("flat_hand_mean").integers();
    if (value.size() == 1) return value.front() != 0;
  }
  if (convention) return *convention;
  throw Error::format("{}: neither 'smplx_kwargs' nor 'flat_hand_mean' says whether hands are relative to a flat hand",
                      file.path().string());
}

}  // namespace

SmplxParameters read_smplx_parameters(const std::filesystem::path& path, const SmplxConventions& conventions) {
  const NpzFile file(path);
  const int64_t rows = file.read("global_orient", {-1, 3}).shape[0];
  if (rows == 0) throw Error::format("{}: 'global_orient' has no rows", path.string());

  SmplxParameters parameters;
  parameters.poses.resize(static_cast<size_t>(rows));
  for (Pose& pose : parameters.poses) pose.axis_angles.assign(smplx_joints, Eigen::Vector3d::Zero());
  for (const SmplxJointBlock& block : smplx_joint_blocks) {
    const bool of_eye = block.first_joint == LeftEyeJoint || block.first_joint == RightEyeJoint;
    if (of_eye && !conventions.has_eye_poses && !file.contains(block.key)) continue;
    const std::vector<double> angles = finite_rows(file, block.key, {rows, 3 * block.joints});
    const double* next = angles.data();
    for (Pose& pose : parameters.poses) {
      for (int joint = 0; joint < block.joints; ++joint, next += 3) {
        pose.axis_angles[static_cast<size_t>(block.first_joint + joint)] = {next[0], next[1], next[2]};
      }
    }
  }
  const std::vector<double> translations = finite_rows(file, "transl", {rows, 3});
  const std::vector<double> expressions = finite_rows(file, "expression", {rows, -1});
  const size_t width = expressions.size() / static_cast<size_t>(rows);
  for (size_t row = 0; row < parameters.poses.size(); ++row) {
    Pose& pose = parameters.poses[row];
    pose.translation = {translations[3 * row], translations[3 * row + 1], translations[3 * row + 2]};
    const auto begin = expressions.begin() + static_cast<ptrdiff_t>(row * width);
    pose.expression.assign(begin, begin + static_cast<ptrdiff_t>(width));
  }
  parameters.frame_numbers = read_frame_numbers(file, rows);
  const Shape betas_shape = file.read("betas").shape;
  parameters.betas = finite_rows(file, "betas", betas_shape.size() == 2 ? Shape{1, -1} : Shape{-1});
  parameters.flat_hand_mean = read_flat_hand_mean(file, conventions.flat_hand_mean);
  return parameters;
}

}  // namespace degas
