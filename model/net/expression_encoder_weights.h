#pragma once

#include <filesystem>
#include <string>

#include "model/net/expression_encoder.h"

namespace degas {

/// Where the parts of an expression encoder lie in a file of weights: the paths that its keys begin with, at any depth
/// ("gen.mlp.0.weight" is found by "mlp"). The defaults are those of DPE's published code. The layers below a path are
/// numbered from 0:
///
///   features      PATH.0.0.weight PATH.0.1.bias (1x1), blocks I = 1 ..: PATH.I.conv1.0.weight PATH.I.conv1.1.bias
///                 PATH.I.conv2.1.weight PATH.I.conv2.2.bias PATH.I.skip.1.weight, last PATH.I.weight (4x4)
///   coefficients  PATH.I.weight PATH.I.bias
///   basis         PATH.weight
///   code          PATH.I.weight PATH.I.bias
struct EncoderKeys {
  std::string features = "enc.net_app.convs", coefficients = "mlp", basis = "dir", code = "mlp_exp";
};

/// "coefficients=enc.fc,basis=dec.direction" over the defaults. Throws Error naming the part that is wrong.
EncoderKeys parse_encoder_keys(const std::string& text);

/// Reads a torch archive (.pt, .pth) or an .npz. Throws Error naming file, key and what fits: for a part that is not
/// there or there twice, a shape that does not fit the layers before it, numbers that are not finite.
ExpressionEncoderWeights load_expression_encoder(const std::filesystem::path& path, const EncoderKeys& keys = {});

}  // namespace degas
