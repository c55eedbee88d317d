#include "model/faces/code_folder.h"

#include <string>
#include <vector>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/input_limits.h"
#include "host/io/torch_archive.h"
#include "model/data/dreams_codes.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

constexpr const char* description = "encoder.json";
constexpr const char* remedy = "write elsewhere by --out DIR, or replace them by --overwrite";

std::vector<fs::path> code_files(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;  // not begun
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_code_file(entry.path().filename().string())) files.push_back(entry.path());
  }
  return files;
}

/// The settings that codes in the folder were made with; Error when there are codes that were made otherwise.
void require_same(const fs::path& file, const nlohmann::json& settings) {
  const std::vector<std::byte> bytes = read_file_bytes(file);
  const auto known = nlohmann::json::parse(checked_json(bytes, file.string()), nullptr, false);
  if (!known.is_object()) throw Error::format("{}: is no JSON object; {}", file.string(), remedy);
  for (const auto& [key, value] : settings.items()) {
    if (known.contains(key) && known.at(key) == value) continue;
    throw Error::format("{}: the codes here were made with another '{}': {} (now {}); {}", file.string(), key,
                        known.contains(key) ? known.at(key).dump() : "none", value.dump(), remedy);
  }
}

}  // namespace

CodeFolder::CodeFolder(const fs::path& place, const nlohmann::json& settings, bool overwrite)
    : path_(place / "dpe"), settings_(settings), overwrite_(overwrite) {
  if (overwrite) return;
  if (fs::exists(path_ / description)) {
    require_same(path_ / description, settings);
    return;
  }
  for (const fs::path& other : code_places(place)) {
    const std::vector<fs::path> files = fs::is_directory(other) ? code_files(other) : std::vector{other};
    if (!files.empty()) throw Error::format("{}: there are face codes already; {}", files[0].string(), remedy);
  }
}

void CodeFolder::begin() const {
  if (!overwrite_ && fs::exists(path_ / description)) return;  // goes on, and nothing that is there changes
  if (overwrite_) {
    for (const fs::path& file : code_files(path_)) fs::remove(file);
  }
  write_text(path_ / description, settings_.dump(1));
}

fs::path CodeFolder::file(int64_t frame_number, int camera) const {
  return path_ / (code_name(frame_number, camera) + ".pt");
}

void CodeFolder::write(int64_t frame_number, int camera, std::span<const float> code) const {
  const fs::path target = file(frame_number, camera);
  const TorchTensors tensors = {{"exp", NpyArray::from({1, static_cast<int64_t>(code.size())}, code)}};
  write_file_atomically(target, make_torch_archive(tensors, target.stem().string()));
}

}  // namespace degas
