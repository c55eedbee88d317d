#pragma once

#include <vector>

#include "host/ops/image.h"
#include "model/config.h"
#include "model/data/capture.h"
#include "model/train/view_schedule.h"

namespace degas {

/// The config with its ranges of cameras written out as names, as a run keeps them: another sequence may lack cameras
/// that a range goes by.
Config with_camera_names(Config config, const Capture& capture);

/// The cameras that a config allows: data.cameras (or all) without data.hold_out.
std::vector<int> allowed_cameras(const Capture& capture, const DataConfig& data);

/// Which pictures train, which only validate, and the window that is cut out of them.
struct TrainingViews {
  std::vector<LoadRequest> training;  ///< frames with their cameras
  std::vector<FrameCamera>
      validation;  ///< set aside: every picture of data.validation's cameras, and one of each 16th frame
  int window_width = 0, window_height = 0;  ///< pixels cut out of each picture; 0: data.crop_to_person is off, no cut

  /// Throws Error when nothing is left to train on.
  TrainingViews(const Capture& capture, const DataConfig& data);
};

/// The smallest rectangle that holds every pixel of the mask of at least 16 of 255: below lies the noise of video
/// codecs. The whole picture where there is none.
Rectangle mask_box(const Image8& mask);

/// A window of the given size (at most the picture's) around the middle of `box`, moved to lie within a picture of
/// width x height.
Rectangle window_around(const Rectangle& box, int window_width, int window_height, int width, int height);

}  // namespace degas
