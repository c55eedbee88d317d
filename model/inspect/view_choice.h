#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/inspect/inspection.h"

namespace degas {

/// What every camera has: pictures, gaps, codes.
std::vector<CameraFindings> list_cameras(const Capture& capture);

/// Which pictures are looked at.
struct ChosenViews {
  std::vector<int> cameras, frames;  ///< frames ascending
  std::vector<std::pair<int, int>>
      drawn;  ///< (frame, camera) shown on the page: one a camera, of other frames each time
};
/// The selections; empty ones take up to 40 cameras that have pictures, and up to 12 frames, fewer for more cameras.
ChosenViews choose_views(const Capture& capture, const std::vector<std::string>& cameras,
                         const std::vector<std::string>& frames);

/// `count` of the items (all of fewer), spread evenly.
std::vector<int> spread(const std::vector<int>& items, int count);

}  // namespace degas
