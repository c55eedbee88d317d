#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "model/drive/pose.h"

namespace degas {

/// Places in SMPL-X's joint order that the avatar speaks of by name.
enum SmplxJoint : int {
  PelvisJoint = 0,
  HeadJoint = 15,
  JawJoint = 22,
  LeftEyeJoint = 23,
  RightEyeJoint = 24,
  LeftHandJoint = 25,
  RightHandJoint = 40
};
constexpr int joints_per_hand = 15;

/// One joint's share in moving a vertex.
struct JointWeight {
  int joint;
  double weight;
};

/// Joints of a posed body: each maps its own frame into the world, which is parallel to the joint's at rest.
struct JointFrames {
  std::vector<Eigen::Matrix3d> rotations;
  std::vector<Eigen::Vector3d> positions;  ///< metres
};

/// Linear blend shapes: the columns of a basis that are not zero throughout.
struct BlendShapes {
  std::vector<int> columns;    ///< ascending
  std::vector<float> offsets;  ///< columns.size() x V x 3, metres per unit
};

/// A body in the SMPL-X family: a template mesh with shape, expression and pose blend shapes, skinned about joints that
/// are regressed from the shaped mesh. Lengths in metres. Immutable and without caches, so that threads may share it.
/// The canonical pose is that of the template (all angles zero).
class BodyModel {
 public:
  /// Reads SMPL-X's npz (any V, F and J, float32 or float64; arrays not needed are not touched). Columns of
  /// `shapedirs`: from 300 on they are expression; a file of fewer than 300 has 10 shape columns, then expression (the
  /// smplx package's rule). Error naming file, key and reason: missing, wrong shape, not finite, indices out of range,
  /// a joint before its parent, weights that do not sum to 1.
  static BodyModel load(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  int vertex_count() const { return static_cast<int>(template_.size()); }
  int joint_count() const { return static_cast<int>(parents_.size()); }
  int face_count() const { return static_cast<int>(faces_.size()); }
  int shape_count() const { return shape_count_; }
  int expression_count() const { return expression_count_; }

  const std::vector<int>& parents() const { return parents_; }             ///< -1 for joint 0, the root
  const std::vector<std::array<int, 3>>& faces() const { return faces_; }  ///< vertices, counter-clockwise
  const std::vector<Eigen::Vector2d>& texture_coordinates() const { return texture_coordinates_; }  ///< u, v (up), 0..1
  const std::vector<std::array<int, 3>>& texture_faces() const { return texture_faces_; }  ///< into the coordinates
  /// The joints of non-zero weight, ascending; their weights sum to 1.
  std::span<const JointWeight> skinning_weights(int vertex) const {
    return {weights_.data() + weight_begins_[vertex], weights_.data() + weight_begins_[vertex + 1]};
  }

  /// Template + shape + expression, unposed. Missing coefficients are zero; Error for a non-zero one beyond the basis.
  std::vector<Eigen::Vector3d> canonical_vertices(const std::vector<double>& betas,
                                                  const std::vector<double>& expression) const;
  /// Rest joints: J_regressor times the shaped vertices without expression.
  std::vector<Eigen::Vector3d> joints(const std::vector<double>& betas) const;
  /// Forward kinematics with global rotation (about the root joint) and translation.
  JointFrames posed_joints(const Pose& pose, const std::vector<double>& betas) const;
  /// Linear blend skinning of the vertices with all blend shapes (Loper et al. 2015, Pavlakos et al. 2019).
  /// Without `include_global` the root's rotation and the translation are left out.
  std::vector<Eigen::Vector3d> posed_vertices(const Pose& pose, const std::vector<double>& betas,
                                              bool include_global) const;

  /// The pose with its finger angles whole: coefficients times the first rows of hands_componentsl/r where it has such,
  /// plus the mean hand unless flat_hand_mean (as the smplx package does). Error when the file has fewer components, or
  /// no mean hands.
  Pose with_hands(Pose pose, bool flat_hand_mean) const;
  bool has_hand_mean() const { return !hand_means_.empty(); }
  /// Vertices whose summed weight of head, jaw and eye joints exceeds one half, ascending.
  std::vector<int> head_vertices() const { return vertices_of({HeadJoint, JawJoint, LeftEyeJoint, RightEyeJoint}); }
  /// Those that the jaw moves: its weight exceeds one half.
  std::vector<int> jaw_vertices() const { return vertices_of({JawJoint}); }

 private:
  friend class BodyModelReader;
  BodyModel() = default;
  void check(const Pose& pose) const;
  void expand_hand(Pose& pose, int hand) const;
  std::vector<int> vertices_of(std::initializer_list<int> joints) const;
  void add_shapes(std::vector<Eigen::Vector3d>& vertices, const std::vector<double>& betas,
                  const std::vector<double>& expression) const;
  void add_pose_shapes(std::vector<Eigen::Vector3d>& vertices, const Pose& pose) const;
  JointFrames frames(const Pose& pose, const std::vector<Eigen::Vector3d>& rest, bool include_global) const;

  std::filesystem::path path_;
  std::vector<Eigen::Vector3d> template_;
  BlendShapes shapes_;  // betas, then expression
  BlendShapes pose_shapes_;
  int shape_count_ = 0, expression_count_ = 0;
  std::vector<Eigen::Vector3d> template_joints_;
  std::vector<Eigen::Vector3d> joint_shapes_;  // shapes_.columns x J: how a unit of each column moves the rest joints
  std::vector<int> parents_;
  std::vector<JointWeight> weights_;
  std::vector<int> weight_begins_;  // V + 1
  std::vector<std::array<int, 3>> faces_, texture_faces_;
  std::vector<Eigen::Vector2d> texture_coordinates_;
  std::vector<Eigen::Vector3d> hand_means_;  // left then right, axis-angles; empty where the file has none
  std::array<std::vector<Eigen::Vector3d>, 2> hand_components_;  // left, right: axis-angles, a hand after another
};

/// Radians between the direction that the head faces and the direction from the head to a point of the world.
double frontal_angle(const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                     const Eigen::Vector3d& from);

/// Rotation by an axis-angle vector (Rodrigues), exact near zero.
Eigen::Matrix3d rotation_from_axis_angle(const Eigen::Vector3d& axis_angle);

/// Area-weighted means of the normals of a vertex's triangles, unit length; zero where the area is.
std::vector<Eigen::Vector3d> vertex_normals(const std::vector<std::array<int, 3>>& faces,
                                            const std::vector<Eigen::Vector3d>& vertices);

}  // namespace degas
