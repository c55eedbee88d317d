#include "model/data/capture.h"

#include "host/device/program.h"
#include "host/error.h"
#include "model/data/dreams_capture.h"
#include "model/data/image_cache.h"

namespace degas {
namespace fs = std::filesystem;

std::unique_ptr<Capture> open_capture(const fs::path& path, const CaptureOptions& given) {
  CaptureOptions options = given;
  if (!options.warn) options.warn = [](const std::string& text) { fmt::print(stderr, "warning: {}\n", text); };
  if (!(options.image_scale > 0 && options.image_scale <= 1)) {
    throw Error::format("image_scale is {}, expected above 0 and at most 1", options.image_scale);
  }
  if (!options.format.empty() && options.format != "dreams") {
    throw Error::format("capture format '{}' is not known; known: dreams", options.format);
  }
  if (!fs::is_directory(path)) {
    throw Error::format("{}: no such folder; name that of a capture, with cameras.json and capture.json",
                        path.string());
  }
  if (options.format.empty() && !DreamsCapture::recognises(path)) {
    throw Error::format("{}: holds no known capture; one in the DREAMS layout has cameras.json and capture.json",
                        path.string());
  }
  auto capture = std::make_unique<DreamsCapture>(path, options);
  const fs::path cache = options.cache.empty() ? cache_folder() / "captures" : options.cache;
  return std::make_unique<CachedCapture>(std::move(capture), cache, options.warn);
}

}  // namespace degas
