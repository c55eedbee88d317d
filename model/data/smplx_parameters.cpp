#include "model/data/smplx_parameters.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "host/error.h"
#include "host/io/input_limits.h"
#include "host/io/npz.h"
#include "model/body/body_model.h"

namespace degas {
namespace {

constexpr int64_t most_rows = 1'000'000;  ///< nine hours of video

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

/// What the file says the smplx package was called with; an empty object where it does not.
nlohmann::json read_arguments(const NpzFile& file) {
  if (!file.contains("smplx_kwargs")) return nlohmann::json::object();
  const std::string text = file.read("smplx_kwargs").text();
  check_json(text, file.path().string());
  nlohmann::json arguments = nlohmann::json::parse(text, nullptr, false);
  if (arguments.is_discarded()) throw Error::format("{}: 'smplx_kwargs' is no JSON", file.path().string());
  return arguments.is_object() ? arguments : nlohmann::json::object();
}

/// Coefficients of principal components that each hand has in a row; 0 where rows hold the angles of its joints. As
/// many columns as there are angles are coefficients only if the arguments say so.
int64_t count_hand_coefficients(const NpzFile& file, const nlohmann::json& arguments) {
  constexpr int64_t angles = 3 * joints_per_hand;
  const int64_t columns = file.read("left_hand_pose", {-1, -1}).shape[1];
  const nlohmann::json use_pca = arguments.value("use_pca", nlohmann::json());
  if (columns < angles && use_pca == false) {
    throw Error::format(
        "{}: 'left_hand_pose' has {} columns, but 'smplx_kwargs' has use_pca false; angles have {} columns, fewer are "
        "PCA coefficients",
        file.path().string(), columns, angles);
  }
  const bool has_all = use_pca == true && arguments.value("num_pca_comps", nlohmann::json()) == angles;
  return columns < angles || (columns == angles && has_all) ? columns : 0;
}

void read_hand_coefficients(const NpzFile& file, int64_t count, std::vector<Pose>& poses) {
  const std::array<const char*, 2> keys = {"left_hand_pose", "right_hand_pose"};
  for (size_t hand = 0; hand < keys.size(); ++hand) {
    const std::vector<double> values = finite_rows(file, keys[hand], {static_cast<int64_t>(poses.size()), count});
    const double* next = values.data();
    for (Pose& pose : poses) {
      pose.hand_coefficients[hand].assign(next, next + count);
      next += count;
    }
  }
}

/// A person's shape: (B), (1,B), or (rows,B) as trackers write it beside the poses. Of rows that differ, their mean.
std::vector<double> read_betas(const NpzFile& file, int64_t rows, const std::function<void(const std::string&)>& warn) {
  const Shape shape = file.read("betas").shape;
  if (shape.size() != 2) return finite_rows(file, "betas", {-1});
  if (shape[0] != 1 && shape[0] != rows) {
    throw Error::format(
        "{}: 'betas' has shape {}, expected (B), (1, B) or ({}, B): the person's shape, once or for each frame",
        file.path().string(), to_string(shape), rows);
  }
  const std::vector<double> all = finite_rows(file, "betas", {shape[0], -1});
  const auto width = static_cast<size_t>(shape[1]);
  std::vector<double> first(all.begin(), all.begin() + shape[1]);
  bool differ = false;
  for (size_t i = width; i < all.size(); ++i) differ = differ || all[i] != all[i - width];
  if (!differ) return first;
  warn(fmt::format("{}: 'betas' differ from frame to frame; their mean is the person's shape", file.path().string()));
  std::vector<double> mean(width, 0);
  for (size_t i = 0; i < all.size(); ++i) mean[i % width] += all[i] / static_cast<double>(rows);
  return mean;
}

bool read_flat_hand_mean(const NpzFile& file, const nlohmann::json& arguments, std::optional<bool> convention) {
  const auto found = arguments.find("flat_hand_mean");
  if (found != arguments.end() && found->is_boolean()) return found->get<bool>();
  if (file.contains("flat_hand_mean")) {
    const std::vector<int64_t> value = file.read("flat_hand_mean").integers();
    if (value.size() == 1) return value.front() != 0;
  }
  if (convention) return *convention;
  throw Error::format("{}: neither 'smplx_kwargs' nor 'flat_hand_mean' says whether hands are relative to a flat hand",
                      file.path().string());
}

}  // namespace

SmplxParameters read_smplx_parameters(const std::filesystem::path& path, const SmplxConventions& conventions,
                                      const std::function<void(const std::string&)>& warn) {
  const NpzFile file(path);
  const int64_t rows = file.read("global_orient", {-1, 3}).shape[0];
  if (rows == 0) throw Error::format("{}: 'global_orient' has no rows", path.string());
  if (rows > most_rows) {
    throw Error::format("{}: 'global_orient' has {} rows; at most {} frames are read", path.string(), rows, most_rows);
  }

  const nlohmann::json arguments = read_arguments(file);
  const int64_t coefficients = count_hand_coefficients(file, arguments);
  SmplxParameters parameters;
  parameters.poses.resize(static_cast<size_t>(rows));
  for (Pose& pose : parameters.poses) pose.axis_angles.assign(smplx_joints, Eigen::Vector3d::Zero());
  for (const SmplxJointBlock& block : smplx_joint_blocks) {
    const bool of_eye = block.first_joint == LeftEyeJoint || block.first_joint == RightEyeJoint;
    if (of_eye && !conventions.has_eye_poses && !file.contains(block.key)) continue;
    if (block.first_joint >= LeftHandJoint && coefficients > 0) continue;
    const std::vector<double> angles = finite_rows(file, block.key, {rows, 3 * block.joints});
    const double* next = angles.data();
    for (Pose& pose : parameters.poses) {
      for (int joint = 0; joint < block.joints; ++joint, next += 3) {
        pose.axis_angles[static_cast<size_t>(block.first_joint + joint)] = {next[0], next[1], next[2]};
      }
    }
  }
  if (coefficients > 0) read_hand_coefficients(file, coefficients, parameters.poses);
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
  parameters.betas = read_betas(file, rows, warn);
  parameters.flat_hand_mean = read_flat_hand_mean(file, arguments, conventions.flat_hand_mean);
  return parameters;
}

std::map<std::string, NpyArray> smplx_arrays(const SmplxParameters& parameters) {
  const std::vector<Pose>& poses = parameters.poses;
  const auto rows = static_cast<int64_t>(poses.size());
  for (const Pose& pose : poses) {
    const bool has_angles = pose.axis_angles.size() == smplx_joints && pose.hand_coefficients[0].empty();
    if (!has_angles || pose.expression.size() != poses[0].expression.size())
      throw std::logic_error("[body parameters] poses need 55 joints, hands by angles, expressions of one length");
  }
  std::map<std::string, NpyArray> arrays;
  for (const SmplxJointBlock& block : smplx_joint_blocks) {
    std::vector<float> values;
    for (const Pose& pose : poses) {
      for (int joint = 0; joint < block.joints; ++joint) {
        const Eigen::Vector3f angles =
            pose.axis_angles.at(static_cast<size_t>(block.first_joint + joint)).cast<float>();
        values.insert(values.end(), angles.data(), angles.data() + 3);
      }
    }
    arrays[block.key] = NpyArray::from({rows, 3 * block.joints}, values);
  }
  std::vector<float> translations, expressions;
  for (const Pose& pose : poses) {
    const Eigen::Vector3f translation = pose.translation.cast<float>();
    translations.insert(translations.end(), translation.data(), translation.data() + 3);
    expressions.insert(expressions.end(), pose.expression.begin(), pose.expression.end());
  }
  const int64_t coefficients = static_cast<int64_t>(expressions.size()) / std::max<int64_t>(rows, 1);
  const std::vector<float> shape(parameters.betas.begin(), parameters.betas.end());
  arrays["transl"] = NpyArray::from({rows, 3}, translations);
  arrays["expression"] = NpyArray::from({rows, coefficients}, expressions);
  arrays["betas"] = NpyArray::from({static_cast<int64_t>(shape.size())}, shape);
  arrays["frames"] = NpyArray::from({rows}, parameters.frame_numbers);
  const nlohmann::json arguments = {{"flat_hand_mean", parameters.flat_hand_mean},
                                    {"use_pca", false},
                                    {"num_betas", shape.size()},
                                    {"num_expression_coeffs", coefficients}};
  arrays["smplx_kwargs"] = NpyArray::from_text(arguments.dump());
  return arrays;
}

}  // namespace degas
