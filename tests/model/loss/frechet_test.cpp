#include "model/loss/frechet.h"

#include "host/io/npz.h"
#include "tests/support/catch.h"

using namespace degas;

namespace {

FeatureRows read_rows(const std::string& name) {
  static const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/frechet.npz");
  const NpyArray array = file.read(name);
  const std::vector<float> values = array.floats();
  FeatureRows rows;
  const size_t columns = static_cast<size_t>(array.shape[1]);
  for (size_t i = 0; i < values.size(); i += columns) rows.add({values.data() + i, columns});
  return rows;
}

}  // namespace

TEST_CASE("the Frechet distance equals scipy's, with more and with fewer pictures than features") {
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/frechet.npz");
  const std::string name = GENERATE("full", "few", "mixed", "near");
  CAPTURE(name);
  const Eigen::MatrixXd a = read_rows(name + "_a").matrix(), b = read_rows(name + "_b").matrix();
  const double expected = file.read(name).doubles()[0];
  // "near" is the rest of a difference of numbers of 10.
  CHECK(frechet_distance(a, b) == Approx(expected).epsilon(1e-6).margin(1e-10));
  CHECK(frechet_distance(b, a) == Approx(expected).epsilon(1e-6).margin(1e-10));
  CHECK(std::abs(frechet_distance(a, a)) < 1e-9);
}

TEST_CASE("the Frechet distance of single numbers by hand") {
  // Means 1 and 5, variances 2 and 8: 16 + (sqrt 8 - sqrt 2)^2.
  const Eigen::MatrixXd a = Eigen::Vector2d(0, 2), b = Eigen::Vector2d(3, 7);
  CHECK(frechet_distance(a, b) == Approx(16 + 2));
}

TEST_CASE("sets that do not fit are refused") {
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(5, 3);
  CHECK_THROWS_AS(frechet_distance(a, Eigen::MatrixXd::Random(1, 3)), std::logic_error);
  CHECK_THROWS_AS(frechet_distance(a, Eigen::MatrixXd::Random(5, 4)), std::logic_error);
  FeatureRows rows;
  rows.add(std::vector<float>{1, 2});
  CHECK_THROWS_AS(rows.add(std::vector<float>{1}), std::logic_error);
}
