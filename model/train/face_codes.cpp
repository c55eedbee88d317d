#include "model/train/face_codes.h"

#include <algorithm>
#include <cmath>

#include "host/error.h"
#include "model/drive/driving_signal.h"
#include "model/net/map_network.h"

namespace degas {

FaceCodes::FaceCodes(const Capture& capture, std::vector<int> cameras, const FaceConfig& config,
                     FrontalAngle frontal_angle, std::optional<int> size)
    : capture_(capture),
      cameras_(std::move(cameras)),
      config_(config),
      frontal_angle_(std::move(frontal_angle)),
      size_(size.value_or(face_code_size(capture, config.signal))) {}

int face_code_size(const Capture& capture, FaceSignal signal) {
  if (signal == FaceSignal::None) return 0;
  if (signal == FaceSignal::Code) return capture.face_code_size();
  return static_cast<int>(expression_code(capture.pose(0)).size());
}

int required_face_code_size(const Capture& capture, const Config& config) {
  const int size = face_code_size(capture, config.face.signal);
  if (size == 0 && config.face.signal == FaceSignal::Code && reads_face_code(config.net)) {
    throw Error(
        "face.signal is code, and the capture has no face codes; name them by --codes, extract "
        "them by `degas encode-faces`, or set it to expression, mesh or none");
  }
  return size;
}

const FaceCodes::FrameCodes& FaceCodes::codes_of(int frame) {
  if (const auto found = kept_.find(frame); found != kept_.end()) return found->second;
  if (config_.signal == FaceSignal::None) return kept_[frame] = {};
  if (config_.signal != FaceSignal::Code) {
    std::vector<float> code = expression_code(capture_.pose(frame));
    if (static_cast<int>(code.size()) != size_) {
      throw Error::format("expression and jaw of frame {}: {} values where others have {}", frame, code.size(), size_);
    }
    return kept_[frame] = {{}, {std::move(code)}};
  }
  std::vector<std::pair<double, int>> ranking;
  for (int camera : cameras_) ranking.emplace_back(frontal_angle_(frame, capture_.camera(camera)), camera);
  std::sort(ranking.begin(), ranking.end());

  FrameCodes found;  // kept when complete: a later call for a broken frame fails again
  for (const auto& [angle, camera] : ranking) {
    if (static_cast<int>(found.cameras.size()) == config_.frontal_views) break;
    std::optional<std::vector<float>> code = capture_.face_code(frame, camera);
    if (!code) continue;
    const bool finite = std::all_of(code->begin(), code->end(), [](float value) { return std::isfinite(value); });
    if (static_cast<int>(code->size()) != size_ || !finite) {
      throw Error::format("face code of frame {}, camera {}: {}; extract it again or remove it", frame,
                          capture_.camera_names()[camera],
                          finite ? fmt::format("{} values where others have {}", code->size(), size_) : "not finite");
    }
    found.cameras.push_back(camera);
    found.codes.push_back(std::move(*code));
  }
  return kept_[frame] = std::move(found);
}

std::vector<float> FaceCodes::combine(const FrameCodes& frame, const std::vector<double>& weights) const {
  std::vector<double> total(size_, 0.0);
  for (size_t i = 0; i < frame.codes.size(); ++i) {
    for (int k = 0; k < size_; ++k) total[k] += weights[i] * static_cast<double>(frame.codes[i][k]);
  }
  return {total.begin(), total.end()};
}

std::vector<float> FaceCodes::mixture(int frame, Random& random) {
  const FrameCodes& codes = codes_of(frame);
  return combine(codes, random.convex_weights(codes.codes.size()));
}

std::vector<float> FaceCodes::mean(int frame) {
  const FrameCodes& codes = codes_of(frame);
  return combine(codes, std::vector<double>(codes.codes.size(),
                                            1.0 / std::max<double>(1.0, static_cast<double>(codes.codes.size()))));
}

}  // namespace degas
