#pragma once

#include <filesystem>

#include "model/data/dreams_writer.h"

namespace degas::test {

/// Sizes of the capture that write_small_capture makes.
inline constexpr int small_width = 21, small_height = 13, small_frames = 6, small_cameras = 3;

/// A camera of the small capture: turned about the vertical axis, principal point off the centre.
inline Camera small_camera(int index) {
  Camera camera;
  camera.width = small_width;
  camera.height = small_height;
  camera.fx = 30 + index;
  camera.fy = 31;
  camera.cx = 9.5;
  camera.cy = 7;
  const double angle = 0.4 * index;
  camera.rotation << std::cos(angle), 0, std::sin(angle), 0, -1, 0, std::sin(angle), 0, -std::cos(angle);
  camera.translation = {0.1 * index, 1.2, 3};
  return camera;
}

/// Alpha of a pixel: a box that moves with the frame, soft at its left side.
inline uint8_t small_alpha(int frame, int x, int y) {
  const int left = 3 + frame;
  if (y < 2 || y > 10 || x < left || x > left + 8) return 0;
  return x == left ? 90 : 255;
}

inline Image8 small_mask(int frame) {
  Image8 mask = Image8::black(small_width, small_height, 1);
  for (int y = 0; y < small_height; ++y) {
    for (int x = 0; x < small_width; ++x) *mask.at(x, y) = small_alpha(frame, x, y);
  }
  return mask;
}

inline Image8 small_image(int frame, int camera) {
  Image8 image = Image8::black(small_width, small_height, 3);
  for (int y = 0; y < small_height; ++y) {
    for (int x = 0; x < small_width; ++x) {
      const int alpha = small_alpha(frame, x, y);
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = static_cast<uint8_t>((17 * x + 31 * y + 50 * c + 90 * camera) % 256 * alpha / 255);
    }
  }
  return image;
}

inline std::vector<Pose> small_poses() {
  std::vector<Pose> poses(small_frames);
  for (int frame = 0; frame < small_frames; ++frame) {
    Pose& pose = poses[static_cast<size_t>(frame)];
    for (int joint = 0; joint < 55; ++joint)
      pose.axis_angles.push_back(Eigen::Vector3d(0.01 * joint, 0.1 * frame, -0.25));
    pose.translation = {0.5, 1.0 * frame, -1};
    pose.expression = {0.5, -0.25 * frame};
  }
  return poses;
}

/// 3 cameras, of which camera 2 has no video; codes of 4 numbers for cameras 0 and 2, none in frame 3.
inline void write_small_capture(const std::filesystem::path& folder) {
  DreamsWriter writer(folder, {small_camera(0), small_camera(1), small_camera(2)}, 30);
  for (int frame = 0; frame < small_frames; ++frame) {
    for (int camera = 0; camera < 2; ++camera)
      writer.write_frame(camera, small_image(frame, camera), small_mask(frame));
    const std::vector<float> code = {static_cast<float>(frame), 1, 2, 3};
    if (frame != 3) writer.write_code(frame, 0, code);
    if (frame != 3) writer.write_code(frame, 2, code);
  }
  writer.finish(small_poses(), {0.5, -1}, true);
}

}  // namespace degas::test
