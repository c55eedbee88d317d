#pragma once

#include <Eigen/Core>
#include <vector>

namespace degas {

/// For each point the root mean squared distance to its three nearest other points, by a uniform grid. Meant for
/// points spread over a surface. Throws std::logic_error for fewer than four points.
std::vector<double> three_neighbor_distances(const std::vector<Eigen::Vector3d>& points);

}  // namespace degas
