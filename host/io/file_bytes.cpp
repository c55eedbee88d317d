#include "host/io/file_bytes.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "host/error.h"

namespace degas {
namespace fs = std::filesystem;

std::vector<std::byte> read_file_bytes(const fs::path& path) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure)) throw Error::format("{}: no such file", path.string());
  const uintmax_t size = fs::file_size(path, failure);
  std::ifstream stream(path, std::ios::binary);
  if (failure || !stream) throw Error::format("{}: cannot be opened for reading", path.string());
  std::vector<std::byte> bytes(size);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<uintmax_t>(stream.gcount()) != size)
    throw Error::format("{}: cannot be read to its end", path.string());
  return bytes;
}

fs::path temporary_name(const fs::path& path) {
  static std::atomic<int> calls = 0;
  const std::string name =
      fmt::format(".{}.{}-{}.tmp{}", path.stem().string(), getpid(), calls++, path.extension().string());
  return path.parent_path() / name;
}

void remove_leftovers_of(const fs::path& path) {
  const std::string begin = '.' + path.stem().string() + '.', end = ".tmp" + path.extension().string();
  std::error_code ignored;
  std::vector<fs::path> leftovers;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  for (fs::directory_iterator entry(folder, ignored), last; entry != last; entry.increment(ignored)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(begin) || !name.ends_with(end) || name.size() <= begin.size() + end.size()) continue;
    int process = 0, call = 0, length = 0;
    const std::string middle = name.substr(begin.size(), name.size() - begin.size() - end.size());
    const bool ours = std::sscanf(middle.c_str(), "%d-%d%n", &process, &call, &length) == 2 &&
                      length == static_cast<int>(middle.size()) && process > 0;
    if (ours && kill(process, 0) != 0 && errno == ESRCH) leftovers.push_back(entry->path());
  }
  for (const fs::path& leftover : leftovers) fs::remove(leftover, ignored);
}

AtomicFile::AtomicFile(const fs::path& path) : path_(path), temporary_(temporary_name(path)) {
  std::error_code ignored;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), ignored);
  file_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) fail(errno);
}

AtomicFile::~AtomicFile() {
  if (file_ >= 0) close(file_);
  std::error_code ignored;
  fs::remove(temporary_, ignored);  // after commit there is none of this name
}

void AtomicFile::fail(int reason) const {
  throw Error::format("{}: cannot be written: {}", path_.string(), std::strerror(reason));
}

void AtomicFile::write_at(size_t at, std::span<const std::byte> bytes) {
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t written = pwrite(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(errno);
    done += static_cast<size_t>(written);
  }
}

void AtomicFile::append(std::span<const std::byte> bytes) {
  write_at(size_, bytes);
  size_ += bytes.size();
}

void AtomicFile::overwrite(size_t at, std::span<const std::byte> bytes) {
  write_at(at, bytes);
}

void AtomicFile::commit() {
  if (fsync(file_) != 0) fail(errno);
  const int file = file_;
  file_ = -1;
  if (close(file) != 0 || std::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno);
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.append(bytes);
  file.commit();
}

void write_text(const fs::path& path, const std::string& text) {
  write_file_atomically(path, std::as_bytes(std::span<const char>(text)));
}

}  // namespace degas
