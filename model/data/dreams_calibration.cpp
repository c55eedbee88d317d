#include "model/data/dreams_calibration.h"

#include "host/error.h"
#include "host/io/json_node.h"

namespace degas {
namespace {

using json = nlohmann::ordered_json;

Lens read_dreams_lens(const JsonNode& node) {
  constexpr int largest_side = 1 << 16;
  Camera camera;
  camera.width = node["w"].integer(1, largest_side);
  camera.height = node["h"].integer(1, largest_side);
  camera.fx = node["fx"].number();
  camera.fy = node["fy"].number();
  camera.cx = node["cx"].number();
  camera.cy = node["cy"].number();
  if (camera.fx <= 0 || camera.fy <= 0) node.fail("fx and fy must be above 0");
  const Eigen::Matrix3d rotation = node["R"].rotation();
  const Eigen::Vector3d center(node["c"].numbers(3).data());
  camera.rotation = rotation * Eigen::Vector3d(1, -1, -1).asDiagonal();
  camera.translation = -rotation * center;
  Lens lens{camera, {}};
  if (node.has("distortion")) {
    const JsonNode distortion = node["distortion"];
    if (!is_distortion_size(distortion.size())) distortion.fail("must be k1 k2 p1 p2 [k3 [k4 k5 k6]]");
    lens.distortion = distortion.numbers(distortion.size());
  }
  return lens;
}

}  // namespace

std::vector<Lens> read_dreams_cameras(const std::filesystem::path& path) {
  const json file = read_json(path);
  const JsonNode rigs = JsonNode(file, path.string())["rigs"];
  std::vector<Lens> lenses;
  for (size_t i = 0; i < rigs.size(); ++i) {
    const JsonNode list = rigs[i]["cameras"];
    if (list.size() != 1) list.fail(fmt::format("has {} cameras; one a rig is read", list.size()));
    lenses.push_back(read_dreams_lens(list[size_t{0}]));
  }
  if (lenses.empty()) rigs.fail("is empty");
  return lenses;
}

DreamsDescription read_dreams_description(const std::filesystem::path& path) {
  const json file = read_json(path);
  const JsonNode root(file, path.string());
  DreamsDescription description;
  if (root.has("frame_convention")) {
    description.frame_offset = root["frame_convention"]["offset_d"].integer(-1'000'000, 1'000'000);
  }
  if (root.has("video")) {
    const JsonNode video = root["video"];
    if (video.has("rgb_width")) description.colour_width = video["rgb_width"].integer(1, 1 << 16);
    if (video.has("background")) {
      const std::string name = video["background"].text();
      if (name == "white")
        description.background = Background::White;
      else if (name == "black")
        description.background = Background::Black;
      else if (name == "scene")
        description.background = Background::Scene;
      else
        video["background"].fail(fmt::format("is '{}', expected white, black or scene", name));
    }
  }
  if (root.has("cameras_present")) {
    const JsonNode list = root["cameras_present"];
    description.cameras_present.emplace();
    for (size_t i = 0; i < list.size(); ++i) description.cameras_present->push_back(list[i].integer(0, 1 << 16));
  }
  return description;
}

}  // namespace degas
