#pragma once

#include <cstdint>
#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// Which of G groups each of N rows belongs to.
struct RowGroups {
  Tensor members;       ///< Int32 (N), the rows of group 0, then those of group 1 ..
  Tensor starts;        ///< Int32 (G+1), where in `members` each group begins; N at last
  Tensor group_of_row;  ///< Int32 (N)
};

/// group_of_row: N numbers below `groups`; std::logic_error for others.
RowGroups group_rows(Device& device, const std::vector<int32_t>& group_of_row, int groups);

/// How far the groups of rows of vectors (N,3) have moved as wholes: the Euclidean length of each group's mean vector,
/// averaged over the rows: shape (1). A group whose mean is 0 has gradient 0.
Tensor mean_drift(Tape& tape, const Tensor& vectors, const RowGroups& groups);

}  // namespace degas
