#include "model/data/dreams_codes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host/error.h"
#include "host/io/torch_archive.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

void check_code(const std::vector<float>& code, int size, const std::string& label) {
  if (size > 0 && static_cast<int>(code.size()) != size) {
    throw Error::format("{}: the face code has {} numbers where others have {}", label, code.size(), size);
  }
  if (!std::all_of(code.begin(), code.end(), [](float value) { return std::isfinite(value); })) {
    throw Error::format("{}: the face code is not finite; remove it (the view then has none) or extract it again",
                        label);
  }
}

}  // namespace

DreamsCodes::DreamsCodes(const fs::path& folder, const std::vector<int64_t>& frame_numbers, int cameras)
    : folder_(folder) {
  fs::path bundle = folder / "dpe.zip";
  if (fs::is_directory(folder / "dpe")) {
    for (const auto& entry : fs::directory_iterator(folder / "dpe")) {
      if (entry.path().extension() == ".zip") bundle = entry.path();
      if (entry.path().extension() == ".pt") add(entry.path().filename(), entry.path(), frame_numbers, cameras);
    }
  }
  if (!sources_.empty()) {
    files_ = {folder / "dpe"};
  } else if (fs::exists(bundle)) {
    bundle_ = std::make_unique<ZipReader>(bundle);
    for (const std::string& name : bundle_->names()) add(fs::path(name).filename(), name, frame_numbers, cameras);
    files_ = {bundle};
  } else if (fs::exists(folder / "expression_codes.npz")) {
    read_table(folder / "expression_codes.npz", frame_numbers.size(), cameras);
    files_ = {folder / "expression_codes.npz"};
  }
  if (!sources_.empty()) size_ = static_cast<int>(read(sources_.begin()->second).size());
}

std::vector<fs::path> DreamsCodes::files() const {
  return files_;
}

void DreamsCodes::add(const std::string& file_name, const std::string& source,
                      const std::vector<int64_t>& frame_numbers, int cameras) {
  long long number = 0;
  int camera = 0, end = 0;
  if (std::sscanf(file_name.c_str(), "dpe-%9lld-cam%4d.pt%n", &number, &camera, &end) != 2) return;
  if (end != static_cast<int>(file_name.size()) || camera < 0 || camera >= cameras) return;
  const auto row = std::lower_bound(frame_numbers.begin(), frame_numbers.end(), number);
  if (row == frame_numbers.end() || *row != number) return;
  sources_[{static_cast<int>(row - frame_numbers.begin()), camera}] = source;
}

void DreamsCodes::read_table(const fs::path& path, size_t rows, int cameras) {
  const NpzFile file(path);
  const auto frames = static_cast<int64_t>(rows);
  const NpyArray codes = file.read("codes", {frames, cameras, -1});
  const std::vector<int64_t> valid = file.read("valid", {frames, cameras}).integers();
  const std::vector<float> values = codes.floats();
  size_ = static_cast<int>(codes.shape[2]);
  for (size_t view = 0; view < valid.size(); ++view) {
    if (!valid[view]) continue;
    const auto begin = values.begin() + static_cast<ptrdiff_t>(view) * size_;
    const int frame = static_cast<int>(view) / cameras, camera = static_cast<int>(view) % cameras;
    auto& code = codes_[{frame, camera}];
    code.assign(begin, begin + size_);
    check_code(code, size_, fmt::format("{}: 'codes' of frame {}, camera {}", path.string(), frame, camera));
  }
}

std::vector<float> DreamsCodes::read(const std::string& source) const {
  const std::string label = bundle_ ? bundle_->label() + ": " + source : source;
  const TorchTensors tensors =
      bundle_ ? read_torch_archive(bundle_->read(source), label) : read_torch_archive(fs::path(source));
  const auto found = tensors.find("exp");
  if (found == tensors.end()) throw Error::format("{}: has no tensor 'exp'", label);
  std::vector<float> code = found->second.floats();
  check_code(code, size_, label);
  return code;
}

bool DreamsCodes::has_code(int frame, int camera) const {
  const std::lock_guard lock(mutex_);
  const View view{frame, camera};
  return sources_.count(view) > 0 || codes_.count(view) > 0;
}

std::optional<std::vector<float>> DreamsCodes::code(int frame, int camera) const {
  const std::lock_guard lock(mutex_);
  const View view{frame, camera};
  if (const auto known = codes_.find(view); known != codes_.end()) return known->second;
  const auto source = sources_.find(view);
  if (source == sources_.end()) return std::nullopt;
  return codes_[view] = read(source->second);
}

}  // namespace degas
