#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string_view>

#include "model/data/mannequin_mesh.h"

namespace degas {

constexpr int mannequin_joint_count = 55;

/// Expression columns of the mannequin; coefficient 1 is a strong but natural expression.
enum class MannequinExpression : int {
  JawOpen,
  LipWide,
  LipPucker,
  Smile,
  MouthFrown,
  UpperLipRaise,
  LowerLipDrop,
  BrowRaise,
  BrowFrown,
  LidsClose,
  Squint,
  CheekPuff
};
constexpr int mannequin_expression_count = 12;
constexpr int mannequin_shape_count = 10;

/// Joints of the mannequin in SMPL-X order.
struct MannequinSkeleton {
  std::array<Eigen::Vector3d, mannequin_joint_count> joints;  // canonical A-pose, metres, Y up, floor at 0, facing +Z
  std::array<int, mannequin_joint_count> parents;             // -1 for the pelvis
};
MannequinSkeleton mannequin_skeleton();

/// The procedural humanoid as a body model: mesh, atlas, skinning, blend shapes.
struct MannequinBody {
  MannequinSkeleton skeleton;
  MannequinMesh mesh;
  std::vector<bool> below_mouth;    // per vertex: on the lower lip's side of the mouth slit
  Eigen::MatrixXf weights;          // (V, 55), rows sum to 1
  Eigen::MatrixXf joint_regressor;  // (55, V), rows sum to 1, regressor * vertices = skeleton.joints
  Eigen::MatrixXf shapes;           // (3V, 10) betas: stature, girth, head size, then zeros
  Eigen::MatrixXf expressions;      // (3V, 12), columns by MannequinExpression
};

/// Builds the body; always the same bits.
MannequinBody build_mannequin();

/// Writes the body as an SMPL-X style npz (formats.md): posedirs are zero, the hand components are the identity,
/// the flat hand is the mean hand.
void write_mannequin_body(const std::filesystem::path& path, const MannequinBody& body);

}  // namespace degas
