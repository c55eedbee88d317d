#pragma once

#include <filesystem>
#include <vector>

#include "host/ops/lpips.h"
#include "model/config.h"

namespace degas {

/// The layers of torchvision's AlexNet, SqueezeNet 1.1 or VGG16 with LPIPS v0.1's linear weights, from an .npz with the
/// keys features.* (OIHW) and lin*. Throws Error naming file and key.
std::vector<LpipsLayer> load_lpips_layers(const std::filesystem::path& path, LpipsNetwork network);

/// Where lpips_{alex,squeeze,vgg}_v0.1.npz is: `configured` (loss.lpips_weights: the file or its folder) when given,
/// else the file or folder that $DEGAS_LPIPS names. Throws Error that tells the remedy when there is none.
std::filesystem::path lpips_weights_path(const std::string& configured, LpipsNetwork network);

}  // namespace degas
