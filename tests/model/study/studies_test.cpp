#include "model/study/studies.h"

#include <fstream>
#include <numbers>
#include <numeric>

#include "host/error.h"
#include "model/study/markdown_table.h"
#include "model/study/published.h"
#include "tests/model/study/variant_names.h"
#include "tests/model/train/fake_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;

namespace {

Variant base_of(const std::string& config = "{}") {
  const TemporaryFolder folder;
  std::ofstream(folder / "base.json") << config;
  return make_variant("base", folder / "base.json", {});
}

}  // namespace

TEST_CASE("studies vary what they say around the base, which comes first") {
  const FakeCapture capture;
  using Names = std::vector<std::string>;
  const auto of = [&](const std::string& study, const Variant& base) { return study_variants(study, base, capture); };

  const std::vector<Variant> encoders = of("encoders", base_of());
  CHECK(names_of(encoders) == Names{"all", "no pose embedding", "no PVM", "no PVE"});
  CHECK(encoders[0].config.net.use_pvm);
  CHECK_FALSE(encoders[2].config.net.use_pvm);
  CHECK(encoders[2].overrides == Names{"net.use_pvm=false"});
  CHECK(names_of(of("encoders", base_of(R"({"net":{"use_world_normals":true,"use_pve":false}})"))) ==
        Names{"all", "no pose embedding", "no PVM", "no world normals"});

  CHECK(names_of(of("face", base_of())) == Names{"code", "expression", "mesh", "none"});
  const std::vector<Variant> face = of("face", base_of(R"({"face":{"signal":"mesh"}})"));
  CHECK(names_of(face) == Names{"mesh", "code", "expression", "none"});
  CHECK(face[2].config.face.signal == FaceSignal::Expression);

  CHECK(names_of(of("losses", base_of())) ==
        Names{"all terms", "no SSIM", "no LPIPS", "no offset term", "no scale term", "no collapse term"});
  CHECK(names_of(of("losses", base_of(R"({"loss":{"drift_weight":0.02}})")))[4] == "no drift term");
  CHECK(of("losses", base_of(R"({"loss":{"lpips_weight":0}})")).back().config.loss.lpips_weight == 0.1);

  const std::vector<Variant> size = of("size", base_of(R"({"net":{"resolution":128}})"));
  CHECK(names_of(size) ==
        Names{"128 texels, width 1", "128 texels, width 0.5", "256 texels, width 1", "128 texels, width 2"});
  const std::vector<Variant> stability = of("stability", base_of());
  CHECK(names_of(stability) == Names{"as recorded", "learning rate ramped up over 100 steps",
                                     "registration off by up to 3 degrees and 1 cm", "20 % of masks wrong",
                                     "30 % of frames without face codes"});
  CHECK(stability[0].config.data.corruption == CorruptionConfig());
  CHECK(stability[2].config.data.corruption.registration_metres == 0.01);
  CHECK(stability[4].config.data.corruption.missing_codes == 0.3);
  CHECK(names_of(of("stability", base_of(R"({"face":{"signal":"mesh"},"train":{"warm_up_steps":9}})"))) ==
        Names{"as recorded", "no ramp of the learning rate", "registration off by up to 3 degrees and 1 cm",
              "20 % of masks wrong"});
  CHECK_THROWS_WITH(of("hats", base_of()), Catch::Contains("--study hats: no such study; there are encoders, views"));
}

TEST_CASE("some of a study's variants are chosen by name, beside the one they are compared with") {
  const FakeCapture capture;
  const std::vector<Variant> all = study_variants("face", base_of(), capture);
  using Names = std::vector<std::string>;
  CHECK(names_of(named_variants(all, {"none", "mesh"})) == Names{"code", "mesh", "none"});
  CHECK(names_of(named_variants(all, {"code"})) == Names{"code"});
  CHECK_THROWS_WITH(named_variants(all, {"hat"}),
                    "--only 'hat': no such variant; there are 'code', 'expression', "
                    "'mesh', 'none'");
}

TEST_CASE("views are spread evenly around the person") {
  FakeCapture ring;
  ring.names.clear();
  for (int i = 0; i < 13; ++i) ring.names.push_back(fmt::format("cam{:02}", i));
  ring.view = [](int camera) {
    Camera view;
    const double angle = 2 * std::numbers::pi * camera / 12;
    view.translation = camera == 12 ? Eigen::Vector3d(0, -3, 0) : Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
    return view;
  };
  std::vector<int> cameras(12);
  std::iota(cameras.begin(), cameras.end(), 0);
  for (const int count : {2, 3, 4, 6}) {
    const std::vector<int> chosen = spread_cameras(cameras, ring, count);
    REQUIRE(static_cast<int>(chosen.size()) == count);
    for (int i = 1; i < count; ++i) CHECK(chosen[i] - chosen[i - 1] == 12 / count);
  }
  CHECK(spread_cameras(cameras, ring, 12) == cameras);
  // In a list whose order tells nothing, too.
  CHECK(spread_cameras({0, 1, 2, 3, 4, 8}, ring, 3) == std::vector<int>{0, 4, 8});

  Variant base = base_of();
  base.config.data.hold_out = {"cam12"};
  const std::vector<Variant> views = study_variants("views", base, ring);
  CHECK(names_of(views) == std::vector<std::string>{"12 (all)", "6", "3"});
  CHECK(views[2].config.data.cameras.size() == 3);
  CHECK(views[1].paper_labels == std::vector<std::string>{"6"});
}

TEST_CASE("every label of the paper that a study names has its row") {
  const FakeCapture capture;
  for (const std::string study : {"encoders", "face"}) {
    for (const Variant& variant : study_variants(study, base_of(), capture)) {
      for (const std::string& label : variant.paper_labels) CHECK(find_published(study, label));
    }
  }
  CHECK(find_published("encoders", "no PVE")->figures.at("psnr") == 29.43);
  CHECK(find_published("views", "31 (all)")->figures.at("psnr") == 32.63);
  CHECK_FALSE(find_published("views", "no PVE"));
}

TEST_CASE("names make folders apart") {
  CHECK(folder_name("no pose embedding") == "no-pose-embedding");
  CHECK(folder_name("31 (all)/../x") == "31-all-..-x");
  CHECK_THROWS_AS(folder_name("../.."), Error);
  const Variant base = base_of();
  CHECK_THROWS_WITH(require_distinct({varied(base, "a b", {}), varied(base, "a/b", {})}),
                    Catch::Contains("two of this name"));
  CHECK_THROWS_WITH(varied(base, "x", {"net.widht=1"}), Catch::Contains("unknown key"));
  CHECK_THROWS_WITH(varied(base, "x", {"net.width=0"}), Catch::Contains("net.width"));
}

TEST_CASE("tables align their columns") {
  CHECK(markdown_table({{"a", "PSNR"}, {"long one", "±1"}}) ==
        "| a        | PSNR |\n|----------|-----:|\n| long one |   ±1 |\n");
}
