#include "model/body/makehuman_files.h"

#include <fmt/format.h>

#include "host/error.h"
#include "host/io/json_node.h"
#include "host/io/text_lines.h"

namespace degas {

std::string MakeHumanRig::ancestor(const std::string& bone, const std::map<std::string, int>& names) const {
  std::string at = bone;
  for (size_t steps = 0; steps <= bones.size(); ++steps) {  // a ring of parents ends too
    if (names.contains(at)) return at;
    const auto found = bones.find(at);
    if (found == bones.end()) break;
    at = found->second.parent;
  }
  return "";
}

constexpr size_t most_head_vertices = 1'000'000;

MakeHumanRig read_makehuman_rig(const std::filesystem::path& path, int vertex_count) {
  const nlohmann::ordered_json file = read_json(path);
  const JsonNode root(file, path.string());
  const JsonNode bones = root["bones"], joints = root["joints"];
  MakeHumanRig rig;
  size_t named = 0;  // bones may share a list of vertices: as many as there are lists would be no skeleton
  for (const std::string& name : bones.keys()) {
    const JsonNode bone = bones[name];
    MakeHumanRig::Bone& made = rig.bones[name];
    if (bone.has("parent") && !bone["parent"].is_null()) made.parent = bone["parent"].text();
    const JsonNode vertices = joints[bone["head"].text()];
    for (size_t i = 0; i < vertices.size(); ++i) made.head_vertices.push_back(vertices[i].integer(0, vertex_count - 1));
    named += made.head_vertices.size();
    if (named > most_head_vertices) bones.fail(fmt::format("name more than {} vertices", most_head_vertices));
    if (made.head_vertices.empty()) vertices.fail("has no vertices; a joint is the mean of some");
  }
  return rig;
}

MakeHumanWeights read_makehuman_weights(const std::filesystem::path& path, int vertex_count) {
  const nlohmann::ordered_json file = read_json(path);
  const JsonNode bones = JsonNode(file, path.string())["weights"];
  MakeHumanWeights weights;
  for (const std::string& name : bones.keys()) {
    const JsonNode list = bones[name];
    std::vector<std::pair<int, double>>& shares = weights[name];
    for (size_t i = 0; i < list.size(); ++i) {
      const JsonNode pair = list[i];
      if (pair.size() != 2) pair.fail("is no pair of a vertex and its weight");
      shares.emplace_back(pair[0].integer(0, vertex_count - 1), pair[1].number());
      if (shares.back().second < 0) pair.fail("has a negative weight");
    }
  }
  return weights;
}

MakeHumanTarget read_makehuman_target(const std::filesystem::path& path, int vertex_count) {
  TextLines lines(path);
  MakeHumanTarget target;
  while (lines.next()) {
    if (lines.words()[0].starts_with('#')) continue;
    const long vertex = lines.whole(lines.words()[0]);
    if (vertex < 0 || vertex >= vertex_count) {
      lines.fail(fmt::format("moves vertex {}, but the base mesh has {}", vertex, vertex_count));
    }
    const std::vector<double> offset = lines.numbers(1, 3);
    target.emplace_back(static_cast<int>(vertex), Eigen::Vector3d(offset[0], offset[1], offset[2]));
  }
  return target;
}

}  // namespace degas
