#include "model/data/dreams_capture.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <mutex>

#include "host/error.h"
#include "host/io/video.h"
#include "model/data/identity.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

/// Alpha from which a pixel counts as the person's when a mask is asked whether it is empty.
constexpr int opaque = 128;

/// Turns the colour half into colour times alpha, in place.
void premultiply(Image8& colour, const Image8& alpha, DreamsBackground background) {
  for (size_t i = 0; i < alpha.pixels.size(); ++i) {
    const int a = alpha.pixels[i];
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const int value = colour.pixels[c];
      // Over paper of colour B the video holds alpha F + (1 - alpha) B. Compression leaves values beyond 0..alpha.
      const int foreground = background == DreamsBackground::White   ? value - (255 - a)
                             : background == DreamsBackground::Black ? value
                                                                     : (value * a + 127) / 255;
      colour.pixels[c] = static_cast<uint8_t>(std::clamp(foreground, 0, a));
    }
  }
}

}  // namespace

struct DreamsCapture::Video {
  explicit Video(const fs::path& path) : path(path), reader(path) {}
  fs::path path;
  std::mutex mutex;
  VideoReader reader;
};

bool DreamsCapture::recognises(const fs::path& folder) {
  return fs::is_regular_file(folder / "cameras.json") && fs::is_regular_file(folder / "capture.json");
}

DreamsCapture::DreamsCapture(const fs::path& folder, const CaptureOptions& options)
    : folder_(folder),
      options_(options),
      cameras_(read_dreams_cameras(folder / "cameras.json")),
      description_(read_dreams_description(folder / "capture.json")),
      parameters_(read_dreams_parameters(folder / options.parameters)),
      codes_(folder, parameters_.frame_numbers, static_cast<int>(cameras_.size())) {
  if (!options_.warn) options_.warn = [](const std::string& text) { fmt::print(stderr, "warning: {}\n", text); };
  for (size_t i = 0; i < cameras_.size(); ++i) names_.push_back(fmt::format("cam{:02d}", i));
  open_videos();
  measure_background();
  make_identity();
}

DreamsCapture::~DreamsCapture() = default;

void DreamsCapture::open_videos() {
  const auto& listed = description_.cameras_present;
  std::vector<std::string> without;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    videos_.emplace_back();
    const fs::path path = folder_ / "videos" / (names_[i] + ".mp4");
    const bool present = listed && std::find(listed->begin(), listed->end(), static_cast<int>(i)) != listed->end();
    if (listed && !present) continue;
    if (!fs::exists(path)) {
      if (present) {
        throw Error::format(
            "{}: no such file, but {} lists camera {} in cameras_present; restore the video or shorten the list",
            path.string(), (folder_ / "capture.json").string(), i);
      }
      without.push_back(names_[i]);
      continue;
    }
    videos_.back() = std::make_unique<Video>(path);
    check_length(*videos_.back());
    const Camera& camera = cameras_[i];
    const int width = videos_.back()->reader.width(), height = videos_.back()->reader.height();
    // Encoders take even sizes only: an odd height has a row more in the video.
    if (width != 2 * description_.colour_width.value_or(width / 2) || width != 2 * camera.width ||
        height != camera.height + camera.height % 2) {
      throw Error::format(
          "{}: is {}x{}, but colour and alpha of {}x{} (cameras.json) side by side (rgb_width {}) make {}x{}",
          path.string(), width, height, camera.width, camera.height, description_.colour_width.value_or(width / 2),
          2 * camera.width, camera.height);
    }
  }
  if (without.size() == cameras_.size())
    throw Error::format("{}: no camera has a video", (folder_ / "videos").string());
  if (!without.empty()) {
    options_.warn(
        fmt::format("{}: cameras without a video are skipped: {}", folder_.string(), fmt::join(without, ", ")));
  }
  warn_of_offset();
}

void DreamsCapture::check_length(const Video& video) const {
  const auto& numbers = parameters_.frame_numbers;
  if (video.reader.frame_count() > numbers.back()) return;
  const auto covered = std::lower_bound(numbers.begin(), numbers.end(), video.reader.frame_count()) - numbers.begin();
  throw Error::format(
      "{}: has {} frames, but {} goes to frame {}; restore the video or cut the parameters to their first {} rows",
      video.path.string(), video.reader.frame_count(), (folder_ / options_.parameters).string(), numbers.back(),
      covered);
}

void DreamsCapture::warn_of_offset() const {
  int lost = 0;
  for (int frame = 0; frame < frame_count(); ++frame) {
    bool reached = true;
    for (int camera = 0; camera < static_cast<int>(videos_.size()); ++camera) {
      if (videos_[static_cast<size_t>(camera)]) reached = reached && has_image(frame, camera);
    }
    lost += !reached;
  }
  if (lost == 0) return;
  options_.warn(fmt::format("{}: offset_d = {} puts {} of {} frames outside of the videos; their pictures are skipped",
                            folder_.string(), description_.frame_offset, lost, frame_count()));
}

int64_t DreamsCapture::video_frame(int frame) const {
  return parameters_.frame_numbers.at(static_cast<size_t>(frame)) + description_.frame_offset;
}

bool DreamsCapture::has_image(int frame, int camera) const {
  const auto& video = videos_.at(static_cast<size_t>(camera));
  const int64_t number = video_frame(frame);
  return video && number >= 0 && number < video->reader.frame_count();
}

std::pair<Image8, Image8> DreamsCapture::halves(int64_t number, int camera) const {
  Video& video = *videos_[static_cast<size_t>(camera)];
  const Camera& view = cameras_[static_cast<size_t>(camera)];
  Image8 frame;
  {
    const std::lock_guard lock(video.mutex);
    video.reader.seek(static_cast<int>(number));
    if (!video.reader.read(frame)) {
      throw Error::format("{}: frame {} cannot be decoded; the file is damaged or cut short", video.path.string(),
                          number);
    }
  }
  std::pair<Image8, Image8> halves{cropped(frame, 0, 0, view.width, view.height),
                                   Image8::black(view.width, view.height, 1)};
  for (int y = 0; y < view.height; ++y) {
    const uint8_t* right = frame.at(view.width, y);
    for (int x = 0; x < view.width; ++x) *halves.second.at(x, y) = right[3 * x + 1];
  }
  return halves;
}

void DreamsCapture::measure_background() {
  if (description_.background) {
    background_ = *description_.background;
    return;
  }
  // Not said: seen on the first picture there is, in the pixels that alpha calls empty.
  for (int camera = 0; camera < static_cast<int>(cameras_.size()); ++camera) {
    for (int frame = 0; frame < frame_count(); ++frame) {
      if (!has_image(frame, camera)) continue;
      const auto [colour, alpha] = halves(video_frame(frame), camera);
      size_t outside = 0, white = 0, black = 0;
      for (size_t i = 0; i < alpha.pixels.size(); ++i) {
        if (alpha.pixels[i] > 2) continue;
        const auto [low, high] =
            std::minmax({colour.pixels[3 * i], colour.pixels[3 * i + 1], colour.pixels[3 * i + 2]});
        ++outside;
        white += low > 225;
        black += high < 30;
      }
      if (10 * white > 9 * outside)
        background_ = DreamsBackground::White;
      else if (10 * black >= 9 * outside)
        background_ = DreamsBackground::Black;
      else
        background_ = DreamsBackground::Scene;
      return;
    }
  }
}

Sample DreamsCapture::load(int frame, int camera) const {
  if (frame < 0 || frame >= frame_count() || camera < 0 || camera >= static_cast<int>(cameras_.size())) {
    throw Error::format("{}: no frame {} of camera {}; there are {} frames and {} cameras", folder_.string(), frame,
                        camera, frame_count(), cameras_.size());
  }
  const std::string& name = names_[static_cast<size_t>(camera)];
  if (!has_image(frame, camera)) {
    throw Error::format("{}: {} has no picture of frame {}: {}", folder_.string(), name, frame,
                        videos_[static_cast<size_t>(camera)] ? "its video does not reach there" : "it has no video");
  }
  auto [colour, alpha] = halves(video_frame(frame), camera);
  if (*std::max_element(alpha.pixels.begin(), alpha.pixels.end()) < opaque) {
    throw Error::format("{}: frame {} of {} has an empty mask", videos_[static_cast<size_t>(camera)]->path.string(),
                        frame, name);
  }
  premultiply(colour, alpha, background_);
  const Camera view = this->camera(camera);
  return {frame, camera, view, resized(colour, view.width, view.height), resized(alpha, view.width, view.height)};
}

void DreamsCapture::make_identity() {
  Identity identity;
  identity.add("dreams 1");
  identity.add(fmt::format("{:.17g} {}", options_.image_scale, static_cast<int>(background_)));
  for (const fs::path& file : {folder_ / "cameras.json", folder_ / "capture.json", folder_ / options_.parameters}) {
    identity.add_file(file);
  }
  for (const auto& video : videos_) {
    if (video) identity.add_file(video->path);
  }
  for (const fs::path& file : codes_.files()) identity.add_file(file);
  identity_ = identity.text();
}

}  // namespace degas
