#pragma once

#include <string>
#include <vector>

#include "host/io/torch_archive.h"

namespace degas::test {

/// Sizes of an expression encoder; names as in tests/vectors/make_expression_encoder.py.
struct EncoderSizes {
  std::vector<int64_t> channels;  ///< of the input layer and of each block
  int64_t features, motions;
  int depth;  ///< linear layers down to the motion coefficients
  int64_t codes;
};

/// The numbers that the script draws by this name, uniform in +-bound.
std::vector<float> encoder_numbers(const std::string& name, const Shape& shape, double bound);

/// Random weights under the keys that load_expression_encoder expects, the script's.
TorchTensors make_encoder_weights(const EncoderSizes& sizes);

}  // namespace degas::test
