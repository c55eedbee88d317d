#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

namespace degas {

/// The folder dpe/ of a capture, or of another place, while codes are written to it: a torch archive a view,
/// dpe-{frame:06}-cam{camera:02}.pt, as the published captures have them, and encoder.json, which says how they were
/// made. A file has its name only when it is whole, so that an interrupted run goes on where it was.
class CodeFolder {
 public:
  /// Changes nothing yet. Throws Error naming file, key and value when `place` holds codes that were made otherwise, or
  /// by others, in any of code_places; not to `overwrite`.
  CodeFolder(const std::filesystem::path& place, const nlohmann::json& settings, bool overwrite);

  /// Before the first code: writes encoder.json; to overwrite, the codes in dpe/ go first (those in other places stay,
  /// but are no longer read).
  void begin() const;
  const std::filesystem::path& path() const { return path_; }
  bool contains(int64_t frame_number, int camera) const { return std::filesystem::exists(file(frame_number, camera)); }
  void write(int64_t frame_number, int camera, std::span<const float> code) const;

 private:
  std::filesystem::path file(int64_t frame_number, int camera) const;
  std::filesystem::path path_;
  nlohmann::json settings_;
  bool overwrite_;
};

}  // namespace degas
