#include "model/data/synthetic_capture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <thread>

#include "host/error.h"
#include "host/random.h"
#include "model/data/dreams_writer.h"
#include "model/data/mannequin_code.h"
#include "model/data/mannequin_motion.h"

namespace degas {
namespace {

using Eigen::Vector3d;
constexpr double frames_per_second = 10;
constexpr int supersampling = 3;

void check(const SyntheticOptions& options) {
  const auto require = [](const char* name, int value, int low, int high) {
    if (value >= low && value <= high) return;
    throw Error::format("synthetic capture: {} is {}; it must be between {} and {}", name, value, low, high);
  };
  require("frames", options.frames, 1, 100000);
  require("novel frames", options.novel_frames, 1, 100000);
  require("views", options.views, 1, 100);
  require("width", options.width, 16, 8192);
  require("height", options.height, 16, 8192);
}

Pose body_parameters(const MannequinPose& state) {
  Pose pose;
  pose.axis_angles.assign(state.axis_angles.begin(), state.axis_angles.end());
  pose.translation = state.translation;
  pose.expression.assign(state.expression.begin(), state.expression.end());
  return pose;
}

/// One sequence: its lit scene per frame serves all cameras.
class SequenceWriter {
 public:
  SequenceWriter(const MannequinBody& body, const DressedMannequin& person, const SyntheticOptions& options)
      : body_(body),
        person_(person),
        options_(options),
        cameras_(synthetic_cameras(options)),
        lights_(studio_lights()) {}

  void write(const std::filesystem::path& folder, MannequinSequence sequence, int frames,
             const std::function<void()>& picture_done) const {
    DreamsWriter writer(folder, cameras_, frames_per_second);
    const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    std::vector<Pose> poses;
    std::mutex mutex;
    for (int frame = 0; frame < frames; ++frame) {
      const double time = (frame + 0.5) / frames;
      const MannequinPose state = mannequin_motion(sequence, time, options_.seed, body_.skeleton);
      poses.push_back(body_parameters(state));
      LitScene scene = person_.pose(state);
      light_scene(scene, person_.shadow_casters(), lights_, threads);
      for_each_parallel(static_cast<int>(cameras_.size()), threads, [&](int camera) {
        const RenderedPicture picture = rasterize(scene, cameras_[camera], supersampling);
        writer.write_frame(camera, {picture.width, picture.height, 3, picture.rgb},
                           {picture.width, picture.height, 1, picture.alpha});
        const std::lock_guard lock(mutex);
        picture_done();
      });
      for (int camera = 0; camera < static_cast<int>(cameras_.size()); ++camera) {
        const double yaw = MannequinFaceEncoder::yaw(body_.skeleton, state, cameras_[camera]);
        if (yaw > MannequinFaceEncoder::largest_yaw) continue;
        const uint64_t view = static_cast<uint64_t>(frame) * 1000 + static_cast<uint64_t>(camera);
        const uint64_t stream = options_.seed * 4 + (sequence == MannequinSequence::Novel ? 3 : 2);
        writer.write_code(frame, camera, encoder_.encode(state, yaw, stream * 0xD1B54A32D192ED03ULL + view * 7919));
      }
    }
    writer.finish(poses, {}, true);
  }

 private:
  const MannequinBody& body_;
  const DressedMannequin& person_;
  SyntheticOptions options_;
  std::vector<Camera> cameras_;
  std::vector<DirectionalLight> lights_;
  MannequinFaceEncoder encoder_;
};

}  // namespace

std::vector<Camera> synthetic_cameras(const SyntheticOptions& options) {
  check(options);
  Random random(options.seed * 77 + 5);
  constexpr std::array<double, 5> heights{1.25, 0.75, 1.60, 1.05, 1.85};
  constexpr double seen_height = 2.0, person_middle = 0.885;
  std::vector<Camera> cameras;
  for (int i = 0; i < options.views; ++i) {
    const double s = (2 * i + 1.0) / options.views - 1;  // -1 .. 1
    const double yaw = std::numbers::pi * (0.55 * s + 0.45 * s * s * s) + 0.04 * (random.uniform() - 0.5);
    const double distance = 3.2 + 0.5 * random.uniform();
    Camera camera;
    camera.width = options.width;
    camera.height = options.height;
    // Arms may reach to the side: narrow pictures see less height instead of cutting hands.
    const double span = std::max(seen_height, 1.44 * options.height / options.width);
    const double focal = options.height / span * distance;
    camera.fx = focal * (1 + 0.01 * (random.uniform() - 0.5));
    camera.fy = focal;
    const double off_x = 0.10 * (random.uniform() - 0.5) * options.width;
    const double off_y = 0.08 * (random.uniform() - 0.5) * options.height;
    camera.cx = 0.5 * options.width + off_x;
    camera.cy = 0.5 * options.height + off_y;
    const double height = heights[static_cast<size_t>(i) % heights.size()] + 0.1 * (random.uniform() - 0.5);
    const Vector3d center(distance * std::sin(yaw), height, distance * std::cos(yaw)), middle(0, person_middle, 0);
    // Aim beside the person by as much as the principal point is off, so that the person stands in the middle.
    const auto axes = [&](const Vector3d& target) {
      Eigen::Matrix3d rotation;
      const Vector3d forward = (target - center).normalized(), right = forward.cross(Vector3d::UnitY()).normalized();
      rotation.row(0) = right;
      rotation.row(1) = forward.cross(right);
      rotation.row(2) = forward;
      return rotation;
    };
    const Eigen::Matrix3d straight = axes(middle);
    camera.rotation = axes(
        middle + distance * (off_x / camera.fx * straight.row(0) + off_y / camera.fy * straight.row(1)).transpose());
    camera.translation = -camera.rotation * center;
    cameras.push_back(camera);
  }
  return cameras;
}

void write_synthetic_capture(const std::filesystem::path& directory, const SyntheticOptions& options,
                             const std::function<void(int, int)>& progress) {
  check(options);
  std::error_code failure;
  std::filesystem::create_directories(directory, failure);
  if (failure) throw Error::format("{}: cannot be made: {}", directory.string(), failure.message());
  const MannequinBody body = build_mannequin();
  write_mannequin_body(directory / "body.npz", body);
  const DressedMannequin person(body);
  const SequenceWriter sequences(body, person, options);
  const int total = options.views * (options.frames + options.novel_frames);
  int done = 0;
  const auto picture_done = [&] {
    ++done;
    if (progress) progress(done, total);
  };
  sequences.write(directory / "P1C1", MannequinSequence::Training, options.frames, picture_done);
  sequences.write(directory / "P1C2", MannequinSequence::Novel, options.novel_frames, picture_done);
}

}  // namespace degas
