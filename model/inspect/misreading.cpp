#include "model/inspect/misreading.h"

#include <fmt/format.h>

#include <Eigen/LU>

namespace degas {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Camera with_rotation(Camera camera, const Matrix3d& rotation, const Vector3d& center) {
  camera.rotation = rotation;
  camera.translation = -rotation * center;
  return camera;
}

void add_extrinsics(std::vector<Misreading>& all) {
  all.push_back({"camera_to_world",
                 "extrinsics are camera to world, but were taken as world to camera: invert [R|T] in the calibration",
                 [](Camera camera) {
                   const Vector3d center = camera.translation;
                   return with_rotation(camera, camera.rotation.transpose(), center);
                 },
                 {}});
  const std::string words =
      "rotations are transposed (camera to world taken as world to camera, or the reverse): transpose R in the "
      "calibration";
  all.push_back({"transposed_rotation",
                 words,
                 [](Camera camera) { return with_rotation(camera, camera.rotation.transpose(), camera.center()); },
                 {}});
  all.push_back({"transposed_rotation",
                 words,
                 [](Camera camera) {
                   camera.rotation.transposeInPlace();
                   return camera;
                 },
                 {}});
  // A calibration whose world has Y and Z turned round before R, as DREAMS' has.
  all.push_back({"transposed_rotation",
                 words,
                 [](Camera camera) {
                   const Matrix3d turned = Vector3d(1, -1, -1).asDiagonal();
                   return with_rotation(camera, turned * camera.rotation.transpose() * turned, camera.center());
                 },
                 {}});
}

/// Axes of the cameras' own frames.
void add_camera_axes(std::vector<Misreading>& all) {
  const auto add = [&](const char* name, const char* words, const Vector3d& signs) {
    all.push_back({name,
                   words,
                   [signs](Camera camera) {
                     camera.rotation = signs.asDiagonal() * camera.rotation;
                     camera.translation = signs.asDiagonal() * camera.translation;
                     return camera;
                   },
                   {}});
  };
  add("opengl_camera_axes", "cameras look along -Z with Y up (OpenGL's axes): negate the second and third row of [R|T]",
      {1, -1, -1});
  add("flipped_y", "the cameras' Y axis points up instead of down: negate the second row of [R|T]", {1, -1, 1});
  add("rotated_image",
      "pictures are upside down, turned by 180 degrees: turn them, or negate the first two rows of [R|T]", {-1, -1, 1});
}

/// Axes of the world, in which body and cameras must agree.
void add_world_axes(std::vector<Misreading>& all) {
  const auto add_body = [&](const char* name, const char* axes, const Matrix3d& turn) {
    const std::string words =
        fmt::format("the body's world has {} against the cameras': convert the cameras or the body parameters", axes);
    all.push_back(
        {name, words, {}, [turn](const Vector3d& vertex, const Vector3d&) { return Vector3d(turn * vertex); }});
  };
  const auto diagonal = [](double x, double y, double z) -> Matrix3d { return Vector3d(x, y, z).asDiagonal(); };
  add_body("flipped_x", "the X axis flipped", diagonal(-1, 1, 1));
  add_body("flipped_y", "the Y axis flipped", diagonal(1, -1, 1));
  add_body("flipped_z", "the Z axis flipped", diagonal(1, 1, -1));
  add_body("flipped_yz", "the Y and Z axes flipped (a Y-down world)", diagonal(1, -1, -1));
  add_body("flipped_xz", "the X and Z axes flipped (turned round the vertical)", diagonal(-1, 1, -1));
  add_body("flipped_xy", "the X and Y axes flipped", diagonal(-1, -1, 1));
  add_body("swapped_yz", "the Y and Z axes swapped (Z up, Y up)",
           (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished());
  add_body("swapped_yz", "the Y and Z axes swapped (Y up, Z up)",
           (Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished());

  all.push_back({"flipped_yz",
                 "rotations are of a world with the Y and Z axes flipped, the cameras' centres are not: multiply R by "
                 "diag(1,-1,-1) from the right",
                 [](Camera camera) {
                   const Matrix3d turn = Vector3d(1, -1, -1).asDiagonal();
                   return with_rotation(camera, camera.rotation * turn, camera.center());
                 },
                 {}});
  const auto add_centers = [&](const char* name, const char* axis, const Vector3d& signs) {
    all.push_back({name,
                   fmt::format("the {} coordinate of the cameras' centres has the wrong sign", axis),
                   [signs](Camera camera) {
                     return with_rotation(camera, camera.rotation, signs.asDiagonal() * camera.center());
                   },
                   {}});
  };
  add_centers("flipped_x", "X", {-1, 1, 1});
  add_centers("flipped_y", "Y", {1, -1, 1});
  add_centers("flipped_z", "Z", {1, 1, -1});
  const auto add_translation = [&](const char* name, const char* axis, const Vector3d& signs) {
    all.push_back({name,
                   fmt::format("the {} component of 'transl' has the wrong sign", axis),
                   {},
                   [signs](const Vector3d& vertex, const Vector3d& translation) {
                     return Vector3d(vertex - translation + signs.asDiagonal() * translation);
                   }});
  };
  add_translation("flipped_y", "Y", {1, -1, 1});
  add_translation("flipped_z", "Z", {1, 1, -1});
}

/// Lengths that would be out of the question if they were metres; others stay as they are, or a body that stands
/// beside its place would fit better for having lost its way there.
constexpr double no_distance_of_cameras = 30, no_translation = 3;

void add_units(std::vector<Misreading>& all) {
  const auto add = [&](const std::string& unit, double factor) {
    all.push_back({unit,
                   fmt::format("the cameras' positions are in {}: multiply them by {}", unit, factor),
                   [factor](Camera camera) {
                     if (camera.translation.norm() > no_distance_of_cameras) camera.translation *= factor;
                     return camera;
                   },
                   {}});
    all.push_back({unit,
                   fmt::format("'transl' of the body parameters is in {}: multiply it by {}", unit, factor),
                   {},
                   [factor](const Vector3d& vertex, const Vector3d& translation) {
                     if (translation.norm() < no_translation) return vertex;
                     return Vector3d(vertex - (1 - factor) * translation);
                   }});
    all.push_back({unit,
                   fmt::format("the body model is in {}: multiply its template and shapes by {}", unit, factor),
                   {},
                   [factor](const Vector3d& vertex, const Vector3d& translation) {
                     if ((vertex - translation).norm() < no_translation) return vertex;
                     return Vector3d(factor * (vertex - translation) + translation);
                   }});
  };
  add("millimetres", 0.001);
  add("centimetres", 0.01);
}

}  // namespace

const std::vector<Misreading>& misreadings() {
  static const std::vector<Misreading> all = [] {
    std::vector<Misreading> list;
    add_extrinsics(list);
    add_camera_axes(list);
    add_world_axes(list);
    add_units(list);
    for (const int offset : {-2, -1, 1, 2}) {
      Misreading late{
          fmt::format("frame_offset_{:+}", offset),
          fmt::format("pictures and body parameters are off by {}: the picture of frame i shows the pose of "
                      "frame i {} {} (DREAMS: frame_convention.offset_d)",
                      std::abs(offset) == 1 ? "one frame" : "two frames", offset < 0 ? '-' : '+', std::abs(offset)),
          {},
          {}};
      late.frame_offset = offset;
      list.push_back(late);
    }
    Misreading mirrored{"mirrored_image", "pictures are mirrored, left for right: flip them back, masks too", {}, {}};
    mirrored.mirrored_image = true;
    list.push_back(mirrored);
    Misreading upside_down{"flipped_y", "pictures are mirrored top to bottom: flip them back, masks too", {}, {}};
    upside_down.image_upside_down = true;
    list.push_back(upside_down);
    return list;
  }();
  return all;
}

}  // namespace degas
