#include "model/train/trained_avatar.h"

#include <algorithm>

#include "host/error.h"
#include "host/io/checksum.h"
#include "model/data/corrupted_capture.h"
#include "model/train/training_state.h"

namespace degas {
namespace {

bool is_named(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

TrainedAvatar::TrainedAvatar(Device& device, const RunFolder& run) {
  run.require_trained();
  const Checkpoint checkpoint = run.newest_checkpoint();
  RunState state = read_state(checkpoint);
  config_ = std::move(state.config);
  picture_identity_ = std::move(state.pictures);
  steps_ = state.step;
  face_code_size_ = state.face_code_size;
  avatar_ = std::make_unique<Avatar>(device, config_, BodyModel::load(run.body_file()), std::move(state.betas),
                                     face_code_size_);
  for (const ParameterStore::Parameter& parameter : avatar_->network().parameters().parameters()) {
    restore_tensor(parameter.value, parameter.name, checkpoint);
  }
  const Tensor refined = refined_angles(device, avatar_->body().joint_count());
  for (const int frame : state.refined_frames) {
    PoseCorrection correction(device, refined);
    restore_tensor(correction.axis_angles, PoseCorrection::name(frame, "axis_angles"), checkpoint);
    restore_tensor(correction.translation, PoseCorrection::name(frame, "translation"), checkpoint);
    corrections_.emplace(frame, correction);
  }
}

FaceCodes TrainedAvatar::face_codes(const Capture& capture) const {
  const bool uses_codes = face_code_size_ > 0 && reads_face_code(config_.net);
  const int size = face_code_size(capture, config_.face.signal);
  if (uses_codes && size != 0 && size != face_code_size_) {
    throw Error::format(
        "the capture's face codes have {} values, the avatar was trained with {}; {}", size, face_code_size_,
        config_.face.signal == FaceSignal::Code ? "extract them with the same encoder"
                                                : "as many coefficients in 'expression' of its parameters are needed");
  }
  const bool has_codes = uses_codes && size != 0;
  if (uses_codes && !has_codes) {
    fmt::print(stderr,
               "warning: face codes drive this avatar and the capture has none: its face stays at rest; name "
               "them by --codes, or extract them by `degas encode-faces`\n");
  }
  FaceConfig face = config_.face;
  if (!has_codes) face.signal = FaceSignal::None;  // zeros in all frames
  return FaceCodes(
      capture, has_codes ? seen_cameras(capture) : std::vector<int>(), face,
      [this, &capture](int frame, const Camera& camera) { return avatar_->frontal_angle(capture.pose(frame), camera); },
      face_code_size_);
}

std::vector<int> TrainedAvatar::seen_cameras(const Capture& capture) const {
  // A novel sequence may lack cameras of the training one, so names are compared rather than looked up.
  const DataConfig& data = config_.data;
  std::vector<int> cameras;
  for (size_t i = 0; i < capture.camera_names().size(); ++i) {
    const std::string& name = capture.camera_names()[i];
    const bool allowed = data.cameras.empty() || is_named(data.cameras, name);
    if (allowed && !is_named(data.hold_out, name)) cameras.push_back(static_cast<int>(i));
  }
  return cameras;
}

uint64_t TrainedAvatar::checksum() const {
  Checksum sum;
  const auto add = [&](const Tensor& tensor) {
    const std::vector<float> values = tensor.to_host<float>();
    sum.add(values.data(), values.size() * sizeof(float));
  };
  for (const ParameterStore::Parameter& parameter : avatar().network().parameters().parameters()) add(parameter.value);
  for (const auto& [frame, correction] : corrections_) {
    add(correction.axis_angles);
    add(correction.translation);
  }
  return sum.value();
}

std::unique_ptr<Capture> TrainedAvatar::as_registered(std::unique_ptr<Capture> capture) const {
  if (capture->picture_identity() != picture_identity_) return capture;
  CorruptionConfig registration = config_.data.corruption;
  registration.wrong_masks = registration.missing_codes = 0;
  return corrupted(std::move(capture), registration);
}

bool TrainedAvatar::is_refined(const Capture& capture, int frame) const {
  return corrections_.count(frame) > 0 && capture.picture_identity() == picture_identity_;
}

Pose TrainedAvatar::best_pose(const Capture& capture, int frame) const {
  Pose pose = avatar_->registered_pose(capture, frame);
  if (is_refined(capture, frame)) corrections_.at(frame).apply(pose);
  return pose;
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
