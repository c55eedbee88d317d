#include "model/gaussians/nearest_neighbors.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Eigen::Vector3d;

TEST_CASE("distances to three neighbours equal those of all pairs") {
  for (const int count : {4, 50, 700}) {
    const std::vector<double> values = random_values(3 * count, 21);
    std::vector<Vector3d> points;
    for (int i = 0; i < count; ++i) {
      // Clusters, a far outlier and a pair that coincides are the hard cases of a grid.
      points.emplace_back(values[3 * i], i % 2 == 0 ? values[3 * i + 1] : 0.01 * values[3 * i + 1], values[3 * i + 2]);
    }
    points[0] = {20, -3, 5};
    points[1] = points[2];
    const std::vector<double> found = three_neighbor_distances(points);
    std::vector<double> expected;
    for (int i = 0; i < count; ++i) {
      std::vector<double> squared;
      for (int j = 0; j < count; ++j) {
        if (j != i) squared.push_back((points[i] - points[j]).squaredNorm());
      }
      std::sort(squared.begin(), squared.end());
      expected.push_back(std::sqrt((squared[0] + squared[1] + squared[2]) / 3));
    }
    CHECK(largest_difference(found, expected) < 1e-12);
  }
  CHECK(three_neighbor_distances(std::vector<Vector3d>(5, Vector3d(1, 2, 3))) == std::vector<double>(5, 0.0));
  CHECK_THROWS_AS(three_neighbor_distances(std::vector<Vector3d>(3, Vector3d::Zero())), std::logic_error);
}
