#pragma once

#include <optional>

#include "host/ops/camera.h"
#include "host/ops/image.h"
#include "model/body/body_model.h"
#include "model/drive/pose.h"

namespace degas {

/// The posed vertices that head, jaw and eyes move, in the world.
std::vector<Eigen::Vector3d> head_points(const BodyModel& body, const Pose& pose, const std::vector<double>& betas);

/// The box around points of the world, projected, cut to the picture; nothing where one lies behind the camera or all
/// outside.
std::optional<Rectangle> projected_box(const std::vector<Eigen::Vector3d>& points, const Camera& camera);

/// The head in a picture: the projected box of its points.
std::optional<Rectangle> head_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera);

/// The face box of the evaluation protocol: the head's box grown by an eighth of its size on every side, because hair
/// is not in the body model, and cut to the picture.
std::optional<Rectangle> face_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                  const Camera& camera);

/// The mouth box of the evaluation protocol: the box of the vertices that the jaw moves, lower lip to chin, grown by a
/// quarter of its size on every side, so that it holds the upper lip, and cut to the picture.
std::optional<Rectangle> mouth_box(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                                   const Camera& camera);

}  // namespace degas
