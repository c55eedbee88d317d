#pragma once

#include <string>
#include <vector>

#include "model/config.h"

namespace degas {

/// The words of each choice, in the order of its enumerators.
template <typename Choice>
std::vector<std::string> choice_names();
template <>
inline std::vector<std::string> choice_names<NetKind>() {
  return {"degas", "static", "skips", "mlp"};
}
template <>
inline std::vector<std::string> choice_names<JointMasks>() {
  return {"joint", "modulo", "none"};
}
template <>
inline std::vector<std::string> choice_names<SkinningInterpolation>() {
  return {"barycentric", "nearest"};
}
template <>
inline std::vector<std::string> choice_names<LpipsNetwork>() {
  return {"alex", "squeeze", "vgg"};
}
template <>
inline std::vector<std::string> choice_names<LossRegion>() {
  return {"full", "person", "face"};
}
template <>
inline std::vector<std::string> choice_names<FaceSignal>() {
  return {"code", "expression", "mesh", "none"};
}
template <>
inline std::vector<std::string> choice_names<LearningRateSchedule>() {
  return {"constant", "cosine"};
}

/// visit_fields calls visit(key, value) for every field of a section, in the order of config.h.
#define FIELD(name) visit(#name, config.name)

template <typename Visitor>
void visit_fields(NetConfig& config, Visitor& visit) {
  FIELD(kind);
  FIELD(resolution);
  FIELD(width);
  FIELD(pvm_channels);
  FIELD(pve_channels);
  FIELD(latent_size);
  FIELD(pve_decoder_channels);
  FIELD(pose_channels);
  FIELD(face_start_channels);
  FIELD(face_channels);
  FIELD(joint_channels);
  FIELD(decoder_channels);
  FIELD(use_pose_embedding);
  FIELD(use_pvm);
  FIELD(use_pve);
  FIELD(use_world_normals);
  FIELD(isotropic);
  FIELD(color_degree);
  FIELD(joint_masks);
  FIELD(untied_bias);
  FIELD(untied_bias_max_resolution);
  FIELD(negative_slope);
  FIELD(noise_std);
  FIELD(kl_weight);
}

template <typename Visitor>
void visit_fields(GaussianConfig& config, Visitor& visit) {
  FIELD(offset_scale);
  FIELD(rotation_scale);
  FIELD(thin_axis);
  FIELD(max_influences);
  FIELD(skinning);
}

template <typename Visitor>
void visit_fields(LossConfig& config, Visitor& visit) {
  FIELD(ssim_weight);
  FIELD(lpips_weight);
  FIELD(lpips_network);
  FIELD(lpips_weights);
  FIELD(lpips_region);
  FIELD(lpips_every);
  FIELD(lpips_scale);
  FIELD(offset_weight);
  FIELD(drift_weight);
  FIELD(scale_weight);
  FIELD(scale_limit);
  FIELD(collapse_weight);
  FIELD(opacity_floor);
  FIELD(scale_floor);
}

template <typename Visitor>
void visit_fields(GradientClipConfig& config, Visitor& visit) {
  FIELD(norm);
  FIELD(scale);
  FIELD(offset_limit);
}

template <typename Visitor>
void visit_fields(TrainConfig& config, Visitor& visit) {
  FIELD(iterations);
  FIELD(views_per_step);
  FIELD(learning_rate);
  FIELD(schedule);
  FIELD(final_learning_rate_factor);
  FIELD(warm_up_steps);
  FIELD(beta1);
  FIELD(beta2);
  FIELD(epsilon);
  FIELD(gradient_clip);
  FIELD(refine_poses);
  FIELD(pose_learning_rate);
  FIELD(random_background);
  FIELD(validation_every);
  FIELD(checkpoint_every);
  FIELD(log_every);
  FIELD(seed);
  FIELD(spike_limit);
  FIELD(max_skipped_steps);
}

template <typename Visitor>
void visit_fields(FaceConfig& config, Visitor& visit) {
  FIELD(signal);
  FIELD(frontal_views);
}

template <typename Visitor>
void visit_fields(CorruptionConfig& config, Visitor& visit) {
  FIELD(registration_degrees);
  FIELD(registration_metres);
  FIELD(wrong_masks);
  FIELD(missing_codes);
  FIELD(seed);
}

template <typename Visitor>
void visit_fields(DataConfig& config, Visitor& visit) {
  FIELD(image_scale);
  FIELD(cameras);
  FIELD(hold_out);
  FIELD(validation);
  FIELD(frames);
  FIELD(crop_to_person);
  FIELD(crop_margin);
  FIELD(corruption);
}

template <typename Visitor>
void visit_fields(RenderConfig& config, Visitor& visit) {
  FIELD(antialias);
  FIELD(near_plane);
  FIELD(blur);
}

template <typename Visitor>
void visit_fields(Config& config, Visitor& visit) {
  FIELD(description);
  FIELD(net);
  FIELD(gaussians);
  FIELD(loss);
  FIELD(train);
  FIELD(face);
  FIELD(data);
  FIELD(render);
}

#undef FIELD

}  // namespace degas
