#pragma once

#include <vector>

#include "model/body/body_model.h"
#include "model/body/uv_atlas.h"
#include "model/config.h"
#include "model/drive/pose.h"

namespace degas {

/// Everything that drives the avatar in one frame, on the host (method.md, "Driving signals").
struct DrivingSignal {
  Pose pose;                            ///< as driven_pose makes it
  std::vector<float> joint_angles;      ///< theta: axis-angles of joints 1 .. J-1, radians, (J-1) * 3
  std::vector<float> posed_vertex_map;  ///< (R, R, 3), metres
  std::vector<float> world_normals;  ///< (R, R, 3), of the posed surface with its global rotation; empty unless wanted
  std::vector<float> face_code;      ///< as the caller gives it
};

/// The registered pose without its expression, which the face signal tells alone, and with the jaw at zero unless the
/// signal holds it (FaceSignal::Expression).
Pose driven_pose(Pose registered, FaceSignal signal);

/// FaceSignal::Expression's code: the registered expression coefficients, then the jaw's axis-angle.
std::vector<float> expression_code(const Pose& registered);

/// Builds the signal of one frame from its driven pose. Pure host work of some milliseconds, meant for the loader's
/// thread.
/// with_world_normals: also those, which are read only where net.use_world_normals is on.
DrivingSignal make_driving_signal(const BodyModel& body, const UvAtlas& atlas, Pose driven,
                                  const std::vector<double>& betas, std::vector<float> face_code,
                                  bool with_world_normals);

}  // namespace degas
