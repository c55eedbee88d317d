#include "model/body/makehuman_import.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <map>

#include "host/error.h"
#include "host/io/obj.h"
#include "model/body/body_model.h"
#include "model/body/makehuman_files.h"
#include "model/body/uv_packing.h"

namespace degas {
namespace fs = std::filesystem;
using Eigen::Vector3d;

namespace {

constexpr double metres_per_unit = 0.1;

/// A joint of SMPL-X: where it is, and which bones move it (with the bones below them that have no joint of their own).
struct JointSource {
  int parent;
  std::vector<std::string> bones;  ///< the first bone's head is the joint
};

/// In SMPL-X's order; ".L" is the person's left.
std::vector<JointSource> joint_sources() {
  std::vector<JointSource> joints = {
      {-1, {"spine05", "root"}}, {0, {"upperleg01.L"}},  {0, {"upperleg01.R"}},  {0, {"spine04"}},
      {1, {"lowerleg01.L"}},     {2, {"lowerleg01.R"}},  {3, {"spine03"}},       {4, {"foot.L"}},
      {5, {"foot.R"}},           {6, {"spine02"}},       {7, {"toe2-1.L"}},      {8, {"toe2-1.R"}},
      {9, {"neck01"}},           {9, {"clavicle.L"}},    {9, {"clavicle.R"}},    {12, {"head"}},
      {13, {"upperarm01.L"}},    {14, {"upperarm01.R"}}, {16, {"lowerarm01.L"}}, {17, {"lowerarm01.R"}},
      {18, {"wrist.L"}},         {19, {"wrist.R"}},      {HeadJoint, {"jaw"}},   {HeadJoint, {"eye.L"}},
      {HeadJoint, {"eye.R"}}};
  for (const auto& [foot, side] : {std::pair(10, ".L"), std::pair(11, ".R")}) {
    for (const char* toe : {"toe1-1", "toe3-1", "toe4-1", "toe5-1"})
      joints[foot].bones.push_back(std::string(toe) + side);
  }
  for (const auto& [wrist, side] : {std::pair(20, ".L"), std::pair(21, ".R")}) {
    for (const int finger : {2, 3, 5, 4, 1}) {  // index, middle, pinky, ring, thumb
      for (int bone = 1; bone <= 3; ++bone) {
        const int parent = bone == 1 ? wrist : static_cast<int>(joints.size()) - 1;
        joints.push_back({parent, {fmt::format("finger{}-{}{}", finger, bone, side)}});
      }
    }
  }
  return joints;
}

/// Is a group of the base mesh part of the person, not a helper for clothes, hair or joints?
bool is_kept(const std::string& group) {
  static const std::vector<std::string> helpers = {"helper-l-eye", "helper-r-eye", "helper-upper-teeth",
                                                   "helper-lower-teeth", "helper-tongue"};
  if (std::find(helpers.begin(), helpers.end(), group) != helpers.end()) return true;
  return !group.starts_with("helper-") && !group.starts_with("joint-");
}

class MakeHumanImporter {
 public:
  explicit MakeHumanImporter(const MakeHumanSource& source)
      : source_(source), mesh_(read_obj(source.base)), joints_(joint_sources()) {}

  MakeHumanBody import() {
    shape();
    keep_surface();
    place_vertices();
    read_skeleton();
    read_weights();
    regress_joints();
    read_expressions();
    pack();
    return std::move(body_);
  }

 private:
  int base_count() const { return static_cast<int>(mesh_.vertices.size()); }
  int count() const { return static_cast<int>(kept_.size()); }

  void shape() {
    for (const auto& [path, weight] : source_.shapes) {
      for (const auto& [vertex, offset] : read_makehuman_target(path, base_count())) {
        mesh_.vertices[vertex] += weight * offset;
      }
    }
  }

  /// Keeps the person's polygons, as fans of triangles, and their vertices in the file's order.
  void keep_surface() {
    places_.assign(mesh_.vertices.size(), -1);
    std::vector<int> texture_places(mesh_.texture_coordinates.size(), -1);
    for (const ObjMesh::Polygon& polygon : mesh_.polygons) {
      if (!is_kept(mesh_.groups[polygon.group])) continue;
      const ObjMesh::Corner* corners = mesh_.corners.data() + polygon.first;
      for (int k = 0; k < polygon.count; ++k) {
        if (corners[k].texture < 0) {
          throw Error::format("{}: a face of group '{}' has no texture coordinates; the atlas is made of them",
                              source_.base.string(), mesh_.groups[polygon.group]);
        }
        places_[corners[k].vertex] = texture_places[corners[k].texture] = 0;
      }
    }
    const auto number = [](std::vector<int>& places) {
      int next = 0;
      for (int& place : places) place = place < 0 ? -1 : next++;
      return next;
    };
    const int kept = number(places_), kept_texture = number(texture_places);
    if (kept == 0)
      throw Error::format("{}: has no faces but helpers; take MakeHuman's base.obj", source_.base.string());
    kept_.resize(kept), texture_coordinates_.resize(kept_texture);
    for (int v = 0; v < base_count(); ++v) {
      if (places_[v] >= 0) kept_[places_[v]] = v;
    }
    for (size_t t = 0; t < texture_places.size(); ++t) {
      if (texture_places[t] >= 0) texture_coordinates_[texture_places[t]] = mesh_.texture_coordinates[t];
    }
    for (const ObjMesh::Polygon& polygon : mesh_.polygons) {
      if (!is_kept(mesh_.groups[polygon.group])) continue;
      const ObjMesh::Corner* c = mesh_.corners.data() + polygon.first;
      for (int k = 2; k < polygon.count; ++k) {
        body_.arrays.triangles.push_back({places_[c[0].vertex], places_[c[k - 1].vertex], places_[c[k].vertex]});
        body_.arrays.texture_triangles.push_back(
            {texture_places[c[0].texture], texture_places[c[k - 1].texture], texture_places[c[k].texture]});
      }
    }
  }

  /// Metres above the floor, all vertices of the base mesh: joints are means of some that are not kept.
  void place_vertices() {
    double floor = mesh_.vertices[kept_[0]].y();
    for (const int vertex : kept_) floor = std::min(floor, mesh_.vertices[vertex].y());
    for (Vector3d& vertex : mesh_.vertices) vertex = metres_per_unit * (vertex - Vector3d(0, floor, 0));
    for (const int vertex : kept_) body_.arrays.vertices.push_back(mesh_.vertices[vertex]);
  }

  void read_skeleton() {
    rig_ = read_makehuman_rig(source_.rig, base_count());
    for (size_t j = 0; j < joints_.size(); ++j) {
      body_.arrays.parents.push_back(joints_[j].parent);
      for (const std::string& name : joints_[j].bones) joint_of_bone_[name] = static_cast<int>(j);
      const std::string& bone = joints_[j].bones.front();
      const auto found = rig_.bones.find(bone);
      if (found == rig_.bones.end()) {
        throw Error::format("{}: bones: has no '{}', which joint {} of SMPL-X lies at; take MakeHuman's default rig",
                            source_.rig.string(), bone, j);
      }
      Vector3d mean = Vector3d::Zero();
      for (const int vertex : found->second.head_vertices) mean += mesh_.vertices[vertex];
      positions_.push_back(mean / static_cast<double>(found->second.head_vertices.size()));
    }
  }

  void read_weights() {
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(count(), static_cast<Eigen::Index>(joints_.size()));
    for (const auto& [bone, shares] : read_makehuman_weights(source_.weights, base_count())) {
      const std::string moved = rig_.ancestor(bone, joint_of_bone_);
      if (moved.empty()) {
        throw Error::format("{}: weights: bone '{}' hangs on no bone of {}; take the weights that belong to the rig",
                            source_.weights.string(), bone, source_.rig.string());
      }
      for (const auto& [vertex, weight] : shares) {
        if (places_[vertex] >= 0) weights(places_[vertex], joint_of_bone_.at(moved)) += weight;
      }
    }
    for (int v = 0; v < count(); ++v) {
      const double sum = weights.row(v).sum();
      if (!(sum > 1e-6)) {
        throw Error::format("{}: weights: no bone moves vertex {}; take the weights that belong to the base mesh",
                            source_.weights.string(), kept_[v]);
      }
      weights.row(v) /= sum;
    }
    body_.arrays.weights = weights.cast<float>();
  }

  /// Weights w of the vertices with sum w = 1 and sum w v = the joint, of the least sum of w^2 / importance: for a
  /// joint and its parent the vertices that both move, a ring around it; where these are too few or flat, all it moves.
  void regress_joints() {
    const Eigen::MatrixXd weights = body_.arrays.weights.cast<double>();
    Eigen::MatrixXd points(4, count());
    for (int v = 0; v < count(); ++v) points.col(v) << body_.arrays.vertices[v], 1;
    body_.arrays.joint_regressor.resize(static_cast<Eigen::Index>(joints_.size()), count());
    for (size_t j = 0; j < joints_.size(); ++j) {
      const Vector3d joint = positions_[j];
      const auto regress = [&](const Eigen::VectorXd& importance) -> Eigen::VectorXd {
        Eigen::MatrixXd centred = points;
        centred.topRows<3>().colwise() -= joint;
        const Eigen::Matrix4d gram = centred * importance.asDiagonal() * centred.transpose();
        const Eigen::Vector4d multipliers = gram.completeOrthogonalDecomposition().solve(Eigen::Vector4d::UnitW());
        return importance.cwiseProduct(centred.transpose() * multipliers);
      };
      const auto fits = [&](const Eigen::VectorXd& shares) {
        return (points * shares - Eigen::Vector4d(joint.x(), joint.y(), joint.z(), 1)).norm() < 1e-6 &&
               shares.cwiseAbs().maxCoeff() < 1;
      };
      const Eigen::VectorXd moved = weights.col(static_cast<Eigen::Index>(j));
      Eigen::VectorXd shares;
      if (joints_[j].parent >= 0) shares = regress(moved.cwiseProduct(weights.col(joints_[j].parent)));
      if (shares.size() == 0 || !fits(shares)) shares = regress(moved);
      if (!fits(shares)) {
        throw Error::format(
            "{}: the head of bone '{}' cannot be made of the vertices that it moves; do rig, weights and "
            "base mesh belong together?",
            source_.rig.string(), joints_[j].bones.front());
      }
      body_.arrays.joint_regressor.row(static_cast<Eigen::Index>(j)) = shares.cast<float>().transpose();
    }
  }

  void read_expressions() {
    std::vector<fs::path> files;
    if (!source_.targets.empty()) {
      std::error_code failure;
      for (fs::directory_iterator entry(source_.targets, failure), last; entry != last; entry.increment(failure)) {
        if (entry->path().extension() == ".target") files.push_back(entry->path());
      }
      if (failure) throw Error::format("{}: {}", source_.targets.string(), failure.message());
      if (files.empty()) throw Error::format("{}: holds no .target files", source_.targets.string());
    }
    std::sort(files.begin(), files.end());
    body_.arrays.expressions = Eigen::MatrixXf::Zero(3 * count(), static_cast<Eigen::Index>(files.size()));
    for (size_t i = 0; i < files.size(); ++i) {
      body_.expression_names.push_back(files[i].stem().string());
      for (const auto& [vertex, offset] : read_makehuman_target(files[i], base_count())) {
        if (places_[vertex] < 0) continue;
        body_.arrays.expressions.col(static_cast<Eigen::Index>(i)).segment<3>(3 * places_[vertex]) +=
            (metres_per_unit * offset).cast<float>();
      }
    }
  }

  /// The part of the atlas that a triangle belongs to: front and two halves of the back of the head, torso, limbs.
  AtlasPart part(const std::array<int, 3>& triangle) const {
    Eigen::RowVectorXf moved = Eigen::RowVectorXf::Zero(static_cast<Eigen::Index>(joints_.size()));
    Vector3d centre = Vector3d::Zero();
    for (const int vertex : triangle) {
      moved += body_.arrays.weights.row(vertex);
      centre += body_.arrays.vertices[vertex] / 3;
    }
    int joint = 0;
    moved.maxCoeff(&joint);
    if (joint == HeadJoint || (joint >= JawJoint && joint <= RightEyeJoint)) {
      const Vector3d from_head = centre - positions_[HeadJoint];
      const bool is_front = from_head.z() > -0.2 * std::abs(from_head.x());  // as far as the ears, which need no seam
      return {is_front ? 1 : from_head.x() > 0 ? 2 : 3, true};
    }
    if (joint >= LeftHandJoint) return {joint < RightHandJoint ? 4 : 5, false};
    constexpr std::array<int, JawJoint> limbs = {0, 6, 7, 0, 6, 7, 0, 6, 7, 0, 6, 7, 0, 0, 0, 0, 4, 5, 4, 5, 4, 5};
    return {limbs[joint], false};
  }

  void pack() {
    std::vector<AtlasPart> parts;
    for (const std::array<int, 3>& triangle : body_.arrays.triangles) parts.push_back(part(triangle));
    PackedAtlas atlas;
    try {
      atlas = pack_atlas(
          {body_.arrays.vertices, body_.arrays.triangles, texture_coordinates_, body_.arrays.texture_triangles}, parts);
    } catch (const Error& reason) {
      throw Error::format("{}: {}", source_.base.string(), reason.what());
    }
    body_.arrays.texture_coordinates = std::move(atlas.texture_coordinates);
    body_.arrays.texture_triangles = std::move(atlas.texture_triangles);
  }

  const MakeHumanSource& source_;
  ObjMesh mesh_;  // shaped; metres after place_vertices
  std::vector<JointSource> joints_;
  std::vector<int> places_;                           // of the base mesh's vertices among those kept; -1: left out
  std::vector<int> kept_;                             // the reverse
  std::vector<Eigen::Vector2d> texture_coordinates_;  // as the file has them
  MakeHumanRig rig_;
  std::map<std::string, int> joint_of_bone_;
  std::vector<Vector3d> positions_;  // of the joints
  MakeHumanBody body_;
};

}  // namespace

MakeHumanBody import_makehuman(const MakeHumanSource& source) {
  return MakeHumanImporter(source).import();
}

}  // namespace degas
