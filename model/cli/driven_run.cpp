#include "model/cli/driven_run.h"

#include "host/device/tuner.h"

namespace degas {

DrivenRun::DrivenRun(const std::filesystem::path& run, const std::filesystem::path& data,
                     const CaptureChoice& capture_choice, const DeviceChoice& device_choice)
    : device(device_choice.options()),
      avatar(device, RunFolder(run)),
      capture(avatar.as_registered(open_capture(data, capture_choice.options(avatar.config())))) {
  set_tuner(device, device_choice.tune.value_or(TuneMode::Off));
}

}  // namespace degas
