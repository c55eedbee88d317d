#include "model/data/capture.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "host/device/user_cache.h"
#include "host/error.h"
#include "model/data/actorshq_capture.h"
#include "model/data/avatarrex_capture.h"
#include "model/data/dreams_capture.h"
#include "model/data/image_cache.h"
#include "model/data/packed_capture.h"
#include "model/data/registration.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

struct Format {
  std::string name, files;  ///< files: by which it is told
  bool (*recognises)(const fs::path& folder, bool incomplete);
  std::unique_ptr<Capture> (*open)(const fs::path& folder, const CaptureOptions& options);
};

/// In the order in which they are tried.
const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"dreams", "cameras.json and capture.json", DreamsCapture::recognises,
       [](const fs::path& folder, const CaptureOptions& options) -> std::unique_ptr<Capture> {
         return std::make_unique<DreamsCapture>(folder, options);
       }},
      {"avatarrex", "calibration_full.json (THuman4: calibration.json)",
       [](const fs::path& folder, bool) { return is_avatarrex(folder); },
       [](const fs::path& folder, const CaptureOptions& options) -> std::unique_ptr<Capture> {
         return std::make_unique<PictureCapture>(find_avatarrex_layout(folder), options);
       }},
      {"actorshq", "calibration.csv and rgbs/",
       [](const fs::path& folder, bool) { return !find_actorshq(folder).empty(); },
       [](const fs::path& folder, const CaptureOptions& options) -> std::unique_ptr<Capture> {
         return std::make_unique<PictureCapture>(find_actorshq_layout(folder), options);
       }}};
  return all;
}

/// What the formats are told by, for errors.
std::string known_files() {
  std::vector<std::string> all;
  for (const Format& format : formats()) all.push_back(fmt::format("{}: {}", format.name, format.files));
  return fmt::format("{}", fmt::join(all, "; "));
}

/// As it lies there: without a cache, with its own body parameters.
std::unique_ptr<Capture> open_recording(const fs::path& path, const CaptureOptions& options) {
  if (!(options.image_scale > 0 && options.image_scale <= 1)) {
    throw Error::format("image_scale is {}, expected above 0 and at most 1", options.image_scale);
  }
  const std::vector<std::string> names = capture_formats();
  if (!options.format.empty() && std::find(names.begin(), names.end(), options.format) == names.end()) {
    throw Error::format("capture format '{}' is not known; known: {}", options.format, fmt::join(names, ", "));
  }
  if (fs::is_regular_file(path)) {
    if (!options.format.empty()) throw Error::format("{}: is a pack, which has no --format", path.string());
    if (!options.codes.empty()) {
      throw Error::format("{}: a pack has its face codes within; give --codes to `degas pack`", path.string());
    }
    return std::make_unique<PackedCapture>(path, options.image_scale);
  }
  if (!fs::is_directory(path)) {
    throw Error::format("{}: no such folder; name that of a capture ({})", path.string(), known_files());
  }
  for (const Format& format : formats()) {
    const bool is_chosen =
        options.format.empty() ? format.recognises(path, options.incomplete) : options.format == format.name;
    if (is_chosen) return format.open(path, options);
  }
  if (fs::exists(path / "cameras.json")) {
    throw Error::format(
        "{}: has cameras.json, but no capture.json: `degas inspect`, and `degas encode-faces` without --body, take a "
        "recording as it is; training needs capture.json, a body fitted to it (smplx.npz) and masks beside the colours "
        "of its videos (docs/captures.md)",
        path.string());
  }
  throw Error::format("{}: holds no known capture; they are told by their files: {}", path.string(), known_files());
}

std::unique_ptr<Capture> registered(std::unique_ptr<Capture> recording, const CaptureOptions& options) {
  return options.poses.empty() ? std::move(recording)
                               : with_registration(std::move(recording), options.poses, options.warn);
}

}  // namespace

void print_warning(const std::string& text) {
  fmt::print(stderr, "warning: {}\n", text);
}

fs::path frames_file(const fs::path& own_parameters, const CaptureOptions& options) {
  return options.poses.empty() || fs::exists(own_parameters) ? own_parameters : options.poses;
}

std::vector<std::string> capture_formats() {
  std::vector<std::string> names;
  for (const Format& format : formats()) names.push_back(format.name);
  return names;
}

std::unique_ptr<Capture> open_uncached_capture(const fs::path& path, const CaptureOptions& options) {
  return registered(open_recording(path, options), options);
}

std::unique_ptr<Capture> open_capture(const fs::path& path, const CaptureOptions& options) {
  if (fs::is_regular_file(path)) return open_uncached_capture(path, options);  // a pack is decoded already
  const fs::path cache = options.cache.empty() ? cache_folder() / "captures" : options.cache;
  // Pictures are kept for every registration alike.
  return registered(std::make_unique<CachedCapture>(open_recording(path, options), cache, options.warn), options);
}

}  // namespace degas
