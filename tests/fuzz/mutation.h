#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/random.h"

namespace degas::test {

using Bytes = std::vector<std::byte>;

/// Damages bytes the way disks, broken programs and ill will do: flipped bits, cut ends, blocks lost, doubled, swapped
/// or taken from elsewhere, lengths set to extremes in binary and in digits, structure where none belongs. The same
/// seed damages the same bytes alike on every machine.
class Mutator {
 public:
  explicit Mutator(Random random) : random_(random) {}

  /// One to four kinds of damage. donor: bytes that blocks are taken from.
  void damage(Bytes& bytes, std::span<const std::byte> donor);
  /// A number below `count`.
  size_t draw(size_t count) { return count == 0 ? 0 : static_cast<size_t>(random_.next() % count); }
  /// What was done so far.
  const std::string& log() const { return log_; }

 private:
  size_t draw_length(size_t most);
  void damage_once(Bytes& bytes, std::span<const std::byte> donor);
  void set_number(Bytes& bytes);
  void set_digits(Bytes& bytes);
  void insert(Bytes& bytes, size_t at, std::span<const std::byte> block);

  Random random_;
  std::string log_;
};

}  // namespace degas::test
