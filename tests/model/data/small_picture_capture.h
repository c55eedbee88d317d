#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <map>
#include <string>

#include "host/io/npz.h"
#include "tests/model/data/small_capture.h"

namespace degas::test {

inline void write_text_file(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

/// Poses with the keys of ActorsHQ's and AvatarReX's smpl_params.npz: no eyes, no frames, no word on hands; ten
/// components of the expression.
inline std::map<std::string, NpyArray> smpl_params_of(const std::vector<Pose>& poses, const std::vector<float>& betas) {
  std::map<std::string, NpyArray> arrays;
  const auto count = static_cast<int64_t>(poses.size());
  const auto add = [&](const std::string& key, int first_joint, int joints) {
    std::vector<float> values;
    for (const Pose& pose : poses) {
      for (int joint = first_joint; joint < first_joint + joints; ++joint) {
        for (int k = 0; k < 3; ++k)
          values.push_back(static_cast<float>(pose.axis_angles[static_cast<size_t>(joint)][k]));
      }
    }
    arrays[key] = NpyArray::from({count, 3 * joints}, values);
  };
  add("global_orient", 0, 1);
  add("body_pose", 1, 21);
  add("jaw_pose", 22, 1);
  add("left_hand_pose", 25, 15);
  add("right_hand_pose", 40, 15);
  std::vector<float> translations, expressions;
  for (const Pose& pose : poses) {
    for (int k = 0; k < 3; ++k) translations.push_back(static_cast<float>(pose.translation[k]));
    for (size_t k = 0; k < 10; ++k) {
      expressions.push_back(k < pose.expression.size() ? static_cast<float>(pose.expression[k]) : 0.0f);
    }
  }
  arrays["transl"] = NpyArray::from({count, 3}, translations);
  arrays["expression"] = NpyArray::from({count, 10}, expressions);
  arrays["betas"] = NpyArray::from({1, static_cast<int64_t>(betas.size())}, betas);
  return arrays;
}

/// Of small_poses().
inline std::map<std::string, NpyArray> small_smpl_params() {
  return smpl_params_of(small_poses(), std::vector<float>(10, 0.5f));
}

/// Rewrites one array of an npz file, or takes it out.
inline void replace_array(const std::filesystem::path& path, const std::string& key, const NpyArray* array) {
  std::map<std::string, NpyArray> arrays;
  {
    const NpzFile file(path);
    for (const std::string& name : file.keys()) arrays[name] = file.read(name);
  }
  if (array) arrays[key] = *array;
  if (!array) arrays.erase(key);
  write_npz(path, arrays);
}

/// The small capture in the ActorsHQ layout below `folder`/Actor01/Sequence1/1x: cameras Cam001 .. Cam003, of which the
/// last has no pictures; PNG pictures over black.
inline std::filesystem::path write_small_actorshq(const std::filesystem::path& folder) {
  const std::filesystem::path scale = folder / "Actor01/Sequence1/1x";
  std::string csv = "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py\n";
  for (int camera = 0; camera < small_cameras; ++camera) {
    const Camera c = small_camera(camera);
    const Eigen::AngleAxisd turn{Eigen::Matrix3d(c.rotation.transpose())};
    const Eigen::Vector3d r = turn.angle() * turn.axis(), t = c.center();
    const std::string name = "Cam00" + std::to_string(camera + 1);
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\r\n", name, c.width, c.height, r.x(), r.y(), r.z(),
                       t.x(), t.y(), t.z(), c.fx / c.width, c.fy / c.height, c.cx / c.width, c.cy / c.height);
    for (int frame = 0; frame < small_frames && camera < 2; ++frame) {
      write_image(scale / "rgbs" / name / fmt::format("{}_rgb{:06}.png", name, frame), small_image(frame, camera));
      write_image(scale / "masks" / name / fmt::format("{}_mask{:06}.png", name, frame), small_mask(frame));
    }
  }
  write_text_file(scale / "calibration.csv", csv);
  write_npz(scale.parent_path() / "smpl_params.npz", small_smpl_params());
  return scale;
}

}  // namespace degas::test
