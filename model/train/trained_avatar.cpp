#include "model/train/trained_avatar.h"

#include <algorithm>

#include "host/error.h"
#include "model/train/training_state.h"

namespace degas {

TrainedAvatar::TrainedAvatar(Device& device, const RunFolder& run) {
  run.require_trained();
  const std::filesystem::path file = run.checkpoint_file();
  const Checkpoint checkpoint = read_checkpoint(file);
  std::vector<double> betas;
  std::vector<int> refined_frames;
  try {
    config_ = parse_config(checkpoint.header.at("config").dump(), file.string());
    capture_identity_ = checkpoint.header.at("capture");
    steps_ = checkpoint.header.at("step");
    face_code_size_ = checkpoint.header.at("face_code_size");
    betas = checkpoint.header.at("betas").get<std::vector<double>>();
    refined_frames = checkpoint.header.at("refined_frames").get<std::vector<int>>();
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the header of this checkpoint is broken: {}", file.string(), error.what());
  }
  avatar_ =
      std::make_unique<Avatar>(device, config_, BodyModel::load(run.body_file()), std::move(betas), face_code_size_);
  for (const ParameterStore::Parameter& parameter : avatar_->network().parameters().parameters()) {
    restore_tensor(parameter.value, parameter.name, checkpoint, file);
  }
  for (int frame : refined_frames) {
    PoseCorrection correction(device, avatar_->body().joint_count());
    restore_tensor(correction.axis_angles, PoseCorrection::name(frame, "axis_angles"), checkpoint, file);
    restore_tensor(correction.translation, PoseCorrection::name(frame, "translation"), checkpoint, file);
    corrections_.emplace(frame, correction);
  }
}

FaceCodes TrainedAvatar::face_codes(const Capture& capture) const {
  if (capture.face_code_size() != face_code_size_) {
    throw Error::format(
        "the capture's face codes have {} values, the avatar was trained with {}; extract them with the same encoder",
        capture.face_code_size(), face_code_size_);
  }
  std::vector<int> cameras;
  const std::vector<std::string>& held_out = config_.data.hold_out;
  for (size_t i = 0; i < capture.camera_names().size(); ++i) {
    if (std::find(held_out.begin(), held_out.end(), capture.camera_names()[i]) == held_out.end())
      cameras.push_back(static_cast<int>(i));
  }
  return FaceCodes(capture, std::move(cameras), config_.data.frontal_views,
                   [this, &capture](int frame, const Camera& camera) {
                     return avatar_->frontal_angle(capture.pose(frame), camera);
                   });
}

bool TrainedAvatar::is_refined(const Capture& capture, int frame) const {
  return corrections_.count(frame) > 0 && capture.identity() == capture_identity_;
}

Splats TrainedAvatar::pose(Tape& tape, const CanonicalGaussians& gaussians, const Avatar::Signal& signal,
                           const Capture& capture, int frame) const {
  return avatar_->pose(tape, gaussians,
                       is_refined(capture, frame) ? corrections_.at(frame).apply(tape, signal.body) : signal.body);
}

Splats TrainedAvatar::drive(Tape& tape, const Capture& capture, FaceCodes& codes, int frame) {
  const Avatar::Signal signal = avatar_->upload(avatar_->signal(capture, frame, codes.mean(frame)));
  return pose(tape, avatar_->decode(tape, signal).gaussians, signal, capture, frame);
}

}  // namespace degas
