#include "model/train/avatar.h"

namespace degas {
namespace {

Tensor upload_joint_masks(Device& device, const BodyModel& body, const NetConfig& net) {
  const int side = net.resolution / 8;
  return Tensor::from(device, {side, side, body.joint_count() - 1}, std::span<const float>(joint_masks(body, side)));
}

Tensor upload_vector(Device& device, const std::vector<float>& values) {
  return Tensor::from(device, {static_cast<int64_t>(values.size())}, std::span<const float>(values));
}

}  // namespace

Avatar::Avatar(Device& device, const Config& config, BodyModel body, std::vector<double> betas, int face_code_size)
    : device_(device),
      config_(config),
      body_(std::move(body)),
      betas_(std::move(betas)),
      atlas_(body_, config.net.resolution),
      skeleton_(make_skeleton(device, body_, betas_)),
      network_(make_network(device, config.net, face_code_size, upload_joint_masks(device, body_, config.net),
                            config.train.seed, find_face_region(body_))) {
  const GaussianConfig& gaussians = config.gaussians;
  BaseMaps maps =
      make_base_maps(body_, betas_, atlas_, gaussians.max_influences, gaussians.thin_axis, gaussians.skinning);
  if (config.net.isotropic) make_isotropic(maps);
  base_ = make_gaussian_base(device, maps);
  skinning_ = make_skinning_weights(device, maps);
}

Pose Avatar::registered_pose(const Capture& capture, int frame) const {
  return body_.with_hands(capture.pose(frame), capture.flat_hand_mean());
}

DrivingSignal Avatar::signal(const Pose& registered, std::vector<float> face_code) const {
  return make_driving_signal(body_, atlas_, driven_pose(registered), betas_, std::move(face_code),
                             {network_->config().use_world_normals, config_.face.signal == FaceSignal::Mesh});
}

DrivingSignal Avatar::signal(const Capture& capture, int frame, std::vector<float> face_code) const {
  return signal(registered_pose(capture, frame), std::move(face_code));
}

Avatar::Signal Avatar::upload(const DrivingSignal& signal) const {
  const int64_t side = atlas_.resolution();
  const auto upload_map = [&](const std::vector<float>& map) {
    return Tensor::from(device_, {1, side, side, 3}, std::span<const float>(map));
  };
  return {{upload_map(signal.posed_vertex_map), upload_vector(device_, signal.joint_angles),
           upload_vector(device_, signal.face_code),
           signal.world_normals.empty() ? Tensor() : upload_map(signal.world_normals)},
          make_device_pose(device_, signal.pose),
          signal.canonical_positions.empty()
              ? Tensor()
              : Tensor::from(device_, {gaussian_count(), 3}, std::span<const float>(signal.canonical_positions))};
}

Avatar::Decoded Avatar::decode(Tape& tape, const Signal& signal, std::optional<uint64_t> noise_seed) const {
  const HeadMaps maps = network_->decode(tape, signal.network, noise_seed);
  GaussianBase base = base_;
  if (signal.canonical_positions.defined()) base.positions = signal.canonical_positions;
  return {assemble(tape, {maps.position_offsets, maps.rotation_scale, maps.color_opacity, maps.color_harmonics}, base,
                   {config_.gaussians.offset_scale, config_.gaussians.rotation_scale}),
          maps.divergence};
}

Splats Avatar::pose(Tape& tape, const CanonicalGaussians& gaussians, const DevicePose& body) const {
  return pose_gaussians(tape, gaussians, skinning_, skeleton_, body);
}

double Avatar::frontal_angle(const Pose& pose, const Camera& camera) const {
  return degas::frontal_angle(body_, pose, betas_, camera.center());
}

std::vector<int32_t> Avatar::main_joints() const {
  const std::vector<int32_t> joints = skinning_.joints.to_host<int32_t>();
  const auto influences = static_cast<size_t>(skinning_.joints.dim(1));
  std::vector<int32_t> heaviest(joints.size() / influences);
  for (size_t i = 0; i < heaviest.size(); ++i) heaviest[i] = joints[i * influences];
  return heaviest;
}

}  // namespace degas
