// What a run refuses to go on from.
#include "host/error.h"
#include "host/io/checkpoint.h"
#include "model/train/trainer.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

TEST_CASE("resuming with another config or capture is refused, and names what differs") {
  Config config = tiny_config();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene(), other = open_scene("P1C2");
  {
    Trainer trainer(wide(), config, *capture, run);
    train(trainer, config, 1);
  }
  const std::string saved = file_text(run.checkpoint_file());
  Trainer on_other(wide(), config, *other, run);
  CHECK_THROWS_WITH(on_other.resume(), Contains("checkpoint.bin: was trained on another capture"));
  config.loss.scale_weight = 0.5;
  config.net.width = 0.5;
  Trainer differing(wide(), config, *capture, run);
  CHECK_THROWS_WITH(differing.resume(), Contains("checkpoint.bin: was trained with another configuration") &&
                                            Contains("net.width (0.25 / 0.5)") &&
                                            Contains("loss.scale_weight (1.0 / 0.5)"));
  const bool untouched = file_text(run.checkpoint_file()) == saved;
  CHECK(untouched);
}

TEST_CASE("a checkpoint whose arrays or header do not fit is refused") {
  const Config config = tiny_config();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  Trainer trainer(wide(), config, *capture, run);
  train(trainer, config, 1);
  const Checkpoint good = read_checkpoint(run.checkpoint_file());
  SECTION("an array of another size") {
    Checkpoint bad = good;
    bad.arrays[0].second.pop_back();
    write_checkpoint(run.checkpoint_file(), bad);
    CHECK_THROWS_WITH(trainer.resume(), Contains("checkpoint.bin: array '" + bad.arrays[0].first + "' has"));
  }
  SECTION("an array missing") {
    Checkpoint bad = good;
    bad.arrays.erase(bad.arrays.begin());
    write_checkpoint(run.checkpoint_file(), bad);
    CHECK_THROWS_WITH(trainer.resume(), Contains("checkpoint.bin: no array '" + good.arrays[0].first + "'"));
  }
  SECTION("a header without its keys") {
    const std::string key = GENERATE("config", "capture", "step", "optimiser");
    Checkpoint bad = good;
    bad.header.erase(key);
    write_checkpoint(run.checkpoint_file(), bad);
    CHECK_THROWS_AS(trainer.resume(), Error);
    CHECK_THROWS_WITH(trainer.resume(), Contains("checkpoint.bin: ") && Contains(key));
  }
  SECTION("a header with values that none can have") {
    const auto [place, value] = GENERATE(table<const char*, nlohmann::json>({{"/step", -1},
                                                                             {"/step", 2.5},
                                                                             {"/face_code_size", 1 << 30},
                                                                             {"/refined_frames/0", -7},
                                                                             {"/minutes_spent", -1},
                                                                             {"/optimiser/applied", -1},
                                                                             {"/optimiser/updates/0", -1}}));
    Checkpoint bad = good;
    bad.header["refined_frames"] = {0};
    bad.header[nlohmann::json::json_pointer(place)] = value;
    write_checkpoint(run.checkpoint_file(), bad);
    CAPTURE(place);
    CHECK_THROWS_WITH(trainer.resume(), Contains("checkpoint.bin: ") && Contains("use an older copy"));
  }
}
