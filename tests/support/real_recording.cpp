#include "tests/support/real_recording.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <map>
#include <stdexcept>

#include "host/io/video.h"

namespace degas::test {

namespace fs = std::filesystem;
using nlohmann::json;

json caliscope_rigs(const fs::path& recording, int count) {
  // Of TOML there are only sections, and values that JSON has too.
  std::map<std::string, std::map<std::string, json>> sections;
  std::ifstream file(recording / "camera_array.toml");
  std::string section;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('[')) section = line.substr(1, line.find(']') - 1);
    const size_t equals = line.find('=');
    if (section.starts_with("cameras.") && equals != std::string::npos)
      sections[section][line.substr(0, line.find_last_not_of(' ', equals - 1) + 1)] =
          json::parse(line.substr(equals + 1));
  }
  json rigs = json::array();
  for (int camera = 0; camera < count; ++camera) {
    auto& values = sections.at(fmt::format("cameras.{}", camera));
    const json &k = values.at("matrix"), &r = values.at("rotation"), &t = values.at("translation");
    json rows = json::array();  // R diag(1,-1,-1) is world to camera, -R c the translation
    std::array<double, 3> center{};
    for (size_t i = 0; i < 3; ++i) {
      rows.push_back({r[i][0].get<double>(), -r[i][1].get<double>(), -r[i][2].get<double>()});
      for (size_t j = 0; j < 3; ++j) center[j] -= rows[i][j].get<double>() * t[i].get<double>();
    }
    rigs.push_back({{"cameras",
                     {{{"w", values.at("size")[0]},
                       {"h", values.at("size")[1]},
                       {"fx", k[0][0]},
                       {"fy", k[1][1]},
                       {"cx", k[0][2]},
                       {"cy", k[1][2]},
                       {"R", rows},
                       {"c", center},
                       {"distortion", values.at("distortions")}}}}});
  }
  return rigs;
}

void write_caliscope_capture(const fs::path& recording, const fs::path& folder, int cameras,
                             const std::vector<int>& frames) {
  fs::create_directories(folder / "videos");
  std::ofstream(folder / "cameras.json") << json{{"rigs", caliscope_rigs(recording, cameras)}}.dump();
  for (int camera = 0; camera < cameras; ++camera) {
    VideoReader reader(recording / fmt::format("cam_{}.mp4", camera));
    VideoWriter writer(folder / fmt::format("videos/cam{:02}.mp4", camera), reader.width(), reader.height(),
                       reader.frames_per_second(), VideoQuality::Lossless);
    Image8 picture;
    for (const int frame : frames) {
      reader.seek(frame);
      if (!reader.read(picture)) throw std::runtime_error(fmt::format("camera {} has no frame {}", camera, frame));
      writer.write(picture);
    }
    writer.finish();
  }
}

}  // namespace degas::test
