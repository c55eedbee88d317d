// Reading training pictures, with nothing computed in between: steps/s of the loader's thread with quick.json's views a
// step, from the cache of decoded pictures and from a pack; and packing itself, pictures/s with a thread a core.
#include <fmt/format.h>

#include <thread>

#include "bench/support/harness.h"
#include "bench/support/subject.h"
#include "model/data/loader.h"
#include "model/data/packed_capture.h"
#include "model/train/view_schedule.h"

using namespace degas;
using namespace degas::bench;

namespace {

constexpr int steps = 200;

void load(const Capture& capture, const ViewSchedule& schedule) {
  Loader loader(
      capture, [&](int64_t step) { return schedule.plan(step); }, {}, 0, steps);
  for (int step = 0; step < steps; ++step) loader.next();
}

std::vector<LoadRequest> all_views(const Capture& capture) {
  std::vector<LoadRequest> views;
  for (int frame = 0; frame < capture.frame_count(); ++frame) {
    views.push_back({frame, {}});
    for (int camera = 0; camera < static_cast<int>(capture.camera_names().size()); ++camera) {
      if (capture.has_image(frame, camera)) views.back().cameras.push_back(camera);
    }
  }
  return views;
}

}  // namespace

int main(int count, char** values) {
  Bench bench(count, values, "load and pack");
  const WholeCase& c = whole_cases[0];
  const Subject subject(c.width, c.height);
  const std::unique_ptr<Capture> cached = subject.capture();
  const std::vector<LoadRequest> views = all_views(*cached);
  const TrainConfig train = benchmark_config(c.config).train;
  const ViewSchedule schedule(views, train.views_per_step, train.seed);
  const std::filesystem::path file = subject.folder() / "loader_bench.pack";
  PackOptions options;
  options.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));

  const auto add_row = [&](const std::string& name, const char* unit, int64_t items,
                           const std::function<void()>& work) {
    Row row;
    row.name = fmt::format("{} {}x{}/{}", subject.name(), c.width, c.height, name);
    row.time = bench.time(work);
    row.details = {{unit, 1e3 * static_cast<double>(items) / row.time.median}};
    bench.report.add(row);
  };
  const PackSummary summary = write_pack(file, *cached, options);
  add_row("pack of decoded pictures", "pictures_per_second", summary.pictures,
          [&] { write_pack(file, *cached, options); });
  add_row("load from the cache", "steps_per_second", steps, [&] { load(*cached, schedule); });
  const PackedCapture packed(file, 1);
  add_row("load from the pack", "steps_per_second", steps, [&] { load(packed, schedule); });
  std::filesystem::remove(file);
  bench.finish();
}
