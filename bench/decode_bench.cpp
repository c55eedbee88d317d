// Drawing a new frame of an avatar, from the driving signal to the picture: frames/s of decode + pose + splat at a
// picture size. The network's weights are random; the Gaussians are those of the subject's base maps.
#include <fmt/format.h>

#include "bench/support/harness.h"
#include "bench/support/subject.h"
#include "model/train/avatar.h"
#include "model/train/picture.h"

using namespace degas;
using namespace degas::bench;

int main(int count, char** values) {
  Bench bench(count, values, "decode and render");
  Device& device = bench.device;
  for (const WholeCase& c : whole_cases) {
    if (!bench.arguments.wants(c.name())) continue;
    const Subject subject(c.width, c.height);
    const std::unique_ptr<Capture> capture = subject.capture();
    const Config config = benchmark_config(c.config);
    const Avatar avatar(device, config, BodyModel::load(subject.body()), capture->betas(), capture->face_code_size());
    const std::vector<float> face_code(capture->face_code_size(), 0.1f);
    const DrivingSignal signal = avatar.signal(*capture, 0, face_code);
    const Camera camera = capture->camera(capture->camera_names().size() / 2);
    SplatWorkspace workspace;
    fmt::print("{}: {}, {} Gaussians\n", c.name(), subject.name(), avatar.gaussian_count());

    const auto add_row = [&](const char* part, const std::function<void()>& work) {
      Row row;
      row.name = fmt::format("{}/{}", c.name(), part);
      row.time = bench.time(work);
      row.details = {{"frames_per_second", 1e3 / row.time.median}};
      bench.report.add(row);
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
  bench.finish();
}
