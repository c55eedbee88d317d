#include "host/io/npz.h"

#include <fmt/ranges.h>

#include "host/error.h"
#include "host/io/file_bytes.h"

namespace degas {

NpzFile::NpzFile(const std::filesystem::path& path) : path_(path), archive_(path) {}

std::vector<std::string> NpzFile::keys() const {
  std::vector<std::string> keys;
  for (const std::string& name : archive_.names()) {
    if (name.ends_with(".npy")) keys.push_back(name.substr(0, name.size() - 4));
  }
  return keys;
}

NpyArray NpzFile::read(const std::string& key) const {
  if (!contains(key)) throw Error::format("{}: no array '{}'; it has {}", path_.string(), key, fmt::join(keys(), ", "));
  return parse_npy(archive_.read(key + ".npy"), fmt::format("{}: '{}'", path_.string(), key));
}

NpyArray NpzFile::read(const std::string& key, const Shape& expected) const {
  NpyArray array = read(key);
  bool fits = array.shape.size() == expected.size();
  for (size_t i = 0; fits && i < expected.size(); ++i) fits = expected[i] < 0 || expected[i] == array.shape[i];
  if (!fits) {
    throw Error::format("{}: '{}' has shape ({}), expected ({}) where -1 is any size", path_.string(), key,
                        fmt::join(array.shape, ", "), fmt::join(expected, ", "));
  }
  return array;
}

void write_npz(const std::filesystem::path& path, const std::map<std::string, NpyArray>& arrays) {
  std::vector<ZipEntry> entries;
  for (const auto& [key, array] : arrays) entries.push_back({key + ".npy", make_npy(array)});
  write_file_atomically(path, make_zip(entries, true));
}

}  // namespace degas
