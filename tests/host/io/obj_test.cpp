#include "host/io/obj.h"

#include <fstream>

#include "host/error.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

ObjMesh read_text(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.obj") << text;
  return read_obj(folder / "a.obj");
}

}  // namespace

TEST_CASE("faces of every form, groups and indices from the end are read") {
  const ObjMesh mesh = read_text(
      "# comment\r\nmtllib none.mtl\nv 0 0 0\nv 1 0 0 0.5\n  v 1 1e0 0\nv 0 1 -.5\nvt 0 0\nvt .25 1 0\n"
      "f 1 2 3\ng one two\nf 1/1 2/2 -1/-1\ng\nf 1//1 2/1/1 3/2/9\ng one\ns off\nf 1/1 2/1 3/1 4/2");
  REQUIRE(mesh.vertices.size() == 4);
  CHECK(mesh.vertices[3] == Eigen::Vector3d(0, 1, -0.5));
  REQUIRE(mesh.texture_coordinates.size() == 2);
  CHECK(mesh.texture_coordinates[1] == Eigen::Vector2d(0.25, 1));
  CHECK(mesh.groups == std::vector<std::string>{"", "one"});
  REQUIRE(mesh.polygons.size() == 4);
  const auto corners = [&](int polygon) {
    std::vector<std::pair<int, int>> result;
    for (int k = 0; k < mesh.polygons[polygon].count; ++k) {
      const ObjMesh::Corner& corner = mesh.corners[mesh.polygons[polygon].first + k];
      result.emplace_back(corner.vertex, corner.texture);
    }
    return result;
  };
  using Corners = std::vector<std::pair<int, int>>;
  CHECK(corners(0) == Corners{{0, -1}, {1, -1}, {2, -1}});
  CHECK(corners(1) == Corners{{0, 0}, {1, 1}, {3, 1}});
  CHECK(corners(2) == Corners{{0, -1}, {1, 0}, {2, 1}});
  CHECK(corners(3) == Corners{{0, 0}, {1, 0}, {2, 0}, {3, 1}});
  CHECK(mesh.polygons[0].group == 0);
  CHECK(mesh.polygons[1].group == 1);
  CHECK(mesh.polygons[2].group == 0);
  CHECK(mesh.polygons[3].group == 1);
}

TEST_CASE("what is wrong in an .obj is told with its line") {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK_THROWS_WITH(read_text(vertices + "f 1 2 4\n"), Contains("a.obj: line 4: vertex 4 is named, but there are 3"));
  CHECK_THROWS_WITH(read_text(vertices + "f 1 2 0\n"), Contains("line 4: vertex 0"));
  CHECK_THROWS_WITH(read_text(vertices + "f 1 2 -4\n"), Contains("line 4: vertex -4"));
  CHECK_THROWS_WITH(read_text(vertices + "f 1/1 2/1 3/1\n"), Contains("line 4: texture coordinate 1"));
  CHECK_THROWS_WITH(read_text(vertices + "f 1 2\n"), Contains("line 4: a face has fewer than three corners"));
  CHECK_THROWS_WITH(read_text(vertices + "f 1 2 x\n"), Contains("line 4: 'x' is no whole number"));
  CHECK_THROWS_WITH(read_text("v 0 0\n"), Contains("line 1: has 3 words, expected 4"));
  CHECK_THROWS_WITH(read_text("v 0 0 inf\n"), Contains("line 1: 'inf' is no finite number"));
  CHECK_THROWS_WITH(read_text(vertices), Contains("has no faces"));
  std::string many = "f";
  for (int i = 0; i < 1000; ++i) many += " 1";
  CHECK_THROWS_WITH(read_text(vertices + many), Contains("line 4: has more than 1000 words"));
}
