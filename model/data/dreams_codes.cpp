#include "model/data/dreams_codes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host/error.h"
#include "host/io/file_bytes.h"
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

/// Frame number and camera of a code's file, by its name without folder and extension.
std::optional<std::pair<int64_t, int>> view_of(const fs::path& file) {
  if (file.extension() != ".pt" && file.extension() != ".npy") return std::nullopt;
  const std::string name = file.stem().string();
  long long number = 0;
  int camera = 0, end = 0;
  if (std::sscanf(name.c_str(), "dpe-%9lld-cam%4d%n", &number, &camera, &end) != 2) return std::nullopt;
  if (end != static_cast<int>(name.size()) || number < 0 || camera < 0) return std::nullopt;
  return std::pair(static_cast<int64_t>(number), camera);
}

}  // namespace

std::string code_name(int64_t frame_number, int camera) {
  return fmt::format("dpe-{:06d}-cam{:02d}", frame_number, camera);
}

bool is_code_file(const std::string& name) {
  return view_of(name).has_value();
}

std::vector<fs::path> code_places(const fs::path& folder) {
  const fs::path single = folder / "dpe";
  std::vector<fs::path> bundles;
  if (fs::is_directory(single)) {
    for (const auto& entry : fs::directory_iterator(single)) {
      if (entry.path().extension() == ".zip") bundles.push_back(entry.path());
    }
  }
  std::sort(bundles.begin(), bundles.end());
  std::vector<fs::path> places = {single, folder};
  places.insert(places.end(), bundles.begin(), bundles.end());
  for (const char* name : {"dpe.zip", "expression_codes.npz", "expression_codes.npy"}) places.push_back(folder / name);
  std::erase_if(places, [](const fs::path& place) { return !fs::exists(place); });
  return places;
}

DreamsCodes::DreamsCodes(const fs::path& place, const std::vector<int64_t>& frame_numbers, int cameras) {
  const std::vector<fs::path> places = fs::is_regular_file(place) ? std::vector{place} : code_places(place);
  for (const fs::path& path : places) {
    if (files_.empty()) add_all(path, frame_numbers, cameras);
  }
  if (!sources_.empty()) size_ = static_cast<int>(read(sources_.begin()->second).size());
}

std::vector<fs::path> DreamsCodes::files() const {
  return files_;
}

void DreamsCodes::add_all(const fs::path& place, const std::vector<int64_t>& frame_numbers, int cameras) {
  if (fs::is_directory(place)) {
    add_files(place, frame_numbers, cameras);
  } else if (place.extension() == ".npz" || place.extension() == ".npy") {
    read_table(place, frame_numbers.size(), cameras);
  } else {
    add_bundle(place, frame_numbers, cameras);
  }
}

void DreamsCodes::add_files(const fs::path& folder, const std::vector<int64_t>& frame_numbers, int cameras) {
  for (const auto& entry : fs::directory_iterator(folder)) add(entry.path().string(), frame_numbers, cameras);
  if (!sources_.empty()) files_ = {folder};
}

void DreamsCodes::add_bundle(const fs::path& path, const std::vector<int64_t>& frame_numbers, int cameras) {
  bundle_ = std::make_unique<ZipReader>(path);
  for (const std::string& name : bundle_->names()) add(name, frame_numbers, cameras);
  files_ = {path};
}

void DreamsCodes::add(const std::string& source, const std::vector<int64_t>& frame_numbers, int cameras) {
  const auto view = view_of(fs::path(source).filename());
  if (!view && fs::path(source).extension() == ".pt") misnamed_.push_back(fs::path(source).filename().string());
  if (!view || view->second >= cameras) return;
  const auto row = std::lower_bound(frame_numbers.begin(), frame_numbers.end(), view->first);
  if (row == frame_numbers.end() || *row != view->first) return;
  sources_[{static_cast<int>(row - frame_numbers.begin()), view->second}] = source;
}

void DreamsCodes::read_table(const fs::path& path, size_t rows, int cameras) {
  const auto frames = static_cast<int64_t>(rows);
  std::unique_ptr<NpzFile> archive;
  if (path.extension() == ".npz") archive = std::make_unique<NpzFile>(path);
  const NpyArray codes = archive ? archive->read("codes") : parse_npy(read_file_bytes(path), path.string());
  // One code a frame serves every camera.
  const bool by_camera = codes.shape.size() == 3;
  const size_t views = by_camera ? rows * static_cast<size_t>(cameras) : rows;
  const Shape leading(codes.shape.begin(), codes.shape.end() - (codes.shape.empty() ? 0 : 1));
  const Shape expected = by_camera ? Shape{frames, cameras} : Shape{frames};
  if (leading != expected || codes.shape.back() < 1) {
    throw Error::format("{}: 'codes' has shape {}, expected ({}, {}, N) for frames and cameras, or ({}, N)",
                        path.string(), to_string(codes.shape), frames, cameras, frames);
  }
  const std::vector<float> values = codes.floats();
  size_ = static_cast<int>(codes.shape.back());
  std::vector<int64_t> valid;
  if (archive && archive->contains("valid")) valid = archive->read("valid", expected).integers();
  for (size_t view = 0; view < views; ++view) {
    const auto begin = values.begin() + static_cast<ptrdiff_t>(view) * size_;
    const std::vector<float> code(begin, begin + size_);
    const bool there = valid.empty() ? std::all_of(code.begin(), code.end(), [](float v) { return std::isfinite(v); })
                                     : valid[view] != 0;
    if (!there) continue;
    const int frame = static_cast<int>(view) / (by_camera ? cameras : 1);
    const int first = by_camera ? static_cast<int>(view) % cameras : 0, last = by_camera ? first + 1 : cameras;
    check_code(code, size_, fmt::format("{}: 'codes' of frame {}, camera {}", path.string(), frame, first));
    for (int camera = first; camera < last; ++camera) codes_[{frame, camera}] = code;
  }
  files_ = {path};
}

std::vector<float> DreamsCodes::read(const std::string& source) const {
  const std::string label = bundle_ ? bundle_->label() + ": " + source : source;
  const std::vector<std::byte> bytes = bundle_ ? bundle_->read(source) : read_file_bytes(source);
  std::vector<float> code;
  if (fs::path(source).extension() == ".npy") {
    code = parse_npy(bytes, label).floats();
  } else {
    const TorchTensors tensors = read_torch_archive(bytes, label);
    const auto found = tensors.size() == 1 ? tensors.begin() : tensors.find("exp");
    if (found == tensors.end()) {
      throw Error::format("{}: has {} tensors and none is called 'exp'; save the code alone, or under that name", label,
                          tensors.size());
    }
    code = found->second.floats();
  }
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

std::unique_ptr<DreamsCodes> open_codes(const fs::path& capture, const fs::path& named,
                                        const std::vector<int64_t>& frame_numbers, int cameras,
                                        const std::function<void(const std::string&)>& warn) {
  auto codes = std::make_unique<DreamsCodes>(named.empty() ? capture : named, frame_numbers, cameras);
  const std::vector<std::string>& misnamed = codes->misnamed();
  const std::string hint =
      misnamed.empty()
          ? ""
          : fmt::format("{} files have other names than dpe-FRAME-camCAMERA.pt (dpe-000012-cam03.pt), such as '{}'",
                        misnamed.size(), misnamed.front());
  if (!named.empty() && codes->size() == 0) {
    throw Error::format("{}: no face codes of this capture's frames and cameras; {}", named.string(),
                        hint.empty() ? "extract them by `degas encode-faces`" : hint);
  }
  if (!hint.empty()) warn(fmt::format("face codes: {}; they are left out", hint));
  return codes;
}

}  // namespace degas
