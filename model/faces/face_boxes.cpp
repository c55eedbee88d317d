#include "model/faces/face_boxes.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "model/train/boxes.h"

namespace degas {
namespace {

Rectangle united(const Rectangle& a, const Rectangle& b) {
  const int left = std::min(a.left, b.left), top = std::min(a.top, b.top);
  return {left, top, std::max(a.left + a.width, b.left + b.width) - left,
          std::max(a.top + a.height, b.top + b.height) - top};
}

Rectangle square_around(const Rectangle& box, int side) {
  return {box.left + box.width / 2 - side / 2, box.top + box.height / 2 - side / 2, side, side};
}

}  // namespace

std::vector<FaceBox> projected_faces(const Capture& capture, const BodyModel& body, const std::vector<int>& cameras,
                                     double max_angle) {
  const std::vector<double> betas = capture.betas();
  std::vector<FaceBox> faces;
  for (int frame = 0; frame < capture.frame_count(); ++frame) {
    const Pose pose = capture.pose(frame);
    const std::vector<Eigen::Vector3d> head = head_points(body, pose, betas);
    for (const int camera : cameras) {
      const Camera view = capture.camera(camera);
      const double angle = frontal_angle(body, pose, betas, view.center());
      if (!(angle <= max_angle)) continue;
      if (const auto box = projected_box(head, view)) faces.push_back({frame, camera, *box, angle});
    }
  }
  return faces;
}

std::optional<std::vector<FaceBox>> detected_faces(const Capture& capture, FaceDetector& detector,
                                                   const std::vector<int>& cameras,
                                                   const std::function<bool(int done, int total)>& go_on) {
  const int total = capture.frame_count() * static_cast<int>(cameras.size());
  std::vector<FaceBox> faces;
  int done = 0;
  for (const int camera : cameras) {
    for (int frame = 0; frame < capture.frame_count(); ++frame) {
      if (!go_on(done++, total)) return std::nullopt;
      if (!capture.has_image(frame, camera)) continue;
      if (const auto face = detector.find(capture.load(frame, camera).image)) {
        faces.push_back({frame, camera, face->box, -face->score});
      }
    }
  }
  return without_strays(faces);
}

std::vector<FaceBox> without_strays(const std::vector<FaceBox>& faces) {
  constexpr size_t neighbours = 5;  // on each side
  constexpr double farthest = 1.5, largest_ratio = 2;
  std::map<int, std::vector<FaceBox>> by_camera;
  for (const FaceBox& face : faces) by_camera[face.camera].push_back(face);
  std::vector<FaceBox> kept;
  for (const auto& of_camera : by_camera) {
    const std::vector<FaceBox>& row = of_camera.second;
    for (size_t i = 0; i < row.size(); ++i) {
      const size_t begin = i - std::min(i, neighbours), end = std::min(i + neighbours + 1, row.size());
      const auto middle = [&](const auto& value_of) {
        std::vector<double> values;
        for (size_t k = begin; k < end; ++k) values.push_back(value_of(row[k].box));
        std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
        return values[values.size() / 2];
      };
      const auto size = [](const Rectangle& box) { return static_cast<double>(std::max(box.width, box.height)); };
      const auto x = [](const Rectangle& box) { return box.left + 0.5 * box.width; };
      const auto y = [](const Rectangle& box) { return box.top + 0.5 * box.height; };
      const double usual = middle(size), ratio = size(row[i].box) / usual;
      const double away = std::hypot(x(row[i].box) - middle(x), y(row[i].box) - middle(y));
      if (away <= farthest * usual && ratio < largest_ratio && ratio > 1 / largest_ratio) kept.push_back(row[i]);
    }
  }
  return kept;
}

FaceCrops::FaceCrops(const std::vector<FaceBox>& faces, const CropOptions& options) {
  std::map<int, Rectangle> all;  // by camera
  std::map<int, int> largest;
  for (const FaceBox& face : faces) {
    const auto [found, is_new] = all.emplace(face.camera, face.box);
    if (!is_new) found->second = united(found->second, face.box);
    int& side = largest[face.camera];
    side = std::max({side, face.box.width, face.box.height});
  }
  for (const FaceBox& face : faces) {
    const Rectangle& whole = all.at(face.camera);
    const int side = options.track ? largest.at(face.camera) : std::max(whole.width, whole.height);
    FaceBox crop = face;
    crop.box = square_around(options.track ? face.box : whole, side + 2 * options.margin);
    by_frame_[face.frame].push_back(crop);
  }
  for (auto& [frame, crops] : by_frame_) {
    std::sort(crops.begin(), crops.end(), [](const FaceBox& a, const FaceBox& b) {
      return std::tie(a.rank, a.camera) < std::tie(b.rank, b.camera);
    });
  }
}

const std::vector<FaceBox>& FaceCrops::of_frame(int frame) const {
  static const std::vector<FaceBox> none;
  const auto found = by_frame_.find(frame);
  return found == by_frame_.end() ? none : found->second;
}

}  // namespace degas
