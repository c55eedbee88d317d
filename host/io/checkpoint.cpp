#include "host/io/checkpoint.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "host/error.h"
#include "host/io/checksum.h"
#include "host/io/file_bytes.h"
#include "host/io/input_limits.h"

namespace degas {
namespace {

constexpr char checkpoint_magic[8] = {'D', 'E', 'G', 'A', 'S', 'C', 'K', 'P'};
constexpr uint32_t version = 1;

/// A file written under a temporary name; commit() makes it durable and gives it its own.
class CheckpointFile {
 public:
  explicit CheckpointFile(std::filesystem::path path) : path_(std::move(path)), temporary_(temporary_name(path_)) {
    descriptor_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (descriptor_ < 0) fail("cannot be written");
  }
  ~CheckpointFile() {
    if (descriptor_ < 0) return;
    close(descriptor_);
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
  void write(const void* data, size_t bytes) {
    checksum_.add(data, bytes);
    put(data, bytes);
  }
  void commit(const std::filesystem::path& previous) {
    const uint64_t sum = checksum_.value();
    put(&sum, sizeof(sum));
    if (fsync(descriptor_) != 0) fail("cannot be flushed to the disk");
    if (!previous.empty()) keep_as(previous);
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot be given its name");
    close(descriptor_);
    descriptor_ = -1;
  }

 private:
  /// A second name for what stands at path_, so that at no moment there is nothing of that name.
  void keep_as(const std::filesystem::path& previous) {
    std::error_code failure;
    if (!std::filesystem::exists(path_, failure)) return;
    const std::filesystem::path link = temporary_name(previous);
    std::filesystem::create_hard_link(path_, link, failure);
    // File systems without links: for a moment there is the previous one alone, which readers fall back on.
    if (::rename(failure ? path_.c_str() : link.c_str(), previous.c_str()) != 0)
      fail("cannot be kept as the previous one");
    ::unlink(link.c_str());  // there where both were names of one file already: such a rename does nothing
  }
  void put(const void* data, size_t bytes) {
    const auto* begin = static_cast<const char*>(data);
    while (bytes > 0) {
      const ssize_t written = ::write(descriptor_, begin, std::min<size_t>(bytes, size_t{1} << 30));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) fail("cannot be written (is the disk full?)");
      begin += written;
      bytes -= static_cast<size_t>(written);
    }
  }
  [[noreturn]] void fail(const char* what) {
    throw Error::format("{}: {}: {}; the previous checkpoint is untouched", path_.string(), what, std::strerror(errno));
  }
  std::filesystem::path path_, temporary_;
  int descriptor_ = -1;
  Checksum checksum_;
};

/// Reads a checkpoint front to back, counting what is left and summing what was read.
class CheckedReader {
 public:
  explicit CheckedReader(const std::filesystem::path& path) : path_(path), stream_(path, std::ios::binary) {
    if (!stream_)
      throw Error::format("{}: no such checkpoint; train first, or name the run's folder with --run", path.string());
    std::error_code ignored;
    left_ = std::filesystem::file_size(path, ignored);
  }
  void read(void* target, uint64_t bytes) {
    require(bytes);
    checksum_.add(target, take(target, bytes));
  }
  /// Throws when fewer bytes are left: before anything of a hostile size is allocated.
  void require(uint64_t bytes) const {
    if (bytes > left_) throw Error::format("{}: the checkpoint is cut short; use an older copy", path_.string());
  }
  void finish() {
    uint64_t stored = 0;
    require(sizeof(stored));
    take(&stored, sizeof(stored));
    if (stored != checksum_.value() || left_ != 0) {
      throw Error::format("{}: the checkpoint is corrupt (checksum differs); use an older copy", path_.string());
    }
  }

 private:
  uint64_t take(void* target, uint64_t bytes) {
    if (!stream_.read(static_cast<char*>(target), static_cast<std::streamsize>(bytes))) {
      throw Error::format("{}: cannot be read to its end; use an older copy", path_.string());
    }
    left_ -= bytes;
    return bytes;
  }
  std::filesystem::path path_;
  std::ifstream stream_;
  uint64_t left_ = 0;
  Checksum checksum_;
};

}  // namespace

const std::vector<float>& Checkpoint::array(const std::string& name, size_t expected_size) const {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const auto& entry) { return entry.first == name; });
  if (found == arrays.end()) {
    throw Error::format("{}: no array '{}': the checkpoint is of another configuration; use the one it was made with",
                        file.string(), name);
  }
  if (found->second.size() != expected_size) {
    throw Error::format("{}: array '{}' has {} values, this configuration needs {}; use the one it was made with",
                        file.string(), name, found->second.size(), expected_size);
  }
  return found->second;
}

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint,
                      const std::filesystem::path& previous) {
  nlohmann::json index = nlohmann::json::array();
  for (const auto& [name, values] : checkpoint.arrays) index.push_back({name, values.size()});
  const std::string text = nlohmann::json{{"header", checkpoint.header}, {"arrays", index}}.dump();
  const uint64_t length = text.size();
  CheckpointFile file(path);
  file.write(checkpoint_magic, sizeof(checkpoint_magic));
  file.write(&version, sizeof(version));
  file.write(&length, sizeof(length));
  file.write(text.data(), text.size());
  for (const auto& [name, values] : checkpoint.arrays) file.write(values.data(), values.size() * sizeof(float));
  file.commit(previous);
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  CheckedReader reader(path);
  char found_magic[8];
  uint32_t found_version = 0;
  uint64_t length = 0;
  reader.read(found_magic, sizeof(found_magic));
  if (std::memcmp(found_magic, checkpoint_magic, sizeof(checkpoint_magic)) != 0)
    throw Error::format("{}: not a degas checkpoint; name the folder of a run of `degas train`", path.string());
  reader.read(&found_version, sizeof(found_version));
  if (found_version != version) {
    throw Error::format("{}: checkpoint version {}, this program reads {}; use the degas that it was made with",
                        path.string(), found_version, version);
  }
  reader.read(&length, sizeof(length));
  reader.require(length);
  std::string text(length, '\0');
  reader.read(text.data(), length);

  Checkpoint checkpoint;
  checkpoint.file = path;
  try {
    check_json(text, path.string());
    const nlohmann::json root = nlohmann::json::parse(text);
    checkpoint.header = root.at("header");
    if (!checkpoint.header.is_object())
      throw Error::format("{}: its header is no object; use an older copy", path.string());
    for (const auto& entry : root.at("arrays")) {
      if (!entry.at(1).is_number_unsigned())
        throw Error::format("{}: an array's length is no count; use an older copy", path.string());
      const uint64_t count = entry.at(1).get<uint64_t>();
      reader.require(count);  // before the product below could overflow
      reader.require(count * sizeof(float));
      auto& [name, values] = checkpoint.arrays.emplace_back(entry.at(0).get<std::string>(), std::vector<float>(count));
      reader.read(values.data(), count * sizeof(float));
    }
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the checkpoint's header is corrupt: {}; use an older copy", path.string(), error.what());
  }
  reader.finish();
  return checkpoint;
}

}  // namespace degas
