#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// Coefficients a colour channel for spherical harmonics of degrees 1 .. degree.
constexpr int harmonic_coefficients(int degree) {
  return (degree + 1) * (degree + 1) - 1;
}

constexpr int largest_harmonic_degree = 3;  ///< as in 3DGS

/// Colours (C,N,3) as seen from each of C cameras' centres (metres, world): max(0, base_colors + sum_j Y_j(R^T d)
/// harmonics_j). d is the unit direction from the camera to the Gaussian, R the Gaussian's rotation, and Y_j are the
/// real spherical harmonics of degree 1 and up, in the order and with the signs of 3DGS (Kerbl et al. 2023). Unlike
/// there, they turn with the Gaussian: its third axis starts as the surface's normal, so that one texel learns its
/// sheen from the directions in which all frames and cameras show it, rather than from each fixed camera alone.
///   positions    (N,3) metres, world
///   rotations    (N,4) quaternions w,x,y,z of any norm
///   base_colors  (N,3)
///   harmonics    (N, K, 3), K = 3, 8 or 15 for a degree of 1, 2 or 3
/// Gradients reach all four; none where the clamp holds a colour at 0. `room`, where it is more than C, is how many
/// cameras' colours the result has memory for, those beyond C undefined: steps of different numbers of cameras then use
/// memory of one size. Throws std::logic_error when shapes disagree.
Tensor colors_seen_from(Tape& tape, const std::vector<Eigen::Vector3d>& cameras, const Tensor& positions,
                        const Tensor& rotations, const Tensor& base_colors, const Tensor& harmonics, int64_t room = 0);

}  // namespace degas
