#include "tests/fuzz/kept_inputs.h"

#include <algorithm>
#include <stdexcept>

#include "host/io/file_bytes.h"
#include "host/io/zip_archive.h"

namespace degas::test {
namespace fs = std::filesystem;
namespace {

constexpr size_t length_bytes = 4;

}  // namespace

fs::path kept_inputs_folder() {
  return DEGAS_FUZZ_KEPT;
}

std::vector<Bytes> kept_inputs(const std::string& target, const fs::path& folder) {
  const fs::path file = folder / (target + ".zip");
  std::vector<Bytes> inputs;
  if (!fs::exists(file)) return inputs;
  const Bytes all = ZipReader(file).read("inputs");
  for (size_t at = 0; at < all.size();) {
    size_t length = 0;
    for (size_t i = 0; i < length_bytes && at < all.size(); ++i) length |= std::to_integer<size_t>(all[at++]) << 8 * i;
    if (length > all.size() - at) throw std::runtime_error(file.string() + ": ends within an input");
    inputs.emplace_back(all.begin() + static_cast<ptrdiff_t>(at), all.begin() + static_cast<ptrdiff_t>(at + length));
    at += length;
  }
  return inputs;
}

void keep_inputs(const fs::path& from, const std::string& target, const fs::path& folder) {
  std::vector<Bytes> inputs;
  for (const auto& entry : fs::directory_iterator(from)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("seed-") && !name.starts_with("fault-")) inputs.push_back(read_file_bytes(entry.path()));
  }
  if (inputs.empty()) return;
  std::sort(inputs.begin(), inputs.end(),
            [](const Bytes& a, const Bytes& b) { return a.size() != b.size() ? a.size() < b.size() : a < b; });
  inputs.erase(std::unique(inputs.begin(), inputs.end()), inputs.end());  // a search begins with copies of what is kept
  Bytes all;
  for (const Bytes& input : inputs) {
    for (size_t i = 0; i < length_bytes; ++i) all.push_back(static_cast<std::byte>(input.size() >> 8 * i));
    all.insert(all.end(), input.begin(), input.end());
  }
  const ZipEntry entry{"inputs", all};
  write_file_atomically(folder / (target + ".zip"), make_zip({&entry, 1}, true));
}

}  // namespace degas::test
