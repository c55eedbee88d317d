#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/video.h"
#include "tests/model/data/small_picture_capture.h"
#include "tests/support/catch.h"
#include "tests/support/real_recording.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

struct Inspected {
  json found;
  std::string page, output;
};

Inspected inspect(const fs::path& data, const fs::path& body, std::vector<std::string> more = {}) {
  const TemporaryFolder out;
  std::vector<std::string> arguments = {"inspect", "--data", data.string(), "--out", (out / "report").string()};
  if (!body.empty()) arguments.insert(arguments.end(), {"--body", body.string()});
  arguments.insert(arguments.end(), more.begin(), more.end());
  const ProgramResult result = run_program(arguments);
  CAPTURE(arguments, result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  CHECK(result.errors.empty());
  return {json::parse(file_text(out / "report/inspect.json")), file_text(out / "report/index.html"), result.output};
}

/// A folder that shows the files of another one; those that are changed are written anew.
void link_files(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const auto& entry : fs::directory_iterator(from)) fs::create_symlink(entry.path(), to / entry.path().filename());
}

void change_json(const fs::path& path, const std::function<void(json&)>& change) {
  json value = json::parse(file_text(path));
  change(value);
  fs::remove(path);
  std::ofstream(path) << value.dump();
}

/// Frames of a capture in the layout of AvatarReX, or of THuman4; PNG pictures.
void write_avatarrex(const Capture& capture, const std::vector<int>& frames, const fs::path& folder, bool is_thuman) {
  json calibration;
  const std::vector<std::string> names = capture.camera_names();
  const int cameras = static_cast<int>(names.size());
  for (int k = 0; k < cameras; ++k) {
    const Camera camera = capture.camera(k);
    json& entry = calibration[names[static_cast<size_t>(k)]];
    // Its pixel centres are at whole numbers.
    entry["K"] = {camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1};
    for (int i = 0; i < 9; ++i) entry["R"].push_back(camera.rotation(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) entry["T"].push_back(camera.translation[i]);
    entry["imgSize"] = {camera.width, camera.height};
    if (!is_thuman) entry["distCoeff"] = std::vector<double>(5, 0.0);
  }
  write_text_file(folder / (is_thuman ? "calibration.json" : "calibration_full.json"), calibration.dump());
  std::vector<Pose> poses;
  for (size_t row = 0; row < frames.size(); ++row) {
    poses.push_back(capture.pose(frames[row]));
    const std::string file = fmt::format("{:08}.png", row);
    for (int k = 0; k < cameras; ++k) {
      if (!capture.has_image(frames[row], k)) continue;
      const Sample sample = capture.load(frames[row], k);
      const std::string& camera = names[static_cast<size_t>(k)];
      write_image(is_thuman ? folder / "images" / camera / file : folder / camera / file, sample.image);
      write_image(is_thuman ? folder / "masks" / camera / file : folder / camera / "mask/pha" / file, sample.mask);
    }
  }
  const std::vector<double> betas = capture.betas();
  write_npz(folder / "smpl_params.npz", smpl_params_of(poses, std::vector<float>(betas.begin(), betas.end())));
}

}  // namespace

TEST_CASE("inspect shows a synthetic capture with its body, and refuses what is not there") {
  const fs::path data = training_scene() / "P1C1", body = training_scene() / "body.npz";
  const Inspected all = inspect(data, body);
  CHECK(all.found.at("frames") == 6);
  CHECK(all.found.at("cameras").size() == 5);
  CHECK(all.found.at("cameras")[1].at("name") == "cam01");
  CHECK(all.found.at("cameras")[1].at("pictures") == 6);
  CHECK(all.found.at("mask_iou_mean").get<double>() > 0.7);
  CHECK(all.found.at("mask_iou_min").get<double>() <= all.found.at("mask_iou_mean").get<double>());
  CHECK(all.found.at("reprojection_rms_px").is_null());
  CHECK(all.found.at("suspected").empty());
  CHECK(all.found.at("warnings").empty());
  CHECK(all.found.at("face_region").at("left") == 0);
  CHECK(all.found.at("face_region").at("top") == 0);
  CHECK(all.found.at("face_region").at("head_share").get<double>() > 0.75);
  CHECK_THAT(all.output, Contains("6 frames, 5 cameras, body parameters, masks, face codes of") &&
                             Contains("nothing seems wrong") && Contains("index.html"));
  for (const char* part :
       {"Body over photographs", "UV atlas", "from above", "in space", "Faces, the most frontal first",
        "Overlap of the body", "What if it were read otherwise?", "data:image/jpeg;base64,"}) {
    CHECK_THAT(all.page, Contains(part));
  }
  CHECK_THAT(all.page, !Contains("<script") && !Contains(">nan"));

  const Inspected some = inspect(data, body, {"--cameras", "cam01,cam03:", "--frames", "1:6:2"});
  CHECK(some.found.at("frames_looked_at") == json({1, 3, 5}));
  CHECK(some.found.at("cameras")[0].at("mask_iou").is_null());
  CHECK(some.found.at("cameras")[3].at("mask_iou").is_number());

  const TemporaryFolder out;
  check_refused(run_program({"inspect", "--data", out / "none", "--out", out / "x"}), {"none: no such folder"});
  check_refused(run_program({"inspect", "--data", data, "--body", out / "none.npz", "--out", out / "x"}),
                {"none.npz: "});
  check_refused(run_program({"inspect", "--data", data, "--cameras", "cam9", "--out", out / "x"}),
                {"--cameras: no camera 'cam9'; cameras here: cam00"});
  CHECK(run_program({"inspect", "--data", data, "--format", "other", "--out", out / "x"}).exit_code == 2);
}

TEST_CASE("without a body, a fit or masks inspect says what cannot be told") {
  const fs::path data = training_scene() / "P1C1";
  const Inspected no_body = inspect(data, {});
  CHECK(no_body.found.at("mask_iou_mean").is_null());
  CHECK_THAT(no_body.output, Contains("note: no body model (--body)"));
  CHECK_THAT(no_body.page, Contains("data:image/jpeg;base64,") && Contains("from above"));

  // A recording of which only the calibration is known.
  const TemporaryFolder folder;
  fs::create_directories(folder / "recording/videos");
  fs::copy(data / "cameras.json", folder / "recording/cameras.json");
  for (int camera = 0; camera < 5; ++camera) {
    VideoWriter writer(folder / "recording/videos" / ("cam0" + std::to_string(camera) + ".mp4"), 64, 80, 25,
                       VideoQuality::Lossless);
    for (int frame = 0; frame < 4 + camera; ++frame) writer.write(Image8::black(64, 80, 3));
    writer.finish();
  }
  const Inspected raw = inspect(folder / "recording", training_scene() / "body.npz");
  CHECK(raw.found.at("frames") == 4);
  CHECK(raw.found.at("has_masks") == false);
  CHECK(raw.found.at("has_body_parameters") == false);
  CHECK(raw.found.at("mask_iou_mean").is_null());
  CHECK_THAT(raw.output, Contains("no body parameters") && Contains("no masks"));
  CHECK_THAT(raw.page, Contains("fit SMPL-X to the recording before training") && Contains("cut the person out"));
  // Training refuses it.
  Config config = tiny_config();
  TrainCommand train(folder, config);
  train.data = folder / "recording";
  check_refused(train(), {"has cameras.json, but no capture.json", "smplx.npz", "masks"});
}

TEST_CASE("names of cameras are text, not HTML") {
  const TemporaryFolder folder;
  const fs::path scale = write_small_actorshq(folder.path());
  const std::string name = "Cam<b>";
  for (const std::string kind : {"rgbs", "masks"}) {
    fs::create_directories(scale / kind / name);
    for (const auto& entry : fs::directory_iterator(scale / kind / "Cam002")) {
      const std::string file = entry.path().filename().string();
      fs::copy(entry.path(), scale / kind / name / (name + file.substr(file.find('_'))));
    }
  }
  std::string calibration = file_text(scale / "calibration.csv");
  write_text_file(scale / "calibration.csv", calibration.replace(calibration.find("Cam003"), 6, name));
  const Inspected found = inspect(folder.path(), {});
  CHECK(found.found.at("cameras")[2].at("name") == name);
  CHECK_THAT(found.page, Contains("Cam&lt;b&gt;, frame ") && !Contains(name));
}

TEST_CASE("capture A: both layouts fit, alike, and quickly") {
  const std::string dreams = data_path("data/capture/A/P1C1"), actors = data_path("data/capture/A_actorshq"),
                    body = data_path("data/bodies/male.npz");
  if (dreams.empty() || actors.empty() || body.empty()) return;
  const auto start = std::chrono::steady_clock::now();
  const json a = inspect(dreams, body, {"--frames", "0:80:6"}).found;
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const json b = inspect(actors, body, {"--frames", "0:40:3"}).found;
  std::printf("capture A: overlap %.4f (DREAMS), %.4f (ActorsHQ), least %.3f; %.1f s\n",
              a.at("mask_iou_mean").get<double>(), b.at("mask_iou_mean").get<double>(),
              a.at("mask_iou_min").get<double>(), seconds.count());
  CHECK(a.at("mask_iou_mean").get<double>() > 0.75);
  CHECK(b.at("mask_iou_mean").get<double>() > 0.75);
  CHECK(std::abs(a.at("mask_iou_mean").get<double>() - b.at("mask_iou_mean").get<double>()) < 0.01);
  for (const json& found : {a, b}) {
    CAPTURE(found.at("warnings").dump());
    CHECK(found.at("suspected").empty());
    CHECK(found.at("warnings").empty());
  }
  CHECK(a.at("face_code_size") == 512);
  CHECK(b.at("cameras")[2].at("name") == "Cam003");
}

TEST_CASE("capture A: the layouts of AvatarReX and THuman4 fit as its own does") {
  const std::string dreams = data_path("data/capture/A/P1C1"), body = data_path("data/bodies/male.npz");
  if (dreams.empty() || body.empty()) return;
  const json own = inspect(dreams, body, {"--frames", "5,45"}).found;
  const std::unique_ptr<Capture> capture = open_uncached_capture(dreams);
  for (const bool is_thuman : {false, true}) {
    const TemporaryFolder folder;
    write_avatarrex(*capture, {5, 45}, folder.path(), is_thuman);
    const json found = inspect(folder.path(), body).found;
    CAPTURE(is_thuman, found.at("warnings").dump());
    CHECK(found.at("suspected").empty());
    CHECK(found.at("mask_iou_mean").get<double>() > 0.75);
    CHECK(std::abs(found.at("mask_iou_mean").get<double>() - own.at("mask_iou_mean").get<double>()) < 0.01);
  }
}

TEST_CASE("capture A: mistakes in its files are named") {
  const std::string dreams = data_path("data/capture/A/P1C1"), body = data_path("data/bodies/male.npz");
  if (dreams.empty() || body.empty()) return;
  const TemporaryFolder folder;
  const fs::path copy = folder / "capture";
  link_files(dreams, copy);
  const auto change_cameras = [&](const std::function<void(json & camera)>& change) {
    change_json(copy / "cameras.json", [&](json& file) {
      for (json& rig : file.at("rigs")) change(rig.at("cameras")[0]);
    });
  };
  std::string expected;
  SECTION("transposed R") {
    expected = "transposed_rotation";
    change_cameras([](json& camera) {
      json transposed = camera.at("R");
      for (size_t i = 0; i < 9; ++i) transposed[i / 3][i % 3] = camera.at("R")[i % 3][i / 3];
      camera["R"] = transposed;
    });
  }
  SECTION("flipped Y of the centres") {
    expected = "flipped_y";
    change_cameras([](json& camera) { camera["c"][1] = -camera.at("c")[1].get<double>(); });
  }
  SECTION("a world whose Y and Z were turned already") {
    expected = "flipped_yz";
    change_cameras([](json& camera) {
      for (json& row : camera.at("R")) {
        row[1] = -row[1].get<double>();
        row[2] = -row[2].get<double>();
      }
    });
  }
  SECTION("millimetres") {
    expected = "millimetres";
    change_cameras([](json& camera) {
      for (json& value : camera.at("c")) value = 1000 * value.get<double>();
    });
  }
  SECTION("frame + 1") {
    expected = "frame_offset_+1";
    change_json(copy / "capture.json", [](json& file) { file["frame_convention"]["offset_d"] = 1; });
  }
  const json found = inspect(copy, body, {"--frames", "5:75:20"}).found;
  CAPTURE(found.at("warnings").dump(1));
  CHECK(found.at("suspected") == json::array({expected}));
}

TEST_CASE("real recordings without masks or a fit are shown with their calibration") {
  const std::string folder = data_path("data/real/caliscope_4cam");
  if (folder.empty()) return;
  const TemporaryFolder copy;
  const json rigs = caliscope_rigs(folder, 2);
  std::ofstream(copy / "cameras.json") << json{{"rigs", rigs}}.dump();
  fs::create_directories(copy / "videos");
  for (const std::string number : {"0", "1"}) {
    fs::create_symlink(fs::path(folder) / ("cam_" + number + ".mp4"), copy / "videos" / ("cam0" + number + ".mp4"));
  }
  const Inspected raw = inspect(copy.path(), {}, {"--frames", "0,5"});
  CHECK(raw.found.at("cameras").size() == 2);
  CHECK(raw.found.at("cameras")[1].at("pictures").get<int>() > 50);
  CHECK_THAT(raw.output, Contains("no masks") && Contains("no body parameters") && Contains("1280x720"));
  CHECK_THAT(raw.page, Contains("data:image/jpeg;base64,"));

  // As calibrations of padded videos have it.
  for (const size_t camera : {0, 1}) {
    json padded = {{"rigs", rigs}};
    padded["rigs"][camera]["cameras"][0]["w"] = 1288;
    std::ofstream(copy / "cameras.json") << padded.dump();
    check_refused(run_program({"inspect", "--data", copy.path(), "--out", copy / "page"}),
                  {"cam0" + std::to_string(camera) + ".mp4: is 1280x720, but cameras.json has 1288x720", "w and h"});
  }
}
