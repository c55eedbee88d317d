#pragma once

#include <string>
#include <string_view>

#include "host/autograd/tensor.h"

namespace degas {

/// What the dictionary at the head of a .npy file says.
struct NpyHeader {
  char byte_order = '|';   ///< '<', '>' or '|'
  char kind = 'f';         ///< f, i, u, b, U, S
  int64_t item_bytes = 0;  ///< of one element
  int64_t unit_bytes = 1;  ///< of what byte order applies to: the number, or the code point of text
  bool fortran_order = false;
  Shape shape;
};

/// Parses "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }" and nothing more liberal. Error beginning with
/// `label` for anything else; object ('O') and structured types are named as such.
NpyHeader parse_npy_header(std::string_view text, const std::string& label);

}  // namespace degas
