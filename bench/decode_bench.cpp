// Drawing a new frame of an avatar, from the driving signal to the picture: frames/s of decode + pose + splat at a
// picture size. The network's weights are random; the Gaussians are those of the subject's base maps.
#include <fmt/format.h>

#include "bench/support/harness.h"
#include "bench/support/subject.h"
#include "model/train/avatar.h"
#include "model/train/picture.h"

using namespace degas;
using namespace degas::bench;

namespace {

struct Case {
  const char* config;
  int width, height;
};
constexpr Case cases[] = {{"quick", 480, 640}, {"full", 1024, 750}};

}  // namespace

int main(int count, char** values) {
  const Arguments arguments = parse_arguments(count, values);
  DeviceOptions options;
  options.selector = arguments.device;
  Device device(options);
  Report report("decode and render on " + device.description().name, 0);
  for (const auto& [config_name, width, height] : cases) {
    const std::string name = fmt::format("{} {}x{}", config_name, width, height);
    if (name.find(arguments.filter) == std::string::npos) continue;
    const Subject subject(width, height);
    const std::unique_ptr<Capture> capture = subject.capture();
    const Config config = benchmark_config(config_name);
    const Avatar avatar(device, config, BodyModel::load(subject.body()), capture->betas(), capture->face_code_size());
    const std::vector<float> face_code(capture->face_code_size(), 0.1f);
    const DrivingSignal signal = avatar.signal(*capture, 0, face_code);
    const Camera camera = capture->camera(capture->camera_names().size() / 2);
    SplatWorkspace workspace;
    fmt::print("{}: {}, {} Gaussians\n", name, subject.name(), avatar.gaussian_count());

    const auto add_row = [&](const char* part, const std::function<void()>& work) {
      Row row;
      row.name = fmt::format("{}/{}", name, part);
      row.time = measure(work, [&] { device.finish(); }, {.clock = arguments.clock});
      row.details = {{"frames_per_second", 1e3 / row.time.median}};
      report.add(row);
    };
    Tape tape(device, false);
    const auto splats_of = [&](const Avatar::Signal& uploaded) {
      return avatar.pose(tape, avatar.decode(tape, uploaded).gaussians, uploaded.body);
    };
    const auto draw = [&](const Splats& splats) {
      splat(tape, workspace, splats, camera, {1, 1, 1}, splat_options(config.render));
    };
    const Avatar::Signal uploaded = avatar.upload(signal);
    const Splats posed = splats_of(uploaded);
    add_row("driving signal (host)", [&] { avatar.signal(*capture, 0, face_code); });
    add_row("decode", [&] { avatar.decode(tape, uploaded); });
    add_row("render", [&] { draw(posed); });
    add_row("decode and render", [&] { draw(splats_of(avatar.upload(signal))); });
  }
  report.finish(arguments.json);
}
