#include "model/inspect/view_choice.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/data/selection.h"

namespace degas {
namespace {

constexpr int most_cameras = 40, most_drawn = 24, most_frames = 12, about_pictures = 160;

/// Ascending numbers as "3, 7-9".
std::string ranges_text(const std::vector<int>& numbers) {
  std::string text;
  for (size_t i = 0; i < numbers.size();) {
    size_t end = i;
    while (end + 1 < numbers.size() && numbers[end + 1] == numbers[end] + 1) ++end;
    if (!text.empty()) text += ", ";
    text += end == i ? fmt::format("{}", numbers[i]) : fmt::format("{}-{}", numbers[i], numbers[end]);
    i = end + 1;
  }
  return text;
}

}  // namespace

std::vector<int> spread(const std::vector<int>& items, int count) {
  const int size = static_cast<int>(items.size());
  if (size <= count) return items;
  std::vector<int> chosen;
  for (int k = 0; k < count; ++k) chosen.push_back(items[static_cast<size_t>((2 * k + 1) * size / (2 * count))]);
  return chosen;
}

std::vector<CameraFindings> list_cameras(const Capture& capture) {
  std::vector<CameraFindings> cameras;
  for (int camera = 0; camera < static_cast<int>(capture.camera_names().size()); ++camera) {
    CameraFindings found;
    found.name = capture.camera_names()[static_cast<size_t>(camera)];
    found.camera = capture.camera(camera);
    std::vector<int> gaps;
    for (int frame = 0; frame < capture.frame_count(); ++frame) {
      const bool there = capture.has_image(frame, camera);
      found.pictures += there;
      if (!there) gaps.push_back(frame);
      found.codes += capture.face_code_size() > 0 && capture.has_face_code(frame, camera);
    }
    found.gaps = ranges_text(gaps);
    cameras.push_back(found);
  }
  return cameras;
}

ChosenViews choose_views(const Capture& capture, const std::vector<std::string>& cameras,
                         const std::vector<std::string>& frames) {
  ChosenViews chosen;
  chosen.cameras = selected_cameras(cameras, capture.camera_names(), "--cameras");
  chosen.frames = selected_frames(frames, capture.frame_count(), "--frames");
  if (cameras.empty()) {
    std::erase_if(chosen.cameras, [&](int camera) {
      return !std::any_of(chosen.frames.begin(), chosen.frames.end(),
                          [&](int frame) { return capture.has_image(frame, camera); });
    });
    chosen.cameras = spread(chosen.cameras, most_cameras);
  }
  if (frames.empty()) {
    const int count = std::max<int>(1, static_cast<int>(chosen.cameras.size()));
    chosen.frames = spread(chosen.frames, std::clamp(about_pictures / count, 2, most_frames));
  }
  std::sort(chosen.frames.begin(), chosen.frames.end());
  const std::vector<int> drawn = spread(chosen.cameras, most_drawn);
  for (size_t i = 0; i < drawn.size(); ++i) {
    for (size_t k = 0; k < chosen.frames.size(); ++k) {
      const int frame = chosen.frames[(5 * i + k) % chosen.frames.size()];
      if (!capture.has_image(frame, drawn[i])) continue;
      chosen.drawn.emplace_back(frame, drawn[i]);
      break;
    }
  }
  return chosen;
}

}  // namespace degas
