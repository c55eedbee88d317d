#include "model/loss/loss.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "host/ops/pointwise.h"
#include "host/ops/regularizer.h"
#include "host/ops/ssim.h"
#include "model/loss/lpips_weights.h"

namespace degas {
namespace {

/// Sum of what is defined.
void add_to(Tape& tape, Tensor& sum, const Tensor& term) {
  sum = sum.defined() ? add(tape, sum, term) : term;
}

}  // namespace

std::map<std::string, double> LossTerms::values() const {
  std::map<std::string, double> numbers{{"loss", total.to_host<double>()[0]}};
  for (const auto& [name, term] : terms) numbers[name] = term.to_host<double>()[0];
  return numbers;
}

Loss::Loss(Device& device, const Config& config, const Tensor& base_log_scales, RowGroups parts)
    : config_(config.loss),
      kl_weight_(config.net.kl_weight),
      offset_limit_(config.train.gradient_clip.offset_limit),
      base_log_scales_(base_log_scales),
      parts_(std::move(parts)) {
  if (config_.lpips_weight > 0) {
    const std::filesystem::path path = lpips_weights_path(config_.lpips_weights, config_.lpips_network);
    lpips_.emplace(device, load_lpips_layers(path, config_.lpips_network));
  }
}

Tensor Loss::perceptual(Tape& tape, const LossView& view) const {
  Tensor image = view.image, target = view.target;
  if (config_.lpips_region == LossRegion::Face && !view.region) return {};
  if (config_.lpips_region != LossRegion::Full && view.region) {
    image = crop(tape, image, *view.region, view.background);
    target = crop(tape, target, *view.region, view.background);
  }
  const auto side = [&](int64_t length) {
    return std::max(lpips_->smallest_side(),
                    static_cast<int>(std::lround(static_cast<double>(length) * config_.lpips_scale)));
  };
  const int height = side(image.dim(0)), width = side(image.dim(1));
  if (height != image.dim(0) || width != image.dim(1)) {
    image = resize(tape, image, height, width);
    target = resize(tape, target, height, width);
  }
  return lpips_->distance(tape, image, target);
}

LossTerms Loss::evaluate(Tape& tape, const std::vector<LossView>& views, const LossMaps& maps, int64_t step) const {
  if (views.empty()) throw std::logic_error("[loss] no view");
  LossTerms loss;
  const double share = 1.0 / static_cast<double>(views.size());
  const bool has_perceptual = lpips_ && step % config_.lpips_every == 0;
  Tensor photometric, distance;
  for (const LossView& view : views) {
    add_to(tape, photometric, l1_ssim_loss(tape, view.image, view.target, config_.ssim_weight));
    if (!has_perceptual) continue;
    if (const Tensor term = perceptual(tape, view); term.defined()) add_to(tape, distance, term);
  }
  loss.terms["l1_ssim"] = scale(tape, photometric, share);
  Tensor total = loss.terms["l1_ssim"];
  const auto add_weighted = [&](const char* name, const Tensor& term, double weight) {
    loss.terms[name] = term;
    add_to(tape, total, scale(tape, term, weight));
  };
  if (distance.defined())
    add_weighted("lpips", scale(tape, distance, share), config_.lpips_weight * config_.lpips_every);
  add_weighted("scale", excess_scale(tape, maps.log_scales, base_log_scales_, config_.scale_limit),
               config_.scale_weight);
  if (config_.collapse_weight > 0) {
    const double least_logit = std::log(config_.opacity_floor / (1 - config_.opacity_floor));
    add_weighted("collapse",
                 add(tape, mean_shortfall(tape, maps.opacity_logits, least_logit),
                     mean_shortfall(tape, maps.log_scales, std::log(config_.scale_floor), base_log_scales_)),
                 config_.collapse_weight);
  }
  if (kl_weight_ > 0 && maps.divergence.defined()) add_weighted("kl", maps.divergence, kl_weight_);

  if (config_.drift_weight > 0)
    add_weighted("drift", mean_drift(tape, maps.position_offsets, parts_), config_.drift_weight);
  const Tensor offset = mean_length(tape, maps.position_offsets);
  if (offset_limit_ > 0) total = gate(tape, total, offset, offset_limit_);
  add_weighted("offset", offset, config_.offset_weight);
  loss.total = total;
  return loss;
}

}  // namespace degas
