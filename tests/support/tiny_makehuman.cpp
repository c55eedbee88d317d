#include "tests/support/tiny_makehuman.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace degas::test {

using Eigen::Vector3d;
using nlohmann::json;

namespace {

/// Bones from the root on, each with its parent; spine01, shoulder01, lowerarm02, metacarpal1, toe2-2 and special01
/// belong to no joint of SMPL-X.
std::map<std::string, std::string> make_parents() {
  std::map<std::string, std::string> parents = {{"root", ""},           {"spine05", "root"},    {"spine04", "spine05"},
                                                {"spine03", "spine04"}, {"spine02", "spine03"}, {"spine01", "spine02"},
                                                {"neck01", "spine01"},  {"head", "neck01"},     {"jaw", "head"},
                                                {"special01", "head"}};
  for (const std::string side : {".L", ".R"}) {
    const std::vector<std::pair<std::string, std::string>> limbs = {{"upperleg01", "root"},
                                                                    {"lowerleg01", "upperleg01"},
                                                                    {"foot", "lowerleg01"},
                                                                    {"toe1-1", "foot"},
                                                                    {"toe2-1", "foot"},
                                                                    {"toe2-2", "toe2-1"},
                                                                    {"toe3-1", "foot"},
                                                                    {"toe4-1", "foot"},
                                                                    {"toe5-1", "foot"},
                                                                    {"clavicle", "spine01"},
                                                                    {"shoulder01", "clavicle"},
                                                                    {"upperarm01", "shoulder01"},
                                                                    {"lowerarm01", "upperarm01"},
                                                                    {"lowerarm02", "lowerarm01"},
                                                                    {"wrist", "lowerarm02"},
                                                                    {"metacarpal1", "wrist"},
                                                                    {"eye", "head"}};
    for (const auto& [bone, parent] : limbs) {
      const bool is_central = parent == "root" || parent == "spine01" || parent == "head";
      parents[bone + side] = is_central ? parent : parent + side;
    }
    for (int finger = 1; finger <= 5; ++finger) {
      for (int k = 1; k <= 3; ++k) {
        const std::string parent = k > 1         ? fmt::format("finger{}-{}", finger, k - 1)
                                   : finger == 2 ? "metacarpal1"
                                                 : "wrist";
        parents[fmt::format("finger{}-{}{}", finger, k, side)] = parent + side;
      }
    }
  }
  return parents;
}

}  // namespace

TinyMakeHuman::TinyMakeHuman(const std::filesystem::path& folder)
    : base(folder / "base.obj"),
      rig(folder / "rig.mhskel"),
      weights(folder / "weights.mhw"),
      shape(folder / "shape.target"),
      targets(folder / "targets"),
      parents(make_parents()),
      shape_offset(0.5, -2, 1) {
  std::filesystem::create_directories(targets);
  std::string obj = "# made up\n";
  json skeleton = {{"bones", json::object()}, {"joints", json::object()}}, shares = {{"weights", json::object()}};
  int vertices = 0, texture = 0;
  for (const auto& [bone, parent] : parents) {
    const double turn = 0.7 * static_cast<double>(bones.size());
    const Vector3d middle(4 * std::cos(turn), 0.2 * static_cast<double>(bones.size()) - 3, 4 * std::sin(turn));
    // Four corners of a helper, whose mean is the joint, and a tube of two rings about the same place.
    obj += fmt::format("g joint-{}\n", bone);
    for (const Vector3d& corner : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 0, 1), Vector3d(0, 0, -1)}) {
      obj += fmt::format("v {} {} {}\n", middle.x() + corner.x(), middle.y(), middle.z() + corner.z());
    }
    obj += "f -4 -3 -2 -1\n";
    skeleton["joints"][bone + "____head"] = {vertices, vertices + 1, vertices + 2, vertices + 3};
    skeleton["bones"][bone] = {{"head", bone + "____head"}, {"parent", parent.empty() ? json() : json(parent)}};
    vertices += 4;

    first_vertex[bone] = vertices;
    middles[bone] = middle;
    bones.push_back(bone);
    obj += bone == "eye.L" ? "g helper-l-eye\n" : "g body\n";
    for (int k = 0; k < 8; ++k) {
      const double angle = k % 4 * 1.5707963267948966;
      obj += fmt::format("v {} {} {}\n", middle.x() + 0.5 * std::cos(angle), middle.y() + (k < 4 ? -0.8 : 0.8),
                         middle.z() - 0.5 * std::sin(angle));
      shares["weights"][bone].push_back({vertices + k, parent.empty() ? 2.0 : 0.6});
      if (!parent.empty()) shares["weights"][parent].push_back({vertices + k, 0.3});
    }
    for (int k = 0; k < 10; ++k) obj += fmt::format("vt {} {}\n", 0.1 + 0.15 * (k % 5), k < 5 ? 0.2 : 0.5);
    for (int k = 0; k < 4; ++k) {
      const int v = vertices + 1, t = texture + 1, next = (k + 1) % 4;
      obj += fmt::format("f {}/{} {}/{} {}/{} {}/{}\n", v + k, t + k, v + next, t + k + 1, v + next + 4, t + k + 6,
                         v + k + 4, t + k + 5);
    }
    vertices += 8, texture += 10;
  }
  std::ofstream(base) << obj;
  std::ofstream(rig) << skeleton.dump(1);
  std::ofstream(weights) << shares.dump(1);
  std::ofstream shaped(shape);
  shaped << "# every vertex\n";
  for (int v = 0; v < vertices; ++v) {
    shaped << fmt::format("{} {} {} {}\n", v, shape_offset.x(), shape_offset.y(), shape_offset.z());
  }
  const int jaw = first_vertex.at("jaw");
  std::ofstream(targets / "jawOpen.target")
      << fmt::format("# a helper too\n{} 9 9 9\n\n{} 0 -.5 .25\n", jaw - 1, jaw + 2);
  std::ofstream(targets / "blink.target") << fmt::format("{} 1 0 0\n", first_vertex.at("eye.R"));
  std::ofstream(targets / "silence.target") << "";
}

}  // namespace degas::test
