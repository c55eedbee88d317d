#include "model/train/training_report.h"

#include <cmath>

#include "host/ops/splat.h"

namespace degas {

nlohmann::json history_line(const TrainingReport& report) {
  nlohmann::json line = {{"step", report.step},
                         {"seconds", report.seconds},
                         {"steps_per_second", report.steps_per_second},
                         {"learning_rate", report.learning_rate},
                         {"skipped", report.skipped},
                         {"dead_texels", report.dead_texels}};
  for (const auto& [name, value] : report.losses) line[name] = value;
  if (!report.skip_cause.empty()) line["skip_cause"] = report.skip_cause;
  if (report.validation_psnr) line["validation_psnr"] = *report.validation_psnr;
  return line;
}

int64_t count_dead(const Tensor& opacities, const Tensor& log_scales) {
  const std::vector<float> opacity = opacities.to_host<float>(), log_scale = log_scales.to_host<float>();
  int64_t dead = 0;
  for (size_t i = 0; i < opacity.size(); ++i) {
    const bool lives = opacity[i] >= faintest_opacity && std::abs(log_scale[3 * i]) <= largest_log_scale &&
                       std::abs(log_scale[3 * i + 1]) <= largest_log_scale &&
                       std::abs(log_scale[3 * i + 2]) <= largest_log_scale;
    dead += !lives;
  }
  return dead;
}

}  // namespace degas
