#pragma once

#include <functional>
#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// A convolution with ReLU as torch stores it: weight (Cout,Cin,K,K), bias (Cout).
struct LpipsConvolution {
  Shape shape;
  std::vector<float> weight, bias;
  int stride = 1, padding = 0;
};

/// A step of the feature network. Convolution: one of `convolutions`. Fire (SqueezeNet): three, squeeze, then expand
/// 1x1 and expand 3x3 side by side. Pool: max_pool.
struct LpipsLayer {
  enum class Kind { Convolution, Fire, Pool };
  Kind kind = Kind::Convolution;
  std::vector<LpipsConvolution> convolutions;
  bool ceil_mode = false;              ///< Pool
  std::vector<float> feature_weights;  ///< one per channel where this layer's output is compared; empty where not
  int window = 3;                      ///< Pool
};

/// Perceptual distance (Zhang et al. 2018, version 0.1): features of a frozen network, unit length over the channels at
/// each pixel (eps 1e-10), squared differences weighted by channel, mean over pixels, sum over the compared layers.
class Lpips {
 public:
  /// Copies the weights to the device. Throws std::logic_error when sizes do not fit.
  Lpips(Device& device, const std::vector<LpipsLayer>& layers);

  /// image, target: (H,W,3) in 0..1, of one size that the network's layers do not shrink to nothing (std::logic_error;
  /// smallest_side). Shape (1); the gradient goes to image only.
  Tensor distance(Tape& tape, const Tensor& image, const Tensor& target) const;

  /// The least height and width that every layer accepts.
  int smallest_side() const { return smallest_side_; }

 private:
  struct Convolution {
    Tensor weight, bias;
    int stride, padding;
  };
  struct Layer {
    LpipsLayer::Kind kind;
    std::vector<Convolution> convolutions;
    bool ceil_mode;
    Tensor feature_weights;
    int window;
  };

  static Convolution upload(Device& device, const LpipsConvolution& source);
  static Tensor convolve(Tape& tape, const Tensor& input, const Convolution& convolution);
  /// Side length after all layers, or 0 when one of them does not accept it.
  int output_side(int side) const;
  /// Calls compare with each compared layer and its output, as soon as it is there.
  void run(Tape& tape, const Tensor& image, const std::function<void(const Layer&, const Tensor&)>& compare) const;

  std::vector<Layer> layers_;
  int smallest_side_ = 1;
};

}  // namespace degas
