#include "model/data/smplx_parameters.h"

#include <limits>

#include "host/error.h"
#include "tests/model/data/small_picture_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

/// Numbers of a hand, `columns` a frame.
NpyArray hand_array(int64_t columns, unsigned seed) {
  return NpyArray::from({small_frames, columns}, random_values(small_frames * columns, seed));
}

struct WrittenParameters {
  TemporaryFolder folder;
  std::map<std::string, NpyArray> arrays = small_smpl_params();

  mutable std::vector<std::string> warnings;

  SmplxParameters read() const {
    write_npz(folder / "params.npz", arrays);
    return read_smplx_parameters(folder / "params.npz", {false, true},
                                 [this](const std::string& text) { warnings.push_back(text); });
  }
};

}  // namespace

TEST_CASE("hands of fewer columns than angles are coefficients of principal components") {
  WrittenParameters parameters;
  const int64_t count = GENERATE(int64_t{1}, int64_t{6}, int64_t{12}, int64_t{44});
  const NpyArray hands[] = {hand_array(count, 1), hand_array(count, 2)};
  parameters.arrays["left_hand_pose"] = hands[0];
  parameters.arrays["right_hand_pose"] = hands[1];
  if (count == 12) {
    parameters.arrays["smplx_kwargs"] = NpyArray::from_text(R"({"use_pca": true, "num_pca_comps": 12})");
  }
  const SmplxParameters read = parameters.read();
  CHECK(read.flat_hand_mean);
  for (size_t frame = 0; frame < read.poses.size(); ++frame) {
    const Pose &pose = read.poses[frame], written = small_poses()[frame];
    for (size_t hand = 0; hand < 2; ++hand) {
      const std::vector<double> all = hands[hand].doubles();
      const auto row = all.begin() + static_cast<ptrdiff_t>(frame) * count;
      CHECK(pose.hand_coefficients[hand] == std::vector<double>(row, row + count));
    }
    for (size_t joint = 25; joint < 55; ++joint) CHECK(pose.axis_angles[joint].norm() == 0);
    CHECK((pose.axis_angles[21] - written.axis_angles[21]).norm() < 1e-6);
  }
}

TEST_CASE("hands of 45 columns are angles unless the file says that they are all components") {
  WrittenParameters parameters;
  const auto [arguments, are_coefficients] =
      GENERATE(table<std::string, bool>({{"{}", false},
                                         {R"({"use_pca": false, "num_pca_comps": 45})", false},
                                         {R"({"use_pca": true})", false},
                                         {R"({"use_pca": true, "num_pca_comps": 12})", false},
                                         {R"({"use_pca": "true", "num_pca_comps": "45"})", false},
                                         {R"([1])", false},
                                         {R"({"use_pca": true, "num_pca_comps": 45})", true}}));
  CAPTURE(arguments);
  parameters.arrays["smplx_kwargs"] = NpyArray::from_text(arguments);
  parameters.arrays["right_hand_pose"] = hand_array(45, 3);
  const std::vector<double> numbers = parameters.arrays["right_hand_pose"].doubles();
  const Pose pose = parameters.read().poses[0];
  CHECK(pose.hand_coefficients[1].size() == (are_coefficients ? 45U : 0U));
  CHECK((are_coefficients ? pose.hand_coefficients[1][4] : pose.axis_angles[41].y()) == numbers[4]);
  CHECK((pose.axis_angles[41].norm() == 0) == are_coefficients);
}

TEST_CASE("hands that are neither angles nor coefficients are refused with key and shape") {
  WrittenParameters parameters;
  auto& arrays = parameters.arrays;
  arrays["left_hand_pose"] = hand_array(12, 1);
  CHECK_THROWS_WITH(parameters.read(), Contains("params.npz: 'right_hand_pose' has shape (6, 45), expected (6, 12)"));
  arrays["right_hand_pose"] = hand_array(12, 2);
  arrays["smplx_kwargs"] = NpyArray::from_text(R"({"use_pca": false})");
  CHECK_THROWS_WITH(parameters.read(), Contains("params.npz: 'left_hand_pose' has 12 columns, but 'smplx_kwargs' has "
                                                "use_pca false"));
  arrays.erase("smplx_kwargs");
  std::vector<double> values(12 * small_frames);
  values[12 * 3 + 5] = std::numeric_limits<double>::quiet_NaN();
  arrays["right_hand_pose"] = NpyArray::from({small_frames, 12}, values);
  CHECK_THROWS_WITH(parameters.read(), Contains("'right_hand_pose' holds nan in row 3"));
  for (const int64_t columns : {0, 46, 90}) {
    arrays["left_hand_pose"] = hand_array(columns, 1);
    CHECK_THROWS_WITH(parameters.read(), Contains("'left_hand_pose' has shape (6, ") && Contains("expected (6, 45)"));
  }
  arrays["left_hand_pose"] = NpyArray::from({small_frames * 12}, std::vector<float>(small_frames * 12));
  CHECK_THROWS_WITH(parameters.read(), Contains("'left_hand_pose' has shape (72)"));
}

TEST_CASE("the person's shape stands once, or beside each pose") {
  WrittenParameters parameters;
  const auto betas = [&](const Shape& shape, const std::vector<float>& values) {
    parameters.arrays["betas"] = NpyArray::from(shape, values);
  };
  std::vector<float> rows;
  for (int64_t row = 0; row < small_frames; ++row) rows.insert(rows.end(), {0.5f, -1.0f});
  SECTION("once") {
    betas({2}, {0.5f, -1.0f});
    CHECK(parameters.read().betas == std::vector<double>{0.5, -1});
    betas({1, 2}, {0.5f, -1.0f});
    CHECK(parameters.read().betas == std::vector<double>{0.5, -1});
    CHECK(parameters.warnings.empty());
  }
  SECTION("beside each pose, alike") {
    betas({small_frames, 2}, rows);
    CHECK(parameters.read().betas == std::vector<double>{0.5, -1});
    CHECK(parameters.warnings.empty());
  }
  SECTION("beside each pose, fitted anew for each") {
    rows[0] += static_cast<float>(small_frames);
    betas({small_frames, 2}, rows);
    const std::vector<double> read = parameters.read().betas;
    CHECK(read[0] == Approx(1.5));
    CHECK(read[1] == Approx(-1));
    REQUIRE(parameters.warnings.size() == 1);
    CHECK_THAT(parameters.warnings[0], Contains("params.npz: 'betas' differ from frame to frame"));
  }
  SECTION("for other frames") {
    betas({small_frames - 1, 2}, {rows.begin() + 2, rows.end()});
    CHECK_THROWS_WITH(parameters.read(),
                      Contains("params.npz: 'betas' has shape") && Contains("once or for each frame"));
  }
}
