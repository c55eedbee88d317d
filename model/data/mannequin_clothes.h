#pragma once

#include <Eigen/Geometry>
#include <array>

#include "model/data/mannequin_body.h"
#include "model/data/mannequin_renderer.h"

namespace degas {

/// The mannequin's state in one frame.
struct MannequinPose {
  std::array<Eigen::Vector3d, mannequin_joint_count> axis_angles;  // local rotations, the root's is global
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  std::array<double, mannequin_expression_count> expression{};

  MannequinPose() { axis_angles.fill(Eigen::Vector3d::Zero()); }
};

/// Per joint: canonical world -> posed world.
std::vector<Eigen::Affine3d> pose_joints(const MannequinSkeleton& skeleton, const MannequinPose& pose);

/// Linear blend skinning of the body model's own vertices (what a body model registered to the person gives).
std::vector<Eigen::Vector3d> pose_body(const MannequinBody& body, const MannequinPose& pose);

/// Height (metres) of the cloth's folds over a canonical point, from the angles of the joints nearby.
double fold_height(MannequinChart chart, const Eigen::Vector3d& rest, const MannequinPose& pose);

/// The person in front of the cameras: the body with shirt, jeans, shoes and hair over it, finer than the body model.
class DressedMannequin {
 public:
  explicit DressedMannequin(const MannequinBody& body);

  /// Posed surface with normals; irradiance is left empty (light_scene). Refers to this object.
  LitScene pose(const MannequinPose& pose) const;
  const std::vector<Eigen::Vector3i>& shadow_casters() const { return coarse_triangles_; }

 private:
  struct Influence {
    int joint;
    float weight;
  };

  MannequinSkeleton skeleton_;
  MannequinTexture texture_;
  std::vector<Eigen::Vector3f> rest_;
  std::vector<Eigen::Vector3d> rest_bare_;  // without the clothes' thickness: where folds are evaluated
  std::vector<MannequinChart> charts_;      // per vertex
  std::vector<bool> cloth_;                 // per vertex
  std::vector<std::vector<Influence>> influences_;
  Eigen::MatrixXf expressions_;
  std::vector<Eigen::Vector3i> triangles_, coarse_triangles_;
  std::vector<std::array<Eigen::Vector2f, 3>> texture_coordinates_;
};

}  // namespace degas
