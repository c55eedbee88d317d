#include "model/train/training_views.h"

#include <algorithm>

#include "host/error.h"
#include "model/data/selection.h"

namespace degas {
namespace {

constexpr int validation_stride = 16;
constexpr uint8_t least_alpha = 16;  // above the ringing of a lossy alpha video

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

/// Smallest size, in steps of 16 pixels, that holds the person's box with its margin in every training picture. One
/// size for all pictures, so that every step needs the same device memory.
void find_window(const Capture& capture, const DataConfig& data, TrainingViews& views) {
  const auto padded = [&](int side) { return (side + 2 * data.crop_margin + 15) / 16 * 16; };
  for (const LoadRequest& frame : views.training) {
    for (int camera : frame.cameras) {
      const Rectangle box = mask_box(capture.load(frame.frame, camera).mask);
      views.window_width = std::max(views.window_width, padded(box.width));
      views.window_height = std::max(views.window_height, padded(box.height));
    }
  }
}

}  // namespace

Config with_camera_names(Config config, const Capture& capture) {
  const std::vector<std::string>& known = capture.camera_names();
  const auto write_out = [&](std::vector<std::string>& list, const char* key) {
    if (list.empty()) return;
    std::vector<std::string> names;
    for (const int camera : selected_cameras(list, known, key)) names.push_back(known[static_cast<size_t>(camera)]);
    list = std::move(names);
  };
  write_out(config.data.cameras, "data.cameras");
  write_out(config.data.hold_out, "data.hold_out");
  write_out(config.data.validation, "data.validation");
  return config;
}

std::vector<int> allowed_cameras(const Capture& capture, const DataConfig& data) {
  std::vector<int> allowed = selected_cameras(data.cameras, capture.camera_names(), "data.cameras");
  if (!data.hold_out.empty()) {
    const std::vector<int> held_out = selected_cameras(data.hold_out, capture.camera_names(), "data.hold_out");
    std::erase_if(allowed, [&](int camera) { return contains(held_out, camera); });
  }
  if (allowed.empty()) throw Error("data.hold_out: leaves no camera to train on; hold out fewer");
  return allowed;
}

TrainingViews::TrainingViews(const Capture& capture, const DataConfig& data) {
  const std::vector<int> allowed = allowed_cameras(capture, data);
  std::vector<int> set_aside;
  if (!data.validation.empty()) {
    set_aside = selected_cameras(data.validation, capture.camera_names(), "data.validation");
  }
  for (int frame : selected_frames(data.frames, capture.frame_count(), "data.frames")) {
    LoadRequest views{frame, {}};
    for (int camera : allowed) {
      if (!capture.has_image(frame, camera)) continue;
      if (contains(set_aside, camera)) {
        validation.push_back({frame, camera});
      } else {
        views.cameras.push_back(camera);
      }
    }
    // A small sample of pictures that training never sees, of another camera each time.
    if (set_aside.empty() && frame % validation_stride == validation_stride / 2 && views.cameras.size() > 2) {
      const auto chosen = views.cameras.begin() + frame / validation_stride % static_cast<int>(views.cameras.size());
      validation.push_back({frame, *chosen});
      views.cameras.erase(chosen);
    }
    if (!views.cameras.empty()) training.push_back(views);
  }
  if (!set_aside.empty() && validation.empty()) {
    throw Error(
        "data.validation: none of its cameras has a picture that training may use; name cameras that are not held out");
  }
  if (training.empty()) throw Error("the capture has no picture to train on: every chosen frame and camera lacks one");
  if (data.crop_to_person) find_window(capture, data, *this);
}

Rectangle mask_box(const Image8& mask) {
  int left = mask.width, right = -1, top = mask.height, bottom = -1;
  for (int y = 0; y < mask.height; ++y) {
    const uint8_t* row = mask.at(0, y);
    for (int x = 0; x < mask.width; ++x) {
      if (row[x] < least_alpha) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = y;
    }
  }
  if (right < 0) return {0, 0, mask.width, mask.height};
  return {left, top, right - left + 1, bottom - top + 1};
}

Rectangle window_around(const Rectangle& box, int window_width, int window_height, int width, int height) {
  window_width = std::min(window_width, width);
  window_height = std::min(window_height, height);
  const int left = box.left + box.width / 2 - window_width / 2, top = box.top + box.height / 2 - window_height / 2;
  return {std::clamp(left, 0, width - window_width), std::clamp(top, 0, height - window_height), window_width,
          window_height};
}

}  // namespace degas
