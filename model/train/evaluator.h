#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "model/train/scores.h"
#include "model/train/trained_avatar.h"

namespace degas {

struct EvaluationOptions {
  std::vector<int> cameras;  ///< of the capture
  std::vector<int> frames;
  /// Whose poses give the face's and the mouth's box; null: the capture that is measured on. For poses that an avatar
  /// was fitted by: figures of different avatars are then of the same pixels.
  const Capture* boxes = nullptr;
  std::filesystem::path output;
  std::optional<MetricNetworks> networks;  ///< unset: default_metric_networks
  std::function<bool()> stop_requested = [] { return false; };
};

/// Means over all pictures of the protocol of method.md ("Evaluation protocol"), measured on 8-bit pictures over white,
/// so that they can be made again from the files written.
struct EvaluationSummary {
  nlohmann::json metrics;  ///< what metrics.json holds
  int pictures = 0, refined_pictures = 0, without_picture = 0, without_face = 0;
};

using EvaluationProgress = std::function<void(int done, int total)>;

/// Draws the avatar in every given frame and camera that has a picture, and fills an EvaluationFolder at
/// options.output; sheets show truth, render and error. Frames whose pose training refined (on this very capture) are
/// drawn with the refined pose. Throws Error when no picture is left.
EvaluationSummary evaluate(Device& device, TrainedAvatar& avatar, const Capture& capture,
                           const EvaluationOptions& options, const EvaluationProgress& progress);

/// Scores given pictures, a file {camera}_{frame}.png each in the folder `pictures`, against the photographs of an
/// earlier evaluation, in its boxes. Writes what evaluate does, but for truth/ and render/. Throws Error naming a
/// picture that is missing or of another size.
EvaluationSummary evaluate_pictures(Device& device, const std::filesystem::path& pictures,
                                    const EvaluationFolder& truth, const EvaluationOptions& options,
                                    const EvaluationProgress& progress);

/// The networks that a config's LPIPS weights give: AlexNet's, or none with a message to stderr where they are missing.
MetricNetworks default_metric_networks(const LossConfig& loss);

}  // namespace degas
