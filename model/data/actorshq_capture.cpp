#include "model/data/actorshq_capture.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/body/body_model.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

/// The fields of a line without the spaces around them.
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) {
    const size_t begin = field.find_first_not_of(" \t\r"), end = field.find_last_not_of(" \t\r");
    fields.push_back(begin == std::string::npos ? "" : field.substr(begin, end - begin + 1));
  }
  return fields.size() == 1 && fields[0].empty() ? std::vector<std::string>{} : fields;
}

/// A row of calibration.csv, by the names of its columns.
class CalibrationRow {
 public:
  CalibrationRow(std::string label, const std::vector<std::string>& columns, std::vector<std::string> fields)
      : label_(std::move(label)), columns_(columns), fields_(std::move(fields)) {
    if (fields_.size() != columns_.size()) {
      throw Error::format("{}: has {} fields, but the head has {} columns; the line is cut or damaged", label_,
                          fields_.size(), columns_.size());
    }
  }
  const std::string& text(const char* column) const {
    const auto found = std::find(columns_.begin(), columns_.end(), column);
    return fields_[static_cast<size_t>(found - columns_.begin())];
  }
  double number(const char* column) const {
    const std::string& field = text(column);
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(value)) {
      fail(column, "expected a number");
    }
    return value;
  }
  double number(const char* column, double low, double high, const char* remedy) const {
    const double value = number(column);
    if (!(value > low && value < high)) fail(column, remedy);
    return value;
  }
  int size(const char* column) const {
    const double value = number(column);
    if (value != std::floor(value) || value < 1 || value > 65536) fail(column, "expected pixels, 1 to 65536");
    return static_cast<int>(value);
  }

 private:
  [[noreturn]] void fail(const char* column, const std::string& reason) const {
    throw Error::format("{}: {} is '{}'; {}", label_, column, text(column), reason);
  }
  std::string label_;
  const std::vector<std::string>& columns_;
  std::vector<std::string> fields_;
};

constexpr const char* column_names[] = {"name", "w", "h", "rx", "ry", "rz", "tx", "ty", "tz", "fx", "fy", "px", "py"};

Camera read_camera(const CalibrationRow& row) {
  Camera camera;
  camera.width = row.size("w");
  camera.height = row.size("h");
  const char* remedy = "intrinsics are parts of the picture's size, a focal length above 0: divide pixels by w and h";
  camera.fx = camera.width * row.number("fx", 0, 50, remedy);
  camera.fy = camera.height * row.number("fy", 0, 50, remedy);
  camera.cx = camera.width * row.number("px", -50, 50, remedy);
  camera.cy = camera.height * row.number("py", -50, 50, remedy);
  const char *angle_remedy = "an axis-angle is in radians", *center_remedy = "a camera's centre is in metres";
  const auto angle = [&](const char* column) { return row.number(column, -1000, 1000, angle_remedy); };
  const auto place = [&](const char* column) { return row.number(column, -1e6, 1e6, center_remedy); };
  const Eigen::Vector3d axis_angle(angle("rx"), angle("ry"), angle("rz"));
  const Eigen::Vector3d center(place("tx"), place("ty"), place("tz"));
  camera.rotation = rotation_from_axis_angle(axis_angle).transpose();
  camera.translation = -camera.rotation * center;
  return camera;
}

/// Cameras of calibration.csv by name, in its order.
std::vector<std::pair<std::string, Camera>> read_calibration(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  std::istringstream stream(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> columns = fields_of(line);
  for (const char* name : column_names) {
    if (std::find(columns.begin(), columns.end(), name) != columns.end()) continue;
    throw Error::format("{}: has no column '{}' in its first line; the columns are {}", path.string(), name,
                        fmt::join(column_names, ","));
  }
  std::vector<std::pair<std::string, Camera>> cameras;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (fields_of(line).empty()) continue;
    const CalibrationRow row(fmt::format("{}: line {}", path.string(), number), columns, fields_of(line));
    const std::string& name = row.text("name");
    const bool is_known = std::any_of(cameras.begin(), cameras.end(), [&](auto& known) { return known.first == name; });
    if (!is_folder_name(name) || is_known) {
      throw Error::format("{}: line {}: name is '{}'; expected the name of a folder of rgbs/, each once", path.string(),
                          number, name);
    }
    cameras.emplace_back(name, read_camera(row));
  }
  if (cameras.empty()) throw Error::format("{}: names no camera", path.string());
  return cameras;
}

}  // namespace

std::vector<fs::path> find_actorshq(const fs::path& folder) {
  std::vector<fs::path> found, level = {folder};
  for (int depth = 0; depth < 4 && found.empty(); ++depth) {
    std::vector<fs::path> next;
    for (const fs::path& path : level) {
      std::error_code unreadable;  // such a folder, lost+found say, is passed over
      if (fs::is_regular_file(path / "calibration.csv", unreadable) && fs::is_directory(path / "rgbs", unreadable)) {
        found.push_back(path);
      }
      for (fs::directory_iterator entry(path, unreadable), end; entry != end; entry.increment(unreadable)) {
        std::error_code broken;
        if (entry->is_directory(broken)) next.push_back(entry->path());
      }
    }
    level = std::move(next);
  }
  std::sort(found.begin(), found.end());
  return found;
}

PictureLayout find_actorshq_layout(const fs::path& folder) {
  const std::vector<fs::path> found = find_actorshq(folder);
  if (found.empty()) {
    throw Error::format("{}: no calibration.csv with rgbs/ beside it, here or below", folder.string());
  }
  if (found.size() > 1) {
    std::vector<std::string> names;
    for (const fs::path& path : found) names.push_back(path.string());
    throw Error::format("{}: holds several captures; name one of {}", folder.string(), fmt::join(names, ", "));
  }
  PictureLayout layout;
  layout.folder = found.front();
  layout.format = "actorshq 1";
  layout.files = {layout.folder / "calibration.csv"};
  const fs::path above = (fs::absolute(layout.folder) / "../smpl_params.npz").lexically_normal();
  layout.parameters = layout.folder / "smpl_params.npz";
  if (!fs::exists(layout.parameters) && fs::exists(above)) layout.parameters = above;
  layout.conventions = {false, true};
  for (const auto& [camera_name, camera] : read_calibration(layout.files.front())) {
    layout.views.push_back({camera_name,
                            {camera, {}},
                            NumberedFiles(layout.folder / "rgbs" / camera_name, camera_name + "_rgb", 6),
                            NumberedFiles(layout.folder / "masks" / camera_name, camera_name + "_mask", 6)});
  }
  return layout;
}

}  // namespace degas
