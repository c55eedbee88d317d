#include "model/data/mannequin_clothes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "model/data/mannequin_parts.h"
#include "model/data/mannequin_texture.h"

namespace degas {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// How far clothes, shoes and hair stand off the body (metres).
double thickness(MannequinChart chart, const Vector3d& p) {
  switch (mannequin_material(chart, p)) {
    case MannequinMaterial::Hair:
      return (0.009 + 0.011 * smoothstep(1.69, 1.75, p.y()) + 0.003 * value_noise(p / 0.03)) *
             smoothstep(0.45, 0.95, hair_amount(p));
    case MannequinMaterial::Shirt:
      if (chart == MannequinChart::Torso) {
        return p.y() > 1.485 ? 0.013 : 0.009 + 0.013 * bell(p.y() - 1.06, 0.10) * (p.z() > 0 ? 0.7 : 1.2);
      }
      return 0.0075 + 0.004 * bell(along_arm(p) - 0.22, 0.12) + (along_arm(p) > 0.45 ? 0.0015 : 0);
    case MannequinMaterial::Trousers:
      return chart == MannequinChart::Torso ? 0.006 : 0.008 + 0.012 * smoothstep(0.45, 0.14, p.y());
    case MannequinMaterial::Shoe:
      return p.y() < 0.018 ? 0.010 : 0.006;
    default:
      return 0;
  }
}

/// Midpoint that bulges towards the surface the normals suggest (Phong tessellation, strength 3/4).
Vector3d curved_midpoint(const Vector3d& a, const Vector3d& b, const Vector3d& normal_a, const Vector3d& normal_b) {
  const Vector3d middle = 0.5 * (a + b);
  return middle - 0.375 * ((middle - a).dot(normal_a) * normal_a + (middle - b).dot(normal_b) * normal_b);
}

}  // namespace

std::vector<Eigen::Affine3d> pose_joints(const MannequinSkeleton& skeleton, const MannequinPose& pose) {
  std::vector<Eigen::Affine3d> transforms(mannequin_joint_count);
  for (int j = 0; j < mannequin_joint_count; ++j) {
    const Vector3d& axis_angle = pose.axis_angles[j];
    const double angle = axis_angle.norm();
    const Eigen::Matrix3d rotation =
        angle > 1e-12 ? Eigen::AngleAxisd(angle, axis_angle / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    // Rotation about the joint's canonical place.
    Eigen::Affine3d local = Eigen::Affine3d::Identity();
    local.linear() = rotation;
    local.translation() = skeleton.joints[j] - rotation * skeleton.joints[j];
    if (skeleton.parents[j] < 0) {
      local.translation() += pose.translation;
      transforms[j] = local;
    } else {
      transforms[j] = transforms[skeleton.parents[j]] * local;
    }
  }
  return transforms;
}

std::vector<Vector3d> pose_body(const MannequinBody& body, const MannequinPose& pose) {
  const auto transforms = pose_joints(body.skeleton, pose);
  std::vector<Vector3d> posed(body.mesh.vertices.size());
  for (size_t v = 0; v < posed.size(); ++v) {
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(v);
    Vector3d p = body.mesh.vertices[v];
    for (int e = 0; e < mannequin_expression_count; ++e) {
      p += pose.expression[e] * body.expressions.block<3, 1>(row, e).cast<double>();
    }
    posed[v].setZero();
    for (int j = 0; j < mannequin_joint_count; ++j) {
      const double weight = body.weights(static_cast<Eigen::Index>(v), j);
      if (weight > 0) posed[v] += weight * (transforms[j] * p);
    }
  }
  return posed;
}

DressedMannequin::DressedMannequin(const MannequinBody& body)
    : skeleton_(body.skeleton), texture_(paint_mannequin(body, 1024)), coarse_triangles_(body.mesh.triangles) {
  const MannequinMesh& mesh = body.mesh;
  const size_t coarse_count = mesh.vertices.size();
  const auto normals = vertex_normals(mesh.vertices, mesh.triangles);
  std::vector<MannequinChart> coarse_charts(coarse_count, MannequinChart::Torso);
  for (size_t t = mesh.triangles.size(); t-- > 0;) {
    for (int k = 0; k < 3; ++k) coarse_charts[mesh.triangles[t][k]] = mesh.triangle_charts[t];
  }
  // The lips' and lids' rims belong to the head, whatever else shares them: triangles come head first.
  std::vector<Vector3d> dressed(coarse_count);
  for (size_t v = 0; v < coarse_count; ++v) {
    dressed[v] = mesh.vertices[v] + thickness(coarse_charts[v], mesh.vertices[v]) * normals[v];
    dressed[v].y() = std::max(dressed[v].y(), 0.0);
  }
  const auto dressed_normals = vertex_normals(dressed, mesh.triangles);

  // One round of subdivision; the first vertices are the body's.
  rest_bare_ = mesh.vertices;
  charts_ = coarse_charts;
  for (const auto& p : dressed) rest_.push_back(p.cast<float>());
  std::vector<std::pair<int, int>> parents;
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b, MannequinChart chart) {
    if (a > b) std::swap(a, b);
    const auto [place, fresh] = middles.try_emplace({a, b}, static_cast<int>(rest_.size()));
    if (fresh) {
      rest_.push_back(curved_midpoint(dressed[a], dressed[b], dressed_normals[a], dressed_normals[b]).cast<float>());
      rest_bare_.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
      charts_.push_back(chart);
      parents.emplace_back(a, b);
    }
    return place->second;
  };
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3i& c = mesh.triangles[t];
    std::array<int, 3> m{};
    std::array<Eigen::Vector2f, 3> uv, half;
    for (int k = 0; k < 3; ++k) {
      m[k] = middle(c[k], c[(k + 1) % 3], mesh.triangle_charts[t]);
      uv[k] = mesh.texture_vertices[mesh.texture_triangles[t][k]].cast<float>();
    }
    for (int k = 0; k < 3; ++k) half[k] = 0.5F * (uv[k] + uv[(k + 1) % 3]);
    for (int k = 0; k < 3; ++k) {
      triangles_.emplace_back(c[k], m[k], m[(k + 2) % 3]);
      texture_coordinates_.push_back({uv[k], half[k], half[(k + 2) % 3]});
    }
    triangles_.emplace_back(m[0], m[1], m[2]);
    texture_coordinates_.push_back(half);
  }

  const Eigen::Index count = static_cast<Eigen::Index>(rest_.size());
  expressions_.resize(3 * count, mannequin_expression_count);
  expressions_.topRows(body.expressions.rows()) = body.expressions;
  for (Eigen::Index v = 0; v < count; ++v) {
    Eigen::VectorXf weights;
    if (v < static_cast<Eigen::Index>(coarse_count)) {
      weights = body.weights.row(v).transpose();
    } else {
      const auto [a, b] = parents[v - coarse_count];
      weights = 0.5F * (body.weights.row(a) + body.weights.row(b)).transpose();
      expressions_.middleRows(3 * v, 3) =
          0.5F * (body.expressions.middleRows(3 * a, 3) + body.expressions.middleRows(3 * b, 3));
    }
    auto& list = influences_.emplace_back();
    for (int j = 0; j < mannequin_joint_count; ++j) {
      if (weights[j] > 0) list.push_back({j, weights[j]});
    }
    const MannequinMaterial material = mannequin_material(charts_[v], rest_bare_[v]);
    cloth_.push_back(material == MannequinMaterial::Shirt || material == MannequinMaterial::Trousers);
  }
}

LitScene DressedMannequin::pose(const MannequinPose& pose) const {
  std::vector<Eigen::Matrix<float, 3, 4>> transforms;
  for (const auto& transform : pose_joints(skeleton_, pose)) {
    transforms.push_back(transform.matrix().topRows<3>().cast<float>());
  }
  const size_t count = rest_.size();
  LitScene scene;
  scene.triangles = &triangles_;
  scene.texture_coordinates = &texture_coordinates_;
  scene.texture = &texture_;
  scene.positions.resize(count);
  for (size_t v = 0; v < count; ++v) {
    Vector3f p = rest_[v];
    for (int e = 0; e < mannequin_expression_count; ++e) {
      if (pose.expression[e] != 0) {
        p += static_cast<float>(pose.expression[e]) * expressions_.block<3, 1>(3 * static_cast<Eigen::Index>(v), e);
      }
    }
    Eigen::Matrix<float, 3, 4> blend = Eigen::Matrix<float, 3, 4>::Zero();
    for (const auto& [joint, weight] : influences_[v]) blend += weight * transforms[joint];
    scene.positions[v] = blend * p.homogeneous();
  }
  const auto compute_normals = [&] {
    scene.normals.assign(count, Vector3f::Zero());
    for (const auto& t : triangles_) {
      const Vector3f normal =
          (scene.positions[t[1]] - scene.positions[t[0]]).cross(scene.positions[t[2]] - scene.positions[t[0]]);
      for (int k = 0; k < 3; ++k) scene.normals[t[k]] += normal;
    }
    for (auto& normal : scene.normals) normal.normalize();
  };
  compute_normals();
  for (size_t v = 0; v < count; ++v) {
    if (!cloth_[v]) continue;
    scene.positions[v] += static_cast<float>(fold_height(charts_[v], rest_bare_[v], pose)) * scene.normals[v];
  }
  compute_normals();
  return scene;
}

}  // namespace degas
