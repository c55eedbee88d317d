#include "model/loss/frechet.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

namespace degas {
namespace {

/// F of at most as many rows as columns with F^T F the covariance of the rows about `mean`.
Eigen::MatrixXd covariance_factor(const Eigen::MatrixXd& rows, const Eigen::RowVectorXd& mean) {
  const Eigen::MatrixXd centred = (rows.rowwise() - mean) / std::sqrt(static_cast<double>(rows.rows() - 1));
  if (centred.rows() <= centred.cols()) return centred;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(centred);
  return qr.matrixQR().topRows(centred.cols()).triangularView<Eigen::Upper>();
}

}  // namespace

void FeatureRows::add(std::span<const float> features) {
  if (!rows_.empty() && rows_.front().size() != features.size()) {
    throw std::logic_error(
        fmt::format("[feature rows] {} features after {} of others", features.size(), rows_.front().size()));
  }
  rows_.emplace_back(features.begin(), features.end());
}

Eigen::MatrixXd FeatureRows::matrix() const {
  Eigen::MatrixXd result(rows_.size(), rows_.empty() ? 0 : rows_.front().size());
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    const std::vector<float>& row = rows_[static_cast<size_t>(i)];
    result.row(i) = Eigen::Map<const Eigen::RowVectorXf>(row.data(), result.cols()).cast<double>();
  }
  return result;
}

double frechet_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() < 2 || b.rows() < 2 || a.cols() != b.cols() || a.cols() == 0) {
    throw std::logic_error(
        fmt::format("[frechet distance] features {} x {} against {} x {}", a.rows(), a.cols(), b.rows(), b.cols()));
  }
  const Eigen::RowVectorXd mean_a = a.colwise().mean(), mean_b = b.colwise().mean();
  const Eigen::MatrixXd factor_a = covariance_factor(a, mean_a), factor_b = covariance_factor(b, mean_b);
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(factor_a * factor_b.transpose());
  return (mean_a - mean_b).squaredNorm() + factor_a.squaredNorm() + factor_b.squaredNorm() -
         2 * svd.singularValues().sum();
}

}  // namespace degas
