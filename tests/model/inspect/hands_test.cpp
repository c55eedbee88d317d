#include "model/inspect/hands.h"

#include <map>

#include "host/io/npz.h"
#include "model/data/capture.h"
#include "model/data/synthetic_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

TEST_CASE("hands whose angles are meant the other way are told by their masks") {
  const TemporaryFolder folder;
  SyntheticOptions options;
  options.frames = 2;
  options.novel_frames = 1;
  options.views = 4;
  options.width = 360;
  options.height = 480;
  write_synthetic_capture(folder.path(), options);
  // A mean hand that is half a fist, as SMPL-X's is; the mannequin's own angles are relative to the flat hand.
  std::map<std::string, NpyArray> arrays;
  {
    const NpzFile file(folder / "body.npz");
    for (const std::string& name : file.keys()) arrays[name] = file.read(name);
  }
  std::vector<float> left(45, 0.0F), right(45, 0.0F);
  for (size_t joint = 0; joint < 15; ++joint) {
    left[3 * joint + 2] = -0.9F;
    right[3 * joint + 2] = 0.9F;
  }
  arrays["hands_meanl"] = NpyArray::from({45}, left);
  arrays["hands_meanr"] = NpyArray::from({45}, right);
  write_npz(folder / "fist.npz", arrays);
  const BodyModel body = BodyModel::load(folder / "fist.npz");
  REQUIRE(body.has_hand_mean());

  CaptureOptions opening;
  opening.cache = folder / "cache";
  const auto capture = open_capture(folder / "P1C1", opening);
  HandFit flat, fists;
  for (int frame = 0; frame < 2; ++frame) {
    const Pose pose = capture->pose(frame);
    const auto surface = [&](const Pose& posed) {
      return BodySurface(body.posed_vertices(posed, capture->betas(), true), body.faces());
    };
    const BodySurface flat_hands = surface(pose), curled_hands = surface(body.with_hands(pose, false));
    for (int camera = 0; camera < 4; ++camera) {
      const Sample sample = capture->load(frame, camera);
      flat += compare_hands(body, flat_hands, curled_hands, sample.view, sample.mask);
      fists += compare_hands(body, curled_hands, flat_hands, sample.view, sample.mask);
    }
  }
  CAPTURE(flat.hands, flat.as_registered / flat.hands, flat.otherwise / flat.hands);
  CHECK(flat.hands >= 8);
  CHECK(flat.as_registered == fists.otherwise);
  CHECK_FALSE(flat.verdict(true).has_value());
  REQUIRE(fists.verdict(false).has_value());
  CHECK_THAT(*fists.verdict(false), Contains("relative to the flat hand, but the capture says the mean one"));
  CHECK_FALSE(HandFit().verdict(true).has_value());
}
