#include "model/train/training_run.h"

#include "host/device/tuner.h"
#include "model/data/selection.h"
#include "model/loss/lpips_weights.h"
#include "model/train/face_codes.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

/// The folder, once all that a run is made of has been looked through.
std::filesystem::path checked(const Config& config, const Capture& capture, const std::filesystem::path& body,
                              const std::filesystem::path& folder) {
  BodyModel::load(body);
  allowed_cameras(capture, config.data);
  with_camera_names(config, capture);  // looks data.validation up too
  selected_frames(config.data.frames, capture.frame_count(), "data.frames");
  required_face_code_size(capture, config);
  if (config.loss.lpips_weight > 0) lpips_weights_path(config.loss.lpips_weights, config.loss.lpips_network);
  return folder;
}

bool opened(Device& device, const RunFolder& folder, const Config& config, const std::filesystem::path& body,
            bool resume, std::optional<TuneMode> tune) {
  const bool continues = resume && folder.has_checkpoint();
  if (continues) {
    folder.require_same_body(body);
  } else {
    folder.create(config, body);
  }
  set_tuner(device, tune.value_or(continues ? folder.tuning() : TuneMode::Off));
  if (device.tuner()) device.tuner()->record_in(folder.tuning_file());
  return continues;
}

}  // namespace

TrainingRun::TrainingRun(Device& device, const Config& config, const Capture& capture,
                         const std::filesystem::path& folder, const std::filesystem::path& body, bool resume,
                         std::optional<TuneMode> tune)
    : folder_(folder),
      lock_(checked(config, capture, body, folder)),
      continues_(opened(device, folder_, config, body, resume, tune)),
      trainer_(device, config, capture, folder_) {
  if (continues_) trainer_.resume();
}

}  // namespace degas
