#include <fmt/ranges.h>

#include <limits>
#include <optional>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/body/body_model.h"
#include "tests/support/npy_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using Eigen::Vector3d;

namespace {

Pose random_pose(unsigned seed) {
  const std::vector<double> values = random_values(3 * 56, seed, -1, 1);
  Pose pose;
  for (int j = 0; j < 55; ++j) pose.axis_angles.emplace_back(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
  pose.translation = Vector3d(values[165], values[166], values[167]);
  pose.expression = random_values(3, seed + 1, -2, 2);
  return pose;
}

template <typename Value>
std::vector<std::byte> npy_of(const char* type, bool fortran_order, const Shape& shape,
                              const std::vector<Value>& values) {
  std::string payload(values.size() * sizeof(Value), 0);
  std::memcpy(payload.data(), values.data(), payload.size());
  return npy_file(fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': ({},), }}\n", type,
                              fortran_order ? "True" : "False", fmt::join(shape, ", ")),
                  payload);
}

/// The values of an array, its first index the fastest.
std::vector<double> in_fortran_order(const NpyArray& array) {
  const std::vector<double> values = array.doubles();
  std::vector<double> out(values.size());
  std::vector<int64_t> index(array.shape.size(), 0);
  for (const double value : values) {
    int64_t place = 0;
    for (size_t axis = index.size(); axis-- > 0;) place = place * array.shape[axis] + index[axis];
    out[static_cast<size_t>(place)] = value;
    for (size_t axis = index.size(); axis-- > 0 && ++index[axis] == array.shape[axis];) index[axis] = 0;
  }
  return out;
}

/// A body's arrays as SMPL-X's own file has them: float64 in Fortran order, 32-bit indices (the root's parent is
/// 2^32-1), beside landmarks and pickled objects, which nobody needs.
void write_official(const std::filesystem::path& path, const NpzFile& body) {
  std::vector<ZipEntry> entries;
  for (const char* key : {"f", "ft", "kintree_table"}) {
    const NpyArray array = body.read(key);
    const std::vector<int64_t> values = array.integers();
    entries.push_back({std::string(key) + ".npy",
                       npy_of("<u4", false, array.shape, std::vector<uint32_t>(values.begin(), values.end()))});
  }
  for (const char* key : {"v_template", "shapedirs", "posedirs", "J_regressor", "weights", "vt", "hands_meanl",
                          "hands_meanr", "hands_componentsl", "hands_componentsr"}) {
    const NpyArray array = body.read(key);
    entries.push_back({std::string(key) + ".npy", npy_of("<f8", true, array.shape, in_fortran_order(array))});
  }
  for (const char* key : {"joint2num", "part2num"}) {
    entries.push_back({std::string(key) + ".npy",
                       npy_file("{'descr': '|O', 'fortran_order': False, 'shape': (), }\n", "\x80\x03}q.")});
  }
  entries.push_back({"lmk_faces_idx.npy", npy_of("<i8", false, {51}, std::vector<int64_t>(51))});
  entries.push_back({"lmk_bary_coords.npy", npy_of("<f8", true, {51, 3}, std::vector<double>(153))});
  entries.push_back({"hands_coeffsl.npy", npy_of("<f8", false, {2, 45}, std::vector<double>(90))});
  write_file_atomically(path, make_zip(entries, true));
}

/// Every array of both, exactly: what is linear in a basis with a random number for each of its columns.
void check_equal(const BodyModel& a, const BodyModel& b) {
  REQUIRE(a.vertex_count() == b.vertex_count());
  REQUIRE(a.shape_count() == b.shape_count());
  REQUIRE(a.expression_count() == b.expression_count());
  CHECK(a.parents() == b.parents());
  CHECK((a.faces() == b.faces() && a.texture_faces() == b.texture_faces()));
  CHECK((a.texture_coordinates() == b.texture_coordinates()));
  bool same_weights = true;
  for (int v = 0; v < a.vertex_count(); ++v) {
    const auto x = a.skinning_weights(v), y = b.skinning_weights(v);
    same_weights = same_weights && std::equal(x.begin(), x.end(), y.begin(), y.end(), [](auto& left, auto& right) {
                     return left.joint == right.joint && left.weight == right.weight;
                   });
  }
  CHECK(same_weights);
  CHECK((a.canonical_vertices({}, {}) == b.canonical_vertices({}, {})));
  const std::vector<double> betas = random_values(a.shape_count(), 40),
                            expression = random_values(a.expression_count(), 41);
  CHECK((a.canonical_vertices(betas, expression) == b.canonical_vertices(betas, expression)));
  CHECK((a.joints(betas) == b.joints(betas)));
  Pose pose = random_pose(42);
  CHECK((a.posed_vertices(pose, betas, true) == b.posed_vertices(pose, betas, true)));
  pose.hand_coefficients = {random_values(45, 43), random_values(45, 44)};
  CHECK(a.with_hands(pose, false).axis_angles == b.with_hands(pose, false).axis_angles);
}

}  // namespace

TEST_CASE("the official file's types, order and further keys make the same body") {
  const TemporaryFolder folder;
  std::string path = data_path("data/bodies/male.npz");
  const bool full_size = GENERATE(false, true);
  if (full_size && path.empty()) return;
  if (!full_size) write_tiny_body(path = (folder / "tiny.npz").string());
  write_official(folder / "official.npz", NpzFile(path));
  check_equal(BodyModel::load(folder / "official.npz"), BodyModel::load(path));
}

TEST_CASE("both layouts of the pose blend shapes and of the root's parent are read") {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  write_npz(folder / "a.npz", arrays);
  const std::vector<float> by_vertex = arrays.at("posedirs").floats();
  std::vector<float> by_feature(by_vertex.size());
  for (int p = 0; p < 486; ++p) {
    for (int i = 0; i < 27; ++i) by_feature[p * 27 + i] = by_vertex[i * 486 + p];
  }
  arrays["posedirs"] = NpyArray::from({486, 27}, by_feature);
  std::vector<int64_t> tree = arrays.at("kintree_table").integers();
  tree[0] = -1;
  arrays["kintree_table"] = NpyArray::from({2, 55}, tree);
  write_npz(folder / "b.npz", arrays);
  const Pose pose = random_pose(11);
  const std::vector<Vector3d> a = BodyModel::load(folder / "a.npz").posed_vertices(pose, {1}, true);
  CHECK(a == BodyModel::load(folder / "b.npz").posed_vertices(pose, {1}, true));
}

TEST_CASE("faults of a body model name file and key") {
  const TemporaryFolder folder;
  const auto load_with = [&](const std::string& key, std::optional<NpyArray> array) {
    auto arrays = tiny_body_arrays();
    arrays.erase(key);
    if (array) arrays[key] = *array;
    write_npz(folder / "bad.npz", arrays);
    BodyModel::load(folder / "bad.npz");
  };
  for (const std::string key :
       {"v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f", "vt", "ft"}) {
    CAPTURE(key);
    CHECK_THROWS_WITH(load_with(key, {}), Contains("bad.npz: no array '" + key + "'"));
    CHECK_THROWS_WITH(load_with(key, NpyArray::from({2, 2, 2, 1}, std::vector<float>(8))),
                      Contains("bad.npz: '" + key + "' has shape (2, 2, 2, 1), expected"));
  }
  for (const std::string key : {"hands_meanr", "hands_componentsl"}) {
    CHECK_THROWS_WITH(load_with(key, {}), Contains("bad.npz: no array '" + key + "'"));
  }
  CHECK_THROWS_WITH(load_with("hands_componentsr", NpyArray::from({45, 44}, std::vector<float>(45 * 44))),
                    Contains("bad.npz: 'hands_componentsr' has shape (45, 44), expected (-1, 45)"));
  for (const std::string key :
       {"v_template", "shapedirs", "posedirs", "J_regressor", "weights", "vt", "hands_meanl", "hands_componentsr"}) {
    CAPTURE(key);
    const NpyArray array = tiny_body_arrays().at(key);
    std::vector<double> values = array.doubles();
    values[5] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(load_with(key, NpyArray::from(array.shape, values)),
                      Contains("bad.npz: '" + key + "' has nan at element 5"));
  }
  const auto changed = [&](const std::string& key, int index, int64_t value) {
    const NpyArray array = tiny_body_arrays().at(key);
    std::vector<int64_t> values = array.integers();
    values[index] = value;
    return NpyArray::from(array.shape, values);
  };
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 0, 0)),
                    Contains("bad.npz: 'kintree_table' gives joint 0 the parent 0"));
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 7, 7)),
                    Contains("'kintree_table' gives joint 7 the parent 7"));
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 7, -1)), Contains("gives joint 7 the parent"));
  CHECK_THROWS_WITH(load_with("f", changed("f", 4, 9)), Contains("bad.npz: 'f' has index 9 in triangle 1"));
  CHECK_THROWS_WITH(load_with("ft", changed("ft", 4, -1)), Contains("bad.npz: 'ft' has index -1 in triangle 1"));
  CHECK_THROWS_WITH(load_with("weights", NpyArray::from({9, 55}, std::vector<double>(9 * 55, 0.1))),
                    Contains("bad.npz: 'weights' of vertex 0 sum to 5.5"));
  CHECK_THROWS_WITH(load_with("vt", NpyArray::from({9, 2}, std::vector<double>(18, 1.5))),
                    Contains("bad.npz: 'vt' has (1.5, 1.5) at 0"));
  CHECK_THROWS_WITH(BodyModel::load(folder / "missing.npz"), Contains("missing.npz: no such file"));
}
