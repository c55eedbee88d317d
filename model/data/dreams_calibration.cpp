#include "model/data/dreams_calibration.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/file_bytes.h"

namespace degas {
namespace {

using nlohmann::json;

json read_json(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  try {
    return json::parse(text, text + bytes.size());
  } catch (const json::exception& failure) {
    throw Error::format("{}: is no JSON: {}", path.string(), failure.what());
  }
}

/// A value of a JSON file, with the way to it for errors.
class Node {
 public:
  Node(const json& value, std::string label) : value_(value), label_(std::move(label)) {}

  [[noreturn]] void fail(const std::string& reason) const { throw Error::format("{}: {}", label_, reason); }
  bool has(const char* key) const { return value_.is_object() && value_.contains(key); }
  Node operator[](const char* key) const {
    if (!has(key)) fail(fmt::format("has no key '{}'", key));
    return {value_.at(key), fmt::format("{}: {}", label_, key)};
  }
  Node operator[](size_t index) const { return {value_.at(index), fmt::format("{}[{}]", label_, index)}; }
  size_t size() const {
    if (!value_.is_array()) fail("is no list");
    return value_.size();
  }
  double number() const {
    if (!value_.is_number() || !std::isfinite(value_.get<double>())) fail("is no number");
    return value_.get<double>();
  }
  int integer(int low, int high) const {
    const double value = number();
    if (value != std::floor(value) || value < low || value > high) {
      fail(fmt::format("is {}, expected a whole number from {} to {}", value, low, high));
    }
    return static_cast<int>(value);
  }
  std::string text() const {
    if (!value_.is_string()) fail("is no text");
    return value_.get<std::string>();
  }

 private:
  const json& value_;
  std::string label_;
};

Camera read_camera(const Node& node) {
  constexpr int largest_side = 1 << 16;
  Camera camera;
  camera.width = node["w"].integer(1, largest_side);
  camera.height = node["h"].integer(1, largest_side);
  camera.fx = node["fx"].number();
  camera.fy = node["fy"].number();
  camera.cx = node["cx"].number();
  camera.cy = node["cy"].number();
  if (camera.fx <= 0 || camera.fy <= 0) node.fail("fx and fy must be above 0");
  Eigen::Matrix3d rotation;
  Eigen::Vector3d center;
  if (node["R"].size() != 3 || node["c"].size() != 3) node.fail("R must be 3x3 and c must have 3 numbers");
  for (size_t row = 0; row < 3; ++row) {
    if (node["R"][row].size() != 3) node.fail("R must be 3x3");
    for (size_t column = 0; column < 3; ++column) {
      rotation(static_cast<int>(row), static_cast<int>(column)) = node["R"][row][column].number();
    }
    center(static_cast<int>(row)) = node["c"][row].number();
  }
  const double error = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(error < 1e-3)) node.fail(fmt::format("R is no rotation: |R R^T - 1| = {:.3g}", error));
  camera.rotation = rotation * Eigen::Vector3d(1, -1, -1).asDiagonal();
  camera.translation = -rotation * center;
  return camera;
}

}  // namespace

std::vector<Camera> read_dreams_cameras(const std::filesystem::path& path) {
  const json file = read_json(path);
  const Node rigs = Node(file, path.string())["rigs"];
  std::vector<Camera> cameras;
  for (size_t i = 0; i < rigs.size(); ++i) {
    const Node list = rigs[i]["cameras"];
    if (list.size() != 1) list.fail(fmt::format("has {} cameras; one a rig is read", list.size()));
    cameras.push_back(read_camera(list[size_t{0}]));
  }
  if (cameras.empty()) rigs.fail("is empty");
  return cameras;
}

DreamsDescription read_dreams_description(const std::filesystem::path& path) {
  const json file = read_json(path);
  const Node root(file, path.string());
  DreamsDescription description;
  if (root.has("frame_convention")) {
    description.frame_offset = root["frame_convention"]["offset_d"].integer(-1'000'000, 1'000'000);
  }
  if (root.has("video")) {
    const Node video = root["video"];
    if (video.has("rgb_width")) description.colour_width = video["rgb_width"].integer(1, 1 << 16);
    if (video.has("background")) {
      const std::string name = video["background"].text();
      if (name == "white")
        description.background = DreamsBackground::White;
      else if (name == "black")
        description.background = DreamsBackground::Black;
      else if (name == "scene")
        description.background = DreamsBackground::Scene;
      else
        video["background"].fail(fmt::format("is '{}', expected white, black or scene", name));
    }
  }
  if (root.has("cameras_present")) {
    const Node list = root["cameras_present"];
    description.cameras_present.emplace();
    for (size_t i = 0; i < list.size(); ++i) description.cameras_present->push_back(list[i].integer(0, 1 << 16));
  }
  return description;
}

}  // namespace degas
