#include "host/io/ply.h"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "host/error.h"
#include "host/io/file_bytes.h"

namespace degas {
namespace {

/// A property of the file, and where it comes from: member, components a splat, component. Null: zero.
struct Property {
  std::string name;
  std::vector<float> PlySplats::*values;
  size_t components, component;
};

/// In file order; coefficients: K of the harmonics, which the file has colour by colour.
std::vector<Property> properties_of(size_t coefficients) {
  std::vector<Property> properties;
  const auto add = [&](const char* name, std::vector<float> PlySplats::*values, size_t count) {
    for (size_t c = 0; c < count; ++c) properties.push_back({fmt::format("{}{}", name, c), values, count, c});
  };
  const char* axes[] = {"x", "y", "z"};
  for (size_t c = 0; c < 3; ++c) properties.push_back({axes[c], &PlySplats::positions, 3, c});
  for (const char* normal : {"nx", "ny", "nz"}) properties.push_back({normal, nullptr, 0, 0});
  add("f_dc_", &PlySplats::color_dc, 3);
  for (size_t i = 0; i < 3 * coefficients; ++i) {
    const size_t component = i % coefficients * 3 + i / coefficients;
    properties.push_back({fmt::format("f_rest_{}", i), &PlySplats::harmonics, 3 * coefficients, component});
  }
  properties.push_back({"opacity", &PlySplats::opacity_logits, 1, 0});
  add("scale_", &PlySplats::log_scales, 3);
  add("rot_", &PlySplats::rotations, 4);
  return properties;
}

struct PlyHeader {
  size_t vertices = 0, bytes = 0;  ///< bytes: of the header itself
  std::vector<std::string> names;  ///< float properties in order
};

PlyHeader parse_header(const std::vector<std::byte>& file, const std::string& label) {
  constexpr std::string_view last = "end_header\n";
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  const size_t end = text.substr(0, 1 << 16).find(last);
  if (!text.starts_with("ply\n") || end == std::string_view::npos) throw Error::format("{}: is no PLY file", label);
  PlyHeader header;
  header.bytes = end + last.size();
  std::istringstream lines{std::string(text.substr(4, end - 4))};
  bool in_vertices = false, is_binary = false;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, type, name;
    words >> word >> type >> name;
    if (word == "format") is_binary = type == "binary_little_endian";
    if (word == "element") {
      in_vertices = type == "vertex" && header.names.empty();
      if (!in_vertices) throw Error::format("{}: has elements '{}'; only one list of vertices is read", label, type);
      std::istringstream count(name);
      if (name.empty() || name[0] == '-' || !(count >> header.vertices))
        throw Error::format("{}: has no vertex count", label);
    }
    if (word == "property") {
      if (type != "float" && type != "float32")
        throw Error::format("{}: property '{}' is {}, not float", label, name, type);
      header.names.push_back(name);
    }
  }
  if (!is_binary) throw Error::format("{}: is not binary little endian", label);
  return header;
}

}  // namespace

void write_ply(const std::filesystem::path& path, const PlySplats& splats) {
  const size_t count = splats.opacity_logits.size();
  const std::vector<Property> properties = properties_of(count == 0 ? 0 : splats.harmonics.size() / (3 * count));
  std::string header = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", count);
  for (const Property& property : properties) {
    header += fmt::format("property float {}\n", property.name);
    if (property.values && (splats.*property.values).size() != property.components * count) {
      throw std::logic_error(fmt::format("[ply] '{}' is not there for each of {} splats", property.name, count));
    }
  }
  header += "end_header\n";
  std::vector<std::byte> file(header.size() + sizeof(float) * properties.size() * count);
  std::memcpy(file.data(), header.data(), header.size());
  std::byte* next = file.data() + header.size();
  for (size_t i = 0; i < count; ++i) {
    for (const Property& property : properties) {
      const float value =
          property.values ? (splats.*property.values)[i * property.components + property.component] : 0.0f;
      std::memcpy(next, &value, sizeof(value));
      next += sizeof(value);
    }
  }
  write_file_atomically(path, file);
}

PlySplats read_ply(const std::filesystem::path& path) {
  const std::vector<std::byte> file = read_file_bytes(path);
  const PlyHeader header = parse_header(file, path.string());
  const size_t row = sizeof(float) * header.names.size(), room = file.size() - header.bytes;
  if (row == 0 || header.vertices != room / row || room % row != 0) {
    throw Error::format("{}: {} vertices of {} bytes do not make the {} bytes after the header; the file is damaged",
                        path.string(), header.vertices, row, room);
  }
  PlySplats splats;
  const auto rest = std::count_if(header.names.begin(), header.names.end(),
                                  [](const std::string& name) { return name.starts_with("f_rest_"); });
  if (rest != 0 && rest != 9 && rest != 24 && rest != 45) {
    throw Error::format("{}: has {} properties 'f_rest_*', which are harmonics of no degree up to 3", path.string(),
                        rest);
  }
  for (const Property& property : properties_of(static_cast<size_t>(rest) / 3)) {
    if (!property.values) continue;
    size_t column = 0;
    while (column < header.names.size() && header.names[column] != property.name) ++column;
    if (column == header.names.size()) throw Error::format("{}: has no property '{}'", path.string(), property.name);
    std::vector<float>& values = splats.*property.values;
    values.resize(property.components * header.vertices);
    const std::byte* source = file.data() + header.bytes + sizeof(float) * column;
    for (size_t i = 0; i < header.vertices; ++i) {
      std::memcpy(&values[i * property.components + property.component], source + i * row, sizeof(float));
    }
  }
  return splats;
}

}  // namespace degas
