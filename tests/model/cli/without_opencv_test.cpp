#include <cstdlib>

#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

/// While it lives, commands are run by the program that has no OpenCV and lies beside the other.
class WithoutOpencv {
 public:
  WithoutOpencv() : usual_(std::getenv("DEGAS_PROGRAM")) {
    setenv("DEGAS_PROGRAM", (usual_ + "_without_opencv").c_str(), 1);
  }
  ~WithoutOpencv() { setenv("DEGAS_PROGRAM", usual_.c_str(), 1); }

 private:
  std::string usual_;
};

void run(const std::vector<std::string>& arguments) {
  const ProgramResult result = run_program(arguments);
  CAPTURE(arguments.front(), result.output, result.errors);
  REQUIRE(result.exit_code == 0);
}

/// Trains from the pack for three steps, measures a camera, draws another and exports a frame, each into `folder`.
void use(const fs::path& pack, const fs::path& folder) {
  fs::create_directory(folder);
  std::ofstream(folder / "config.json") << config_text(tiny_config());
  const std::string data = pack.string(), trained = (folder / "run").string();
  run({"train", "--data", data, "--body", (training_scene() / "body.npz").string(), "--config",
       (folder / "config.json").string(), "--iterations", "3", "--hold-out", "cam02", "--out", trained});
  run({"eval", "--run", trained, "--data", data, "--cameras", "cam02", "--out", (folder / "eval").string()});
  run({"render", "--run", trained, "--data", data, "--cameras", "cam01", "--frames", "0:2", "--out",
       (folder / "pictures").string()});
  run({"export", "--run", trained, "--data", data, "--frame", "0", "--out", (folder / "a.ply").string()});
}

}  // namespace

TEST_CASE("without OpenCV a pack is trained from, measured and drawn to the same bits") {
  const TemporaryFolder folder;
  const fs::path pack = folder / "P1C1.pack";
  run({"pack", "--data", (training_scene() / "P1C1").string(), "--out", pack.string()});
  use(pack, folder / "usual");
  {
    const WithoutOpencv scope;
    use(pack, folder / "without");
  }
  for (const char* file : {"run/checkpoint.bin", "eval/per_frame.csv", "a.ply"}) {
    CAPTURE(file);
    const bool same = file_text(folder / "usual" / file) == file_text(folder / "without" / file);
    CHECK((same && fs::file_size(folder / "without" / file) > 100));
  }
  for (const char* file : {"eval/worst.png", "pictures/000001.png"}) {
    CAPTURE(file);
    const Image8 usual = read_image(folder / "usual" / file), without = read_image(folder / "without" / file);
    int largest = usual.pixels.size() == without.pixels.size() ? 0 : 256;
    for (size_t i = 0; i < usual.pixels.size() && largest < 256; ++i) {
      largest = std::max(largest, std::abs(usual.pixels[i] - without.pixels[i]));
    }
    // Tiles of the worst ones are resized, to a level, and their differences are drawn four times as large.
    CHECK(largest <= (fs::path(file).stem() == "worst" ? 8 : 0));
  }
}

TEST_CASE("what takes OpenCV is refused without it in one line that tells the remedy") {
  const TemporaryFolder folder;
  const WithoutOpencv scope;
  const auto refused = [](const std::vector<std::string>& arguments, const std::string& what) {
    check_refused(run_program(arguments), {what, "built without OpenCV", "degas pack", "-DDEGAS_WITH_OPENCV=ON"});
  };
  refused(TrainCommand(folder, tiny_config()).arguments(), "cam00.mp4: videos cannot be read");
  const std::string data = (training_scene() / "P1C1").string(), out = (folder / "out").string();
  refused({"pack", "--data", data, "--out", out}, "cam00.mp4: videos cannot be read");
  refused({"synth", "--out", out, "--frames", "2"}, "cam00.mp4: videos cannot be written");
}
