#include <chrono>
#include <memory>
#include <numbers>

#include "host/device/tuner.h"
#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/network_input.h"
#include "model/cli/progress.h"
#include "model/cli/shared_options.h"
#include "model/data/selection.h"
#include "model/faces/face_encoding.h"
#include "model/faces/head_pose.h"
#include "model/train/stop_signal.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

struct EncodeFacesOptions {
  std::filesystem::path data, body, detector, weights, onnx, head_pose, output, cache;
  std::string format, keys, onnx_output, head_pose_input, cameras, hold_out, frames;
  int input = 256, views = 4;
  std::vector<double> mean = {0}, scale = {1 / 255.0};
  double max_angle = 90;  ///< degrees
  CropOptions crop;
  bool overwrite = false;
  DeviceChoice device;
};

/// One number for all channels, or three.
std::array<double, 3> by_channel(const std::vector<double>& values, const char* option) {
  if (values.size() == 2) throw Error::format("{}: two numbers, expected one, or three: R,G,B", option);
  return values.size() == 3 ? std::array{values[0], values[1], values[2]} : std::array{values[0], values[0], values[0]};
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::filesystem::path detector_file(const EncodeFacesOptions& options) {
  return options.detector.empty() ? FaceDetector::installed() : options.detector;
}

std::unique_ptr<HeadPoseNetwork> head_pose_network(const EncodeFacesOptions& options) {
  if (options.head_pose.empty()) return nullptr;
  const NetworkInput input = parse_network_input(options.head_pose_input, "--head-pose-input", {});
  return std::make_unique<HeadPoseNetwork>(options.head_pose, input.picture, input.output);
}

/// All that codes depend on besides frame and camera.
nlohmann::json settings_of(const EncodeFacesOptions& options, const Capture& capture, const FaceEncoder& encoder,
                           const HeadPoseNetwork* head_pose) {
  nlohmann::json settings = encoder.description;
  settings["capture"] = capture.picture_identity();
  settings["margin"] = options.crop.margin;
  settings["track"] = options.crop.track;
  if (options.body.empty()) {
    settings["detector"] = file_description(detector_file(options));
  } else {
    settings["body"] = file_description(options.body);
  }
  if (head_pose) settings["head_pose"] = head_pose->description();
  if (head_pose || !options.body.empty()) settings["max_angle"] = options.max_angle;
  return settings;
}

/// Boxes of all faces; nothing when stopped.
std::optional<std::vector<FaceBox>> find_faces(const EncodeFacesOptions& options, const Capture& capture,
                                               const std::vector<int>& cameras, HeadPoseNetwork* head_pose) {
  Progress progress;
  const auto telling = [&](const char* what) {
    return [&progress, what](int done, int total) {
      progress.show(static_cast<double>(done) / total, fmt::format("{}: picture {} of {}", what, done, total));
      return !StopSignal::requested();
    };
  };
  const double max_angle = options.max_angle * std::numbers::pi / 180;
  std::optional<std::vector<FaceBox>> faces;
  if (options.body.empty()) {
    FaceDetector detector(detector_file(options));
    faces = detected_faces(capture, detector, cameras, telling("looking for faces"));
  } else {
    // Whoever asks the network for angles does not want them of the body.
    faces = projected_faces(capture, BodyModel::load(options.body), cameras, head_pose ? std::numbers::pi : max_angle);
  }
  if (faces && head_pose)
    faces = ranked_by_head_pose(capture, *faces, *head_pose, options.crop.margin, max_angle, telling("head poses"));
  progress.finish();
  return faces;
}

void encode(const EncodeFacesOptions& options) {
  if (options.weights.empty() == options.onnx.empty()) {
    throw Error("encode-faces: name one encoder, DPE's by --weights FILE or another by --onnx FILE");
  }
  if (std::filesystem::is_regular_file(options.data)) {
    throw Error::format("{}: is a pack; encode its capture's faces, then pack that", options.data.string());
  }
  CaptureOptions capture_options;
  capture_options.cache = options.cache;
  capture_options.format = options.format;
  capture_options.incomplete = options.body.empty();
  const std::unique_ptr<Capture> capture = open_capture(options.data, capture_options);
  DataConfig data;
  data.cameras = selection_parts(options.cameras);
  data.hold_out = selection_parts(options.hold_out);
  const std::vector<int> cameras = allowed_cameras(*capture, data);
  const std::vector<int> frames = selected_frames(selection_parts(options.frames), capture->frame_count(), "--frames");

  std::unique_ptr<Device> device;
  FaceEncoder encoder;
  if (options.onnx.empty()) {
    device = std::make_unique<Device>(options.device.options());
    set_tuner(*device, options.device.tune.value_or(TuneMode::Off));
    encoder = make_dpe_encoder(*device, options.weights, parse_encoder_keys(options.keys));
  } else {
    const OnnxInput input = {options.input, by_channel(options.mean, "--mean"), by_channel(options.scale, "--scale")};
    encoder = make_onnx_encoder(options.onnx, input, options.onnx_output);
  }
  const std::unique_ptr<HeadPoseNetwork> head_pose = head_pose_network(options);
  const CodeFolder folder(options.output.empty() ? options.data : options.output,
                          settings_of(options, *capture, encoder, head_pose.get()), options.overwrite);

  const StopSignal stop;
  const auto boxes = find_faces(options, *capture, cameras, head_pose.get());
  if (!boxes) {
    fmt::print("interrupted while looking for faces: nothing is written\n");
    return;
  }
  if (boxes->empty()) throw Error::format("{}: no face in any picture of these cameras", options.data.string());
  folder.begin();
  const auto start = std::chrono::steady_clock::now();
  const auto rate = [&](const FaceEncodingSummary& summary) { return summary.written / seconds_since(start); };
  Progress encoding;
  const FaceEncodingSummary summary = encode_faces(
      *capture, FaceCrops(*boxes, options.crop), frames, options.views, encoder, folder,
      [&](const FaceEncodingSummary& so_far) {
        encoding.show(static_cast<double>(so_far.frames) / static_cast<double>(frames.size()),
                      fmt::format("frame {} of {}  {:.1f} codes/s", so_far.frames, frames.size(), rate(so_far)));
        return !StopSignal::requested();
      });
  encoding.finish();
  if (summary.written > 0) {
    fmt::print("wrote {} codes to {}, {:.1f} a second\n", summary.written, folder.path().string(), rate(summary));
  }
  if (summary.present > 0) fmt::print("{} codes were there already\n", summary.present);
  if (summary.without_face > 0)
    fmt::print("{} frames show no face to these cameras: without a code, they train with zeros\n",
               summary.without_face);
  if (!summary.is_whole)
    fmt::print("interrupted after {} of {} frames: the same command goes on\n", summary.frames, frames.size());
  if (!options.output.empty()) fmt::print("to use these codes: --codes {}\n", options.output.string());
}

}  // namespace

void add_encode_faces_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "encode-faces",
      "Make face codes of a capture's pictures: finds the face, cuts it out of each frame's most frontal views, and\n"
      "runs DPE's expression encoder or any ONNX network. Writes a code a view to dpe/, where training looks for "
      "them;\n"
      "an interrupted run goes on where it was");
  auto options = std::make_shared<EncodeFacesOptions>();
  command->add_option("--data", options->data, "Capture")->required();
  command->add_option("--body", options->body,
                      "Body model: its head, projected, tells where the face is and which views are frontal\n"
                      "(default: a face detector looks for it)");
  command->add_option("--detector", options->detector,
                      "Without --body: OpenCV's Haar cascade (.xml) or YuNet (.onnx) (default: the installed cascade)");
  CLI::Option* weights = command->add_option("--weights", options->weights, "DPE's checkpoint (.pt, .npz)");
  command
      ->add_option("--keys", options->keys,
                   "Where the encoder's parts lie in it, at any depth (default: as DPE has them,\n"
                   "features=enc.net_app.convs,coefficients=mlp,basis=dir,code=mlp_exp)")
      ->needs(weights);
  CLI::Option* onnx =
      command->add_option("--onnx", options->onnx, "Another encoder: an ONNX network of (1,3,N,N) RGB pictures")
          ->excludes(weights);
  command->add_option("--input", options->input, "Side N of its pictures")
      ->capture_default_str()
      ->check(CLI::Range(1, 4096))
      ->needs(onnx);
  command->add_option("--mean", options->mean, "Its pixels are (value - mean) * scale of 0..255: one number, or R,G,B")
      ->delimiter(',')
      ->expected(1, 3)
      ->needs(onnx);
  command->add_option("--scale", options->scale, "(default: 1/255)")->delimiter(',')->expected(1, 3)->needs(onnx);
  command->add_option("--onnx-output", options->onnx_output, "Its output that is the code (default: the largest)")
      ->needs(onnx);
  command->add_option("--out", options->output,
                      "Folder that gets dpe/ (default: the capture); see --codes of the others");
  command->add_option("--cameras", options->cameras, fmt::format("{} (default: all)", cameras_help));
  command->add_option("--hold-out", options->hold_out, "Cameras that are never used");
  command->add_option("--frames", options->frames, frames_help);
  command->add_option("--views", options->views, "Codes a frame, of its most frontal views")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  CLI::Option* head_pose = command->add_option(
      "--head-pose", options->head_pose,
      "Which views are frontal, by this ONNX network of face pictures: yaw, pitch and roll in degrees, or a rotation\n"
      "(default: by the body's head; without --body by the detector's score)");
  command
      ->add_option("--head-pose-input", options->head_pose_input,
                   "Its side N, pixels (value - mean) * scale of 0..255, and output that counts (default:\n"
                   "side=256,mean=0,scale=0.00392157, the largest output)")
      ->needs(head_pose);
  command
      ->add_option("--max-angle", options->max_angle,
                   "With --body or --head-pose: degrees off the front that a view may be")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 180.0));
  command->add_option("--margin", options->crop.margin, "Pixels that the face's box grows by on every side")
      ->capture_default_str()
      ->check(CLI::Range(0, 10000));
  command->add_flag("--track", options->crop.track, "Follow the head (default: one square a camera for all frames)");
  command->add_flag("--overwrite", options->overwrite, "Remove the codes that are there first");
  command->add_option("--format", options->format, format_help)->check(CLI::IsMember(capture_formats()));
  command->add_option("--cache", options->cache, "Folder of decoded pictures (default: the user's cache folder)");
  add_device_options(*command, options->device);
  command->callback([options] { encode(*options); });
}

}  // namespace degas
