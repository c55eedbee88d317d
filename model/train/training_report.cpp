#include "model/train/training_report.h"

#include <cmath>

#include "host/ops/splat.h"

namespace degas {

nlohmann::json history_line(const TrainingReport& report) {
  nlohmann::json line = {{"step", report.step},
                         {"seconds", report.seconds},
                         {"steps_per_second", report.steps_per_second},
                         {"learning_rate", report.learning_rate},
                         {"gradient_norm", report.gradient_norm},
                         {"skipped", report.skipped},
                         {"dead_texels", report.dead_texels},
                         {"exploded_texels", report.exploded_texels}};
  for (const auto& [name, value] : report.losses) line[name] = value;
  if (!report.skip_cause.empty()) line["skip_cause"] = report.skip_cause;
  if (report.validation_psnr) line["validation_psnr"] = *report.validation_psnr;
  return line;
}

TexelFaults count_faults(const Tensor& opacities, const Tensor& log_scales, const Tensor& base_log_scales,
                         double scale_limit) {
  const std::vector<float> opacity = opacities.to_host<float>(), log_scale = log_scales.to_host<float>(),
                           base = base_log_scales.to_host<float>();
  const double log_limit = std::log(scale_limit);
  TexelFaults faults;
  for (size_t i = 0; i < opacity.size(); ++i) {
    bool lives = opacity[i] >= faintest_opacity, exploded = false;
    for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
      lives = lives && std::abs(log_scale[k]) <= largest_log_scale;
      exploded = exploded || log_scale[k] > base[k] + log_limit;
    }
    faults.dead += !lives;
    faults.exploded += exploded;
  }
  return faults;
}

}  // namespace degas
