#include "model/data/identity.h"

#include "host/error.h"

namespace degas {
namespace fs = std::filesystem;

void Identity::add(std::string_view text) {
  const auto mix = [this](unsigned char c) {
    low_ = (low_ ^ c) * 0x100000001b3u;
    high_ = (high_ ^ c ^ 0x5au) * 0x100000001b3u;
  };
  for (const char c : text) mix(static_cast<unsigned char>(c));
  mix(0);  // "ab" + "c" is not "a" + "bc"
}

void Identity::add_file(const fs::path& path) {
  std::error_code failure;
  const auto changed = fs::last_write_time(path, failure);
  if (failure) throw Error::format("{}: {}", path.string(), failure.message());
  const uintmax_t size = fs::is_regular_file(path) ? fs::file_size(path) : 0;
  add(fmt::format("{} {} {}", fs::weakly_canonical(path).string(), size, changed.time_since_epoch().count()));
}

void Identity::add_files(const NumberedFiles& files) {
  if (files.numbers().empty()) return;
  add(fs::weakly_canonical(files.folder()).string());  // once: a capture may have a million files
  for (const int64_t number : files.numbers()) {
    const fs::path path = files.path(number);
    std::error_code failure;
    const auto changed = fs::last_write_time(path, failure);
    const uintmax_t size = failure ? 0 : fs::file_size(path, failure);
    if (failure) throw Error::format("{}: {}", path.string(), failure.message());
    add(fmt::format("{} {} {}", path.filename().string(), size, changed.time_since_epoch().count()));
  }
}

std::string Identity::text() const {
  return fmt::format("{:016x}{:016x}", low_, high_);
}

}  // namespace degas
