#pragma once

#include <filesystem>
#include <string>

namespace degas {

/// Where what can be made again is kept: $DEGAS_CACHE, else $XDG_CACHE_HOME/degas, else ~/.cache/degas.
std::filesystem::path cache_folder();

/// Writes under a temporary name and renames, so that concurrent processes see whole files only; makes missing folders.
/// False where that fails: a cache that cannot be written costs time, not correctness, so callers may let it go.
bool replace_cache_file(const std::filesystem::path& path, const std::string& bytes);

/// 128 bits as hexadecimal digits: FNV-1a with two offsets, far more than caches of some thousand entries need.
std::string content_hash(const std::string& text);

}  // namespace degas
