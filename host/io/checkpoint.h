#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace degas {

/// What a checkpoint holds: a JSON header of the owner's and named float arrays in order.
struct Checkpoint {
  nlohmann::json header;
  std::vector<std::pair<std::string, std::vector<float>>> arrays;
  std::filesystem::path file = {};  ///< that it was read from, for messages

  /// Throws Error naming the file and the array when it is missing or has another size.
  const std::vector<float>& array(const std::string& name, size_t expected_size) const;
};

/// Layout: "DEGASCKP", uint32 version, uint64 length of the JSON text, the text ({"header", "arrays": [[name,
/// count]]}), then the arrays' float32 values one after another, little endian, then a 64-bit checksum of all before
/// it. Equal contents give equal bytes. Written under a temporary name, flushed to the disk, renamed: a reader sees the
/// old file or the new one, never a part. What stood at `path` before goes on under the name `previous`, where one is
/// given. Throws Error naming the file when the disk refuses; what was saved last then has one of the two names.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint,
                      const std::filesystem::path& previous = {});

/// Throws Error naming the file and what is wrong: missing, not a checkpoint, another version, cut short, corrupt.
Checkpoint read_checkpoint(const std::filesystem::path& path);

}  // namespace degas
