#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace degas {

/// Features of pictures, one row a picture.
class FeatureRows {
 public:
  /// Throws std::logic_error when a picture has another number of features than those before.
  void add(std::span<const float> features);
  int count() const { return static_cast<int>(rows_.size()); }
  Eigen::MatrixXd matrix() const;

 private:
  std::vector<std::vector<float>> rows_;
};

/// Frechet distance of the Gaussians fitted to the rows of `a` and `b` (FID, Heusel et al. 2017), in double:
///   |mean_a - mean_b|^2 + tr C_a + tr C_b - 2 tr (C_a C_b)^(1/2), covariances by n - 1.
/// The square root is taken of no product of covariances, whose small eigenvalues rounding drowns: with C = F^T F the
/// trace is the sum of the singular values of F_a F_b^T. Exact for fewer rows than columns too. Both need at least two
/// rows, and as many columns (std::logic_error).
double frechet_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace degas
