#include "model/gaussians/base_maps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host/error.h"
#include "model/gaussians/nearest_neighbors.h"

namespace degas {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// The edge of the triangle that runs most along u, towards +u.
Vector3d tangent_edge(const std::array<Vector3d, 3>& corners, const std::array<Vector2d, 3>& texture) {
  double most = -1;
  Vector3d edge = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const double along = texture[next].x() - texture[k].x();
    if (std::abs(along) <= most) continue;
    most = std::abs(along);
    edge = along < 0 ? Vector3d(corners[k] - corners[next]) : Vector3d(corners[next] - corners[k]);
  }
  return edge;
}

/// Area-weighted unit tangents of the texture's vertices.
std::vector<Vector3d> texture_tangents(const BodyModel& body, const std::vector<Vector3d>& vertices) {
  std::vector<Vector3d> tangents(body.texture_coordinates().size(), Vector3d::Zero());
  for (int t = 0; t < body.face_count(); ++t) {
    const std::array<int, 3>&face = body.faces()[t], &texture_face = body.texture_faces()[t];
    std::array<Vector3d, 3> corners;
    std::array<Vector2d, 3> texture;
    for (int k = 0; k < 3; ++k) {
      corners[k] = vertices[face[k]];
      texture[k] = body.texture_coordinates()[texture_face[k]];
    }
    const double twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    const Vector3d tangent = twice_area * tangent_edge(corners, texture).normalized();
    for (int k = 0; k < 3; ++k) tangents[texture_face[k]] += tangent;
  }
  for (Vector3d& tangent : tangents) tangent.normalize();
  return tangents;
}

/// The rotation whose z is `normal` and whose x is nearest to `tangent`, as a quaternion with w >= 0. Any x will do
/// where the tangent is lost, any frame where the normal is (a surface folded onto itself).
Eigen::Quaterniond frame(const Vector3d& normal, const Vector3d& tangent) {
  const Vector3d z = normal.norm() > 1e-9 ? Vector3d(normal.normalized()) : Vector3d(Vector3d::UnitZ());
  Vector3d x = tangent - z * z.dot(tangent);
  x = x.norm() > 1e-6 ? Vector3d(x.normalized()) : Vector3d(z.unitOrthogonal());
  Matrix3d rotation;
  rotation << x, z.cross(x), z;
  Eigen::Quaterniond quaternion(rotation);
  quaternion.normalize();
  if (quaternion.w() < 0) quaternion.coeffs() *= -1;
  return quaternion;
}

/// The joints that move a texel by falling weight (then by number), all of them.
std::vector<JointWeight> texel_weights(const BodyModel& body, const Texel& texel, SkinningInterpolation skinning) {
  const std::array<int, 3>& face = body.faces()[texel.triangle];
  std::vector<JointWeight> all;
  if (skinning == SkinningInterpolation::Nearest) {
    const auto largest = std::max_element(texel.barycentric.begin(), texel.barycentric.end());
    const auto shares = body.skinning_weights(face[largest - texel.barycentric.begin()]);
    all.assign(shares.begin(), shares.end());
  } else {
    for (int k = 0; k < 3; ++k) {
      for (const JointWeight& share : body.skinning_weights(face[k])) {
        const double weight = texel.barycentric[k] * share.weight;
        const auto same = std::find_if(all.begin(), all.end(), [&](const auto& w) { return w.joint == share.joint; });
        if (same != all.end()) {
          same->weight += weight;
        } else if (weight > 0) {
          all.push_back({share.joint, weight});
        }
      }
    }
  }
  std::sort(all.begin(), all.end(), [](const JointWeight& a, const JointWeight& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.joint < b.joint;
  });
  return all;
}

void set_skinning(BaseMaps& maps, const BodyModel& body, const UvAtlas& atlas, int max_influences,
                  SkinningInterpolation skinning) {
  std::vector<std::vector<JointWeight>> rows;
  size_t most = 0;
  for (const int index : atlas.covered()) {
    rows.push_back(texel_weights(body, atlas.texels()[index], skinning));
    most = std::max(most, rows.back().size());
  }
  maps.influences = std::min<int>(max_influences, static_cast<int>(most));
  for (std::vector<JointWeight>& row : rows) {
    row.resize(maps.influences, {row[0].joint, 0});
    double sum = 0;
    for (const JointWeight& share : row) sum += share.weight;
    for (const JointWeight& share : row) {
      maps.joints.push_back(share.joint);
      maps.weights.push_back(static_cast<float>(share.weight / sum));
    }
  }
}

}  // namespace

BaseMaps make_base_maps(const BodyModel& body, const std::vector<double>& betas, const UvAtlas& atlas,
                        int max_influences, double thin_axis, SkinningInterpolation skinning) {
  if (max_influences < 1) throw std::logic_error("[base_maps] max_influences must be positive");
  if (atlas.covered().size() < 4) {
    throw Error::format("{}: 'vt' covers {} texels of a {}x{} atlas; four are the least", body.path().string(),
                        atlas.covered().size(), atlas.resolution(), atlas.resolution());
  }
  const std::vector<Vector3d> vertices = body.canonical_vertices(betas, {});
  const std::vector<Vector3d> normals = vertex_normals(body.faces(), vertices);
  const std::vector<Vector3d> tangents = texture_tangents(body, vertices);
  BaseMaps maps;
  maps.resolution = atlas.resolution();
  maps.covered.assign(atlas.covered().begin(), atlas.covered().end());
  std::vector<Vector3d> points;
  for (const int index : atlas.covered()) {
    const Texel& texel = atlas.texels()[index];
    Vector3d point = Vector3d::Zero(), normal = Vector3d::Zero(), tangent = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      point += texel.barycentric[k] * vertices[body.faces()[texel.triangle][k]];
      normal += texel.barycentric[k] * normals[body.faces()[texel.triangle][k]];
      tangent += texel.barycentric[k] * tangents[body.texture_faces()[texel.triangle][k]];
    }
    const Eigen::Quaterniond rotation = frame(normal, tangent);
    points.push_back(point);
    for (int c = 0; c < 3; ++c) maps.positions.push_back(static_cast<float>(point[c]));
    for (const double value : {rotation.w(), rotation.x(), rotation.y(), rotation.z()}) {
      maps.rotations.push_back(static_cast<float>(value));
    }
  }
  for (const double distance : three_neighbor_distances(points)) {
    const float along = static_cast<float>(std::log(std::max(distance, thin_axis)));  // coinciding points have none
    maps.log_scales.insert(maps.log_scales.end(), {along, along, static_cast<float>(std::log(thin_axis))});
  }
  set_skinning(maps, body, atlas, max_influences, skinning);
  return maps;
}

void make_isotropic(BaseMaps& maps) {
  for (size_t i = 0; i < maps.log_scales.size(); i += 3) maps.log_scales[i + 2] = maps.log_scales[i];
}

}  // namespace degas
