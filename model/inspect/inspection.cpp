#include "model/inspect/inspection.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <set>

#include "host/error.h"
#include "model/data/mannequin_renderer.h"
#include "model/inspect/camera_plan.h"
#include "model/inspect/hands.h"
#include "model/inspect/page_pictures.h"
#include "model/inspect/silhouette.h"
#include "model/inspect/view_choice.h"
#include "model/train/html.h"

namespace degas {
namespace {

constexpr int largest_side = 640, trial_side = 320;  ///< pixels of pictures looked at, and of those tried on
constexpr int about_trials = 80;                     ///< pictures that misreadings are tried on
constexpr int face_rows = 4, frontal_views = 4;

/// Camera and picture made small enough that no side exceeds `side`.
void shrink(int side, Camera& view, Image8& image) {
  view = view.scaled(std::min(1.0, static_cast<double>(side) / std::max(view.width, view.height)));
  image = resized(image, view.width, view.height);
}

/// A frame's body as registered, and with the other convention of the hands where that can be told.
struct FrameBody {
  Pose pose;
  BodySurface surface;
  std::optional<BodySurface> other_hands;
};

class Inspector {
 public:
  Inspector(const Capture& capture, const BodyModel* body, const InspectionOptions& options, Inspection& result)
      : capture_(capture), body_(body), options_(options), result_(result) {}

  void run() {
    describe_capture();
    if (body_) pose_bodies();
    look_at_pictures();
    if (body_ && capture_.has_masks()) judge_fit();
    if (body_) draw_atlas();
    draw_plan();
    note_what_is_lacking();
  }

 private:
  void describe_capture();
  void pose_bodies();
  void rank_cameras();
  void look_at_pictures();
  void look_at(int frame, int camera);
  void judge_fit();
  void draw_atlas();
  void draw_plan();
  void note_what_is_lacking();
  double degrees_off(int frame, int camera) const {
    return frontal_angle(*body_, bodies_.at(frame).pose, capture_.betas(), capture_.camera(camera).center()) * 180 /
           std::numbers::pi;
  }

  const Capture& capture_;
  const BodyModel* body_;
  const InspectionOptions& options_;
  Inspection& result_;
  std::map<int, FrameBody> bodies_;
  std::vector<std::pair<int, int>> overlay_views_;  // (frame, camera)
  std::map<int, std::vector<int>> face_cameras_;    // by frame, the most frontal first
  std::mutex mutex_;                                // of what follows
  std::map<std::pair<int, int>, MaskView> masks_;   // ordered, so that results do not depend on threads
  std::map<std::pair<int, int>, PagePicture> overlays_;
  std::map<std::pair<int, int>, Image8> faces_;
  std::map<std::pair<int, int>, HandFit> hands_;
  std::map<std::pair<int, int>, std::string> failures_;
};

void Inspector::describe_capture() {
  result_.frame_count = capture_.frame_count();
  result_.code_size = capture_.face_code_size();
  result_.has_poses = capture_.has_poses();
  result_.has_masks = capture_.has_masks();
  result_.has_body = body_ != nullptr;
  result_.cameras = list_cameras(capture_);
  const ChosenViews chosen = choose_views(capture_, options_.cameras, options_.frames);
  result_.cameras_seen = chosen.cameras;
  result_.frames_seen = chosen.frames;
  overlay_views_ = chosen.drawn;
}

void Inspector::pose_bodies() {
  const bool is_flat = capture_.flat_hand_mean();
  for (const int frame : result_.frames_seen) {
    const Pose recorded = capture_.pose(frame);
    const auto surface_of = [&](const Pose& pose) {
      return BodySurface(body_->posed_vertices(pose, capture_.betas(), true), body_->faces());
    };
    const Pose pose = body_->with_hands(recorded, is_flat);
    FrameBody body{pose, surface_of(pose), {}};
    if (body_->has_hand_mean()) body.other_hands = surface_of(body_->with_hands(recorded, !is_flat));
    bodies_.emplace(frame, std::move(body));
  }
  rank_cameras();
}

void Inspector::rank_cameras() {
  const std::vector<int> face_frames = spread(result_.frames_seen, face_rows);
  for (const int frame : result_.frames_seen) {
    std::vector<std::pair<double, int>> ranking;
    for (int camera = 0; camera < static_cast<int>(result_.cameras.size()); ++camera) {
      CameraFindings& found = result_.cameras[static_cast<size_t>(camera)];
      const double degrees = degrees_off(frame, camera);
      found.frontal_degrees =
          found.frontal_degrees.value_or(0) + degrees / static_cast<double>(result_.frames_seen.size());
      if (capture_.has_image(frame, camera)) ranking.emplace_back(degrees, camera);
    }
    std::sort(ranking.begin(), ranking.end());
    const bool is_shown = std::find(face_frames.begin(), face_frames.end(), frame) != face_frames.end();
    for (size_t i = 0; i < ranking.size() && i < frontal_views; ++i) {
      ++result_.cameras[static_cast<size_t>(ranking[i].second)].times_frontal;
      if (is_shown) face_cameras_[frame].push_back(ranking[i].second);
    }
  }
}

void Inspector::look_at_pictures() {
  // A camera a thread, frames ascending: videos are read forwards. Faces may be of cameras that are not looked at.
  std::map<int, std::set<int>> frames_of;
  for (const int camera : result_.cameras_seen) {
    frames_of[camera].insert(result_.frames_seen.begin(), result_.frames_seen.end());
  }
  for (const auto& [frame, cameras] : face_cameras_) {
    for (const int camera : cameras) frames_of[camera].insert(frame);
  }
  const std::vector<std::pair<int, std::set<int>>> work(frames_of.begin(), frames_of.end());
  for_each_parallel(static_cast<int>(work.size()), options_.threads, [&](int i) {
    const auto& [camera, frames] = work[static_cast<size_t>(i)];
    for (const int frame : frames) {
      if (capture_.has_image(frame, camera)) look_at(frame, camera);
    }
  });
  for (const auto& [place, reason] : failures_) result_.warnings.push_back(reason);
  for (const auto& view : overlay_views_) {
    if (const auto found = overlays_.find(view); found != overlays_.end()) result_.overlays.push_back(found->second);
  }
  for (const auto& [frame, cameras] : face_cameras_) {
    std::vector<Image8> row;
    std::string caption = fmt::format("frame {}:", frame);
    for (const int camera : cameras) {
      const auto face = faces_.find({frame, camera});
      if (face == faces_.end()) continue;
      row.push_back(face->second);
      caption += fmt::format(" {} {:.0f}&deg;{}", escape(result_.cameras[static_cast<size_t>(camera)].name),
                             degrees_off(frame, camera), capture_.has_face_code(frame, camera) ? " (code)" : "");
    }
    if (!row.empty()) result_.face_rows.push_back(jpeg_picture(side_by_side(row), caption));
  }
}

void Inspector::look_at(int frame, int camera) {
  const std::pair<int, int> place(frame, camera);
  Sample sample;
  try {
    sample = capture_.load(frame, camera);
  } catch (const Error& reason) {
    const std::lock_guard lock(mutex_);
    failures_[place] = reason.what();
    return;
  }
  Camera view = sample.view;
  shrink(largest_side, view, sample.image);
  const Image8 mask = capture_.has_masks() ? resized(sample.mask, view.width, view.height) : Image8();
  const std::string& name = result_.cameras[static_cast<size_t>(camera)].name;
  const bool is_drawn = std::find(overlay_views_.begin(), overlay_views_.end(), place) != overlay_views_.end();
  const bool is_seen =
      std::find(result_.cameras_seen.begin(), result_.cameras_seen.end(), camera) != result_.cameras_seen.end();
  std::string caption = fmt::format("{}, frame {}", escape(name), frame);
  const FrameBody* body = body_ ? &bodies_.at(frame) : nullptr;
  if (body && !mask.empty() && is_seen) {
    const Image8 covered = silhouette(body->surface, view);
    const double fit = overlap(covered, mask);
    caption += fmt::format(": overlap {:.2f}", fit);
    const HandFit hands =
        body->other_hands ? compare_hands(*body_, body->surface, *body->other_hands, view, mask) : HandFit();
    MaskView small{frame, camera, view, mask};
    shrink(trial_side, small.view, small.mask);
    const std::lock_guard lock(mutex_);
    result_.overlaps[place] = fit;
    masks_[place] = std::move(small);
    hands_[place] = hands;
  }
  if (is_drawn) {
    const Image8 picture = body ? drawn_over(sample.image, mask, body->surface, view) : sample.image;
    PagePicture drawn = jpeg_picture(picture, caption);
    const std::lock_guard lock(mutex_);
    overlays_[place] = std::move(drawn);
  }
  const auto faces = face_cameras_.find(frame);
  if (faces == face_cameras_.end()) return;
  if (std::find(faces->second.begin(), faces->second.end(), camera) == faces->second.end()) return;
  Image8 face = face_crop(sample.image, *body_, body->pose, capture_.betas(), view);
  const std::lock_guard lock(mutex_);
  if (!face.empty()) faces_[place] = std::move(face);
}

void Inspector::judge_fit() {
  if (result_.overlaps.empty()) return;
  double sum = 0, least = 1;
  for (CameraFindings& camera : result_.cameras) {
    const int index = static_cast<int>(&camera - result_.cameras.data());
    double of_camera = 0;
    int count = 0;
    for (const auto& [place, fit] : result_.overlaps) {
      if (place.second != index) continue;
      of_camera += fit;
      least = std::min(least, fit);
      ++count;
    }
    sum += of_camera;
    if (count > 0) camera.mask_iou = of_camera / count;
  }
  result_.mask_iou_mean = sum / static_cast<double>(result_.overlaps.size());
  result_.mask_iou_min = least;
  // Trials cost as much as looking did, and half of the frames tell the same.
  const int cameras = std::max<int>(1, static_cast<int>(result_.cameras_seen.size()));
  const std::vector<int> frames = spread(result_.frames_seen, std::max(2, about_trials / cameras));
  std::vector<MaskView> views;
  for (auto& [place, view] : masks_) {
    if (std::find(frames.begin(), frames.end(), place.first) != frames.end()) views.push_back(std::move(view));
  }
  result_.diagnosis =
      diagnose(FitTrials(capture_, *body_, std::move(views), options_.threads), capture_.camera_names());

  HandFit hands;
  for (const auto& [place, fit] : hands_) hands += fit;
  if (const auto words = hands.verdict(capture_.flat_hand_mean()); words && result_.diagnosis->suspected.empty()) {
    result_.diagnosis->suspected.push_back("flat_hand_mean");
    result_.diagnosis->sentences.push_back(*words);
  }
  for (const std::string& sentence : result_.diagnosis->sentences) result_.warnings.push_back(sentence);
}

void Inspector::draw_atlas() {
  const AtlasPicture atlas = atlas_picture(*body_);
  result_.atlas_png = atlas.png;
  result_.face_region = atlas.face_region;
  const FaceRegion& region = atlas.face_region;
  const bool holds_head = region.head_share >= head_share_of_smplx;
  if (region.is_smplx() && holds_head) return;
  const std::string place = fmt::format(
      "{:.0f} % of the head's texels lie in the square from u {:.2f}, v {:.2f} rightwards and down, where "
      "the network puts the face",
      100 * region.head_share, region.column / 16.0, 1 - region.row / 16.0);
  result_.warnings.push_back(
      holds_head
          ? fmt::format("{}: this is not SMPL-X's UV layout, whose head lies in the upper left quarter: {}; if it "
                        "was meant to be, take the file with the other 'vt' and 'ft' (is v turned over?)",
                        body_->path().string(), place)
          : fmt::format("{}: no quarter of the UV atlas holds the head: only {}; take the body model's file with "
                        "the other 'vt' and 'ft'",
                        body_->path().string(), place));
}

void Inspector::draw_plan() {
  CameraPlan plan;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const CameraFindings& found : result_.cameras) {
    plan.cameras.push_back(found.camera);
    plan.names.push_back(found.name);
    up -= found.camera.rotation.row(1).transpose();  // pictures are upright, more or less
  }
  if (body_) {
    const JointFrames joints = body_->posed_joints(bodies_.begin()->second.pose, capture_.betas());
    up = joints.rotations[PelvisJoint] * Eigen::Vector3d::UnitY();
    for (size_t j = 1; j < joints.positions.size(); ++j) {
      plan.bones.emplace_back(joints.positions[static_cast<size_t>(body_->parents()[j])], joints.positions[j]);
    }
  }
  if (up.norm() > 1e-6) plan.up = up.normalized();
  result_.plan_svg = camera_plan_svg(plan);
}

void Inspector::note_what_is_lacking() {
  if (!body_) {
    result_.notes.push_back(
        capture_.has_poses()
            ? "no body model (--body): nothing can be said of the fit, the axes, the units, the face or the atlas"
            : "no body parameters (smplx.npz, smpl_params.npz): nobody can be drawn over the pictures, and the fit, "
              "the "
              "axes and the units cannot be judged; fit SMPL-X to the recording before training");
  }
  if (!capture_.has_masks()) {
    result_.notes.push_back(
        "no masks: the silhouette cannot be compared with the person, and training is not possible; cut the person out "
        "first");
  }
  if (result_.code_size == 0) {
    result_.notes.push_back("no face codes: drive the face by face.signal=expression, or extract codes first");
  }
  result_.notes.push_back("reprojection error: not known, the capture has no 2-D keypoints");
}

}  // namespace

Inspection inspect_capture(const Capture& capture, const BodyModel* body, const InspectionOptions& options,
                           std::vector<std::string> warnings) {
  Inspection result;
  result.warnings = std::move(warnings);
  Inspector(capture, capture.has_poses() ? body : nullptr, options, result).run();
  return result;
}

}  // namespace degas
