#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace degas {

/// Which mask multiplies channel c of the tiled pose: that of joint c div 3, that of joint c mod (number of joints) as
/// in the method's later release, or none.
enum class JointMasks { Joint, Modulo, None };
/// Skinning weights of a texel: interpolated over its triangle, or those of its nearest vertex.
enum class SkinningInterpolation { Barycentric, Nearest };
enum class LpipsNetwork { Alex, Squeeze, Vgg };
/// The part of the picture that the perceptual loss sees: all, the person's box, or the face's box.
enum class LossRegion { Full, Person, Face };
/// What tells the face's expression (method.md, "Driving signals"): the codes of a portrait encoder; the registered
/// expression coefficients and jaw, which then also drives the body's jaw joint; the same, which then also move the
/// body mesh itself; or nothing.
enum class FaceSignal { Code, Expression, Mesh, None };
enum class LearningRateSchedule { Constant, Cosine };

/// The method's own network, or another's choice to compare it with (model/net/map_network.h): maps that depend on
/// nothing; an encoder-decoder of the posed vertex map with skip connections; a network per texel.
enum class NetKind { Degas, Static, Skips, Mlp };

/// Sizes and switches of the network (method.md, "Network"). Channel lists are the paper's, before `width`.
struct NetConfig {
  NetKind kind = NetKind::Degas;  ///< degas | static | skips | mlp
  int resolution = 512;           ///< texels on a side of the Gaussian maps, R; a power of two of at least 128
  double width = 1;               ///< multiplies channel and code sizes, rounded to multiples of 8, at least 8
  std::vector<int> pvm_channels = {8, 16, 32};                    ///< posed-vertex-map encoder, sides R/2, R/4, R/8
  std::vector<int> pve_channels = {8, 16, 32, 32, 64, 128, 128};  ///< posed-vertex encoder, sides R/2 .. 4
  int latent_size = 1024;                                         ///< of the posed-vertex encoder's code z
  std::vector<int> pve_decoder_channels = {128, 128, 64, 32};     ///< its decoder, sides 8 .. R/8
  int pose_channels = 16;                                         ///< pose embedding, side R/8
  int face_start_channels = 32;                                   ///< face decoder's map of side 4
  std::vector<int> face_channels = {64, 64, 32};                  ///< face decoder, sides 8 .. R/16
  int joint_channels = 128;                                       ///< joint feature, side R/8
  std::vector<int> decoder_channels = {64, 32, 16};               ///< of each of the three groups, sides R/4, R/2, R
  bool use_pose_embedding = true;  ///< ablation: the pose angles, tiled over their joints' texels
  bool use_pvm = true;             ///< ablation: the convolutional encoding of the posed vertex map
  bool use_pve = true;             ///< ablation: the posed vertex map through the bottleneck z
  bool use_world_normals = false;  ///< also the surface's normals in the world: shading under the studio's fixed
                                   ///< lights, which the paper's signals, free of the global rotation, cannot tell
  bool isotropic = false;          ///< Gaussians are balls of one fixed opacity
  int color_degree = 0;  ///< of the spherical harmonics that make a colour depend on the direction it is seen from
                         ///< (sheen on hair, skin and cloth), 0 .. 3; 0, the paper's: the same from everywhere
  JointMasks joint_masks = JointMasks::Joint;  ///< joint | modulo | none
  bool untied_bias = true;                     ///< one bias per texel and channel rather than per channel
  int untied_bias_max_resolution = 1 << 20;    ///< layers with a larger side have tied biases (saves memory)
  double negative_slope = 0.2;                 ///< of the leaky ReLU
  double noise_std = 0;  ///< training noise on z, in units of exp(its log-variance); the release uses 1
  double kl_weight = 0;  ///< on the mean divergence of z from a unit Gaussian
};

/// From head maps to Gaussians (method.md, "Gaussian maps and posing").
struct GaussianConfig {
  double offset_scale = 0.05;    ///< metres of position per unit of the position head
  double rotation_scale = 0.05;  ///< quaternion change per unit of the rotation head
  double thin_axis = 1e-4;       ///< metres: base scale along the normal
  int max_influences = 8;        ///< joints that may move one Gaussian (the largest weights are kept)
  SkinningInterpolation skinning = SkinningInterpolation::Barycentric;  ///< barycentric | nearest
};

/// Weights of the loss's terms (method.md, "Loss, optimiser, schedule").
struct LossConfig {
  double ssim_weight = 0.2;                         ///< w of (1 - w) L1 + w (1 - SSIM)
  double lpips_weight = 0.1;                        ///< 0 switches the perceptual loss off
  LpipsNetwork lpips_network = LpipsNetwork::Alex;  ///< alex | squeeze | vgg
  std::string lpips_weights;                        ///< path of lpips_{network}_v0.1.npz; empty: $DEGAS_LPIPS
  LossRegion lpips_region = LossRegion::Full;       ///< full | person | face
  int lpips_every = 1;                              ///< steps between perceptual losses (its weight grows as much)
  double lpips_scale = 1;                           ///< factor on the region's size before the perceptual network
  double offset_weight = 0.001;                     ///< on the mean length of the position head
  double drift_weight = 0;                          ///< on the length of its mean over what a joint moves. Not in the paper
  double scale_weight = 1;                          ///< on log-scales that exceed scale_limit times their base
  double scale_limit = 10;
  /// On the mean shortfalls of opacity logits and log-scales below their floors; 0: off. Not in the paper.
  double collapse_weight = 0.01;
  double opacity_floor = 0.008;  ///< opacity under which a Gaussian is pulled up; under 1/255 none is drawn
  double scale_floor = 0.01;     ///< the same of scales, as a part of their base
};

struct GradientClipConfig {
  double norm = 1;            ///< a gradient whose Euclidean norm exceeds this ..
  double scale = 0.1;         ///< .. is scaled to this norm; norm 0 switches clipping off
  double offset_limit = 0.1;  ///< mean offset length above which the offset term alone is used for a step; 0: never
};

/// Optimiser and schedule. The paper: 800,000 steps of one image at a constant rate of 1e-4.
struct TrainConfig {
  int64_t iterations = 800000;  ///< optimiser steps
  int views_per_step = 1;       ///< cameras of one frame that share a decode
  double learning_rate = 1e-4;
  LearningRateSchedule schedule = LearningRateSchedule::Constant;  ///< constant | cosine
  double final_learning_rate_factor = 0.01;                        ///< cosine: the last step's rate over the first's
  int64_t warm_up_steps = 0;                                       ///< steps over which the rate rises linearly from 0
  double beta1 = 0.9, beta2 = 0.999;                               ///< Adam's decay of the moments
  double epsilon = 1e-15;                                          ///< Adam's
  GradientClipConfig gradient_clip;
  bool refine_poses = false;         ///< also fit the training frames' body poses
  double pose_learning_rate = 1e-3;  ///< of those, Rprop's: the first step, radians (and metres)
  bool random_background = true;     ///< a colour drawn per step; otherwise black
  int64_t validation_every = 1000;   ///< steps; 0: never
  int64_t checkpoint_every = 10000;  ///< steps; 0: only at the end
  int64_t log_every = 100;           ///< steps between lines of history.jsonl
  uint64_t seed = 1;
  double spike_limit =
      100;  ///< steps whose gradient norm exceeds so many times the largest of late are skipped; 0: none
  int max_skipped_steps = 20;  ///< skipped steps (spikes, non-finite ones) in a row before training stops
};

struct FaceConfig {
  FaceSignal signal = FaceSignal::Code;  ///< code | expression | mesh | none
  int frontal_views = 4;                 ///< face codes of a frame come from so many most frontal cameras
};

/// What is made wrong of a capture before it trains, to see what training withstands (model/data/corrupted_capture.h).
struct CorruptionConfig {
  double registration_degrees = 0;  ///< each joint of each frame is turned by an angle up to this ..
  double registration_metres = 0;   ///< .. and the body moved by a length up to this
  double wrong_masks = 0;           ///< share of the pictures whose mask is shifted, lacks a part or has one too much
  double missing_codes = 0;         ///< share of the frames that lose their face codes
  uint64_t seed = 1;                ///< of what is wrong where; not training's, so that runs of many seeds meet the same
  bool operator==(const CorruptionConfig&) const = default;
};

/// What of a capture is used. Cameras by name, frames by row, both also by ranges (model/data/selection.h); an empty
/// list means all, but holds out and validates none.
struct DataConfig {
  double image_scale = 1;               ///< factor on the pictures' sides (the paper trains DREAMS at half size)
  std::vector<std::string> cameras;     ///< that may be used at all
  std::vector<std::string> hold_out;    ///< cameras that training never sees, their face codes included
  std::vector<std::string> validation;  ///< training cameras set aside for the running PSNR; empty: none is
  std::vector<std::string> frames;      ///< rows of the capture's parameters
  bool crop_to_person = false;          ///< train on the person's box rather than whole pictures
  int crop_margin = 16;                 ///< pixels around that box
  CorruptionConfig corruption;          ///< none
};

struct RenderConfig {
  bool antialias = false;    ///< blur with its compensation factor (off in the paper)
  double near_plane = 0.05;  ///< metres: nearer splats are not drawn
  double blur = 0.3;         ///< square pixels on the diagonal of the projected covariance
};

/// Everything a run is made of; the defaults are the paper's full model. JSON files mirror this structure.
struct Config {
  std::string description;  ///< what the config stands for; of no effect
  NetConfig net;
  GaussianConfig gaussians;
  LossConfig loss;
  TrainConfig train;
  FaceConfig face;
  DataConfig data;
  RenderConfig render;
};

/// Defaults overridden by the file's keys, checked by validate. Throws Error naming the file and the key (and the
/// nearest known one) for unknown keys, wrong types and bad values.
Config load_config(const std::filesystem::path& path);
/// The same from text; `name` stands for the file in messages.
Config parse_config(const std::string& text, const std::string& name);
/// Applies "net.width=0.5": a dotted key and a value as in JSON, where strings need no quotes and lists may be written
/// "a,b". Throws Error as load_config does; the caller runs validate after the last override.
void apply_override(Config& config, const std::string& assignment);
/// Throws Error naming the key, its value and what is allowed; `name` is the file or option the config came from.
void validate(const Config& config, const std::string& name);

/// All keys as indented JSON, always in the same order and with numbers that read back exactly.
std::string config_text(const Config& config);
/// Dotted keys whose values differ, with both values: "net.width (1 / 0.5)".
std::vector<std::string> config_differences(const Config& a, const Config& b);

}  // namespace degas
