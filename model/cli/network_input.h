#pragma once

#include <string>

#include "host/io/onnx_model.h"

namespace degas {

/// What an ONNX network of pictures takes, and which of its outputs counts.
struct NetworkInput {
  OnnxInput picture;
  std::string output;  ///< empty: the largest
};

/// "side=299,mean=127.5,scale=0.0078,output=pool" over the given ones. Throws Error naming the option and the part that
/// is wrong.
NetworkInput parse_network_input(const std::string& text, const std::string& option, NetworkInput input);

}  // namespace degas
