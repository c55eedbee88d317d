// The body: SMPL-X's .npz, and MakeHuman's files.

#include "host/io/file_bytes.h"
#include "model/body/body_model.h"
#include "model/body/makehuman_files.h"
#include "model/body/makehuman_import.h"
#include "model/body/uv_atlas.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tiny_body.h"
#include "tests/support/tiny_makehuman.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

constexpr int cube_vertices = 8;

MakeHumanBody import_folder(const fs::path& folder) {
  return import_makehuman({folder / "base.obj",
                           folder / "rig.mhskel",
                           folder / "weights.mhw",
                           {{folder / "shape.target", 0.5}},
                           folder / "targets"});
}

}  // namespace

TEST_CASE("damaged bodies") {
  const TemporaryFolder folder;
  write_tiny_body(folder / "seed.npz");
  const auto read = [](const fs::path& path) {
    const BodyModel body = BodyModel::load(path);
    Pose pose;
    pose.axis_angles.assign(static_cast<size_t>(body.joint_count()), Eigen::Vector3d(0.1, 0.2, 0.3));
    body.posed_vertices(pose, {}, true);
    UvAtlas(body, 32).map(body.canonical_vertices({}, {}));
  };
  fuzz({"body.npz", {archive_parts(folder / "seed.npz")}, write_archive, read, 1500});
}

TEST_CASE("damaged rigs, weights and targets of MakeHuman") {
  const std::string rig = R"({"bones": {"root": {"head": "root____head", "parent": null},
 "spine": {"head": "spine____head", "parent": "root"}},
 "joints": {"root____head": [0, 1, 2], "spine____head": [3]}})";
  const std::string weights = R"({"name": "w", "weights": {"root": [[0, 1.0], [1, 0.5]], "spine": [[2, 0.25]]}})";
  fuzz({"rig.mhskel",
        {whole(bytes_of(rig))},
        {},
        [](const fs::path& path) {
          const MakeHumanRig read = read_makehuman_rig(path, cube_vertices);
          for (const auto& [name, bone] : read.bones) read.ancestor(name, {{"root", 0}});
        },
        5000});
  fuzz({"weights.mhw",
        {whole(bytes_of(weights))},
        {},
        [](const fs::path& path) { read_makehuman_weights(path, cube_vertices); },
        5000});
  fuzz({"smile.target",
        {whole(bytes_of("# a smile\n0 0.5 -1e-3 2\n7 1 2 3\n\n3 .5 0 0\n"))},
        {},
        [](const fs::path& path) { read_makehuman_target(path, cube_vertices); },
        3000});
}

TEST_CASE("a damaged person of MakeHuman") {
  const TemporaryFolder folder;
  const TinyMakeHuman person(folder.path());
  fuzz({"person", {folder_parts(folder.path())}, write_folder, import_folder, 60});
}
