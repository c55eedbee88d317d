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
  std::vector<float> canonical_positions;  ///< (N, 3) metres: where the covered texels lie on the body at rest with the
                                           ///< pose's expression; empty unless wanted
  std::vector<float> face_code;            ///< as the caller gives it
};

/// What of the registered pose moves the body. The face signal alone tells the expression: the jaw stays at zero unless
/// the signal holds it (FaceSignal::Expression and Mesh), and so do the coefficients but for FaceSignal::Mesh.
Pose driven_pose(Pose registered, FaceSignal signal);

/// The code of FaceSignal::Expression and Mesh: the registered expression coefficients, then the jaw's axis-angle.
std::vector<float> expression_code(const Pose& registered);

/// What is made besides, because not every network reads it.
struct SignalParts {
  bool world_normals = false;        ///< for net.use_world_normals
  bool canonical_positions = false;  ///< for FaceSignal::Mesh
};

/// Builds the signal of one frame from its driven pose. Pure host work of some milliseconds, meant for the loader's
/// thread.
DrivingSignal make_driving_signal(const BodyModel& body, const UvAtlas& atlas, Pose driven,
                                  const std::vector<double>& betas, std::vector<float> face_code, SignalParts parts);

}  // namespace degas
