#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace degas {

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers on every machine and library, which <random>'s distributions
/// do not promise. Its state is a counter, so that any stream starts anywhere.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  /// Numbers that are a function of (seed, stream, step) alone, so that a resumed run draws what the uninterrupted one
  /// would have, with no state to save.
  static Random of_step(uint64_t seed, uint64_t stream, uint64_t step) {
    return Random(mix(seed ^ mix(stream ^ mix(step))));
  }

  uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15u); }
  /// In [0, 1), 53 random bits.
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  /// Standard normal (Box-Muller).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }
  /// In 0 .. count - 1.
  int64_t index(int64_t count) { return static_cast<int64_t>(uniform() * static_cast<double>(count)); }
  template <typename Value>
  void shuffle(std::vector<Value>& values) {
    for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[index(static_cast<int64_t>(i))]);
  }
  /// Weights of a convex combination, uniform over the simplex.
  std::vector<double> convex_weights(size_t count) {
    std::vector<double> weights(count);
    double total = 0;
    for (double& weight : weights) total += weight = -std::log(1 - uniform());
    for (double& weight : weights) weight = total > 0 ? weight / total : 1.0 / static_cast<double>(count);
    return weights;
  }

 private:
  static uint64_t mix(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  uint64_t state_;
};

}  // namespace degas
