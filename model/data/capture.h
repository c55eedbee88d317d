#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/io/image.h"
#include "host/ops/camera.h"
#include "model/drive/pose.h"

namespace degas {

/// Names one picture of a capture.
struct FrameCamera {
  int frame;   ///< 0-based row of the capture's parameters, whatever number the source gives the frame
  int camera;  ///< 0-based index into Capture::camera_names
  bool operator==(const FrameCamera&) const = default;
};

/// One picture with what is needed to draw it again.
struct Sample {
  int frame = 0, camera = 0;
  Camera view;   ///< of the picture as delivered, image scale included
  Image8 image;  ///< RGB, 0..255, the foreground over black: colour times alpha, never above the mask
  Image8 mask;   ///< one channel: alpha, 0..255; never all zero
};

/// A multi-view recording of one person: the one interface for all formats. Reading is thread-safe. Camera axes are
/// OpenCV's, lengths metres, angles radians (axis-angle).
class Capture {
 public:
  virtual ~Capture() = default;

  /// Changes with any file of the capture and with every option that changes a sample.
  virtual std::string identity() const = 0;
  /// The same without the face codes: keys caches of pictures.
  virtual std::string picture_identity() const { return identity(); }
  /// Rows of the parameters; frames are numbered 0 .. frame_count - 1.
  virtual int frame_count() const = 0;
  /// What the capture's own files call the frame, and the files of its face codes.
  virtual int64_t frame_number(int frame) const { return frame; }
  virtual const std::vector<std::string>& camera_names() const = 0;
  virtual Camera camera(int camera) const = 0;

  /// Is there a picture with a person in it? What is missing is warned of once.
  virtual bool has_image(int frame, int camera) const = 0;
  /// Error naming file, camera and frame where has_image is false.
  virtual Sample load(int frame, int camera) const = 0;

  /// Joints in SMPL-X order (55; root orientation at 0), jaw and expression as recorded: whoever drives an avatar by
  /// face codes neutralises them. Fingers need BodyModel::with_hands: they are relative to the mean hand unless
  /// flat_hand_mean, and may be as many coefficients of principal components for both hands in every frame.
  virtual Pose pose(int frame) const = 0;
  virtual std::vector<double> betas() const = 0;
  virtual bool flat_hand_mean() const = 0;

  /// False only where CaptureOptions::incomplete let a capture be opened without body parameters (pose, betas and
  /// flat_hand_mean are then an Error) or without masks (every mask is then 255 throughout).
  virtual bool has_poses() const { return true; }
  virtual bool has_masks() const { return true; }

  /// Length of every face code; 0 when the capture has none.
  virtual int face_code_size() const = 0;
  /// Nothing where no code exists for this view (a frame may have codes of cameras without a picture).
  virtual std::optional<std::vector<float>> face_code(int frame, int camera) const = 0;
  /// Is there a code? Cheaper than to read it.
  virtual bool has_face_code(int frame, int camera) const { return face_code(frame, camera).has_value(); }
};

/// "warning: ..." on the error output.
void print_warning(const std::string& text);

/// How a capture is opened.
struct CaptureOptions {
  double image_scale = 1;       ///< factor on the pictures' sides, above 0 and at most 1; moves the cameras too
  std::filesystem::path cache;  ///< folder of decoded pictures; empty: captures/ in the user's cache folder
  std::string format;           ///< one of capture_formats(); empty: told from the files
  std::filesystem::path codes;  ///< where face codes lie (DreamsCodes); empty: in the capture
  std::filesystem::path poses;  ///< body parameters instead of the capture's, or where it has none; empty: its own
  bool incomplete = false;      ///< also without body parameters, masks or capture.json: to look at, not to train
  std::function<void(const std::string&)> warn = print_warning;  ///< told once for each thing that is skipped
};

/// The file that tells which frames a capture has: its own body parameters or, where these are missing, options.poses.
std::filesystem::path frames_file(const std::filesystem::path& own_parameters, const CaptureOptions& options);

/// Names of the formats that are read: dreams, avatarrex (THuman4 too), actorshq.
std::vector<std::string> capture_formats();

/// Opens a capture that decodes a picture at every load: for looking at a few. A file is a pack (PackedCapture). Error
/// when a folder holds no known format, or for what the format's reader finds wrong.
std::unique_ptr<Capture> open_uncached_capture(const std::filesystem::path& path, const CaptureOptions& options = {});

/// Opens a capture with a cache of its decoded pictures in between: the first has_image or load of a camera decodes
/// that camera's pictures. Errors as above.
std::unique_ptr<Capture> open_capture(const std::filesystem::path& path, const CaptureOptions& options = {});

}  // namespace degas
