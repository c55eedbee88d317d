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
  /// Throws Error naming file, key and value when `place` holds codes that were made otherwise, or by others; with
  /// `overwrite` those go (a dpe.zip or expression_codes.npz stays, but is no longer read).
  CodeFolder(const std::filesystem::path& place, const nlohmann::json& settings, bool overwrite);

  const std::filesystem::path& path() const { return path_; }
  bool contains(int64_t frame_number, int camera) const { return std::filesystem::exists(file(frame_number, camera)); }
  void write(int64_t frame_number, int camera, std::span<const float> code) const;

 private:
  std::filesystem::path file(int64_t frame_number, int camera) const;
  std::filesystem::path path_;
};

}  // namespace degas
