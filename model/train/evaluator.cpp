#include "model/train/evaluator.h"

#include <chrono>
#include <numeric>
#include <set>

#include "host/error.h"
#include "host/io/image.h"
#include "model/loss/lpips_weights.h"
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

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void require_going_on(const EvaluationOptions& options) {
  if (options.stop_requested()) throw Error("interrupted: no metrics.json was written; pictures made so far stand");
}

/// At the end: an evaluation that fails leaves the files of an earlier one.
void write_results(const EvaluationFolder& folder, const Scores& scores, const nlohmann::json& metrics,
                   const std::function<fs::path(const EvaluatedPicture&)>& truth,
                   const std::function<fs::path(const EvaluatedPicture&)>& render) {
  write_image(folder.path() / "worst.png", scores.worst_sheet([&](const EvaluatedPicture& picture) {
    return std::pair(read_image(truth(picture)), read_image(render(picture)));
  }));
  folder.write_pictures(scores.pictures());
  folder.write_text("per_frame.csv", scores.table());
  folder.write_text("metrics.json", metrics.dump(2) + '\n');
}

/// At the end: a fault of the inputs is told by one line alone.
void tell_what_lacks(const MetricNetworks& networks) {
  if (!networks.no_lpips.empty()) fmt::print(stderr, "degas: no LPIPS in this evaluation: {}\n", networks.no_lpips);
}

}  // namespace

MetricNetworks default_metric_networks(const LossConfig& loss) {
  MetricNetworks networks;
  try {
    const fs::path path = lpips_weights_path(loss.lpips_weights, LpipsNetwork::Alex);
    networks.lpips.emplace_back(LpipsNetwork::Alex, load_lpips_layers(path, LpipsNetwork::Alex));
  } catch (const Error& error) {
    networks.no_lpips = error.what();
  }
  return networks;
}

EvaluationSummary evaluate(Device& device, TrainedAvatar& avatar, const Capture& capture,
                           const EvaluationOptions& options, const EvaluationProgress& progress) {
  const EvaluationFolder folder(options.output);
  for (const char* part : {"truth", "render", "sheets"}) fs::create_directories(options.output / part);
  const MetricNetworks networks = options.networks ? *options.networks : default_metric_networks(avatar.config().loss);
  Scores scores(device, networks);
  FaceCodes codes = avatar.face_codes(capture);
  SplatWorkspace workspace;
  EvaluationSummary summary;
  std::vector<double> decode_ms, render_ms;
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
      require_going_on(options);
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
      render_ms.push_back(milliseconds_since(render_start));
      decode_ms.push_back(decode_time);

      const Image8 render = to_image8(image.color), truth = over_background(sample, {255, 255, 255});
      const BodyModel& body = avatar.avatar().body();
      const Pose pose = (options.boxes ? *options.boxes : capture).pose(frame);
      const EvaluatedPicture picture{capture.camera_names()[camera],
                                     frame,
                                     avatar.is_refined(capture, frame),
                                     mask_box(sample.mask),
                                     face_box(body, pose, avatar.avatar().betas(), sample.view),
                                     mouth_box(body, pose, avatar.avatar().betas(), sample.view)};
      write_image(folder.truth(picture), truth);
      write_image(folder.render(picture), render);
      write_image(folder.sheet(picture), comparison_sheet(truth, render));
      scores.add(picture, truth, render);
      ++summary.pictures;
      summary.refined_pictures += picture.refined;
    }
  }
  if (summary.pictures == 0) throw Error("none of the chosen frames and cameras has a picture to compare with");

  summary.without_face = scores.without_face();
  nlohmann::json& metrics = summary.metrics = scores.metrics();
  metrics["cameras"] = options.cameras.size();
  metrics["refined_pictures"] = summary.refined_pictures;
  metrics["gaussians"] = avatar.avatar().gaussian_count();
  metrics["parameters"] = avatar.avatar().network().parameters().count();
  metrics["decode_ms"] = mean_of(decode_ms);
  metrics["render_ms"] = mean_of(render_ms);
  metrics["fps"] = 1000.0 / (mean_of(decode_ms) + mean_of(render_ms));
  metrics["device"] = device.description().name;
  metrics["steps"] = avatar.steps_trained();
  write_results(
      folder, scores, metrics, [&](const EvaluatedPicture& picture) { return folder.truth(picture); },
      [&](const EvaluatedPicture& picture) { return folder.render(picture); });
  tell_what_lacks(networks);
  return summary;
}

EvaluationSummary evaluate_pictures(Device& device, const fs::path& pictures, const EvaluationFolder& truth,
                                    const EvaluationOptions& options, const EvaluationProgress& progress) {
  const std::vector<EvaluatedPicture> wanted = truth.read_pictures();
  const EvaluationFolder folder(options.output);
  const auto given = [&](const EvaluatedPicture& picture) { return pictures / (picture.name() + ".png"); };
  fs::create_directories(options.output / "sheets");
  const MetricNetworks networks = options.networks ? *options.networks : default_metric_networks({});
  Scores scores(device, networks);
  EvaluationSummary summary;
  std::set<std::string> cameras;
  for (const EvaluatedPicture& picture : wanted) {
    require_going_on(options);
    progress(++summary.pictures, static_cast<int>(wanted.size()));
    const Image8 photograph = read_image(truth.truth(picture)), image = read_image(given(picture));
    if (image.width != photograph.width || image.height != photograph.height) {
      throw Error::format("{}: {}x{} pixels, and {} has {}x{}; draw it at that size", given(picture).string(),
                          image.width, image.height, truth.truth(picture).string(), photograph.width,
                          photograph.height);
    }
    write_image(folder.sheet(picture), comparison_sheet(photograph, image));
    scores.add(picture, photograph, image);
    summary.refined_pictures += picture.refined;
    cameras.insert(picture.camera);
  }
  summary.without_face = scores.without_face();
  summary.metrics = scores.metrics();
  summary.metrics["cameras"] = cameras.size();
  summary.metrics["refined_pictures"] = summary.refined_pictures;
  write_results(
      folder, scores, summary.metrics, [&](const EvaluatedPicture& picture) { return truth.truth(picture); }, given);
  tell_what_lacks(networks);
  return summary;
}

}  // namespace degas
