// What runs, evaluations and studies leave on disk, and configurations.

#include <nlohmann/json.hpp>

#include "host/device/tuning_table.h"
#include "host/io/checkpoint.h"
#include "host/io/checksum.h"
#include "host/io/file_bytes.h"
#include "model/config.h"
#include "model/faces/code_folder.h"
#include "model/study/grid.h"
#include "model/train/evaluation_folder.h"
#include "model/train/report.h"
#include "model/train/run_folder.h"
#include "model/train/training_state.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

constexpr size_t checkpoint_head = 8 + 4 + 8;  // magic, version, length of the text

/// A checkpoint whose length and checksum hold, whatever its text and numbers are.
void write_sealed_checkpoint(const Parts& parts, const fs::path& path) {
  Bytes bytes = bytes_of("DEGASCKP");
  const auto append = [&](const void* data, size_t count) {
    const auto* begin = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + count);
  };
  const Bytes &text = parts.at("text"), &numbers = parts.at("numbers");
  const uint32_t version = 1;
  const uint64_t length = text.size();
  append(&version, sizeof(version));
  append(&length, sizeof(length));
  append(text.data(), text.size());
  append(numbers.data(), numbers.size());
  Checksum sum;  // as it is written, piece by piece
  sum.add(bytes.data(), 8);
  sum.add(&version, sizeof(version));
  sum.add(&length, sizeof(length));
  sum.add(text.data(), text.size());
  const nlohmann::json root = nlohmann::json::parse(text.begin(), text.end(), nullptr, false);
  size_t at = 0;
  if (root.is_object() && root.contains("arrays")) {
    for (const auto& entry : root["arrays"]) {
      if (!entry.is_array() || entry.size() < 2 || !entry[1].is_number_unsigned()) break;
      const uint64_t bytes_here = entry[1].get<uint64_t>() * sizeof(float);
      if (bytes_here > numbers.size() - at) break;
      sum.add(numbers.data() + at, bytes_here);
      at += bytes_here;
    }
  }
  const uint64_t value = sum.value();
  append(&value, sizeof(value));
  write_folder({{path.filename().string(), bytes}}, path.parent_path());
}

}  // namespace

TEST_CASE("damaged checkpoints") {
  const TemporaryFolder folder;
  Checkpoint checkpoint;
  checkpoint.header = {{"step", 12}, {"betas", {0.5, -1}}, {"config", {{"net", {{"width", 1}}}}}};
  checkpoint.arrays = {{"weights", {1, 2, 3}}, {"bias", {4}}, {"none", {}}};
  write_checkpoint(folder / "seed.bin", checkpoint);
  const Bytes seed = read_file_bytes(folder / "seed.bin");
  uint64_t length = 0;
  std::memcpy(&length, seed.data() + checkpoint_head - sizeof(length), sizeof(length));
  const auto text = seed.begin() + checkpoint_head, numbers = text + static_cast<ptrdiff_t>(length);
  const auto read = [](const fs::path& path) { read_checkpoint(path); };
  fuzz({"checkpoint.bin", {whole(seed)}, {}, read, 3000});
  const Parts parts = {{"text", Bytes(text, numbers)}, {"numbers", Bytes(numbers, seed.end() - 8)}};
  fuzz({"sealed.bin", {parts}, write_sealed_checkpoint, read, 5000});
}

TEST_CASE("damaged states of a run within checkpoints that hold") {
  Checkpoint checkpoint;
  store_state({12, Config(), "capture", "pictures", {0.5, -1}, 512, {0, 3}, 1.5}, checkpoint);
  const std::string text = nlohmann::json{{"header", checkpoint.header}, {"arrays", nlohmann::json::array()}}.dump();
  fuzz({"state.bin",
        {{{"text", bytes_of(text)}, {"numbers", {}}}},
        write_sealed_checkpoint,
        [](const fs::path& path) { read_state(read_checkpoint(path)); },
        5000});
}

TEST_CASE("damaged histories and metrics of a report") {
  const Parts parts = {
      {"run/history.jsonl", bytes_of("{\"step\": 1, \"loss\": 0.5}\n{\"step\": 2, \"loss\": 0.25, \"psnr\": 30}\n")},
      {"run/config.json", bytes_of(config_text(Config()))},
      {"view/metrics.json", bytes_of(R"({"psnr": 30.5, "frames": 12, "cameras": ["cam02"], "fps": 20.1})")}};
  fuzz({"report",
        {parts},
        write_folder,
        [](const fs::path& path) {
          write_report(path / "report.html", {path / "run", {path / "view"}});
        },
        3000});
}

TEST_CASE("damaged configurations") {
  Config config;
  fuzz({"config.json",
        {whole(bytes_of(config_text(config)))},
        {},
        [](const fs::path& path) { load_config(path); },
        5000});
}

TEST_CASE("damaged boxes of an evaluation") {
  const TemporaryFolder folder;
  const EvaluationFolder evaluation(folder.path());
  evaluation.write_pictures({{"cam00", 3, true, {1, 2, 30, 40}, Rectangle{3, 4, 5, 6}, std::nullopt},
                             {"cam01", 4, false, {1, 2, 30, 40}, std::nullopt, std::nullopt}});
  fuzz({"evaluation",
        {{{"boxes.json", read_file_bytes(folder / "boxes.json")}}},
        write_folder,
        [](const fs::path& path) { EvaluationFolder(path).read_pictures(); },
        5000});
}

TEST_CASE("damaged grids of a study") {
  const std::string text = R"({"sweep": {"net.resolution": [128, 512], "net.width": [0.25, 1]},
 "points": [{"name": "fast", "set": {"net.resolution": 128, "net.width": 0.25}}, {"set": {"train.views_per_step": 2}}]})";
  const Variant base{"base", Config(), {}, {}, false, {}};
  fuzz({"grid.json", {whole(bytes_of(text))}, {}, [&](const fs::path& path) { grid_variants(base, path); }, 3000});
}

TEST_CASE("damaged settings of an encoder") {
  const nlohmann::json settings = {{"side", 256}, {"weights", {{"file", "DPE.pt"}, {"checksum", "0123"}}}};
  fuzz({"codes",
        {{{"dpe/encoder.json", bytes_of(settings.dump(1))}}},
        write_folder,
        [&](const fs::path& path) { CodeFolder(path, settings, false); },
        3000});
}

TEST_CASE("a damaged tuning table counts as empty") {
  const TemporaryFolder folder;
  TuningTable table(folder / "tuning.json");
  table.add({"device", "driver", "conv2d", "1 2 3", "0123"}, {{{"TILE", 4}, {"WIDTH", 8}}, TuneMode::Full, 1.5, 2.5});
  FuzzTarget target{"tuning.json",
                    {whole_file(folder / "tuning.json")},
                    {},
                    [](const fs::path& path) { TuningTable(path).mode(); },
                    3000};
  target.never_refuses = true;
  fuzz(target);
}

TEST_CASE("a damaged history is cut where the damage begins") {
  FuzzTarget target{"run",
                    {{{"history.jsonl", bytes_of("{\"step\": 1, \"loss\": 0.5}\n{\"step\": 2, \"loss\": 0.25}\n")}}},
                    write_folder,
                    [](const fs::path& path) { RunFolder(path).truncate_history(2); },
                    500};
  target.never_refuses = true;
  fuzz(target);
}
