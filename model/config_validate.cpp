#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/error.h"
#include "host/ops/harmonics.h"
#include "model/config.h"

namespace degas {
namespace {

/// Refuses values with one line that names the source, the key and the range.
class Checker {
 public:
  explicit Checker(const std::string& name) : name_(name) {}

  template <typename Value>
  void require(bool holds, const char* key, const Value& value, const char* wanted) const {
    if (!holds) throw Error::format("{}: '{}' is {}; it must be {}", name_, key, value, wanted);
  }
  // Phrased positively: NaN fails too.
  void positive(const char* key, double value) const {
    require(value > 0 && std::isfinite(value), key, value, "above 0");
  }
  void not_negative(const char* key, double value) const {
    require(value >= 0 && std::isfinite(value), key, value, "at least 0");
  }
  void fraction(const char* key, double value) const { require(value >= 0 && value < 1, key, value, "in [0, 1)"); }
  void channels(const char* key, const std::vector<int>& list, size_t count) const {
    require(count ? list.size() == count : !list.empty(), key, list.size(),
            count ? fmt::format("a list of {} channel counts", count).c_str() : "a list of channel counts");
    for (const int value : list) positive(key, value);
  }

 private:
  const std::string& name_;
};

void validate_net(const NetConfig& net, const Checker& check) {
  const int r = net.resolution;
  check.require(r >= 128 && r <= 4096 && (r & (r - 1)) == 0, "net.resolution", r, "a power of two from 128 to 4096");
  check.require(net.width > 0 && net.width <= 8, "net.width", net.width, "above 0 and at most 8");
  check.require(net.color_degree >= 0 && net.color_degree <= largest_harmonic_degree, "net.color_degree",
                net.color_degree, "from 0 to 3");
  check.channels("net.pvm_channels", net.pvm_channels, 3);
  check.channels("net.pve_channels", net.pve_channels, 0);
  check.channels("net.pve_decoder_channels", net.pve_decoder_channels, 0);
  check.channels("net.face_channels", net.face_channels, 0);
  check.channels("net.decoder_channels", net.decoder_channels, 3);
  check.positive("net.latent_size", net.latent_size);
  check.positive("net.pose_channels", net.pose_channels);
  check.positive("net.face_start_channels", net.face_start_channels);
  check.positive("net.joint_channels", net.joint_channels);
  check.not_negative("net.untied_bias_max_resolution", net.untied_bias_max_resolution);
  check.require(net.negative_slope >= 0 && net.negative_slope <= 1, "net.negative_slope", net.negative_slope,
                "in [0, 1]");
  check.not_negative("net.noise_std", net.noise_std);
  check.not_negative("net.kl_weight", net.kl_weight);
  const int widest = std::max({net.pvm_channels.back(), net.pve_decoder_channels.back(), net.pose_channels});
  check.require(net.face_channels.back() >= widest, "net.face_channels", net.face_channels.back(),
                "at last no narrower than the maps whose corner it replaces (pvm, pve_decoder, pose)");
}

void validate_loss(const LossConfig& loss, const Checker& check) {
  check.require(loss.ssim_weight >= 0 && loss.ssim_weight <= 1, "loss.ssim_weight", loss.ssim_weight, "in [0, 1]");
  check.not_negative("loss.lpips_weight", loss.lpips_weight);
  check.positive("loss.lpips_every", loss.lpips_every);
  check.positive("loss.lpips_scale", loss.lpips_scale);
  check.not_negative("loss.offset_weight", loss.offset_weight);
  check.not_negative("loss.drift_weight", loss.drift_weight);
  check.not_negative("loss.scale_weight", loss.scale_weight);
  check.positive("loss.scale_limit", loss.scale_limit);
  check.not_negative("loss.collapse_weight", loss.collapse_weight);
  check.require(loss.opacity_floor > 0 && loss.opacity_floor < 1, "loss.opacity_floor", loss.opacity_floor,
                "above 0 and below 1");
  check.require(loss.scale_floor > 0 && loss.scale_floor < loss.scale_limit, "loss.scale_floor", loss.scale_floor,
                "above 0 and below loss.scale_limit");
}

void validate_corruption(const CorruptionConfig& corruption, const Checker& check) {
  check.require(corruption.registration_degrees >= 0 && corruption.registration_degrees <= 180,
                "data.corruption.registration_degrees", corruption.registration_degrees, "from 0 to 180");
  check.not_negative("data.corruption.registration_metres", corruption.registration_metres);
  check.fraction("data.corruption.wrong_masks", corruption.wrong_masks);
  check.fraction("data.corruption.missing_codes", corruption.missing_codes);
}

void validate_train(const TrainConfig& train, const Checker& check) {
  check.positive("train.iterations", static_cast<double>(train.iterations));
  check.positive("train.views_per_step", train.views_per_step);
  check.positive("train.learning_rate", train.learning_rate);
  check.not_negative("train.final_learning_rate_factor", train.final_learning_rate_factor);
  check.not_negative("train.warm_up_steps", static_cast<double>(train.warm_up_steps));
  check.fraction("train.beta1", train.beta1);
  check.fraction("train.beta2", train.beta2);
  check.positive("train.epsilon", train.epsilon);
  check.not_negative("train.gradient_clip.norm", train.gradient_clip.norm);
  check.positive("train.gradient_clip.scale", train.gradient_clip.scale);
  check.not_negative("train.gradient_clip.offset_limit", train.gradient_clip.offset_limit);
  check.positive("train.pose_learning_rate", train.pose_learning_rate);
  check.not_negative("train.validation_every", static_cast<double>(train.validation_every));
  check.not_negative("train.checkpoint_every", static_cast<double>(train.checkpoint_every));
  check.not_negative("train.log_every", static_cast<double>(train.log_every));
  check.require(train.spike_limit == 0 || train.spike_limit > 1, "train.spike_limit", train.spike_limit,
                "0 or above 1");
  check.positive("train.max_skipped_steps", train.max_skipped_steps);
}

}  // namespace

void validate(const Config& config, const std::string& name) {
  const Checker check(name);
  validate_net(config.net, check);
  check.not_negative("gaussians.offset_scale", config.gaussians.offset_scale);
  check.not_negative("gaussians.rotation_scale", config.gaussians.rotation_scale);
  check.positive("gaussians.thin_axis", config.gaussians.thin_axis);
  check.require(config.gaussians.max_influences >= 1 && config.gaussians.max_influences <= 64,
                "gaussians.max_influences", config.gaussians.max_influences, "from 1 to 64");
  validate_loss(config.loss, check);
  validate_train(config.train, check);
  check.require(config.data.image_scale > 0 && config.data.image_scale <= 4, "data.image_scale",
                config.data.image_scale, "above 0 and at most 4");
  check.positive("face.frontal_views", config.face.frontal_views);
  check.not_negative("data.crop_margin", config.data.crop_margin);
  validate_corruption(config.data.corruption, check);
  check.positive("render.near_plane", config.render.near_plane);
  check.not_negative("render.blur", config.render.blur);
}

}  // namespace degas
