#include "model/body/face_region.h"

#include "host/io/npz.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;

namespace {

/// The tiny body, all of it head, in a square of the texture from (u, v) leftmost and lowest, of the given side.
BodyModel body_at(float u, float v, float side) {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  std::vector<float> texture;
  for (int vertex = 0; vertex < 9; ++vertex) {
    texture.insert(texture.end(), {u + side * 0.5f * (vertex % 3), v + side * 0.5f * (vertex / 3)});
  }
  std::vector<float> weights(9 * 55, 0.f);
  for (int vertex = 0; vertex < 9; ++vertex) weights[vertex * 55 + HeadJoint] = 1;
  arrays["vt"] = NpyArray::from({9, 2}, texture);
  arrays["weights"] = NpyArray::from({9, 55}, weights);
  write_npz(folder / "body.npz", arrays);
  return BodyModel::load(folder / "body.npz");
}

/// A body's file with its texture coordinates changed.
template <typename Change>
BodyModel retextured(const std::string& path, const Change& change) {
  const NpzFile file(path);
  std::map<std::string, NpyArray> arrays;
  for (const char* key :
       {"v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f", "ft"}) {
    arrays[key] = file.read(key);
  }
  std::vector<float> texture = file.read("vt").floats();
  for (size_t i = 0; i < texture.size(); i += 2) change(texture[i], texture[i + 1]);
  arrays["vt"] = NpyArray::from({static_cast<int64_t>(texture.size() / 2), 2}, texture);
  const TemporaryFolder folder;
  write_npz(folder / "body.npz", arrays);
  return BodyModel::load(folder / "body.npz");
}

}  // namespace

TEST_CASE("the face region is the square that holds the head") {
  struct Case {
    float u, v, side;
    int row, column;
  };
  // The whole head is found: the uppermost and leftmost place of the grid that holds it.
  const auto [u, v, side, row, column] =
      GENERATE(Case{0.01f, 0.6f, 0.38f, 0, 0}, Case{0.51f, 0.51f, 0.48f, 0, 8}, Case{0.01f, 0.01f, 0.48f, 8, 0},
               Case{0.51f, 0.01f, 0.48f, 8, 8}, Case{0.26f, 0.26f, 0.48f, 4, 4});
  const FaceRegion region = find_face_region(body_at(u, v, side));
  CAPTURE(u, v, side);
  CHECK(region.row == row);
  CHECK(region.column == column);
  CHECK(region.head_share == 1);
  CHECK(region.is_smplx() == (row == 0 && column == 0));
}

TEST_CASE("a head that is larger than the region is held in part, one that mostly fits stays SMPL-X's") {
  const FaceRegion large = find_face_region(body_at(0, 0, 1));
  CHECK(large.is_smplx());
  CHECK(large.head_share == Approx(0.25).epsilon(0.02));
  // 0.06 of 0.5 spill over to the right; the square one place further right would hold all of it.
  const FaceRegion spilling = find_face_region(body_at(0.06f, 0.5f, 0.5f));
  CHECK(spilling.is_smplx());
  CHECK(spilling.head_share == Approx(0.88).epsilon(0.02));
}

TEST_CASE("a full-size body's layouts: as it is, v turned over, and that of the mesh it was made of") {
  const std::string path = data_path("data/bodies/male.npz");
  if (path.empty()) return;
  const FaceRegion region = find_face_region(BodyModel::load(path));
  CHECK(region.is_smplx());
  CHECK(region.head_share > 0.99);
  const FaceRegion turned = find_face_region(retextured(path, [](float&, float& v) { v = 1 - v; }));
  CHECK(turned.row == 8);
  CHECK(turned.column == 0);
  CHECK(turned.head_share == Approx(region.head_share).margin(0.01));
  const FaceRegion mirrored = find_face_region(retextured(path, [](float& u, float&) { u = 1 - u; }));
  CHECK(mirrored.row == 0);
  CHECK(mirrored.column == 8);
}
