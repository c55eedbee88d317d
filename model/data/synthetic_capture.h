#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

struct SyntheticOptions {
  int frames = 48, novel_frames = 16;  ///< of the training and the novel sequence
  int views = 10;
  int width = 300, height = 400;  ///< pixels
  uint64_t seed = 1;              ///< of motion, cameras and code noise; the subject is always the same
};

/// The ring of cameras: denser in front, heights and focal lengths vary, principal points off centre; the person
/// fills about nine tenths of the picture's height. Camera 0 and the last one stand behind, the middle ones in front.
std::vector<Camera> synthetic_cameras(const SyntheticOptions& options);

/// Writes DIR/P1C1 (training sequence), DIR/P1C2 (novel sequence) in the DREAMS layout and DIR/body.npz. The parameters
/// are the true ones; clothes and hair are in the pictures only. progress(done, total) counts pictures and is called
/// from one thread at a time. Error for options without a meaning and for files that cannot be written.
void write_synthetic_capture(const std::filesystem::path& directory, const SyntheticOptions& options,
                             const std::function<void(int, int)>& progress = {});

}  // namespace degas
