#include <signal.h>

#include <algorithm>

#include "host/io/file_bytes.h"
#include "model/data/dreams_codes.h"
#include "tests/support/catch.h"
#include "tests/support/encoder_weights.h"
#include "tests/support/real_recording.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// `degas encode-faces` on the training scene with a narrow encoder of random weights, cam02 held out.
struct EncodeCommand {
  fs::path weights, out;
  std::vector<std::string> more = {"--body", training_scene() / "body.npz"};

  explicit EncodeCommand(const TemporaryFolder& folder) : weights(folder / "weights.pt"), out(folder / "codes") {
    write_file_atomically(weights, make_torch_archive(make_encoder_weights({{8, 16, 16, 16}, 24, 5, 2, 12})));
  }
  std::vector<std::string> arguments(std::vector<std::string> encoder = {}) const {
    std::vector<std::string> words = {"encode-faces", "--data",  training_scene() / "P1C1", "--out", out, "--hold-out",
                                      "cam02",        "--cache", training_scene() / "cache"};
    if (encoder.empty()) encoder = {"--weights", weights};
    words.insert(words.end(), encoder.begin(), encoder.end());
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

/// Two steps on codes of a folder.
void train_on(const fs::path& codes, const TemporaryFolder& folder) {
  Config config = tiny_config();
  config.train.iterations = 2;
  TrainCommand train(folder, config);
  train.more = {"--codes", codes, "--hold-out", "cam02"};
  const ProgramResult result = train();
  CAPTURE(result.output, result.errors);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("finished at step 2"));
}

}  // namespace

TEST_CASE("codes of an expression encoder are made once, leave the held-out camera alone, and train") {
  const TemporaryFolder folder;
  EncodeCommand encode(folder);
  const ProgramResult first = run_program(encode.arguments());
  CAPTURE(first.output, first.errors);
  REQUIRE(first.exit_code == 0);
  CHECK_THAT(first.output, Contains("to use these codes: --codes " + encode.out.string()));
  const std::map<std::string, std::string> files = files_of(encode.out / "dpe");
  CHECK(files.size() > 6);
  for (const auto& [name, bytes] : files) CHECK_THAT(name, !Contains("cam02"));
  const DreamsCodes codes(encode.out, {0, 1, 2, 3, 4, 5}, 5);
  CHECK(codes.size() == 12);

  const ProgramResult again = run_program(encode.arguments());
  CHECK(again.exit_code == 0);
  CHECK_THAT(again.output, Contains(std::to_string(files.size() - 1) + " codes were there already"));
  const bool untouched = files_of(encode.out / "dpe") == files;
  CHECK(untouched);
  train_on(encode.out, folder);
}

TEST_CASE("codes of an ONNX network train, of the faces' landmarks too") {
  const TemporaryFolder folder;
  EncodeCommand encode(folder);
  std::vector<std::string> network = {"--onnx", std::string(DEGAS_TEST_VECTORS) + "/io/channel_means.onnx", "--input",
                                      "16"};
  int size = 4;
  if (const std::string landmarks = data_path("weights/face_landmarks_detector.onnx"); !landmarks.empty()) {
    network = {"--onnx", landmarks};
    size = 3 * 478;
  }
  encode.more.insert(encode.more.end(), {"--track", "--margin", "4", "--views", "2", "--frames", "0:4"});
  const ProgramResult result = run_program(encode.arguments(network));
  CAPTURE(result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  CHECK(DreamsCodes(encode.out, {0, 1, 2, 3, 4, 5}, 5).size() == size);
  train_on(encode.out, folder);
}

TEST_CASE(
    "a real recording without a body fit gets codes of the faces that a detector finds, the held-out camera none") {
  const std::string recording = data_path("data/real/caliscope_4cam");
  const std::string landmarks = data_path("weights/face_landmarks_detector.onnx");
  if (recording.empty() || landmarks.empty()) return;
  const TemporaryFolder folder;
  write_caliscope_capture(recording, folder / "capture", 4, {0, 60, 75});
  const ProgramResult result =
      run_program({"encode-faces", "--data", folder / "capture", "--onnx", landmarks, "--hold-out", "cam02", "--track",
                   "--out", folder / "codes", "--cache", folder / "cache"});
  CAPTURE(result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  const DreamsCodes codes(folder / "codes", {0, 1, 2, 3}, 3);
  CHECK(codes.size() == 3 * 478);
  for (int frame = 0; frame < 3; ++frame) {
    CAPTURE(frame);
    CHECK_FALSE(codes.has_code(frame, 2));
    for (const int camera : {0, 1, 3}) {
      if (!codes.has_code(frame, camera)) continue;
      // The network's pictures are 256 on a side: a face's landmarks lie within, and span most of them.
      const std::vector<float> code = *codes.code(frame, camera);
      std::vector<float> x;
      for (size_t i = 0; i < code.size(); i += 3) x.push_back(code[i]);
      const auto [lowest, highest] = std::minmax_element(x.begin(), x.end());
      CAPTURE(camera, *lowest, *highest);
      CHECK(*lowest > 0);
      CHECK(*highest < 256);
      CHECK(*highest - *lowest > 60);
    }
    CHECK((codes.has_code(frame, 1) || codes.has_code(frame, 3)));
  }
}

TEST_CASE("a network of head poses chooses the views, whose angles must be angles") {
  const TemporaryFolder folder;
  EncodeCommand encode(folder);
  const std::string vectors = std::string(DEGAS_TEST_VECTORS) + "/io/";
  // Yaw and pitch are 90 degrees times the means of red and green: none of these faces is that bright.
  encode.more.insert(encode.more.end(), {"--head-pose", vectors + "head_pose.onnx", "--head-pose-input", "side=16",
                                         "--views", "2", "--frames", "0:2"});
  const ProgramResult result = run_program(encode.arguments());
  CAPTURE(result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  CHECK(files_of(encode.out / "dpe").size() == 2 * 2 + 1);
  CHECK_THAT(file_text(encode.out / "dpe/encoder.json"), Contains("head_pose.onnx"));
  encode.out = folder / "none";
  encode.more.insert(encode.more.end(), {"--max-angle", "0"});
  check_refused(run_program(encode.arguments()), {"no face in any picture"});
  encode.more[3] = vectors + "channel_means.onnx";
  check_refused(run_program(encode.arguments()), {"channel_means.onnx: a head pose of 4 numbers", "output=NAME"});
}

TEST_CASE("interrupted, the same command goes on to the same files") {
  const TemporaryFolder folder, whole_folder;
  EncodeCommand encode(folder), whole(whole_folder);
  encode.more.insert(encode.more.end(), {"--views", "5", "--max-angle", "180"});
  whole.more = encode.more;
  REQUIRE(run_program(whole.arguments()).exit_code == 0);
  bool was_interrupted = false;
  for (int attempt = 0; attempt < 10 && !was_interrupted; ++attempt) {  // it may end before the signal comes
    fs::remove_all(encode.out);
    RunningProgram program(encode.arguments());
    while (program.running() && !fs::exists(encode.out / "dpe/dpe-000000-cam00.pt")) usleep(200);
    program.send(SIGINT);
    const ProgramResult result = program.wait();
    CHECK(result.exit_code == 0);
    was_interrupted = result.output.find("interrupted after") != std::string::npos;
  }
  CHECK(was_interrupted);
  CHECK(run_program(encode.arguments()).exit_code == 0);
  const bool same = files_of(encode.out / "dpe") == files_of(whole.out / "dpe");
  CHECK(same);
}

TEST_CASE("what encode-faces cannot use is named with a remedy") {
  const TemporaryFolder folder;
  EncodeCommand encode(folder);
  const auto refused = [&](const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
    check_refused(run_program(arguments), parts);
  };
  const std::string onnx = std::string(DEGAS_TEST_VECTORS) + "/io/channel_means.onnx";
  std::vector<std::string> none = encode.arguments();
  none.erase(none.begin() + 9, none.begin() + 11);
  refused(none, {"name one encoder", "--weights", "--onnx"});
  refused(encode.arguments({"--weights", folder / "none.pt"}), {"none.pt: "});
  refused(encode.arguments({"--weights", onnx}), {"channel_means.onnx: "});
  refused(encode.arguments({"--onnx", encode.weights}), {"weights.pt: is no ONNX network"});
  refused(encode.arguments({"--weights", encode.weights, "--keys", "code=other"}),
          {"weights.pt: no tensor 'other.0.weight'", "--keys code=PATH"});
  refused(encode.arguments({"--onnx", onnx, "--mean", "120,110"}), {"--mean: two numbers", "R,G,B"});
  refused(encode.arguments({"--onnx", onnx, "--scale", "1,2"}), {"--scale: two numbers"});
  refused(encode.arguments({"--weights", encode.weights, "--cameras", "cam9"}), {"no camera 'cam9'", "cam00"});
  REQUIRE(run_program(encode.arguments()).exit_code == 0);
  refused(encode.arguments({"--weights", encode.weights, "--margin", "7"}),
          {"encoder.json: the codes here were made with another 'margin': 50 (now 7)", "--overwrite"});
  const std::map<std::string, std::string> files = files_of(encode.out / "dpe");
  // Another capture, and another body of the same name.
  fs::copy(training_scene() / "P1C1", folder / "P1C2", fs::copy_options::recursive);
  std::vector<std::string> other_capture = encode.arguments();
  other_capture[2] = folder / "P1C2";
  refused(other_capture, {"encoder.json: the codes here were made with another 'capture'"});
  std::vector<std::string> other_body = encode.arguments();
  fs::copy(training_scene() / "body.npz", folder / "body.npz");
  std::ofstream(folder / "body.npz", std::ios::app) << "x";
  other_body.back() = folder / "body.npz";
  refused(other_body, {"encoder.json: the codes here were made with another 'body'", "body.npz"});
  // Nothing is removed before faces are found.
  refused(encode.arguments({"--weights", encode.weights, "--overwrite", "--max-angle", "0"}),
          {"no face in any picture"});
  const bool kept = files_of(encode.out / "dpe") == files;
  CHECK(kept);
  std::vector<std::string> into_capture = encode.arguments();
  into_capture.erase(into_capture.begin() + 3, into_capture.begin() + 5);
  refused(into_capture, {"dpe.zip: there are face codes already", "--out DIR"});
  Config config = tiny_config();
  TrainCommand train(folder, config);
  train.more = {"--codes", folder / "run"};
  check_refused(train(), {"run: no face codes of this capture's frames and cameras", "degas encode-faces"});
}
