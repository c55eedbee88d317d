#include <algorithm>
#include <limits>
#include <map>

#include "host/io/npz.h"
#include "host/io/video.h"
#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

Config short_config() {
  Config config = tiny_config();
  config.train.iterations = 3;
  return config;
}

/// A copy of the scene's training sequence that a test may spoil.
fs::path copied_capture(const TemporaryFolder& folder) {
  fs::copy(training_scene() / "P1C1", folder / "capture", fs::copy_options::recursive);
  return folder / "capture";
}

void replace_array(const fs::path& path, const std::string& key, const NpyArray& array) {
  std::map<std::string, NpyArray> arrays;
  {
    const NpzFile file(path);
    for (const std::string& name : file.keys()) arrays[name] = file.read(name);
  }
  arrays[key] = array;
  write_npz(path, arrays);
}

/// Replaces a camera's video: `frames` copies of a picture that is white, of alpha 255 in the frames for which
/// has_person says so and 0 elsewhere.
void replace_video(const fs::path& capture, const std::string& camera, int frames, bool (*has_person)(int frame)) {
  VideoWriter writer(capture / "videos" / (camera + ".mp4"), 128, 80, 25, VideoQuality::Lossless);
  for (int frame = 0; frame < frames; ++frame) {
    Image8 picture = Image8::black(128, 80, 3);
    if (has_person(frame)) std::fill(picture.pixels.begin(), picture.pixels.end(), uint8_t{255});
    writer.write(picture);
  }
  writer.finish();
}

}  // namespace

TEST_CASE("inputs that are missing or wrong are refused before anything is written") {
  const TemporaryFolder folder;
  TrainCommand train(folder, short_config());
  SECTION("capture missing") {
    train.data = folder / "nowhere";
    check_refused(train(), {"nowhere: no such folder", "cameras.json"});
  }
  SECTION("not a capture") {
    train.data = training_scene();
    check_refused(train(), {"holds no known capture", "capture.json"});
  }
  SECTION("body missing") {
    train.body = folder / "nobody.npz";
    check_refused(train(), {"nobody.npz: ", "no such file"});
  }
  SECTION("not a body") {
    train.body = train.config;
    check_refused(train(), {"config.json: "});
  }
  SECTION("a body of a wrong shape") {
    train.body = folder / "body.npz";
    fs::copy_file(training_scene() / "body.npz", train.body);
    replace_array(train.body, "v_template", NpyArray::from({2, 2}, std::vector<float>(4)));
    check_refused(train(), {"body.npz: 'v_template' has shape (2, 2), expected"});
  }
  SECTION("config missing") {
    train.config = folder / "none.json";
    check_refused(train(), {"none.json: cannot be read", "configs/quick.json"});
  }
  SECTION("unknown key in the config") {
    std::ofstream(train.config) << R"({"net": {"widht": 1}})";
    check_refused(train(), {"config.json: unknown key 'net.widht'", "'net.width'"});
  }
  SECTION("a value of another type in the config") {
    std::ofstream(train.config) << R"({"train": {"iterations": "many"}})";
    check_refused(train(), {"config.json: 'train.iterations' must be a whole number"});
  }
  SECTION("unknown key on the command line") {
    train.more = {"--set", "train.iteration=7"};
    check_refused(train(), {"--set train.iteration=7: unknown key", "'train.iterations'"});
  }
  SECTION("a value of another type on the command line") {
    train.more = {"--set", "net.width=wide"};
    check_refused(train(), {"--set net.width=wide: 'net.width' must be a number"});
  }
  SECTION("a value out of range") {
    train.more = {"--iterations", "0"};
    check_refused(train(), {"'train.iterations' is 0"});
  }
  SECTION("an unknown camera for validation") {
    train.more = {"--set", "data.validation=cam77"};
    check_refused(train(), {"data.validation: no camera 'cam77'; cameras here: cam00"});
  }
  SECTION("no weights for a perceptual loss") {
    train.more = {"--set", "loss.lpips_weight=0.1", "--set", "loss.lpips_weights=" + (folder / "none").string()};
    check_refused(train(), {"LPIPS weights: ", "none does not exist", "--set loss.lpips_weight=0"});
  }
  SECTION("device unknown") {
    train.more = {"--device", "nonsense"};
    check_refused(train(), {"--device nonsense: no such device; devices here: [0]"});
  }
  SECTION("no device at all") {
    fs::create_directory(folder / "empty");
    train.environment = {{"OCL_ICD_VENDORS", (folder / "empty").string() + "/"}};
    check_refused(train(), {"no OpenCL device on this machine", "pocl-opencl-icd"});
    check_refused(run_program({"devices"}, train.environment), {"no OpenCL device on this machine"});
  }
  SECTION("a run folder that cannot be made") {
    train.run = train.config / "run";
    check_refused(train(), {"config.json/run: cannot be made"});
  }
  CHECK_FALSE(fs::exists(train.run));
}

TEST_CASE("a camera that does not exist is refused with those that do") {
  const TemporaryFolder folder;
  TrainCommand train(folder, short_config());
  train.more = {"--hold-out", "cam01,cam77"};
  check_refused(train(), {"data.hold_out: no camera 'cam77'; cameras here: cam00, cam01, cam02, cam03, cam04"});
}

TEST_CASE("a broken capture is refused with file, key and remedy") {
  const TemporaryFolder folder;
  TrainCommand train(folder, short_config());
  train.data = copied_capture(folder);
  std::vector<float> angles(6 * 63);
  SECTION("NaN parameters") {
    angles[63 * 4 + 1] = std::numeric_limits<float>::quiet_NaN();
    replace_array(train.data / "smplx.npz", "body_pose", NpyArray::from({6, 63}, angles));
    check_refused(train(), {"smplx.npz: 'body_pose' holds nan in row 4"});
  }
  SECTION("a wrong shape") {
    replace_array(train.data / "smplx.npz", "body_pose", NpyArray::from({63, 6}, angles));
    check_refused(train(), {"smplx.npz: 'body_pose' has shape (63, 6), expected (6, 63)"});
  }
  SECTION("a camera without a video") {
    fs::remove(train.data / "videos/cam03.mp4");
    check_refused(train(), {"cam03.mp4: no such file", "restore the video or shorten the list"});
  }
  SECTION("a video shorter than the parameters") {
    replace_video(train.data, "cam03", 4, [](int) { return true; });
    check_refused(train(), {"cam03.mp4: has 4 frames, but", "restore the video or cut the parameters"});
  }
  SECTION("a video that is none") {
    std::ofstream(train.data / "videos/cam03.mp4") << "not a video";
    check_refused(train(), {"cam03.mp4: "});
  }
  SECTION("no frame with a mask") {
    for (int camera = 0; camera < 5; ++camera)
      replace_video(train.data, "cam0" + std::to_string(camera), 6, [](int) { return false; });
    const ProgramResult result = train();
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.errors, Contains("degas: the capture has no picture to train on"));
  }
}

TEST_CASE("a frame without a mask is left out with one warning") {
  const TemporaryFolder folder;
  TrainCommand train(folder, short_config());
  train.data = copied_capture(folder);
  replace_video(train.data, "cam03", 6, [](int frame) { return frame != 2 && frame != 4; });
  train.more = {"--iterations", "12"};
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  CHECK(std::count(result.errors.begin(), result.errors.end(), '\n') == 1);
  CHECK_THAT(result.errors, Contains("warning: ") && Contains("cam03") && Contains("2") && Contains("4"));
}

TEST_CASE("a run is never overwritten, and continued only with what it was trained with") {
  const TemporaryFolder folder;
  TrainCommand train(folder, short_config());
  REQUIRE(train().exit_code == 0);
  const std::map<std::string, std::string> before = files_of(train.run);
  CHECK(before.size() == 4);
  SECTION("without --resume") {
    check_refused(train(), {"run: already holds a trained run", "--resume", "--out"});
  }
  SECTION("another config") {
    train.more = {"--resume", "--set", "net.width=0.5"};
    check_refused(train(), {"checkpoint.bin: was trained with another configuration: net.width (0.25 / 0.5)", "--out"});
  }
  SECTION("another capture") {
    train.more = {"--resume"};
    train.data = training_scene() / "P1C2";
    check_refused(train(), {"checkpoint.bin: was trained on another capture"});
  }
  SECTION("another body") {
    train.more = {"--resume"};
    train.body = folder / "body.npz";
    fs::copy_file(training_scene() / "body.npz", train.body);
    const std::vector<float> hand(45, 0.1f);
    replace_array(train.body, "hands_meanl", NpyArray::from({45}, hand));
    check_refused(train(), {"body.npz: is another body than the run was trained with"});
    train.body = folder / "none.npz";
    check_refused(train(), {"none.npz: "});
  }
  SECTION("a checkpoint cut short") {
    train.more = {"--resume"};
    fs::copy(train.run, folder / "cut");
    train.run = folder / "cut";
    fs::resize_file(train.run / "checkpoint.bin", 1000000);
    check_refused(train(), {"checkpoint.bin: the checkpoint is cut short"});
  }
  const bool untouched = files_of(folder / "run") == before;
  CHECK(untouched);
}
