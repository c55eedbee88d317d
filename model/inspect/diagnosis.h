#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/body/body_model.h"
#include "model/data/capture.h"
#include "model/inspect/misreading.h"

namespace degas {

/// A picture's mask with the camera that sees it, both made small.
struct MaskView {
  int frame = 0, camera = 0;
  Camera view;
  Image8 mask;
};

/// How well the posed body covers the person, when the capture is read otherwise than it is. All of the capture's
/// answers are asked for at once; fit may then be called with any reading.
class FitTrials {
 public:
  /// Poses the body in every frame of the views and in those one or two before and after it, where they are registered.
  FitTrials(const Capture& capture, const BodyModel& body, std::vector<MaskView> views, int threads);

  const std::vector<MaskView>& views() const { return views_; }
  /// Intersection over union of silhouette and mask in each view, all misreadings undone one after another; negative
  /// where a frame offset leads to a frame that is not registered.
  std::vector<double> fit(const std::vector<const Misreading*>& undone) const;

 private:
  struct PosedBody {
    std::vector<Eigen::Vector3d> vertices;
    Eigen::Vector3d translation;
  };
  std::vector<MaskView> views_;
  std::vector<std::array<int, 3>> faces_;
  std::map<int, int64_t> numbers_;       // of the views' frames, in the recording
  std::map<int64_t, PosedBody> bodies_;  // by such numbers
  int threads_;
};

/// What trying the misreadings says.
struct Diagnosis {
  struct Trial {
    std::string name, words;
    double mask_iou = 0;  ///< mean with this misreading undone
  };
  double mask_iou = 0;                 ///< mean of the capture as it was read
  std::vector<Trial> trials;           ///< each alone, the best first
  std::vector<std::string> suspected;  ///< names of what is probably wrong
  std::vector<std::string> sentences;  ///< the same in words, with figures, and what could not be explained
};

/// Tries every misreading on all views: one is suspected where undoing it fits clearly better; what then still is
/// wrong is tried on top. After that each camera that fits much worse than the others is tried by itself.
Diagnosis diagnose(const FitTrials& trials, const std::vector<std::string>& camera_names);

}  // namespace degas
