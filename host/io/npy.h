#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/autograd/tensor.h"

namespace degas {

/// An array as NumPy stores it, in little endian and C order whatever the file had.
struct NpyArray {
  Shape shape;        ///< empty for a scalar
  std::string dtype;  ///< "<f4", "<f8", "<f2", "<i4", "<u8", "|u1", "|b1", "<U12", "|S5", ...
  std::vector<std::byte> data;
  std::string label;  ///< "file: 'key'" for errors; empty for arrays made here

  /// Elements converted from any number type (bool too). Error naming file and key for text.
  std::vector<float> floats() const;
  std::vector<double> doubles() const;
  /// From integer and bool types only; Error for floats and for values that do not fit.
  std::vector<int64_t> integers() const;
  /// A scalar (or one-element) text array as UTF-8. Error for anything else.
  std::string text() const;

  static NpyArray from(Shape shape, std::span<const float> values);
  static NpyArray from(Shape shape, std::span<const double> values);
  static NpyArray from(Shape shape, std::span<const int32_t> values);
  static NpyArray from(Shape shape, std::span<const int64_t> values);
  static NpyArray from(Shape shape, std::span<const uint8_t> values);
  /// A scalar "<U" array; `text` is UTF-8.
  static NpyArray from_text(const std::string& text);
};

/// Reads the .npy format 1.0, 2.0 and 3.0: numbers, bools and fixed-width text of either byte order. Error beginning
/// with `label` for object and structured arrays (never unpickled) and for data whose size is not the header's.
NpyArray parse_npy(std::span<const std::byte> file, const std::string& label);
/// The .npy 1.0 file of an array.
std::vector<std::byte> make_npy(const NpyArray& array);

}  // namespace degas
