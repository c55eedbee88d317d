#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "model/train/evaluator.h"

namespace degas {

/// What `degas eval` measures beyond PSNR and SSIM.
struct MetricChoice {
  std::vector<std::string> lpips;  ///< empty: AlexNet's, where its weights are
  std::filesystem::path inception, expression;
  std::string inception_input, expression_input, keys;

  /// Loads the networks. Throws Error naming the file or option that is wrong.
  MetricNetworks networks(Device& device, const LossConfig& loss) const;
  /// The options as they were given; none by default.
  std::vector<std::string> words() const;
};
void add_metric_options(CLI::App& command, MetricChoice& choice);

}  // namespace degas
