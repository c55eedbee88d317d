#include "model/train/evaluator.h"

#include <chrono>
#include <cmath>
#include <sstream>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/image.h"
#include "model/loss/lpips_weights.h"
#include "model/loss/metrics.h"
#include "model/train/boxes.h"
#include "model/train/picture.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A mean that knows whether it has seen anything.
class Mean {
 public:
  void add(double value) {
    total_ += value;
    ++count_;
  }
  nlohmann::json json() const { return count_ ? nlohmann::json(total_ / count_) : nlohmann::json(); }

 private:
  double total_ = 0;
  int count_ = 0;
};

/// PSNR, SSIM and LPIPS of one region, averaged over pictures.
struct QualityMeans {
  Mean psnr, ssim, lpips;
  void add(const ImageQuality& quality) {
    psnr.add(quality.psnr);
    ssim.add(quality.ssim);
    if (quality.lpips) lpips.add(*quality.lpips);
  }
  void store(nlohmann::json& metrics, const std::string& prefix) const {
    metrics[prefix + "psnr"] = psnr.json();
    metrics[prefix + "ssim"] = ssim.json();
    metrics[prefix + "lpips"] = lpips.json();
  }
};

std::string csv_cells(const std::optional<ImageQuality>& quality) {
  if (!quality) return ",,,";
  return fmt::format(",{:.6f},{:.6f},{}", quality->psnr, quality->ssim,
                     quality->lpips ? fmt::format("{:.6f}", *quality->lpips) : std::string());
}

std::vector<LpipsLayer> lpips_layers_if_any(const LossConfig& loss) {
  try {
    return load_lpips_layers(lpips_weights_path(loss.lpips_weights, LpipsNetwork::Alex), LpipsNetwork::Alex);
  } catch (const Error& error) {
    fmt::print(stderr, "degas: no LPIPS in this evaluation: {}\n", error.what());
    return {};
  }
}

}  // namespace

EvaluationSummary evaluate(Device& device, TrainedAvatar& avatar, const Capture& capture,
                           const EvaluationOptions& options, const std::function<void(int done, int total)>& progress) {
  for (const char* folder : {"truth", "render", "sheets"}) fs::create_directories(options.output / folder);
  std::ostringstream csv;  // written at the end: an evaluation that fails leaves the files of an earlier one
  csv << "camera,frame,refined,psnr,ssim,lpips,person_psnr,person_ssim,person_lpips,face_psnr,face_ssim,face_lpips\n";

  const QualityMeter meter(device, lpips_layers_if_any(avatar.config().loss));
  FaceCodes codes = avatar.face_codes(capture);
  SplatWorkspace workspace;
  EvaluationSummary summary;
  QualityMeans whole, person, face;
  Mean decode_ms, render_ms;
  std::vector<int> frames_seen;
  const int total = static_cast<int>(options.frames.size() * options.cameras.size());
  int done = 0;
  {
    // Builds every kernel, so that the times below are those of the kernels alone.
    Tape tape(device, false);
    splat(tape, workspace, avatar.drive(tape, capture, codes, options.frames.front()),
          capture.camera(options.cameras.front()), {1, 1, 1}, splat_options(avatar.config().render));
    device.finish();
  }
  for (int frame : options.frames) {
    Tape tape(device, false);
    const DrivingSignal host_signal = avatar.avatar().signal(capture, frame, codes.mean(frame));
    const Avatar::Signal signal = avatar.avatar().upload(host_signal);
    device.finish();
    const Clock::time_point decode_start = Clock::now();
    const Splats splats = avatar.pose(tape, avatar.avatar().decode(tape, signal).gaussians, signal, capture, frame);
    device.finish();
    const double decode_time = milliseconds_since(decode_start);

    for (int camera : options.cameras) {
      if (options.stop_requested()) throw Error("interrupted: no metrics.json was written; pictures made so far stand");
      progress(++done, total);
      if (!capture.has_image(frame, camera)) {
        ++summary.without_picture;
        continue;
      }
      const Sample sample = capture.load(frame, camera);
      const Clock::time_point render_start = Clock::now();
      const SplatImage image =
          splat(tape, workspace, splats, sample.view, {1, 1, 1}, splat_options(avatar.config().render));
      device.finish();
      render_ms.add(milliseconds_since(render_start));
      decode_ms.add(decode_time);

      const Image8 render = to_image8(image.color), truth = over_background(sample, {255, 255, 255});
      const Rectangle person_box = mask_box(sample.mask);
      const std::optional<Rectangle> face_rectangle =
          face_box(avatar.avatar().body(), capture.pose(frame), avatar.avatar().betas(), sample.view);
      const ImageQuality whole_quality = meter.picture(render, truth, person_box);
      const std::optional<ImageQuality> person_quality = meter.box(render, truth, person_box);
      const std::optional<ImageQuality> face_quality =
          face_rectangle ? meter.box(render, truth, *face_rectangle) : std::nullopt;
      whole.add(whole_quality);
      if (person_quality) person.add(*person_quality);
      if (face_quality) face.add(*face_quality);
      summary.without_face += !face_quality;
      ++summary.pictures;
      summary.refined_pictures += avatar.is_refined(capture, frame);
      if (frames_seen.empty() || frames_seen.back() != frame) frames_seen.push_back(frame);

      const std::string name = fmt::format("{}_{:06}", capture.camera_names()[camera], frame);
      write_image(options.output / "truth" / (name + ".png"), truth);
      write_image(options.output / "render" / (name + ".png"), render);
      write_image(options.output / "sheets" / (name + ".png"), comparison_sheet(truth, render));
      csv << capture.camera_names()[camera] << ',' << frame << ',' << avatar.is_refined(capture, frame)
          << csv_cells(whole_quality) << csv_cells(person_quality) << csv_cells(face_quality) << '\n';
    }
  }
  if (summary.pictures == 0) throw Error("none of the chosen frames and cameras has a picture to compare with");

  nlohmann::json& metrics = summary.metrics;
  whole.store(metrics, "");
  person.store(metrics, "person_");
  face.store(metrics, "face_");
  metrics["frames"] = frames_seen.size();
  metrics["cameras"] = options.cameras.size();
  metrics["pictures"] = summary.pictures;
  metrics["refined_pictures"] = summary.refined_pictures;
  metrics["gaussians"] = avatar.avatar().gaussian_count();
  metrics["parameters"] = avatar.avatar().network().parameters().count();
  metrics["decode_ms"] = decode_ms.json();
  metrics["render_ms"] = render_ms.json();
  metrics["fps"] = 1000.0 / (decode_ms.json().get<double>() + render_ms.json().get<double>());
  metrics["device"] = device.description().name;
  metrics["steps"] = avatar.steps_trained();
  const std::string table = csv.str(), text = metrics.dump(2) + '\n';
  write_file_atomically(options.output / "per_frame.csv", std::as_bytes(std::span<const char>(table)));
  write_file_atomically(options.output / "metrics.json", std::as_bytes(std::span<const char>(text)));
  return summary;
}

}  // namespace degas
