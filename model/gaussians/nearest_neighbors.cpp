#include "model/gaussians/nearest_neighbors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace degas {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

/// Points by cell, in compressed rows.
class Grid {
 public:
  explicit Grid(const std::vector<Vector3d>& points) : points_(points) {
    low_ = points[0];
    Vector3d high = points[0];
    for (const Vector3d& point : points) low_ = low_.cwiseMin(point), high = high.cwiseMax(point);
    const Vector3d extent = high - low_;
    // A box's surface over the count estimates the spacing; cells of twice that hold a handful of points.
    const double surface = 2 * (extent.x() * extent.y() + extent.y() * extent.z() + extent.z() * extent.x());
    cell_ = std::max(2 * std::sqrt(surface / points.size()), 1e-3 * extent.maxCoeff());
    if (!(cell_ > 0)) cell_ = 1;
    for (;; cell_ *= 1.5) {
      const Vector3d counts = (extent / cell_).array().floor() + 1;
      if (counts.prod() > most_cells) continue;
      size_ = counts.cast<int>();
      break;
    }
    begins_.assign(static_cast<size_t>(size_.x()) * size_.y() * size_.z() + 1, 0);
    for (const Vector3d& point : points) ++begins_[index(place(point)) + 1];
    for (size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
    std::vector<int> next(begins_.begin(), begins_.end() - 1);
    members_.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) members_[next[index(place(points[i]))]++] = static_cast<int>(i);
  }

  /// Squared distances to the three nearest points other than `self`. Shell after shell of cells, until nothing nearer
  /// can lie outside.
  std::array<double, 3> nearest(int self) const {
    constexpr double far = std::numeric_limits<double>::infinity();
    std::array<double, 3> best = {far, far, far};
    const Vector3i center = place(points_[self]);
    for (int radius = 0; radius <= size_.maxCoeff(); ++radius) {
      visit_shell(center, radius, self, best);
      const double reached = radius * cell_;
      if (best[2] <= reached * reached) break;
    }
    return best;
  }

 private:
  static constexpr double most_cells = 1 << 22;

  Vector3i place(const Vector3d& point) const {
    return ((point - low_) / cell_).array().floor().cast<int>().matrix().cwiseMin(size_ - Vector3i::Ones());
  }
  size_t index(const Vector3i& cell) const {
    return (static_cast<size_t>(cell.z()) * size_.y() + cell.y()) * size_.x() + cell.x();
  }

  void visit_shell(const Vector3i& center, int radius, int self, std::array<double, 3>& best) const {
    const Vector3i low = (center.array() - radius).max(0), high = (center.array() + radius).min(size_.array() - 1);
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        const bool face = std::abs(z - center.z()) == radius || std::abs(y - center.y()) == radius;
        for (int x = low.x(); x <= high.x(); ++x) {
          if (face || std::abs(x - center.x()) == radius) visit(index({x, y, z}), self, best);
        }
      }
    }
  }

  void visit(size_t cell, int self, std::array<double, 3>& best) const {
    for (int i = begins_[cell]; i < begins_[cell + 1]; ++i) {
      if (members_[i] == self) continue;
      const double distance = (points_[members_[i]] - points_[self]).squaredNorm();
      if (distance >= best[2]) continue;
      best[2] = distance;
      if (best[2] < best[1]) std::swap(best[2], best[1]);
      if (best[1] < best[0]) std::swap(best[1], best[0]);
    }
  }

  const std::vector<Vector3d>& points_;
  Vector3d low_;
  double cell_ = 1;
  Vector3i size_;
  std::vector<int> begins_, members_;
};

}  // namespace

std::vector<double> three_neighbor_distances(const std::vector<Vector3d>& points) {
  if (points.size() < 4) throw std::logic_error("[nearest_neighbors] fewer than four points");
  const Grid grid(points);
  std::vector<double> distances(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const std::array<double, 3> squared = grid.nearest(static_cast<int>(i));
    distances[i] = std::sqrt((squared[0] + squared[1] + squared[2]) / 3);
  }
  return distances;
}

}  // namespace degas
