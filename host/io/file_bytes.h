#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace degas {

/// The whole file. Error naming it when it is missing, no regular file or cut short while reading.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path);

/// Writes beside the target under a temporary name, flushes to disk and renames: readers see the old file or the whole
/// new one. Makes missing parent folders. Error naming the file and the system's reason.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// The name `path` is written under before its rename: unique per process and call, same folder, same extension.
std::filesystem::path temporary_name(const std::filesystem::path& path);

/// Removes what processes that were killed while writing `path` left under such names; not what a living one writes.
void remove_leftovers_of(const std::filesystem::path& path);

}  // namespace degas
