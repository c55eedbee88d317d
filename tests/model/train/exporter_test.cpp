#include "model/train/exporter.h"

#include <algorithm>
#include <cmath>

#include "host/io/exr.h"
#include "host/io/ply.h"
#include "model/loss/metrics.h"
#include "model/train/picture.h"
#include "tests/support/catch.h"
#include "tests/support/harmonics_reference.h"
#include "tests/support/splat_reference.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

namespace {

/// What a viewer at `center` makes of the file (the 3DGS convention).
SplatScene read_as_viewers_do(const std::filesystem::path& path, const Eigen::Vector3d& center) {
  const PlySplats ply = read_ply(path);
  SplatScene scene;
  for (size_t n = 0; n < ply.opacity_logits.size(); ++n) {
    const auto basis = reference_harmonics(
        Eigen::Vector3d(ply.positions[3 * n], ply.positions[3 * n + 1], ply.positions[3 * n + 2]) - center);
    const size_t coefficients = ply.harmonics.size() / ply.color_dc.size();
    const auto color = [&](size_t c) {
      double seen = 0.5 + 0.28209479177387814 * ply.color_dc[3 * n + c];
      for (size_t j = 0; j < coefficients; ++j) seen += basis[j] * ply.harmonics[(n * coefficients + j) * 3 + c];
      return std::max(0.0, seen);
    };
    scene.add({ply.positions[3 * n], ply.positions[3 * n + 1], ply.positions[3 * n + 2]},
              {ply.rotations[4 * n], ply.rotations[4 * n + 1], ply.rotations[4 * n + 2], ply.rotations[4 * n + 3]},
              {ply.log_scales[3 * n], ply.log_scales[3 * n + 1], ply.log_scales[3 * n + 2]},
              1 / (1 + std::exp(-static_cast<double>(ply.opacity_logits[n]))), {color(0), color(1), color(2)});
  }
  return scene;
}

}  // namespace

TEST_CASE("an exported frame drawn by another renderer is our picture, and its maps read back") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 30;
  config.train.refine_poses = true;
  config.net.color_degree = 2;
  SECTION("colours of one value") {
    config.net.color_degree = 0;
  }
  SECTION("colours of a direction") {}
  SECTION("static maps") {
    config.net.kind = NetKind::Static;
  }
  SECTION("skips") {
    config.net.kind = NetKind::Skips;
  }
  SECTION("a network per texel") {
    config.net.kind = NetKind::Mlp;
  }
  const auto capture = open_scene();
  TrainedAvatar avatar(wide(), train_run(folder / "run", config, *capture));
  const int frame = 3;
  export_frame(wide(), avatar, *capture, frame, folder / "out/avatar.ply");

  const Camera camera = capture->camera(2);
  Tape tape(wide(), false);
  SplatWorkspace workspace;
  FaceCodes codes = avatar.face_codes(*capture);
  const Splats splats = avatar.drive(tape, *capture, codes, frame);
  const SplatOptions options = splat_options(config.render);
  const std::vector<float> ours = splat(tape, workspace, splats, camera, {1, 1, 1}, options).color.to_host<float>();

  const SplatScene scene = read_as_viewers_do(folder / "out/avatar.ply", camera.center());
  REQUIRE(scene.count() == avatar.avatar().gaussian_count());
  const ReferenceImage reference = reference_render(scene, camera, {1, 1, 1}, options);
  const std::vector<float> theirs(reference.color.begin(), reference.color.end());
  double covered = 0;
  for (double alpha : reference.alpha) covered += alpha / static_cast<double>(reference.alpha.size());
  CHECK(covered > 0.05);  // there is somebody in the picture
  CHECK(*std::min_element(ours.begin(), ours.end()) < 0.8f);
  const double quality = psnr(ours, theirs);
  std::printf("exported frame, drawn in double precision: %.1f dB\n", quality);
  CHECK(quality >= 45);

  const ExrImage maps = read_exr(folder / "out/avatar.exr");
  CHECK(maps.width == 128);
  CHECK(maps.height == 128);
  CHECK(maps.channels.size() == (config.net.color_degree == 2 ? 3 + 4 + 3 + 1 + 3 + 1 + 24 : 3 + 4 + 3 + 1 + 3 + 1));
  const Avatar::Signal signal = avatar.avatar().upload(avatar.avatar().signal(*capture, frame, codes.mean(frame)));
  const CanonicalGaussians gaussians = avatar.avatar().decode(tape, signal).gaussians;
  const std::vector<float> positions = gaussians.positions.to_host<float>(),
                           rotations = gaussians.rotations.to_host<float>(),
                           log_scales = gaussians.log_scales.to_host<float>(),
                           opacities = gaussians.opacities.to_host<float>(), colors = gaussians.colors.to_host<float>();
  const std::vector<int> texels = avatar.avatar().atlas().covered();
  int differing = 0;
  for (size_t i = 0; i < texels.size(); ++i) {
    const auto at = static_cast<size_t>(texels[i]);
    differing += maps.channels.at("covered")[at] != 1 || maps.channels.at("position.x")[at] != positions[3 * i] ||
                 maps.channels.at("position.z")[at] != positions[3 * i + 2] ||
                 maps.channels.at("rotation.w")[at] != rotations[4 * i] ||
                 maps.channels.at("rotation.z")[at] != rotations[4 * i + 3] ||
                 maps.channels.at("log_scale.y")[at] != log_scales[3 * i + 1] ||
                 maps.channels.at("opacity")[at] != opacities[i] ||
                 maps.channels.at("color.g")[at] != colors[3 * i + 1];
  }
  CHECK(differing == 0);
  double covered_texels = 0, stray = 0;
  for (size_t at = 0; at < 128 * 128; ++at) {
    covered_texels += maps.channels.at("covered")[at];
    for (const auto& [name, values] : maps.channels) stray += maps.channels.at("covered")[at] == 0 && values[at] != 0;
  }
  CHECK(covered_texels == static_cast<double>(texels.size()));
  CHECK(stray == 0);
}
