#include "model/data/registration.h"

#include "host/io/npz.h"
#include "model/data/smplx_parameters.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

/// Parameters of the scene's first sequence, moved.
SmplxParameters moved_parameters() {
  SmplxParameters parameters = read_smplx_parameters(training_scene() / "P1C1" / "smplx.npz");
  for (Pose& pose : parameters.poses) pose.translation += Eigen::Vector3d(0.25, 0, 0);
  parameters.betas.assign(parameters.betas.size(), 0.5);
  return parameters;
}

std::filesystem::path written(const TemporaryFolder& folder, const SmplxParameters& parameters) {
  const auto file = folder / "poses.npz";
  write_npz(file, smplx_arrays(parameters));
  return file;
}

}  // namespace

TEST_CASE("another registration takes the place of the capture's own, and nothing else does") {
  const TemporaryFolder folder;
  const auto own = open_scene();
  const auto other = with_registration(open_scene(), written(folder, moved_parameters()));
  for (int frame = 0; frame < own->frame_count(); ++frame) {
    CHECK(other->pose(frame).translation.isApprox(own->pose(frame).translation + Eigen::Vector3d(0.25, 0, 0), 1e-6));
    CHECK(other->pose(frame).axis_angles == own->pose(frame).axis_angles);
    CHECK(other->face_code(frame, 2) == own->face_code(frame, 2));
  }
  CHECK(other->betas()[0] == 0.5);
  CHECK(other->load(1, 2).image.pixels == own->load(1, 2).image.pixels);
}

TEST_CASE("the identity tells registrations apart, wherever their file lies") {
  const TemporaryFolder folder, elsewhere;
  const auto own = open_scene();
  const auto file = written(folder, moved_parameters());
  const auto one = with_registration(open_scene(), file);
  CHECK(one->identity() != own->identity());
  CHECK(one->picture_identity() != own->picture_identity());
  std::filesystem::copy(file, elsewhere / "other_name.npz");
  CHECK(with_registration(open_scene(), elsewhere / "other_name.npz")->identity() == one->identity());
  SmplxParameters another = moved_parameters();
  another.poses[2].translation.z() += 0.001;
  CHECK(with_registration(open_scene(), written(elsewhere, another))->identity() != one->identity());
}

TEST_CASE("decoded pictures are kept for every registration alike") {
  const TemporaryFolder folder;
  CaptureOptions options;
  options.cache = folder / "cache";
  (void)open_capture(training_scene() / "P1C1", options)->load(0, 1);
  options.poses = written(folder, moved_parameters());
  (void)open_capture(training_scene() / "P1C1", options)->load(0, 1);
  const std::filesystem::directory_iterator kept(options.cache);
  CHECK(std::distance(begin(kept), end(kept)) == 1);
}

TEST_CASE("a registration of another capture is refused by file and reason") {
  const TemporaryFolder folder;
  SmplxParameters parameters = moved_parameters();
  SECTION("other frames") {
    parameters.frame_numbers.back() += 1;
    CHECK_THROWS_WITH(with_registration(open_scene(), written(folder, parameters)),
                      Contains("poses.npz: row 5 is of frame 6") && Contains("this very capture"));
  }
  SECTION("another number of frames") {
    parameters.frame_numbers.pop_back();
    parameters.poses.pop_back();
    CHECK_THROWS_WITH(with_registration(open_scene(), written(folder, parameters)),
                      Contains("poses.npz: has parameters of 5 frames, the capture has 6"));
  }
  SECTION("no file") {
    CHECK_THROWS_WITH(with_registration(open_scene(), folder / "absent.npz"), Contains("absent.npz"));
  }
}
