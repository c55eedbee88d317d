#include "model/data/synthetic_capture.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "host/error.h"
#include "model/body/body_model.h"
#include "model/data/dreams_capture.h"
#include "model/data/mannequin_code.h"
#include "model/data/mannequin_motion.h"
#include "tests/support/test_devices.h"

using namespace degas;
namespace fs = std::filesystem;

namespace {

const MannequinBody& undressed_body() {
  static const MannequinBody built = build_mannequin();
  return built;
}

const DressedMannequin& person() {
  static const DressedMannequin dressed(undressed_body());
  return dressed;
}

RenderedPicture picture_of(const MannequinPose& pose, const Camera& camera) {
  LitScene scene = person().pose(pose);
  light_scene(scene, person().shadow_casters(), studio_lights(), 2);
  return rasterize(scene, camera, 2);
}

std::map<std::string, std::string> files_under(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[fs::relative(entry.path(), folder).string()] =
        std::string(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return files;
}

/// Sum of absolute differences within a window about a world point, as seen by the camera.
double change_about(const RenderedPicture& a, const RenderedPicture& b, const Camera& camera,
                    const Eigen::Vector3d& point, int half) {
  const Eigen::Vector3d pixel = camera.project(point);
  double change = 0;
  for (int y = static_cast<int>(pixel.y()) - half; y <= static_cast<int>(pixel.y()) + half; ++y) {
    for (int x = static_cast<int>(pixel.x()) - half; x <= static_cast<int>(pixel.x()) + half; ++x) {
      for (int k = 0; k < 3; ++k) {
        const size_t at = 3 * (static_cast<size_t>(y) * a.width + x) + k;
        change += std::abs(a.rgb[at] - b.rgb[at]);
      }
    }
  }
  return change / (3.0 * (2 * half + 1) * (2 * half + 1));
}

}  // namespace

TEST_CASE("one seed gives the same bytes, another seed another capture") {
  const fs::path root = fs::temp_directory_path() / "degas_synthetic_capture_test";
  fs::remove_all(root);
  SyntheticOptions options;
  options.frames = 2;
  options.novel_frames = 1;
  options.views = 3;
  options.width = 48;
  options.height = 64;
  int last = 0, total = 0;
  write_synthetic_capture(root / "a", options, [&](int done, int all) {
    CHECK(done == last + 1);
    last = done;
    total = all;
  });
  CHECK(last == 9);
  CHECK(total == 9);
  write_synthetic_capture(root / "b", options);
  options.seed = 2;
  write_synthetic_capture(root / "c", options);
  const auto a = files_under(root / "a"), b = files_under(root / "b"), c = files_under(root / "c");
  CHECK(a == b);
  CHECK(a.count("body.npz") == 1);
  CHECK(a.count("P1C2/videos/cam02.mp4") == 1);
  CHECK(a.at("body.npz") == c.at("body.npz"));
  CHECK(a.at("P1C1/smplx.npz") != c.at("P1C1/smplx.npz"));
  CHECK(a.at("P1C1/videos/cam01.mp4") != c.at("P1C1/videos/cam01.mp4"));
  fs::remove_all(root);
}

TEST_CASE("options without a meaning are refused by name") {
  SyntheticOptions options;
  options.views = 0;
  CHECK_THROWS_WITH(write_synthetic_capture("unused", options), Catch::Contains("views is 0"));
  options.views = 1;
  options.height = -4;
  CHECK_THROWS_AS(synthetic_cameras(options), Error);
  CHECK_FALSE(fs::exists("unused"));
}

TEST_CASE("every camera sees the whole person, large in the picture") {
  SyntheticOptions options;
  const auto cameras = synthetic_cameras(options);
  REQUIRE(cameras.size() == 10);
  for (const MannequinSequence sequence : {MannequinSequence::Training, MannequinSequence::Novel}) {
    int outside = 0, points = 0;
    for (int frame = 0; frame < 48; ++frame) {
      const auto vertices =
          pose_body(undressed_body(), mannequin_motion(sequence, (frame + 0.5) / 48, 1, undressed_body().skeleton));
      for (const Camera& camera : cameras) {
        double top = 1e9, bottom = -1e9;
        for (size_t v = 0; v < vertices.size(); v += 7) {
          const Eigen::Vector3d p = camera.project(vertices[v]);
          outside += p.x() < 0 || p.x() > camera.width || p.y() < 0 || p.y() > camera.height;
          ++points;
          top = std::min(top, p.y());
          bottom = std::max(bottom, p.y());
        }
        CHECK(bottom - top > 0.70 * camera.height);
      }
    }
    CHECK(outside < 0.002 * points);  // a hand may leave a picture now and then
  }
}

TEST_CASE("the motion stands on the floor, differs between sequences and stays within its range") {
  std::array<double, mannequin_expression_count> largest{};
  double jaw = 0, elbow = 0, novel_elbow = 0, apart = 0;
  for (int frame = 0; frame < 48; ++frame) {
    const double time = (frame + 0.5) / 48;
    const MannequinPose training = mannequin_motion(MannequinSequence::Training, time, 1, undressed_body().skeleton);
    const MannequinPose novel = mannequin_motion(MannequinSequence::Novel, time, 1, undressed_body().skeleton);
    double lowest = 1e9;
    for (const auto& p : pose_body(undressed_body(), training)) lowest = std::min(lowest, p.y());
    CHECK(lowest > -0.06);
    CHECK(lowest < 0.04);
    for (int e = 0; e < mannequin_expression_count; ++e) largest[e] = std::max(largest[e], training.expression[e]);
    jaw = std::max(jaw, training.axis_angles[22].x());
    elbow = std::max(elbow, training.axis_angles[18].norm());
    novel_elbow = std::max(novel_elbow, novel.axis_angles[18].norm());
    apart += (training.axis_angles[16] - novel.axis_angles[16]).norm() / 48;
  }
  for (const double value : largest) CHECK(value > 0.6);  // the tour shows every expression
  CHECK(jaw > 0.25);
  CHECK(novel_elbow < elbow + 0.05);
  CHECK(apart > 0.2);
}

TEST_CASE("opening the jaw changes the mouth and nothing at the feet; the clothes fold with the elbow") {
  Camera camera = synthetic_cameras({}).at(5);
  const MannequinPose rest;
  MannequinPose open, bent;
  open.axis_angles[22] = {0.3, 0, 0};
  const RenderedPicture a = picture_of(rest, camera), b = picture_of(open, camera);
  CHECK(change_about(a, b, camera, {0, 1.550, 0.09}, 3) > 15);
  CHECK(change_about(a, b, camera, {0.12, 0.05, 0.1}, 6) == 0);
  CHECK(change_about(a, b, camera, {0, 1.72, 0.09}, 2) < 2);

  bent.axis_angles[18] = {-1.0, -0.9, 0};
  const Eigen::Vector3d crook(0.362, 1.205, 0.015);
  double straight_height = 0, bent_height = 0;
  for (int k = -20; k <= 20; ++k) {
    const Eigen::Vector3d p = crook + 0.003 * k * Eigen::Vector3d(0.66, -0.75, 0);
    straight_height += std::pow(fold_height(MannequinChart::LeftArm, p, rest), 2);
    bent_height += std::pow(fold_height(MannequinChart::LeftArm, p, bent), 2);
  }
  CHECK(bent_height > 4 * straight_height);
}

TEST_CASE("face codes follow the expression, not the view, and noise grows with the angle") {
  const MannequinFaceEncoder encoder;
  MannequinPose neutral, smile;
  smile.expression[static_cast<int>(MannequinExpression::Smile)] = 1;
  const auto distance = [](const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - b[i], 2);
    return std::sqrt(sum / static_cast<double>(a.size()));
  };
  const auto front = encoder.encode(neutral, 5, 1);
  CHECK(front.size() == 512);
  CHECK(front == encoder.encode(neutral, 5, 1));
  const double noise = distance(front, encoder.encode(neutral, 5, 2));
  const double side_noise = distance(front, encoder.encode(neutral, 58, 3));
  const double signal = distance(front, encoder.encode(smile, 5, 4));
  CHECK(side_noise > 2 * noise);
  CHECK(signal > 5 * noise);
  Camera camera = synthetic_cameras({}).at(0);
  CHECK(MannequinFaceEncoder::yaw(undressed_body().skeleton, neutral, camera) > 120);
}

TEST_CASE("a written capture reads back: same pictures, codes where the face shows, the body under the clothes") {
  const fs::path root = fs::temp_directory_path() / "degas_synthetic_capture_roundtrip";
  fs::remove_all(root);
  SyntheticOptions options;
  options.frames = 3;
  options.novel_frames = 1;
  options.views = 4;
  options.width = 120;
  options.height = 160;
  write_synthetic_capture(root, options);
  const DreamsCapture capture(root / "P1C1", {});
  const BodyModel model = BodyModel::load(root / "body.npz");
  CHECK(capture.frame_count() == 3);
  CHECK(capture.camera_names().size() == 4);
  CHECK(capture.face_code_size() == 512);
  CHECK(capture.flat_hand_mean());
  int codes = 0;
  for (int frame = 0; frame < 3; ++frame) {
    LitScene bare;  // the registered body as a silhouette
    for (const auto& p : model.posed_vertices(capture.pose(frame), capture.betas(), true)) {
      bare.positions.push_back(p.cast<float>());
    }
    bare.normals.assign(bare.positions.size(), Eigen::Vector3f::UnitY());
    bare.irradiance.assign(bare.positions.size(), Eigen::Vector3f::Zero());
    const std::vector<std::array<Eigen::Vector2f, 3>> corners(undressed_body().mesh.triangles.size());
    const MannequinTexture black{2, std::vector<Eigen::Vector4f>(4, Eigen::Vector4f::Zero())};
    bare.triangles = &undressed_body().mesh.triangles;
    bare.texture_coordinates = &corners;
    bare.texture = &black;
    for (int camera = 0; camera < 4; ++camera) {
      REQUIRE(capture.has_image(frame, camera));
      const Sample sample = capture.load(frame, camera);
      const RenderedPicture silhouette = rasterize(bare, sample.view, 2);
      int both = 0, either = 0;
      for (size_t i = 0; i < silhouette.alpha.size(); ++i) {
        const bool truth = sample.mask.pixels[i] > 127, drawn = silhouette.alpha[i] > 127;
        both += truth && drawn;
        either += truth || drawn;
      }
      CHECK(both > 0.75 * either);
      CHECK(both < 0.97 * either);  // clothes and hair are not in the body model
      codes += capture.face_code(frame, camera).has_value();
      CHECK_FALSE((camera == 0 && capture.face_code(frame, camera)));  // it stands behind
    }
  }
  CHECK(codes > 0);
  // The video keeps every bit of the picture.
  const MannequinPose state =
      mannequin_motion(MannequinSequence::Training, 0.5, options.seed, undressed_body().skeleton);
  LitScene scene = person().pose(state);
  light_scene(scene, person().shadow_casters(), studio_lights(), 1);
  const RenderedPicture expected = rasterize(scene, synthetic_cameras(options)[2], 3);
  const Sample sample = capture.load(1, 2);
  CHECK(sample.image.pixels == expected.rgb);
  CHECK(sample.mask.pixels == expected.alpha);
  fs::remove_all(root);
}
