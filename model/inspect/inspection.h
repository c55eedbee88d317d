#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/body/face_region.h"
#include "model/data/capture.h"
#include "model/inspect/diagnosis.h"

namespace degas {

struct InspectionOptions {
  std::vector<std::string> cameras, frames;  ///< selections; empty: some spread evenly over all
  int threads = 1;
};

/// What was found of one camera.
struct CameraFindings {
  std::string name;
  Camera camera;                          ///< at full size
  int pictures = 0;                       ///< of how many frames
  std::string gaps;                       ///< frames without one, "3, 7-9"; empty: none
  int codes = 0;                          ///< frames with a face code
  std::optional<double> mask_iou;         ///< mean over the frames looked at
  std::optional<double> frontal_degrees;  ///< mean angle to where the head faces
  int times_frontal = 0;                  ///< frames in which it is among the four most frontal cameras with a picture
};

/// A picture for the page: JPEG bytes and what is below it.
struct PagePicture {
  std::string jpeg, caption;
};

/// Everything that `degas inspect` says.
struct Inspection {
  int frame_count = 0, code_size = 0;
  bool has_poses = false, has_masks = false, has_body = false;
  std::vector<CameraFindings> cameras;
  std::vector<int> frames_seen, cameras_seen;      ///< that pictures were looked at of
  std::map<std::pair<int, int>, double> overlaps;  ///< by (frame, camera): silhouette and mask
  std::optional<double> mask_iou_mean, mask_iou_min;
  std::optional<Diagnosis> diagnosis;
  std::optional<FaceRegion> face_region;  ///< where the head lies in the UV atlas
  std::vector<PagePicture> overlays, face_rows;
  std::string atlas_png, plan_svg;
  std::vector<std::string> notes;     ///< what cannot be told, and why
  std::vector<std::string> warnings;  ///< of the capture's reader and of the diagnosis
};

/// Looks a capture through; `body` may be null. Reads pictures of the chosen frames and cameras only. `warnings` are
/// what its reader said.
Inspection inspect_capture(const Capture& capture, const BodyModel* body, const InspectionOptions& options,
                           std::vector<std::string> warnings);

}  // namespace degas
