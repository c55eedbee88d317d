#include "model/data/dreams_writer.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npz.h"
#include "host/io/torch_archive.h"
#include "model/data/dreams_codes.h"
#include "model/data/smplx_parameters.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

constexpr size_t dreams_betas = 300, dreams_expressions = 100;

}  // namespace

DreamsWriter::DreamsWriter(const fs::path& folder, std::vector<Camera> cameras, double frames_per_second)
    : folder_(folder), cameras_(std::move(cameras)), frames_per_second_(frames_per_second), videos_(cameras_.size()) {
  std::error_code failure;
  fs::create_directories(folder_ / "videos", failure);
  if (failure) throw Error::format("{}: cannot be made: {}", (folder_ / "videos").string(), failure.message());
}

DreamsWriter::~DreamsWriter() = default;

void DreamsWriter::write_frame(int camera, const Image8& image, const Image8& alpha) {
  const Camera& view = cameras_.at(static_cast<size_t>(camera));
  const auto fits = [&](const Image8& picture, int channels) {
    return picture.width == view.width && picture.height == view.height && picture.channels == channels;
  };
  if (!fits(image, 3) || !fits(alpha, 1))
    throw std::logic_error("[dreams writer] a picture of another size than its camera's");
  auto& video = videos_[static_cast<size_t>(camera)];
  if (!video) {
    const fs::path path = folder_ / "videos" / fmt::format("cam{:02d}.mp4", camera);
    video =
        std::make_unique<VideoWriter>(path, 2 * view.width, view.height, frames_per_second_, VideoQuality::Lossless);
  }
  Image8 frame = Image8::black(2 * view.width, view.height, 3);
  for (int y = 0; y < view.height; ++y) {
    std::copy_n(image.at(0, y), 3 * static_cast<size_t>(view.width), frame.at(0, y));
    uint8_t* right = frame.at(view.width, y);
    for (int x = 0; x < view.width; ++x) std::fill_n(right + 3 * x, 3, *alpha.at(x, y));
  }
  video->write(frame);
}

void DreamsWriter::write_code(int frame, int camera, std::span<const float> code) {
  if (!codes_.empty() && codes_.begin()->second.size() != code.size()) {
    throw std::logic_error("[dreams writer] face codes of different lengths");
  }
  codes_[{frame, camera}].assign(code.begin(), code.end());
}

void DreamsWriter::finish(const std::vector<Pose>& poses, const std::vector<double>& betas, bool flat_hand_mean) {
  for (const auto& video : videos_) {
    if (video && video->frames_written() != static_cast<int>(poses.size())) {
      throw std::logic_error(
          fmt::format("[dreams writer] {} frames of a camera for {} poses", video->frames_written(), poses.size()));
    }
  }
  write_calibration();
  write_parameters(poses, betas, flat_hand_mean);
  write_codes();
  for (const auto& video : videos_) {
    if (video) video->finish();
  }
  write_description(poses.size());
}

void DreamsWriter::write_parameters(const std::vector<Pose>& poses, const std::vector<double>& betas,
                                    bool flat_hand_mean) const {
  SmplxParameters parameters{poses, {}, betas, flat_hand_mean};
  size_t width = dreams_expressions;
  for (const Pose& pose : poses) width = std::max(width, pose.expression.size());
  for (Pose& pose : parameters.poses) {
    pose.expression.resize(width);
    parameters.frame_numbers.push_back(static_cast<int64_t>(parameters.frame_numbers.size()));
  }
  parameters.betas.resize(std::max(betas.size(), dreams_betas));
  write_npz(folder_ / "smplx.npz", smplx_arrays(parameters));
}

void DreamsWriter::write_codes() const {
  if (codes_.empty()) return;
  std::vector<ZipEntry> entries;
  for (const auto& [view, code] : codes_) {
    const std::string name = code_name(view.first, view.second);
    const TorchTensors tensors = {{"exp", NpyArray::from({1, static_cast<int64_t>(code.size())}, code)}};
    entries.push_back({name + ".pt", make_torch_archive(tensors, name)});
  }
  write_file_atomically(folder_ / "dpe.zip", make_zip(entries, false));
}

void DreamsWriter::write_calibration() const {
  nlohmann::json rigs = nlohmann::json::array();
  for (size_t i = 0; i < cameras_.size(); ++i) {
    const Camera& camera = cameras_[i];
    // The file's axes: world to camera = R diag(1,-1,-1) with translation -R c.
    const Eigen::Matrix3d rotation = camera.rotation * Eigen::Vector3d(1, -1, -1).asDiagonal();
    const Eigen::Vector3d center = -rotation.transpose() * camera.translation;
    nlohmann::json rows = nlohmann::json::array();
    for (int row = 0; row < 3; ++row) rows.push_back({rotation(row, 0), rotation(row, 1), rotation(row, 2)});
    rigs.push_back({{"cameras",
                     {{{"name", fmt::format("cam{:02d}", i)},
                       {"w", camera.width},
                       {"h", camera.height},
                       {"fx", camera.fx},
                       {"fy", camera.fy},
                       {"cx", camera.cx},
                       {"cy", camera.cy},
                       {"R", rows},
                       {"c", {center.x(), center.y(), center.z()}}}}}});
  }
  write_text(folder_ / "cameras.json", nlohmann::json{{"rigs", rigs}}.dump(1));
}

void DreamsWriter::write_description(size_t frames) const {
  nlohmann::json present = nlohmann::json::array();
  for (size_t i = 0; i < videos_.size(); ++i) {
    if (videos_[i]) present.push_back(i);
  }
  nlohmann::json description = {{"frame_convention", {{"offset_d", 0}}},
                                {"video", {{"background", "black"}}},
                                {"fps", frames_per_second_},
                                {"num_frames", frames},
                                {"cameras_present", present}};
  const bool one_width = std::all_of(cameras_.begin(), cameras_.end(),
                                     [&](const Camera& camera) { return camera.width == cameras_.front().width; });
  if (one_width && !cameras_.empty()) description["video"]["rgb_width"] = cameras_.front().width;
  write_text(folder_ / "capture.json", description.dump(1));
}

}  // namespace degas
