#pragma once

#include <cstdint>
#include <memory>

#include "host/io/mapped_file.h"
#include "model/data/capture.h"

namespace degas {

// A capture in one file, for training without decoding (docs/captures.md, "A pack"). All integers little-endian:
//   "DEGASPK1", bytes of the file, eight sections (offset, bytes, checksum), checksum of all before: uint64 each
//   the pictures: person_pixels.h, frame after frame, in each the cameras in order
//   the sections, in the order of PackSection: JSON text, then NumPy's .npy format
// The same capture and options make the same bytes.

enum class PackSection : int {
  Description,   ///< JSON: identity, picture_identity, image_scale, cameras (names), joints, hand_coefficients (a hand,
                 ///< 0 where fingers are angles), flat_hand_mean, code_size
  Cameras,       ///< float64 (C, 18): width, height, fx, fy, cx, cy, rotation (row after row), translation
  Poses,         ///< float64 (T, 3 J + 3 + 2 H + E): axis-angles, translation, hand coefficients, expression
  FrameNumbers,  ///< int64 (T)
  Betas,         ///< float64 (B)
  Codes,         ///< float32 (M, code size)
  CodeRows,      ///< int64 (T, C): row in Codes, -1 where there is none
  Pictures       ///< int64 (T, C, 3): offset, bytes (0: none), checksum
};
inline constexpr int pack_section_count = 8;

struct PackSummary {
  int64_t pictures = 0, codes = 0;
  size_t bytes = 0;
  bool interrupted = false;  ///< then nothing was written
};

struct PackOptions {
  double image_scale = 1;                                          ///< that the capture was opened with
  int threads = 1;                                                 ///< that decode pictures
  std::function<void(int64_t frames, int64_t pictures)> progress;  ///< after each frame; may be empty
  std::function<bool()> stop_requested;                            ///< may be empty
  std::function<void(const std::string&)> warn = print_warning;
};

/// Writes a pack under a temporary name, then renames. A picture that cannot be used (an empty mask, a frame that does
/// not decode) counts as missing, with one warning a camera.
PackSummary write_pack(const std::filesystem::path& path, const Capture& capture, const PackOptions& options);

/// A pack as a capture: gives what the capture gave when it was packed, its identities included. A picture's checksum
/// is looked at whenever it is loaded, all others at opening; Error for what is damaged or cut short.
class PackedCapture : public Capture {
 public:
  /// image_scale: that is wanted; Error where the pictures were packed at another.
  PackedCapture(const std::filesystem::path& path, double image_scale);

  std::string identity() const override { return identity_; }
  std::string picture_identity() const override { return picture_identity_; }
  int frame_count() const override { return static_cast<int>(poses_.size()); }
  int64_t frame_number(int frame) const override { return frame_numbers_.at(static_cast<size_t>(frame)); }
  const std::vector<std::string>& camera_names() const override { return names_; }
  Camera camera(int camera) const override { return cameras_.at(static_cast<size_t>(camera)); }
  bool has_image(int frame, int camera) const override;
  Sample load(int frame, int camera) const override;
  Pose pose(int frame) const override { return poses_.at(static_cast<size_t>(frame)); }
  std::vector<double> betas() const override { return betas_; }
  bool flat_hand_mean() const override { return flat_hand_mean_; }
  int face_code_size() const override { return code_size_; }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override;
  bool has_face_code(int frame, int camera) const override;

 private:
  std::span<const std::byte> section(PackSection which) const;
  bool is_known(int frame, int camera) const;
  size_t place(int frame, int camera) const { return static_cast<size_t>(frame) * names_.size() + camera; }
  void read_description(double image_scale);
  void read_cameras();
  void read_poses();
  void read_codes();
  void read_pictures();

  std::filesystem::path path_;
  MappedFile file_;
  std::string identity_, picture_identity_;
  std::vector<std::string> names_;
  std::vector<Camera> cameras_;
  int joints_ = 0, hand_coefficients_ = 0, code_size_ = 0;
  std::vector<Pose> poses_;
  std::vector<int64_t> frame_numbers_, code_rows_, pictures_;
  std::vector<double> betas_;
  bool flat_hand_mean_ = false;
  std::vector<float> codes_;
};

}  // namespace degas
