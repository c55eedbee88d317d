#include "model/inspect/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "model/data/mannequin_renderer.h"
#include "model/inspect/silhouette.h"

namespace degas {
namespace {

/// Mean overlap that undoing a misreading must add before it is suspected. Frames that are off by one move a walking
/// person by centimetres only.
constexpr double clear_gain = 0.05, clear_frame_gain = 0.015;
/// A camera by itself must be that much worse than the middle one.
constexpr double much_worse = 0.15;
/// Below this the body is somewhere else than the person.
constexpr double poor_fit = 0.6;

Image8 flipped(const Image8& mask, bool left_right, bool top_bottom) {
  Image8 out = mask;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      *out.at(x, y) = *mask.at(left_right ? mask.width - 1 - x : x, top_bottom ? mask.height - 1 - y : y);
    }
  }
  return out;
}

/// Means of two readings over the views that have both.
struct Comparison {
  double before = 0, after = 0;
  int views = 0;
  double gain() const { return after - before; }
};

Comparison compare(const std::vector<double>& before, const std::vector<double>& after,
                   const std::function<bool(size_t)>& counts) {
  Comparison means;
  for (size_t i = 0; i < before.size(); ++i) {
    if (before[i] < 0 || after[i] < 0 || !counts(i)) continue;
    means.before += before[i];
    means.after += after[i];
    ++means.views;
  }
  means.before /= std::max(means.views, 1);
  means.after /= std::max(means.views, 1);
  return means;
}

double needed_gain(const Misreading& misreading) {
  return misreading.frame_offset != 0 ? clear_frame_gain : clear_gain;
}

}  // namespace

FitTrials::FitTrials(const Capture& capture, const BodyModel& body, std::vector<MaskView> views, int threads)
    : views_(std::move(views)), faces_(body.faces()), threads_(threads) {
  constexpr int most_frames_off = 2;
  std::map<int64_t, int> rows;
  // By the recording's numbers: rows may stand for every fourth frame alone, and a row further is then no frame off.
  for (const MaskView& view : views_) {
    const int64_t number = numbers_[view.frame] = capture.frame_number(view.frame);
    for (int frame = view.frame - most_frames_off; frame <= view.frame + most_frames_off; ++frame) {
      if (frame < 0 || frame >= capture.frame_count()) continue;
      const int64_t other = capture.frame_number(frame);
      if (std::abs(other - number) <= most_frames_off) rows[other] = frame;
    }
  }
  for (const auto& [number, row] : rows) bodies_[number];
  const std::vector<std::pair<int64_t, int>> frames(rows.begin(), rows.end());
  for_each_parallel(static_cast<int>(frames.size()), threads_, [&](int i) {
    const auto [number, row] = frames[static_cast<size_t>(i)];
    const Pose pose = body.with_hands(capture.pose(row), capture.flat_hand_mean());
    bodies_.at(number) = {body.posed_vertices(pose, capture.betas(), true), pose.translation};
  });
}

std::vector<double> FitTrials::fit(const std::vector<const Misreading*>& undone) const {
  int offset = 0;
  bool mirrored = false, upside_down = false;
  for (const Misreading* misreading : undone) {
    offset += misreading->frame_offset;
    mirrored ^= misreading->mirrored_image;
    upside_down ^= misreading->image_upside_down;
  }
  std::map<int, BodySurface> surfaces;
  for (const MaskView& view : views_) {
    const auto found = bodies_.find(numbers_.at(view.frame) + offset);
    if (found == bodies_.end() || surfaces.count(view.frame) > 0) continue;
    PosedBody body = found->second;
    for (const Misreading* misreading : undone) {
      if (!misreading->vertex) continue;
      for (Eigen::Vector3d& vertex : body.vertices) vertex = misreading->vertex(vertex, body.translation);
    }
    surfaces.emplace(view.frame, BodySurface(body.vertices, faces_));
  }
  std::vector<double> fits(views_.size(), -1);
  for_each_parallel(static_cast<int>(views_.size()), threads_, [&](int i) {
    const MaskView& view = views_[static_cast<size_t>(i)];
    const auto surface = surfaces.find(view.frame);
    if (surface == surfaces.end()) return;
    Camera camera = view.view;
    for (const Misreading* misreading : undone) {
      if (misreading->camera) camera = misreading->camera(camera);
    }
    const Image8 covered = silhouette(surface->second, camera);
    fits[static_cast<size_t>(i)] = mirrored || upside_down ? overlap(covered, flipped(view.mask, mirrored, upside_down))
                                                           : overlap(covered, view.mask);
  });
  return fits;
}

namespace {

class Diagnostician {
 public:
  Diagnostician(const FitTrials& trials, const std::vector<std::string>& camera_names)
      : trials_(trials), names_(camera_names), now_(trials.fit({})) {}

  Diagnosis run() {
    diagnosis_.mask_iou = compare(now_, now_, everywhere).after;
    try_on_all_cameras();
    try_on_single_cameras();
    return std::move(diagnosis_);
  }

 private:
  static bool everywhere(size_t) { return true; }
  void try_on_all_cameras();
  void try_on_single_cameras();
  void judge_camera(int camera, double mean, double middle);

  const FitTrials& trials_;
  const std::vector<std::string>& names_;
  Diagnosis diagnosis_;
  std::vector<const Misreading*> undone_;
  std::vector<double> now_;                                 // fit of each view with these undone
  std::map<const Misreading*, std::vector<double>> alone_;  // and with one of all undone alone
};

/// The clearest fault first, what is left on top of it.
void Diagnostician::try_on_all_cameras() {
  constexpr int most_faults = 3;
  for (int round = 0; round < most_faults; ++round) {
    const Misreading* best = nullptr;
    Comparison best_fit;
    std::vector<double> best_fits;
    for (const Misreading& misreading : misreadings()) {
      std::vector<const Misreading*> with = undone_;
      with.push_back(&misreading);
      std::vector<double> fits = trials_.fit(with);
      const Comparison means = compare(now_, fits, everywhere);
      if (round == 0) {
        if (means.views > 0)
          diagnosis_.trials.push_back({misreading.name, misreading.words, diagnosis_.mask_iou + means.gain()});
        alone_[&misreading] = fits;
      }
      if (means.gain() < needed_gain(misreading) || means.gain() <= best_fit.gain()) continue;
      best = &misreading;
      best_fit = means;
      best_fits = std::move(fits);
    }
    if (!best) break;
    undone_.push_back(best);
    now_ = std::move(best_fits);
    diagnosis_.suspected.push_back(best->name);
    diagnosis_.sentences.push_back(fmt::format("{}: {} (mean overlap {:.2f} as read, {:.2f} so)", best->name,
                                               best->words, best_fit.before, best_fit.after));
  }
  std::stable_sort(diagnosis_.trials.begin(), diagnosis_.trials.end(),
                   [](const auto& a, const auto& b) { return a.mask_iou > b.mask_iou; });
}

/// Those that stay behind the others.
void Diagnostician::try_on_single_cameras() {
  std::map<int, double> means;
  for (const MaskView& view : trials_.views()) {
    if (means.count(view.camera) > 0) continue;
    means[view.camera] = compare(now_, now_, [&](size_t i) { return trials_.views()[i].camera == view.camera; }).after;
  }
  if (means.empty()) return;
  std::vector<double> sorted;
  for (const auto& [camera, mean] : means) sorted.push_back(mean);
  std::sort(sorted.begin(), sorted.end());
  const double middle = sorted[sorted.size() / 2];
  for (const auto& [camera, mean] : means) judge_camera(camera, mean, middle);
  if (middle >= poor_fit) return;
  diagnosis_.sentences.push_back(fmt::format(
      "the body covers the person poorly (mean overlap {:.2f}{}) and no known mistake explains it: do parameters, "
      "calibration and pictures belong to one sequence, and is the body model the one that was fitted?",
      compare(now_, now_, everywhere).after, undone_.empty() ? "" : " with the above undone"));
}

void Diagnostician::judge_camera(int camera, double mean, double middle) {
  const auto of_camera = [&](size_t i) { return trials_.views()[i].camera == camera; };
  const std::string& name = names_[static_cast<size_t>(camera)];
  const Misreading* best = nullptr;
  Comparison best_fit;
  for (const Misreading& misreading : misreadings()) {
    if (!undone_.empty()) break;  // one camera's own mistake is looked for where all are read rightly
    const Comparison means = compare(now_, alone_.at(&misreading), of_camera);
    const double needed = misreading.frame_offset != 0 ? 2 * clear_frame_gain : much_worse;
    if (means.gain() < needed || means.gain() <= best_fit.gain()) continue;
    best = &misreading;
    best_fit = means;
  }
  if (best) {
    diagnosis_.suspected.push_back(name + ":" + best->name);
    diagnosis_.sentences.push_back(fmt::format("{} alone: {} (mean overlap {:.2f} as read, {:.2f} so)", name,
                                               best->words, best_fit.before, best_fit.after));
  } else if (mean < middle - much_worse) {
    diagnosis_.sentences.push_back(fmt::format(
        "{} fits much worse than the others (mean overlap {:.2f}, the middle camera has {:.2f}) and no known mistake "
        "explains it: is its calibration of another day, or are its pictures another camera's?",
        name, mean, middle));
  }
}

}  // namespace

Diagnosis diagnose(const FitTrials& trials, const std::vector<std::string>& camera_names) {
  return Diagnostician(trials, camera_names).run();
}

}  // namespace degas
