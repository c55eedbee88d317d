#include "model/data/avatarrex_capture.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/json_node.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

Lens read_avatarrex_lens(const JsonNode& node) {
  Lens lens;
  Camera& camera = lens.camera;
  const JsonNode size = node["imgSize"], intrinsics = node["K"];
  if (size.size() != 2) size.fail("must be width and height");
  camera.width = size[0].integer(1, 1 << 16);
  camera.height = size[1].integer(1, 1 << 16);
  const std::vector<double> k = intrinsics.numbers(9);
  if (!(k[0] > 0 && k[4] > 0)) intrinsics.fail("must have focal lengths above 0 on its diagonal");
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    intrinsics.fail("must be fx 0 cx, 0 fy cy, 0 0 1, row after row");
  }
  camera.fx = k[0];
  camera.fy = k[4];
  camera.cx = k[2] + 0.5;  // our pixel centres lie at +0.5
  camera.cy = k[5] + 0.5;
  camera.rotation = node["R"].rotation();
  camera.translation = Eigen::Vector3d(node["T"].numbers(3).data());
  if (node.has("distCoeff")) {
    const JsonNode distortion = node["distCoeff"];
    // Nested as OpenCV's FileStorage writes it, [[k1, k2, ..]], or flat.
    const bool is_nested = distortion.size() == 1;
    const size_t count = is_nested ? distortion[0].size() : distortion.size();
    if (!is_distortion_size(count)) {
      distortion.fail(fmt::format("has {} numbers, expected OpenCV's 4, 5, 8, 12 or 14", count));
    }
    lens.distortion = distortion.numbers(count);
  }
  return lens;
}

/// Adds the views that a list of paths (with / or \) names: pictures lie in the camera's folder, masks deeper. Those of
/// cameras that the calibration lacks are not read anyway.
void read_missing(const fs::path& path, PictureLayout& layout) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  std::istringstream stream(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    std::replace(line.begin(), line.end(), '\\', '/');
    line.erase(line.find_last_not_of(" \r\t") + 1);
    if (line.empty()) continue;
    const std::string stem = fs::path(line).stem();
    int64_t frame = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), frame);
    if (error != std::errc() || end != stem.data() + stem.size()) {
      throw Error::format("{}: line {} is '{}', expected a path through CAMERA/ to FRAME.jpg", path.string(), number,
                          line);
    }
    const fs::path folders = fs::path(line).parent_path();
    for (size_t i = 0; i < layout.views.size(); ++i) {
      const bool is_named = std::find(folders.begin(), folders.end(), layout.views[i].name) != folders.end();
      if (is_named) layout.excluded.insert({static_cast<int>(i), frame});
    }
  }
}

fs::path calibration_of(const fs::path& folder) {
  const fs::path full = folder / "calibration_full.json";
  return fs::exists(full) ? full : folder / "calibration.json";
}

}  // namespace

bool is_avatarrex(const fs::path& folder) {
  return fs::is_regular_file(calibration_of(folder));
}

PictureLayout find_avatarrex_layout(const fs::path& folder) {
  PictureLayout layout;
  layout.folder = folder;
  layout.format = "avatarrex 1";
  layout.files = {calibration_of(folder)};
  layout.parameters = folder / "smpl_params.npz";
  layout.conventions = {false, true};
  layout.hard_masks = true;
  const nlohmann::ordered_json file = read_json(layout.files.front());
  const JsonNode root(file, layout.files.front().string());
  for (const std::string& name : root.keys()) {
    if (!is_folder_name(name)) {
      root.fail(fmt::format("'{}' is no name of a camera's folder", name));
    }
    const Lens lens = read_avatarrex_lens(root[name]);
    if (fs::is_directory(folder / "images")) {
      layout.views.push_back(
          {name, lens, NumberedFiles(folder / "images" / name, "", 8), NumberedFiles(folder / "masks" / name, "", 8)});
    } else {
      layout.views.push_back(
          {name, lens, NumberedFiles(folder / name, "", 8), NumberedFiles(folder / name / "mask/pha", "", 8)});
    }
  }
  if (layout.views.empty()) root.fail("names no camera");
  for (const char* name : {"missing_img_files.txt", "missing_msk_files.txt"}) {
    if (!fs::exists(folder / name)) continue;
    layout.files.push_back(folder / name);
    read_missing(folder / name, layout);
  }
  return layout;
}

}  // namespace degas
