#include "host/device/user_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>

namespace degas {

namespace fs = std::filesystem;

fs::path cache_folder() {
  if (const char* own = std::getenv("DEGAS_CACHE")) return own;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME")) return fs::path(xdg) / "degas";
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache" / "degas";
  return fs::temp_directory_path() / "degas-cache";
}

bool replace_cache_file(const fs::path& path, const std::string& bytes) {
  static std::atomic<int> calls = 0;
  std::error_code ignored;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), ignored);
  const fs::path temporary = path.string() + fmt::format(".{}-{}.tmp", getpid(), calls++);
  {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) {
      fs::remove(temporary, ignored);
      return false;
    }
  }
  std::error_code failure;
  fs::rename(temporary, path, failure);
  return !failure;
}

std::string content_hash(const std::string& text) {
  uint64_t low = 0xcbf29ce484222325u, high = 0x84222325cbf29ce4u;
  for (unsigned char c : text) {
    low = (low ^ c) * 0x100000001b3u;
    high = (high ^ c ^ 0x5au) * 0x100000001b3u;
  }
  return fmt::format("{:016x}{:016x}", low, high);
}

}  // namespace degas
