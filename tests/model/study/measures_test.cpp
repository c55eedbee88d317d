#include "model/study/measures.h"

#include <cmath>
#include <fstream>
#include <random>

#include "host/error.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;

namespace {

FrameTable random_table(int frames, double shift, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  FrameTable table;
  for (int frame = 0; frame < frames; ++frame)
    table.rows[{"cam02", frame}] = {{"psnr", 30 + shift + noise(random)}, {"face_lpips", 0.1 + 0.01 * noise(random)}};
  return table;
}

}  // namespace

TEST_CASE("measures are told from counts and times, whatever regions there are") {
  for (const char* key :
       {"psnr", "mouth_psnr", "person_ssim", "face_lpips", "fid", "face_aed", "lpips_vgg", "face_lpips_squeeze"})
    CHECK(is_measure(key));
  for (const char* key : {"frames", "fps", "decode_ms", "gaussians", "device", "refined_pictures", "lpips_network"})
    CHECK_FALSE(is_measure(key));
  CHECK(lower_is_better("mouth_lpips"));
  CHECK(lower_is_better("fid"));
  CHECK_FALSE(lower_is_better("face_psnr"));
  const nlohmann::json metrics = {{"psnr", 30.0},       {"lpips", 0.1},      {"fid", 20.0},  {"person_psnr", 25.0},
                                  {"mouth_psnr", 28.0}, {"face_ssim", 0.9},  {"ssim", 0.99}, {"face_lpips", nullptr},
                                  {"aed", 0.1},         {"face_psnr", 27.0}, {"fps", 30.0}};
  CHECK(shown_measures(metrics) ==
        std::vector<std::string>{"psnr", "ssim", "lpips", "fid", "aed", "face_psnr", "mouth_psnr"});
  CHECK(measure_label("face_lpips") == "face LPIPS");
  CHECK(measure_label("mouth_lpips_vgg") == "mouth LPIPS vgg");
  CHECK(lower_is_better("face_lpips_vgg"));
  CHECK(shown_measures({{"lpips_vgg", 1.0}, {"lpips", 1.0}, {"face_psnr", 1.0}, {"fid", 1.0}}) ==
        std::vector<std::string>{"lpips", "lpips_vgg", "fid", "face_psnr"});
  CHECK(measure_text("psnr", 1.234, true) == "+1.23");
}

TEST_CASE("a spread tells mean, median and ends") {
  const Spread odd = spread_of({3, 1, 8}), even = spread_of({4, 1, 2, 9});
  CHECK(odd.mean == 4);
  CHECK(odd.median == 3);
  CHECK(*odd.deviation == Approx(std::sqrt(13.0)));
  CHECK(even.median == 3);
  CHECK(even.lowest == 1);
  CHECK(even.highest == 9);
  CHECK_FALSE(spread_of({5}).deviation);
  CHECK(spread_of({5}).median == 5);
}

TEST_CASE("paired differences are those of plain sums over the pictures that both have") {
  const std::vector<FrameTable> a = {random_table(40, 1, 1), random_table(40, 1, 2)};
  std::vector<FrameTable> b = {random_table(40, 0, 3), random_table(40, 0, 4)};
  for (FrameTable& table : b) table.rows.erase({"cam02", 7});
  const auto found = paired_difference(a, b, "psnr");
  REQUIRE(found);
  CHECK(found->pictures == 39);
  CHECK(found->seeds.count == 2);

  std::vector<double> pictures;
  double better = 0;
  for (int frame = 0; frame < 40; ++frame) {
    if (frame == 7) continue;
    double difference = 0;
    for (size_t seed = 0; seed < 2; ++seed)
      difference += (a[seed].rows.at({"cam02", frame}).at("psnr") - b[seed].rows.at({"cam02", frame}).at("psnr")) / 2;
    pictures.push_back(difference);
    better += difference > 0;
  }
  double mean = 0;
  for (double value : pictures) mean += value / 39;
  CHECK(found->mean == Approx(mean));
  CHECK(found->share_better == Approx(better / 39));
  double squares = 0, batch_total = 0;
  std::vector<double> batches;
  for (int batch = 0; batch < 10; ++batch) {
    double sum = 0;
    int count = 0;
    for (int i = batch * 39 / 10; i < (batch + 1) * 39 / 10; ++i, ++count) sum += pictures[static_cast<size_t>(i)];
    batches.push_back(sum / count);
    batch_total += sum / count;
  }
  for (double value : batches) squares += (value - batch_total / 10) * (value - batch_total / 10);
  CHECK(found->standard_error.value() == Approx(std::sqrt(squares / 9 / 10)));

  CHECK_FALSE(paired_difference(a, b, "mouth_psnr"));
  CHECK_FALSE(paired_difference({random_table(1, 0, 1)}, {random_table(1, 0, 2)}, "psnr")->standard_error);
}

TEST_CASE("a table of frames is read with its gaps, and one that is none is refused with its line") {
  const test::TemporaryFolder folder;
  const auto path = folder / "per_frame.csv";
  std::ofstream(path) << "camera,frame,refined,psnr,mouth_lpips\ncam02,3,1,30.5,\ncam02,4,0,31.5,0.25\n";
  const FrameTable table = FrameTable::read(path);
  CHECK(table.means() == std::map<std::string, double>{{"psnr", 31.0}, {"mouth_lpips", 0.25}});
  const std::vector<int> frames = {3};
  CHECK(table.means(&frames) == std::map<std::string, double>{{"psnr", 30.5}});
  std::ofstream(path) << "camera,frame,psnr\ncam02,3,30.5\ncam02,4,much\n";
  CHECK_THROWS_WITH(FrameTable::read(path), Catch::Contains("per_frame.csv: line 3"));
  std::ofstream(path) << "camera,psnr\n";
  CHECK_THROWS_WITH(FrameTable::read(path), Catch::Contains("no column 'frame'"));
}
