#include "model/config.h"

#include <fstream>
#include <sstream>

#include "host/error.h"
#include "tests/support/catch.h"

using namespace degas;
using Catch::Contains;

TEST_CASE("defaults, text and back are the same config") {
  Config config;
  config.net.width = 0.1 + 0.2;  // a number that needs all its digits
  config.data.hold_out = {"cam02", "cam05"};
  config.loss.lpips_region = LossRegion::Face;
  config.train.seed = ~uint64_t{0};
  const Config read = parse_config(config_text(config), "text");
  CHECK(config_text(read) == config_text(config));
  CHECK(read.net.width == 0.1 + 0.2);
  CHECK(read.train.seed == ~uint64_t{0});
  CHECK(config_differences(Config{}, read).size() == 4);
  CHECK_THAT(config_differences(Config{}, read)[0], Contains("net.width (1.0 / 0.30000000000000004)"));
}

TEST_CASE("a file overrides what it names and nothing else") {
  const Config config =
      parse_config(R"({"net": {"width": 0.5}, "train": {"iterations": 8e5, "gradient_clip": {"norm": 2}}})", "f");
  CHECK(config.net.width == 0.5);
  CHECK(config.net.resolution == 512);
  CHECK(config.train.iterations == 800000);
  CHECK(config.train.gradient_clip.norm == 2);
  CHECK(config.train.gradient_clip.scale == 0.1);
}

TEST_CASE("faults of a file are one line that names file, key and remedy") {
  const auto fault = [](const std::string& text) {
    CHECK_NOTHROW(parse_config("{}", "f.json"));
    parse_config(text, "f.json");
  };
  CHECK_THROWS_WITH(fault(R"({"net": {"widht": 1}})"),
                    "f.json: unknown key 'net.widht'; the nearest known key is 'net.width'");
  CHECK_THROWS_WITH(fault(R"({"nett": {}})"), Contains("nearest known key is 'net'"));
  CHECK_THROWS_WITH(fault(R"({"data": {"corruption": {"wrong_masks": 20}}})"),
                    "f.json: 'data.corruption.wrong_masks' is 20; it must be in [0, 1)");
  CHECK_THROWS_WITH(fault(R"({"net": 3})"), Contains("'net' must be a section"));
  CHECK_THROWS_WITH(fault(R"({"net": {"width": "wide"}})"), "f.json: 'net.width' must be a number, not \"wide\"");
  CHECK_THROWS_WITH(fault(R"({"net": {"use_pvm": 1}})"), Contains("'net.use_pvm' must be true or false"));
  CHECK_THROWS_WITH(fault(R"({"net": {"latent_size": 1.5}})"), Contains("a whole number"));
  CHECK_THROWS_WITH(fault(R"({"net": {"latent_size": 3e9}})"), Contains("a whole number from"));
  CHECK_THROWS_WITH(fault(R"({"train": {"seed": -1}})"), Contains("a whole number from 0"));
  CHECK_THROWS_WITH(fault(R"({"data": {"hold_out": {"cam02": 1}}})"), Contains("'data.hold_out' must be a list"));
  CHECK_THROWS_WITH(fault(R"({"data": {"hold_out": ["cam02", true]}})"), Contains("hold_out[1]' must be a string"));
  CHECK_THROWS_WITH(fault(R"({"net": {"decoder_channels": "8,8,8"}})"), Contains("must be a list"));
  CHECK_THROWS_WITH(fault(R"({"loss": {"lpips_network": "resnet"}})"), Contains("one of alex, squeeze, vgg"));
  CHECK_THROWS_WITH(fault("{\n\"net\": {\n\"width\": }}"), Contains("f.json: line 3 is not valid JSON"));
  CHECK_THROWS_WITH(fault("[1]"), Contains("an object of sections"));
  CHECK_THROWS_WITH(fault(R"({"net": {"resolution": 300}})"),
                    "f.json: 'net.resolution' is 300; it must be a power of two from 128 to 4096");
  CHECK_THROWS_WITH(fault(R"({"net": {"color_degree": 4}})"),
                    "f.json: 'net.color_degree' is 4; it must be from 0 to 3");
  CHECK_THROWS_WITH(fault(R"({"loss": {"scale_floor": 10}})"),
                    "f.json: 'loss.scale_floor' is 10; it must be above 0 and below loss.scale_limit");
  CHECK_THROWS_WITH(fault(R"({"net": {"decoder_channels": [64, 32]}})"), Contains("'net.decoder_channels' is 2"));
  CHECK_THROWS_WITH(fault(R"({"net": {"face_channels": []}})"), Contains("'net.face_channels' is 0"));
  CHECK_THROWS_WITH(fault(R"({"net": {"face_channels": [64, 16]}})"), Contains("net.face_channels"));
  CHECK_THROWS_WITH(fault(R"({"train": {"learning_rate": 0}})"), Contains("above 0"));
  CHECK_THROWS_AS(load_config("no/such/file.json"), Error);
}

TEST_CASE("damaged files are errors, whatever the damage") {
  const std::string text = config_text(Config{});
  for (size_t length = 0; length + 2 < text.size(); length += 7) {
    CHECK_THROWS_AS(parse_config(text.substr(0, length), "f.json"), Error);
  }
  CHECK_THROWS_AS(parse_config("{\"net\": {\"width\": 1e999}}", "f.json"), Error);
  CHECK_THROWS_AS(parse_config("{\"net\": {\"\xff\": 1}}", "f.json"), Error);
  CHECK_THROWS_AS(parse_config(std::string(100000, '['), "f.json"), Error);
  Config config;
  CHECK_THROWS_AS(apply_override(config, "net.width=\xff"), Error);
  CHECK_THROWS_AS(apply_override(config, "=1"), Error);
  CHECK_THROWS_AS(apply_override(config, "net.width.more=1"), Error);
  apply_override(config, "data.hold_out=\xff");
  CHECK_FALSE(config_text(config).empty());
}

TEST_CASE("overrides from the command line need no quotes") {
  Config config;
  apply_override(config, "net.width=0.5");
  apply_override(config, "train.gradient_clip.norm=0");
  apply_override(config, "data.hold_out=cam02,007");
  apply_override(config, "data.frames=3,1");
  apply_override(config, "data.cameras=cam00:cam08,cam12");
  apply_override(config, "net.decoder_channels=[8, 8, 8]");
  apply_override(config, "loss.lpips_region=face");
  apply_override(config, "loss.lpips_weights=12");
  apply_override(config, "net.use_pvm=false");
  CHECK(config.net.width == 0.5);
  CHECK(config.train.gradient_clip.norm == 0);
  CHECK(config.data.hold_out == std::vector<std::string>{"cam02", "007"});
  CHECK(config.data.frames == std::vector<std::string>{"3", "1"});
  CHECK(config.net.decoder_channels == std::vector<int>{8, 8, 8});
  CHECK(config.loss.lpips_region == LossRegion::Face);
  CHECK(config.loss.lpips_weights == "12");
  CHECK_FALSE(config.net.use_pvm);
  apply_override(config, "data.hold_out=");
  CHECK(config.data.hold_out.empty());
  CHECK_THROWS_WITH(apply_override(config, "net.widht=1"), Contains("--set net.widht=1: unknown key 'net.widht'"));
  CHECK_THROWS_WITH(apply_override(config, "net.width=wide"), Contains("must be a number"));
  CHECK_THROWS_WITH(apply_override(config, "net=3"), Contains("'net' must be a section"));
  CHECK_THROWS_WITH(apply_override(config, "net.width"), Contains("must look like"));
  CHECK_THROWS_WITH(apply_override(config, "net.decoder_channels=1,x"), Contains("a whole number"));
}

TEST_CASE("selections may be written as text, and items of lists of names as numbers") {
  const auto frames = [](const std::string& value) {
    return parse_config("{\"data\": {\"frames\": " + value + "}}", "f.json").data.frames;
  };
  CHECK(frames("\"0:400:4\"") == std::vector<std::string>{"0:400:4"});
  CHECK(frames("[0, 4, \"8:20:2\"]") == std::vector<std::string>{"0", "4", "8:20:2"});
  CHECK(frames("[]").empty());
  CHECK_THROWS_WITH(frames("7"), Contains("f.json: 'data.frames' must be a list, not 7"));
  CHECK_THROWS_WITH(frames("[1.5]"), Contains("f.json: 'data.frames[0]' must be a string, not 1.5"));
}

TEST_CASE("the configs of the repository are valid, and full.json is the defaults") {
  const std::filesystem::path folder = std::filesystem::path(DEGAS_TEST_VECTORS) / ".." / ".." / "configs";
  CHECK(config_text(load_config(folder / "full.json")) == config_text(Config{}));
  CHECK(config_text(load_config(folder / "quick.json")) != config_text(Config{}));
  CHECK_NOTHROW(load_config(folder / "demo.json"));
  int baselines = 0;
  const Config quick = load_config(folder / "quick.json");
  for (const auto& entry : std::filesystem::directory_iterator(folder / "baselines")) {
    const Config baseline = load_config(entry.path());
    CAPTURE(entry.path());
    CHECK(baseline.description.find("Leaves out") != std::string::npos);
    ++baselines;
    // The sizes of quick.json and its losses: only the choice differs.
    for (const std::string& difference : config_differences(quick, baseline)) {
      const std::string key = difference.substr(0, difference.find(' '));
      CAPTURE(difference);
      CHECK((key == "description" || key == "net.kind" || key == "net.isotropic" || key == "net.use_world_normals" ||
             key == "face.signal" || key == "train.learning_rate"));
    }
  }
  CHECK(baselines == 5);
  // The README explains every key.
  std::ostringstream readme;
  readme << std::ifstream(folder / "README.md").rdbuf();
  std::istringstream lines(config_text(Config{}));
  for (std::string line; std::getline(lines, line);) {
    const size_t begin = line.find('"'), end = line.find("\":");
    if (begin == std::string::npos || end == std::string::npos || line.find('{') != std::string::npos) continue;
    const std::string key = line.substr(begin + 1, end - begin - 1);
    INFO(key);
    CHECK((readme.str().find("`" + key + "`") != std::string::npos ||
           readme.str().find("." + key + "`") != std::string::npos));
  }
}
