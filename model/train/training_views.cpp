#include "model/train/training_views.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "host/error.h"

namespace degas {
namespace {

constexpr int validation_stride = 16;
constexpr uint8_t least_alpha = 16;  // above the ringing of a lossy alpha video

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

std::vector<int> chosen_frames(const Capture& capture, const DataConfig& data) {
  std::vector<int> frames = data.frames;
  if (frames.empty()) {
    frames.resize(capture.frame_count());
    std::iota(frames.begin(), frames.end(), 0);
  }
  for (auto frame = frames.begin(); frame != frames.end(); ++frame) {
    if (*frame < 0 || *frame >= capture.frame_count()) {
      throw Error::format("data.frames: no frame {}; the capture has 0 .. {}", *frame, capture.frame_count() - 1);
    }
    if (std::find(frames.begin(), frame, *frame) != frame) {
      throw Error::format("data.frames: frame {} twice; name each once", *frame);
    }
  }
  return frames;
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

std::vector<int> camera_indices(const Capture& capture, const std::vector<std::string>& names,
                                const std::string& option) {
  const std::vector<std::string>& known = capture.camera_names();
  std::vector<int> indices;
  for (const std::string& name : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw Error::format("{}: no camera '{}'; cameras here: {}", option, name, fmt::join(known, ", "));
    const int index = static_cast<int>(found - known.begin());
    if (contains(indices, index)) throw Error::format("{}: camera '{}' twice; name each once", option, name);
    indices.push_back(index);
  }
  return indices;
}

std::vector<int> allowed_cameras(const Capture& capture, const DataConfig& data) {
  std::vector<int> allowed = camera_indices(capture, data.cameras, "data.cameras");
  if (data.cameras.empty()) {
    allowed.resize(capture.camera_names().size());
    std::iota(allowed.begin(), allowed.end(), 0);
  }
  const std::vector<int> held_out = camera_indices(capture, data.hold_out, "data.hold_out");
  std::erase_if(allowed, [&](int camera) { return contains(held_out, camera); });
  if (allowed.empty()) throw Error("data.hold_out: leaves no camera to train on; hold out fewer");
  return allowed;
}

TrainingViews::TrainingViews(const Capture& capture, const DataConfig& data) {
  const std::vector<int> allowed = allowed_cameras(capture, data);
  const std::vector<int> set_aside = camera_indices(capture, data.validation, "data.validation");
  for (int frame : chosen_frames(capture, data)) {
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
