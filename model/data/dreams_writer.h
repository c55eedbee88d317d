#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "host/io/image.h"
#include "host/io/video.h"
#include "host/ops/camera.h"
#include "model/drive/pose.h"

namespace degas {

/// Writes a capture in the DREAMS layout (cameras cam00, cam01, ... in the given order). Frames go to the videos at
/// once and without loss; nothing has its final name before finish, so an interrupted writer leaves no half capture.
class DreamsWriter {
 public:
  /// The folder is made; the cameras' sizes are the pictures'.
  DreamsWriter(const std::filesystem::path& folder, std::vector<Camera> cameras, double frames_per_second);
  ~DreamsWriter();

  /// Appends the next frame of a camera: RGB over black (colour times alpha) and alpha (1 channel). Different cameras
  /// may be written from different threads. A camera without any frame is calibrated but has no video.
  void write_frame(int camera, const Image8& image, const Image8& alpha);
  /// The face code of a view; all codes have one length. Views without a call have no code.
  void write_code(int frame, int camera, std::span<const float> code);
  /// Writes parameters (55 joints a pose), codes, calibration and description, and gives the videos their names. Every
  /// camera must have none or all of the frames. Shapes are padded to betas (300) and expression (100).
  void finish(const std::vector<Pose>& poses, const std::vector<double>& betas, bool flat_hand_mean);

 private:
  void write_parameters(const std::vector<Pose>& poses, const std::vector<double>& betas, bool flat_hand_mean) const;
  void write_codes() const;
  void write_calibration() const;
  void write_description(size_t frames) const;

  std::filesystem::path folder_;
  std::vector<Camera> cameras_;
  double frames_per_second_;
  std::vector<std::unique_ptr<VideoWriter>> videos_;
  std::map<std::pair<int, int>, std::vector<float>> codes_;  // by frame and camera
};

}  // namespace degas
