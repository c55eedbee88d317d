#pragma once

#include "model/data/wrapped_capture.h"

namespace degas {

/// A capture opened at another scale than a run was trained at, which the run still knows as its own: the poses that
/// training refined belong to the recording, whatever the size of its pictures.
class SameRecording final : public WrappedCapture {
 public:
  /// picture_identity: of the capture as the run was trained on it.
  SameRecording(std::unique_ptr<Capture> capture, std::string picture_identity)
      : WrappedCapture(std::move(capture)), picture_identity_(std::move(picture_identity)) {}

  std::string picture_identity() const override { return picture_identity_; }

 private:
  std::string picture_identity_;
};

}  // namespace degas
