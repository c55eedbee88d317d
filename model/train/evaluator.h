#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "model/train/trained_avatar.h"

namespace degas {

struct EvaluationOptions {
  std::vector<int> cameras;  ///< of the capture
  std::vector<int> frames;
  std::filesystem::path output;
  std::function<bool()> stop_requested = [] { return false; };
};

/// Means over all pictures of the protocol of method.md ("Evaluation protocol"), measured on 8-bit pictures over white,
/// so that they can be made again from the files written.
struct EvaluationSummary {
  nlohmann::json metrics;  ///< what metrics.json holds
  int pictures = 0, refined_pictures = 0, without_picture = 0, without_face = 0;
};

/// Draws the avatar in every given frame and camera that has a picture, and writes below options.output: metrics.json,
/// per_frame.csv, truth/ and render/{camera}_{frame}.png, sheets/{camera}_{frame}.png (truth, render, error).
/// Frames whose pose training refined (on this very capture) are drawn with the refined pose. Throws Error when no
/// picture is left.
EvaluationSummary evaluate(Device& device, TrainedAvatar& avatar, const Capture& capture,
                           const EvaluationOptions& options, const std::function<void(int done, int total)>& progress);

}  // namespace degas
