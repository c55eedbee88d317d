#include "model/train/evaluation_folder.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/input_limits.h"

namespace degas {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const std::optional<Rectangle>& box) {
  return box ? Json{box->left, box->top, box->width, box->height} : Json();
}

constexpr int largest_coordinate = 100000;

/// Throws Error without the file's name.
std::optional<Rectangle> box_of(const Json& json) {
  if (json.is_null()) return {};
  const auto numbers = json.get<std::array<double, 4>>();  // integers beyond those of int do not wrap around
  for (const double number : numbers) {
    if (!(std::abs(number) <= largest_coordinate)) throw Error::format("a box has {}", number);
  }
  if (numbers[2] < 1 || numbers[3] < 1) throw Error::format("a box has {}x{} pixels", numbers[2], numbers[3]);
  const auto at = [&](size_t i) { return static_cast<int>(numbers[i]); };
  return Rectangle{at(0), at(1), at(2), at(3)};
}

/// Throws Error without the file's name.
int frame_of(const Json& json) {
  constexpr int64_t most = 1 << 30;
  if (!json.is_number_integer() || json.get<double>() < 0 || json.get<double>() > most)
    throw Error::format("a frame is {}", json.dump());
  return json.get<int>();
}

}  // namespace

std::string EvaluatedPicture::name() const {
  return fmt::format("{}_{:06}", camera, frame);
}

void EvaluationFolder::write_text(const std::string& name, const std::string& text) const {
  degas::write_text(path_ / name, text);
}

void EvaluationFolder::write_pictures(const std::vector<EvaluatedPicture>& pictures) const {
  std::string text;  // a line a picture
  for (const EvaluatedPicture& picture : pictures) {
    const Json line = {{"camera", picture.camera},      {"frame", picture.frame},
                       {"refined", picture.refined},    {"person", json_of(picture.person)},
                       {"face", json_of(picture.face)}, {"mouth", json_of(picture.mouth)}};
    text += (text.empty() ? "[\n" : ",\n") + line.dump();
  }
  write_text("boxes.json", text + "\n]\n");
}

std::vector<EvaluatedPicture> EvaluationFolder::read_pictures() const {
  const std::filesystem::path path = path_ / "boxes.json";
  if (!std::filesystem::exists(path)) {
    throw Error::format("{}: no such file; name the folder of an earlier `degas eval`", path.string());
  }
  const std::vector<std::byte> bytes = read_file_bytes(path);
  std::vector<EvaluatedPicture> pictures;
  try {
    for (const Json& line : Json::parse(checked_json(bytes, "its boxes"))) {
      const std::optional<Rectangle> person = box_of(line.at("person"));
      if (!person) throw Error("'person' is null");
      pictures.push_back({line.at("camera"), frame_of(line.at("frame")), line.at("refined"), *person,
                          box_of(line.at("face")), box_of(line.at("mouth"))});
      if (pictures.back().camera.find('/') != std::string::npos) {
        throw Error::format("'{}' is no camera's name", pictures.back().camera);
      }
    }
  } catch (const std::exception& error) {
    throw Error::format("{}: not as `degas eval` writes it: {}", path.string(), error.what());
  }
  if (pictures.empty()) throw Error::format("{}: holds no picture", path.string());
  return pictures;
}

}  // namespace degas
