#include "host/io/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/error.h"

namespace degas {

MappedFile::MappedFile(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw Error::format("{}: cannot be opened: {}", path.string(), std::strerror(errno));
  struct stat state {};
  const bool is_file = fstat(file, &state) == 0 && S_ISREG(state.st_mode) && state.st_size > 0;
  const auto size = static_cast<size_t>(state.st_size);
  void* mapped = is_file ? mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0) : MAP_FAILED;
  close(file);
  if (mapped == MAP_FAILED) throw Error::format("{}: is empty, no file or cannot be mapped", path.string());
  bytes_ = {static_cast<const std::byte*>(mapped), size};
}

MappedFile::~MappedFile() {
  munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace degas
