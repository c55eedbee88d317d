#include "model/data/picture_capture.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "host/error.h"
#include "model/data/identity.h"

namespace degas {
namespace fs = std::filesystem;

PictureCapture::PictureCapture(PictureLayout layout, const CaptureOptions& options)
    : layout_(std::move(layout)), options_(options) {
  size_t pictures = 0, masks = 0;
  for (const PictureLayout::View& view : layout_.views) {
    names_.push_back(view.name);
    pictures += view.pictures.numbers().size();
    masks += view.masks.numbers().size();
  }
  const PictureLayout::View& first = layout_.views.front();
  if (pictures == 0) {
    throw Error::format("{}: no camera has a picture; the first would be {}", layout_.folder.string(),
                        first.pictures.path(0).string());
  }
  if (masks == 0 && !options_.incomplete) {
    throw Error::format("{}: no camera has a mask; the first would be {}: cut the person out before training",
                        layout_.folder.string(), first.masks.path(0).string());
  }
  has_masks_ = masks > 0;
  read_parameters();
  warn_of_gaps();
  measure_background();
  codes_ = open_codes(layout_.folder, options_.codes, parameters_.frame_numbers, static_cast<int>(names_.size()),
                      options_.warn);
  make_identity();
}

void PictureCapture::read_parameters() {
  layout_.parameters = frames_file(layout_.parameters, options_);
  const bool is_there = fs::exists(layout_.parameters);
  if (!is_there && !options_.incomplete) {
    throw Error::format(
        "{}: no such file; recordings come without body fits now and then: fit SMPL-X to it, or take the fit of a "
        "project that did (docs/captures.md), by this name or by --poses",
        layout_.parameters.string());
  }
  if (is_there) {
    parameters_ = read_smplx_parameters(layout_.parameters, layout_.conventions, options_.warn);
    return;
  }
  std::set<int64_t> numbers;
  for (const PictureLayout::View& view : layout_.views) {
    numbers.insert(view.pictures.numbers().begin(), view.pictures.numbers().end());
  }
  parameters_.frame_numbers.assign(numbers.begin(), numbers.end());
}

void PictureCapture::warn_of_gaps() const {
  std::vector<std::string> empty, gaps;
  for (int camera = 0; camera < static_cast<int>(names_.size()); ++camera) {
    const PictureLayout::View& view = layout_.views[static_cast<size_t>(camera)];
    if (view.pictures.numbers().empty()) {
      empty.push_back(view.name);
      continue;
    }
    int missing = 0;
    for (const int64_t number : parameters_.frame_numbers) {
      const bool there = view.pictures.contains(number) && (!has_masks_ || view.masks.contains(number));
      missing += !there && layout_.excluded.count({camera, number}) == 0;
    }
    if (missing > 0) gaps.push_back(fmt::format("{} {}", view.name, missing));
  }
  if (!empty.empty()) {
    options_.warn(
        fmt::format("{}: cameras without pictures are skipped: {}", layout_.folder.string(), fmt::join(empty, ", ")));
  }
  if (!gaps.empty()) {
    options_.warn(fmt::format("{}: of {} frames, so many lack a picture or a mask and are skipped: {}",
                              layout_.folder.string(), frame_count(), fmt::join(gaps, ", ")));
  }
}

bool PictureCapture::has_image(int frame, int camera) const {
  const PictureLayout::View& view = layout_.views.at(static_cast<size_t>(camera));
  const int64_t number = parameters_.frame_numbers.at(static_cast<size_t>(frame));
  return view.pictures.contains(number) && (!has_masks_ || view.masks.contains(number)) &&
         layout_.excluded.count({camera, number}) == 0;
}

std::pair<Image8, Image8> PictureCapture::read(int frame, int camera) const {
  const PictureLayout::View& view = layout_.views[static_cast<size_t>(camera)];
  const Camera& size = view.lens.camera;
  const int64_t number = parameters_.frame_numbers[static_cast<size_t>(frame)];
  const auto read_checked = [&](const NumberedFiles& files, int channels) {
    const fs::path path = files.path(number);
    const Image8 image = read_image(path, channels);
    if (image.width != size.width || image.height != size.height) {
      throw Error::format("{}: is {}x{}, but the calibration of {} says {}x{}; take the calibration of this size",
                          path.string(), image.width, image.height, view.name, size.width, size.height);
    }
    return undistorted(image, view.lens);
  };
  Image8 alpha;
  if (has_masks_) {
    alpha = read_checked(view.masks, 1);
  } else {
    alpha = Image8::black(size.width, size.height, 1);
    std::fill(alpha.pixels.begin(), alpha.pixels.end(), uint8_t{255});
  }
  if (layout_.hard_masks) {
    for (uint8_t& value : alpha.pixels) value = value >= 128 ? 255 : 0;
  }
  return {read_checked(view.pictures, 3), std::move(alpha)};
}

void PictureCapture::measure_background() {
  // A damaged picture is told when it is asked for; so many are a wrong calibration, say, and all would take hours.
  constexpr int most_damaged = 100;
  std::optional<Error> first_damage;
  int damaged = 0;
  for (int frame = 0; frame < frame_count(); ++frame) {
    for (int camera = 0; camera < static_cast<int>(names_.size()); ++camera) {
      if (!has_image(frame, camera)) continue;
      try {
        const auto [colour, alpha] = read(frame, camera);
        background_ = measured_background(colour, alpha);
        return;
      } catch (const Error& damage) {
        if (!first_damage) first_damage = damage;
        if (++damaged == most_damaged) throw *first_damage;
      }
    }
  }
  if (first_damage) throw *first_damage;
  throw Error::format("{}: no frame of {} has a picture with its mask; are they of another sequence?",
                      layout_.folder.string(), layout_.parameters.string());
}

Sample PictureCapture::load(int frame, int camera) const {
  if (frame < 0 || frame >= frame_count() || camera < 0 || camera >= static_cast<int>(names_.size())) {
    throw Error::format("{}: no frame {} of camera {}; there are {} frames and {} cameras", layout_.folder.string(),
                        frame, camera, frame_count(), names_.size());
  }
  const PictureLayout::View& view = layout_.views[static_cast<size_t>(camera)];
  const int64_t number = parameters_.frame_numbers[static_cast<size_t>(frame)];
  if (!has_image(frame, camera)) {
    const char* reason = layout_.excluded.count({camera, number}) > 0 ? "the capture lists it as missing"
                         : view.pictures.contains(number)             ? "it has no mask"
                                                                      : "there is no such file";
    throw Error::format("{}: {} has no picture of frame {}: {}", view.pictures.path(number).string(), view.name, frame,
                        reason);
  }
  auto [colour, alpha] = read(frame, camera);
  return make_sample({frame, camera}, this->camera(camera), std::move(colour), alpha, background_,
                     view.masks.path(number).string(), view.name);
}

void PictureCapture::make_identity() {
  Identity identity;
  identity.add(layout_.format);
  identity.add(fmt::format("{:.17g} {}", options_.image_scale, static_cast<int>(background_)));
  for (const fs::path& file : layout_.files) identity.add_file(file);
  if (has_poses()) identity.add_file(layout_.parameters);
  for (const PictureLayout::View& view : layout_.views) {
    identity.add_files(view.pictures);
    identity.add_files(view.masks);
  }
  picture_identity_ = identity.text();
  for (const fs::path& file : codes_->files()) identity.add_file(file);
  identity_ = identity.text();
}

}  // namespace degas
