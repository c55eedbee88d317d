#pragma once

#include <memory>
#include <vector>

#include "model/data/capture.h"

namespace degas {

/// A part of a capture as a capture of its own, in the order of the selections (model/data/selection.h): frame and
/// camera 0 are the first selected ones, frame_number keeps what the source calls the frame. identity() and
/// picture_identity() change with the selection; a selection of all in their order gives the source itself back.
std::unique_ptr<Capture> selected(std::unique_ptr<Capture> source, const std::vector<int>& frames,
                                  const std::vector<int>& cameras);

}  // namespace degas
