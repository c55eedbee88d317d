#pragma once

#include <vector>

#include "model/data/capture.h"
#include "model/train/avatar.h"

namespace degas {

/// Cameras on a circle around the person, one per frame, a full turn in all: at the distance and with the intrinsics of
/// the capture's first camera, at the pelvis' height and looking at it. Up is the body's own, averaged over the frames.
std::vector<Camera> turntable(const Avatar& avatar, const Capture& capture, const std::vector<int>& frames);

}  // namespace degas
