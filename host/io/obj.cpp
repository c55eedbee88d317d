#include "host/io/obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/error.h"
#include "host/io/text_lines.h"

namespace degas {
namespace {

/// An index of the file, from 1, or negative from the end, as one from 0.
int resolved(const TextLines& lines, std::string_view text, size_t count, const char* kind) {
  const long index = lines.whole(text);
  const long place = index > 0 ? index - 1 : static_cast<long>(count) + index;
  if (index == 0 || place < 0 || place >= static_cast<long>(count)) {
    lines.fail(fmt::format("{} {} is named, but there are {} so far", kind, index, count));
  }
  return static_cast<int>(place);
}

ObjMesh::Corner parse_corner(const TextLines& lines, std::string_view word, const ObjMesh& mesh) {
  const size_t first = std::min(word.find('/'), word.size());
  ObjMesh::Corner corner{resolved(lines, word.substr(0, first), mesh.vertices.size(), "vertex"), -1};
  if (first == word.size()) return corner;
  const std::string_view rest = word.substr(first + 1), texture = rest.substr(0, std::min(rest.find('/'), rest.size()));
  if (!texture.empty()) {
    corner.texture = resolved(lines, texture, mesh.texture_coordinates.size(), "texture coordinate");
  }
  return corner;
}

}  // namespace

ObjMesh read_obj(const std::filesystem::path& path) {
  TextLines lines(path);
  ObjMesh mesh;
  mesh.groups.push_back("");
  std::map<std::string, int> group_places = {{"", 0}};
  int group = 0;
  while (lines.next()) {
    const std::vector<std::string_view>& words = lines.words();
    if (words[0] == "v") {
      const std::vector<double> values = lines.numbers(1, 3);
      mesh.vertices.emplace_back(values[0], values[1], values[2]);
    } else if (words[0] == "vt") {
      const std::vector<double> values = lines.numbers(1, 2);
      mesh.texture_coordinates.emplace_back(values[0], values[1]);
    } else if (words[0] == "g") {
      const std::string name(words.size() > 1 ? words[1] : "");
      const auto [known, is_new] = group_places.emplace(name, static_cast<int>(mesh.groups.size()));
      group = known->second;
      if (is_new) mesh.groups.push_back(name);
    } else if (words[0] == "f") {
      if (words.size() < 4) lines.fail("a face has fewer than three corners");
      mesh.polygons.push_back({static_cast<int>(mesh.corners.size()), static_cast<int>(words.size()) - 1, group});
      for (size_t k = 1; k < words.size(); ++k) mesh.corners.push_back(parse_corner(lines, words[k], mesh));
    }
  }
  if (mesh.polygons.empty())
    throw Error::format("{}: has no faces ('f' lines); is it a Wavefront .obj?", path.string());
  return mesh;
}

}  // namespace degas
