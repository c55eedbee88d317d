#include "model/train/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/error.h"

namespace degas {

namespace fs = std::filesystem;

RunLock::RunLock(const fs::path& run_folder) {
  std::error_code failure;
  fs::create_directories(run_folder, failure);
  if (failure) throw Error::format("{}: cannot be made: {}", run_folder.string(), failure.message());
  folder_ = open(run_folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_ < 0) throw Error::format("{}: cannot be opened: {}", run_folder.string(), std::strerror(errno));
  if (flock(folder_, LOCK_EX | LOCK_NB) == 0) return;
  const int reason = errno;
  close(folder_);
  if (reason != EWOULDBLOCK)
    throw Error::format("{}: cannot be locked: {}", run_folder.string(), std::strerror(reason));
  throw Error::format(
      "{}: another process trains this run now; wait for it or stop it, or name another folder with --out",
      run_folder.string());
}

RunLock::~RunLock() {
  close(folder_);
}

}  // namespace degas
