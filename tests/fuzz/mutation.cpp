#include "tests/fuzz/mutation.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace degas::test {
namespace {

bool is_digit(std::byte byte) {
  return byte >= std::byte{'0'} && byte <= std::byte{'9'};
}

Bytes bytes_of_text(std::string_view text) {
  const auto bytes = std::as_bytes(std::span<const char>(text));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

void Mutator::damage(Bytes& bytes, std::span<const std::byte> donor) {
  const size_t times = draw(2) == 0 ? 1 : 1 + draw(4);
  for (size_t i = 0; i < times; ++i) damage_once(bytes, donor);
}

/// Short blocks are as likely as long ones.
size_t Mutator::draw_length(size_t most) {
  return 1 + draw(std::min(most, size_t{1} << draw(16)));
}

void Mutator::insert(Bytes& bytes, size_t at, std::span<const std::byte> block) {
  bytes.insert(bytes.begin() + static_cast<ptrdiff_t>(at), block.begin(), block.end());
}

void Mutator::damage_once(Bytes& bytes, std::span<const std::byte> donor) {
  if (bytes.empty()) {
    log_ += "one byte; ";
    bytes.push_back(static_cast<std::byte>(draw(256)));
    return;
  }
  const size_t at = draw(bytes.size()), length = std::min(draw_length(bytes.size()), bytes.size() - at);
  const auto begin = bytes.begin() + static_cast<ptrdiff_t>(at), end = begin + static_cast<ptrdiff_t>(length);
  switch (draw(12)) {
    case 0: {
      const size_t bit = draw(8);
      log_ += fmt::format("bit {} of byte {} flipped; ", bit, at);
      bytes[at] ^= static_cast<std::byte>(1u << bit);
      return;
    }
    case 1:
      bytes[at] = static_cast<std::byte>(draw(256));
      log_ += fmt::format("byte {} set to {}; ", at, static_cast<int>(bytes[at]));
      return;
    case 2:
      log_ += fmt::format("cut to {} bytes; ", at);
      bytes.resize(at);
      return;
    case 3:
      log_ += fmt::format("{} bytes at {} lost; ", length, at);
      bytes.erase(begin, end);
      return;
    case 4: {
      log_ += fmt::format("{} bytes at {} doubled; ", length, at);
      const Bytes block(begin, end);
      insert(bytes, at, block);
      return;
    }
    case 5: {
      const size_t to = draw(bytes.size() - length + 1);
      log_ += fmt::format("{} bytes at {} copied over those at {}; ", length, at, to);
      const Bytes block(begin, end);
      std::copy(block.begin(), block.end(), bytes.begin() + static_cast<ptrdiff_t>(to));
      return;
    }
    case 6: {
      if (donor.empty()) return;
      const size_t from = draw(donor.size()), count = std::min(draw_length(donor.size()), donor.size() - from);
      log_ += fmt::format("{} bytes at {} of another inserted at {}; ", count, from, at);
      insert(bytes, at, donor.subspan(from, count));
      return;
    }
    case 7: {
      const std::string_view structure = "{}[]()<>,:;\"'\\/ \n\t-+.#eENT0";
      const char letter = structure[draw(structure.size())];
      log_ += fmt::format("'{}' put over byte {}; ", letter, at);
      bytes[at] = static_cast<std::byte>(letter);
      return;
    }
    case 8:
      log_ += fmt::format("{} bytes at {} set to zero; ", length, at);
      std::fill(begin, end, std::byte{0});
      return;
    case 9:
      return set_digits(bytes);
    default:
      return set_number(bytes);
  }
}

/// A length field, maybe: 1, 2, 4 or 8 bytes of either order become an extreme, or one more or less than they were.
void Mutator::set_number(Bytes& bytes) {
  const size_t width = size_t{1} << draw(4);
  if (bytes.size() < width) return;
  const size_t at = draw(bytes.size() - width + 1);
  const bool is_big_endian = draw(4) == 0;
  const auto place = [&](size_t i) { return at + (is_big_endian ? width - 1 - i : i); };
  uint64_t value = 0;
  for (size_t i = 0; i < width; ++i) value |= static_cast<uint64_t>(bytes[place(i)]) << (8 * i);
  const uint64_t all = ~uint64_t{0} >> (64 - 8 * width);
  const uint64_t choices[] = {0, 1, all, all >> 1, (all >> 1) + 1, all - 1, value + 1, value - 1, value << 1, ~value};
  value = choices[draw(std::size(choices))] & all;
  log_ +=
      fmt::format("{} bytes at {} set to the number {:#x}{}; ", width, at, value, is_big_endian ? ", reversed" : "");
  for (size_t i = 0; i < width; ++i) bytes[place(i)] = static_cast<std::byte>(value >> (8 * i));
}

/// The digits from a place on become another number.
void Mutator::set_digits(Bytes& bytes) {
  const size_t from = draw(bytes.size());
  const auto begin = std::find_if(bytes.begin() + static_cast<ptrdiff_t>(from), bytes.end(), is_digit);
  if (begin == bytes.end()) return;
  const auto end = std::find_if_not(begin, bytes.end(), is_digit);
  static constexpr std::string_view numbers[] = {"0",
                                                 "-1",
                                                 "1",
                                                 "127",
                                                 "255",
                                                 "65536",
                                                 "1000000",
                                                 "2147483647",
                                                 "-2147483648",
                                                 "4294967295",
                                                 "9223372036854775807",
                                                 "-9223372036854775808",
                                                 "18446744073709551615",
                                                 "18446744073709551616",
                                                 "99999999999999999999999999",
                                                 "1e308",
                                                 "1e999",
                                                 "-1e308",
                                                 "1e-320",
                                                 "nan",
                                                 "inf",
                                                 "0.5",
                                                 "null",
                                                 "[]",
                                                 "{}",
                                                 "\"\"",
                                                 "true",
                                                 ""};
  const std::string_view number = numbers[draw(std::size(numbers))];
  const size_t at = static_cast<size_t>(begin - bytes.begin());
  log_ += fmt::format("digits at {} became '{}'; ", at, number);
  bytes.erase(begin, end);
  insert(bytes, at, bytes_of_text(number));
}

}  // namespace degas::test
