#pragma once

#include <cstring>
#include <string>
#include <vector>

namespace degas::test {

/// The bytes of a .npy file, whatever the header's dictionary says.
inline std::vector<std::byte> npy_file(const std::string& dictionary, const std::string& payload, int version = 1) {
  std::string head = "\x93NUMPY";
  head += static_cast<char>(version);
  head += '\0';
  for (int i = 0; i < (version == 1 ? 2 : 4); ++i) head += static_cast<char>(dictionary.size() >> (8 * i));
  head += dictionary;
  std::vector<std::byte> bytes(head.size() + payload.size());
  std::memcpy(bytes.data(), head.data(), head.size());
  if (!payload.empty()) std::memcpy(bytes.data() + head.size(), payload.data(), payload.size());
  return bytes;
}

}  // namespace degas::test
