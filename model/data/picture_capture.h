#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "host/io/lens.h"
#include "model/data/capture.h"
#include "model/data/dreams_codes.h"
#include "model/data/foreground.h"
#include "model/data/numbered_files.h"
#include "model/data/smplx_parameters.h"

namespace degas {

/// What a format's reader finds in a capture whose pictures and masks are files.
struct PictureLayout {
  struct View {
    std::string name;
    Lens lens;
    NumberedFiles pictures, masks;
  };
  std::filesystem::path folder;
  std::string format;                          ///< with a version: part of the identity
  std::vector<std::filesystem::path> files;    ///< calibration and lists
  std::filesystem::path parameters;            ///< file of the body parameters
  SmplxConventions conventions;                ///< of that file
  bool hard_masks = false;                     ///< masks are 255 from 128 on, else 0
  std::vector<View> views;                     ///< cameras in the calibration's order
  std::set<std::pair<int, int64_t>> excluded;  ///< (camera, frame number) that the capture itself calls missing
};

/// A capture of picture files, read and undistorted at every load (open_capture puts a cache before it).
///
/// At opening, Error for: missing or malformed body parameters; no camera with pictures, no picture that can be read,
/// or no mask at all. Warned of once: cameras without pictures; pictures or masks that are missing without being
/// excluded. Pictures are looked into when loaded: Error for one that does not decode or is of another size than its
/// camera.
class PictureCapture : public Capture {
 public:
  PictureCapture(PictureLayout layout, const CaptureOptions& options);

  std::string identity() const override { return identity_; }
  std::string picture_identity() const override { return picture_identity_; }
  int frame_count() const override { return static_cast<int>(parameters_.frame_numbers.size()); }
  int64_t frame_number(int frame) const override { return parameters_.frame_numbers.at(static_cast<size_t>(frame)); }
  const std::vector<std::string>& camera_names() const override { return names_; }
  Camera camera(int camera) const override {
    return layout_.views.at(static_cast<size_t>(camera)).lens.camera.scaled(options_.image_scale);
  }
  bool has_image(int frame, int camera) const override;
  Sample load(int frame, int camera) const override;
  Pose pose(int frame) const override { return parameters_.poses.at(static_cast<size_t>(frame)); }
  std::vector<double> betas() const override { return parameters_.betas; }
  bool flat_hand_mean() const override { return parameters_.flat_hand_mean; }
  bool has_poses() const override { return !parameters_.poses.empty(); }
  bool has_masks() const override { return has_masks_; }
  int face_code_size() const override { return codes_->size(); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return codes_->code(frame, camera);
  }
  bool has_face_code(int frame, int camera) const override { return codes_->has_code(frame, camera); }

 private:
  void read_parameters();
  void warn_of_gaps() const;
  void measure_background();
  void make_identity();
  /// The picture and its alpha at full size, undistorted.
  std::pair<Image8, Image8> read(int frame, int camera) const;

  PictureLayout layout_;
  CaptureOptions options_;
  SmplxParameters parameters_;
  std::vector<std::string> names_;
  bool has_masks_ = true;
  Background background_ = Background::Black;
  std::unique_ptr<DreamsCodes> codes_;
  std::string identity_, picture_identity_;
};

}  // namespace degas
