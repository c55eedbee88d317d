#pragma once

#include <filesystem>

namespace degas {

/// Keeps every other process from training the same run, as long as it lives: two writers of one history and one
/// checkpoint would undo each other's work. The system's lock (flock) on the folder, which a killed process gives back.
class RunLock {
 public:
  /// Makes the folder where there is none. Throws Error when another process trains the run, or naming what the
  /// system refuses.
  explicit RunLock(const std::filesystem::path& run_folder);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int folder_ = -1;
};

}  // namespace degas
