#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/io/lens.h"
#include "model/data/capture.h"
#include "model/data/dreams_calibration.h"
#include "model/data/dreams_codes.h"
#include "model/data/foreground.h"
#include "model/data/smplx_parameters.h"

namespace degas {

/// A capture in the DREAMS layout, decoded from its videos at every load (open_capture puts a cache before it).
///
/// At opening, Error for: missing or malformed files; NaN parameters; a camera that capture.json lists as present
/// without a video; a video shorter than the parameters, or of another size than the calibration. Warned of once:
/// cameras without a video where capture.json has no list; rows that the frame offset pushes off the videos.
///
/// CaptureOptions::incomplete allows cameras.json and videos alone: videos as wide as their cameras have no mattes, and
/// without parameters frames are counted by the shortest video.
class DreamsCapture : public Capture {
 public:
  /// Does the folder hold this format? An incomplete one needs no capture.json.
  static bool recognises(const std::filesystem::path& folder, bool incomplete);

  DreamsCapture(const std::filesystem::path& folder, const CaptureOptions& options);
  ~DreamsCapture() override;

  std::string identity() const override { return identity_; }
  std::string picture_identity() const override { return picture_identity_; }
  int frame_count() const override { return static_cast<int>(parameters_.frame_numbers.size()); }
  int64_t frame_number(int frame) const override { return parameters_.frame_numbers.at(static_cast<size_t>(frame)); }
  const std::vector<std::string>& camera_names() const override { return names_; }
  Camera camera(int camera) const override {
    return lenses_.at(static_cast<size_t>(camera)).camera.scaled(options_.image_scale);
  }
  bool has_image(int frame, int camera) const override;
  Sample load(int frame, int camera) const override;
  Pose pose(int frame) const override { return parameters_.poses.at(static_cast<size_t>(frame)); }
  std::vector<double> betas() const override { return parameters_.betas; }
  bool flat_hand_mean() const override { return parameters_.flat_hand_mean; }
  bool has_poses() const override { return !parameters_.poses.empty(); }
  bool has_masks() const override { return has_mattes_; }
  int face_code_size() const override { return codes_->size(); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return codes_->code(frame, camera);
  }
  bool has_face_code(int frame, int camera) const override { return codes_->has_code(frame, camera); }

 private:
  struct Video;
  void open_videos();
  void check_size(size_t camera);
  void count_frames();
  void check_length(const Video& video) const;
  void warn_of_offset() const;
  void measure_background();
  void make_identity();
  int64_t video_frame(int frame) const;
  /// The colour and alpha halves of a frame of a camera's video, without the lens's distortion.
  std::pair<Image8, Image8> halves(int64_t video_frame, int camera) const;

  std::filesystem::path folder_, parameters_file_;
  CaptureOptions options_;
  std::vector<Lens> lenses_;
  DreamsDescription description_;
  SmplxParameters parameters_;
  std::unique_ptr<DreamsCodes> codes_;
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<Video>> videos_;  // null where a camera has none
  bool has_mattes_ = true;
  Background background_ = Background::Black;
  std::string identity_, picture_identity_;
};

}  // namespace degas
