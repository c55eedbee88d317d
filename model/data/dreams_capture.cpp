#include "model/data/dreams_capture.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <numeric>

#include "host/error.h"
#include "host/io/video.h"
#include "model/data/foreground.h"
#include "model/data/identity.h"

namespace degas {
namespace fs = std::filesystem;

struct DreamsCapture::Video {
  explicit Video(const fs::path& path) : path(path), reader(path) {}
  fs::path path;
  std::mutex mutex;
  VideoReader reader;
};

bool DreamsCapture::recognises(const fs::path& folder, bool incomplete) {
  return fs::is_regular_file(folder / "cameras.json") && (incomplete || fs::is_regular_file(folder / "capture.json"));
}

DreamsCapture::DreamsCapture(const fs::path& folder, const CaptureOptions& options)
    : folder_(folder),
      parameters_file_(frames_file(folder / "smplx.npz", options)),
      options_(options),
      lenses_(read_dreams_cameras(folder / "cameras.json")) {
  const auto is_read = [&](const fs::path& path) { return !options_.incomplete || fs::exists(path); };
  if (is_read(folder / "capture.json")) description_ = read_dreams_description(folder / "capture.json");
  if (is_read(parameters_file_)) parameters_ = read_smplx_parameters(parameters_file_, {}, options_.warn);
  for (size_t i = 0; i < lenses_.size(); ++i) names_.push_back(fmt::format("cam{:02d}", i));
  open_videos();
  if (!has_poses()) count_frames();
  codes_ =
      open_codes(folder, options_.codes, parameters_.frame_numbers, static_cast<int>(lenses_.size()), options_.warn);
  warn_of_offset();
  measure_background();
  make_identity();
}

DreamsCapture::~DreamsCapture() = default;

void DreamsCapture::open_videos() {
  const auto& listed = description_.cameras_present;
  std::vector<std::string> without;
  for (size_t i = 0; i < lenses_.size(); ++i) {
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
    if (has_poses()) check_length(*videos_.back());
    check_size(i);
  }
  if (without.size() == lenses_.size()) throw Error::format("{}: no camera has a video", (folder_ / "videos").string());
  if (!without.empty()) {
    options_.warn(
        fmt::format("{}: cameras without a video are skipped: {}", folder_.string(), fmt::join(without, ", ")));
  }
}

void DreamsCapture::check_size(size_t index) {
  const Camera& camera = lenses_[index].camera;
  const Video& video = *videos_[index];
  const int width = video.reader.width(), height = video.reader.height();
  const bool is_first = std::count(videos_.begin(), videos_.end(), nullptr) + 1 == std::ssize(videos_);
  const auto apart = [&](int side) { return std::abs(width - side); };
  if (is_first && options_.incomplete) has_mattes_ = apart(2 * camera.width) < apart(camera.width);
  // Encoders take even sizes only: an odd height has a row more in the video.
  const bool has_height = height == camera.height || height == camera.height + camera.height % 2;
  if (!has_mattes_) {
    if (width == camera.width && has_height) return;
    throw Error::format("{}: is {}x{}, but cameras.json has {}x{} for it; give w and h (and cx, cy) of these pictures",
                        video.path.string(), width, height, camera.width, camera.height);
  }
  if (width != 2 * description_.colour_width.value_or(width / 2) || width != 2 * camera.width || !has_height) {
    throw Error::format(
        "{}: is {}x{}, but colour and alpha of {}x{} (cameras.json) side by side (rgb_width {}) make {}x{}",
        video.path.string(), width, height, camera.width, camera.height, description_.colour_width.value_or(width / 2),
        2 * camera.width, camera.height);
  }
}

void DreamsCapture::count_frames() {
  int frames = std::numeric_limits<int>::max();
  for (const auto& video : videos_) {
    if (video) frames = std::min(frames, video->reader.frame_count());
  }
  parameters_.frame_numbers.resize(static_cast<size_t>(std::max(frames, 0)));
  std::iota(parameters_.frame_numbers.begin(), parameters_.frame_numbers.end(), 0);
}

void DreamsCapture::check_length(const Video& video) const {
  const auto& numbers = parameters_.frame_numbers;
  if (video.reader.frame_count() > numbers.back()) return;
  const auto covered = std::lower_bound(numbers.begin(), numbers.end(), video.reader.frame_count()) - numbers.begin();
  throw Error::format(
      "{}: has {} frames, but {} goes to frame {}; restore the video or cut the parameters to their first {} rows",
      video.path.string(), video.reader.frame_count(), parameters_file_.string(), numbers.back(), covered);
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
  const Lens& lens = lenses_[static_cast<size_t>(camera)];
  const Camera& view = lens.camera;
  Image8 frame;
  {
    const std::lock_guard lock(video.mutex);
    video.reader.seek(static_cast<int>(number));
    if (!video.reader.read(frame)) {
      throw Error::format("{}: frame {} cannot be decoded; the file is damaged or cut short", video.path.string(),
                          number);
    }
  }
  Image8 colour = cropped(frame, 0, 0, view.width, view.height);
  Image8 alpha = Image8::black(view.width, view.height, 1);
  for (int y = 0; y < view.height && has_mattes_; ++y) {
    const uint8_t* right = frame.at(view.width, y);
    for (int x = 0; x < view.width; ++x) *alpha.at(x, y) = right[3 * x + 1];
  }
  if (!has_mattes_) std::fill(alpha.pixels.begin(), alpha.pixels.end(), uint8_t{255});
  return {undistorted(colour, lens), undistorted(alpha, lens)};
}

void DreamsCapture::measure_background() {
  if (description_.background) {
    background_ = *description_.background;
    return;
  }
  // Not said: seen on the first picture there is, in the pixels that alpha calls empty.
  for (int camera = 0; camera < static_cast<int>(lenses_.size()); ++camera) {
    for (int frame = 0; frame < frame_count(); ++frame) {
      if (!has_image(frame, camera)) continue;
      const auto [colour, alpha] = halves(video_frame(frame), camera);
      background_ = measured_background(colour, alpha);
      return;
    }
  }
}

Sample DreamsCapture::load(int frame, int camera) const {
  if (frame < 0 || frame >= frame_count() || camera < 0 || camera >= static_cast<int>(lenses_.size())) {
    throw Error::format("{}: no frame {} of camera {}; there are {} frames and {} cameras", folder_.string(), frame,
                        camera, frame_count(), lenses_.size());
  }
  const std::string& name = names_[static_cast<size_t>(camera)];
  if (!has_image(frame, camera)) {
    throw Error::format("{}: {} has no picture of frame {}: {}", folder_.string(), name, frame,
                        videos_[static_cast<size_t>(camera)] ? "its video does not reach there" : "it has no video");
  }
  auto [colour, alpha] = halves(video_frame(frame), camera);
  return make_sample({frame, camera}, this->camera(camera), std::move(colour), alpha, background_,
                     videos_[static_cast<size_t>(camera)]->path.string(), name);
}

void DreamsCapture::make_identity() {
  Identity identity;
  identity.add("dreams 1");
  identity.add(fmt::format("{:.17g} {}", options_.image_scale, static_cast<int>(background_)));
  for (const fs::path& file : {folder_ / "cameras.json", folder_ / "capture.json", parameters_file_}) {
    if (!options_.incomplete || fs::exists(file)) identity.add_file(file);
  }
  for (const auto& video : videos_) {
    if (video) identity.add_file(video->path);
  }
  picture_identity_ = identity.text();
  for (const fs::path& file : codes_->files()) identity.add_file(file);
  identity_ = identity.text();
}

}  // namespace degas
