#include "host/io/opencv/onnx_tensors.h"

#include <fmt/ranges.h>

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/error.h"
#include "host/io/mapped_file.h"

namespace degas {
namespace {

using Bytes = std::span<const std::byte>;

enum WireType : uint32_t { varint = 0, fixed64 = 1, length_delimited = 2, fixed32 = 5 };

/// Numbers of fields in the messages of onnx.proto that lead to tensors, or make them up.
namespace field {
constexpr uint32_t model_graph = 7;
constexpr uint32_t graph_node = 1, graph_initializer = 5;
constexpr uint32_t node_attribute = 5;
constexpr uint32_t attribute_tensor = 5, attribute_graph = 6, attribute_tensors = 10, attribute_graphs = 11;
constexpr uint32_t tensor_dims = 1, tensor_type = 2, tensor_floats = 4, tensor_int32s = 5, tensor_strings = 6,
                   tensor_int64s = 7, tensor_name = 8, tensor_raw = 9, tensor_doubles = 10, tensor_uint64s = 11,
                   tensor_location = 14;
}  // namespace field

constexpr size_t most_dimensions = 32;  // OpenCV's limit

/// How a type of tensor (TensorProto.DataType) keeps its numbers: as bytes, or in a field.
struct TensorType {
  uint64_t number_bytes;
  uint32_t field;
};

/// The types that OpenCV takes.
const std::map<uint64_t, TensorType>& tensor_types() {
  static const std::map<uint64_t, TensorType> types = {
      {1, {4, field::tensor_floats}},  {2, {1, field::tensor_int32s}}, {3, {1, field::tensor_int32s}},
      {4, {2, field::tensor_int32s}},  {5, {2, field::tensor_int32s}}, {6, {4, field::tensor_int32s}},
      {7, {8, field::tensor_int64s}},  {9, {1, field::tensor_int32s}}, {10, {2, field::tensor_int32s}},
      {11, {8, field::tensor_doubles}}};
  return types;
}

struct Field {
  uint32_t number;
  uint32_t wire;
  uint64_t value;  ///< of a varint
  Bytes bytes;     ///< of what is delimited by its length
};

class OnnxTensors {
 public:
  explicit OnnxTensors(const std::filesystem::path& path) : path_(path) {}

  void check_model(Bytes model) const {
    for_each_field(model, [&](const Field& field) {
      if (field.number == field::model_graph) check_graph(message(field), 0);
    });
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw Error::format("{}: is no ONNX network that is whole: {}", path_.string(), why);
  }

  uint64_t read_varint(Bytes& bytes) const {
    uint64_t value = 0;
    for (int shift = 0; shift < 70 && !bytes.empty(); shift += 7) {
      const auto byte = static_cast<uint64_t>(bytes.front());
      bytes = bytes.subspan(1);
      if (shift < 64) value |= (byte & 127) << shift;
      if (byte < 128) return value;
    }
    refuse("a number without an end");
  }

  Bytes take(Bytes& bytes, uint64_t count) const {
    if (count > bytes.size()) refuse("it ends within a message");
    const Bytes taken = bytes.first(static_cast<size_t>(count));
    bytes = bytes.subspan(static_cast<size_t>(count));
    return taken;
  }

  template <typename Visit>
  void for_each_field(Bytes bytes, const Visit& visit) const {
    while (!bytes.empty()) {
      const uint64_t tag = read_varint(bytes);
      Field field{static_cast<uint32_t>(tag >> 3), static_cast<uint32_t>(tag & 7), 0, {}};
      switch (field.wire) {
        case varint:
          field.value = read_varint(bytes);
          break;
        case fixed64:
          field.bytes = take(bytes, 8);
          break;
        case length_delimited:
          field.bytes = take(bytes, read_varint(bytes));
          break;
        case fixed32:
          field.bytes = take(bytes, 4);
          break;
        default:
          refuse(fmt::format("a field of the unknown kind {}", field.wire));
      }
      visit(field);
    }
  }

  Bytes message(const Field& field) const {
    require(field, length_delimited);
    return field.bytes;
  }

  /// Readers take a field of another kind for one that they do not know.
  void require(const Field& field, WireType single) const {
    if (field.wire != single && field.wire != length_delimited) refuse("a field of another kind than its own");
  }

  void check_graph(Bytes graph, int depth) const {
    constexpr int deepest = 16;
    if (depth > deepest) refuse(fmt::format("graphs within graphs, more than {} deep", deepest));
    for_each_field(graph, [&](const Field& field) {
      if (field.number == field::graph_initializer) check_tensor(message(field));
      if (field.number != field::graph_node) return;
      for_each_field(message(field), [&](const Field& of_node) {
        if (of_node.number == field::node_attribute) check_attribute(message(of_node), depth);
      });
    });
  }

  void check_attribute(Bytes attribute, int depth) const {
    bool has_tensor = false;
    for_each_field(attribute, [&](const Field& field) {
      switch (field.number) {
        case field::attribute_tensor:
          // Readers join both, their dimensions too.
          if (has_tensor) refuse("an attribute has its tensor twice");
          has_tensor = true;
          [[fallthrough]];
        case field::attribute_tensors:
          check_tensor(message(field));
          break;
        case field::attribute_graph:
        case field::attribute_graphs:
          check_graph(message(field), depth + 1);
          break;
        default:
          break;
      }
    });
  }

  /// Numbers in a field of a tensor: packed or one by one.
  uint64_t count_numbers(const Field& field) const {
    const WireType single = field.number == field::tensor_floats    ? fixed32
                            : field.number == field::tensor_doubles ? fixed64
                            : field.number == field::tensor_strings ? length_delimited
                                                                    : varint;
    require(field, single);
    if (field.wire == single) return 1;
    if (single != varint) return field.bytes.size() / (single == fixed32 ? 4 : 8);
    uint64_t count = 0;
    for (const std::byte byte : field.bytes) count += static_cast<uint8_t>(byte) < 128;
    return count;
  }

  void check_tensor(Bytes tensor) const {
    std::vector<uint64_t> dims;
    std::map<uint32_t, uint64_t> counts;  // numbers by the field that holds them
    std::optional<uint64_t> type;
    std::string name;
    uint64_t raw_bytes = 0;
    for_each_field(tensor, [&](const Field& field) {
      switch (field.number) {
        case field::tensor_dims:
          require(field, varint);
          if (field.wire == varint) dims.push_back(field.value);
          for (Bytes packed = field.bytes; !packed.empty() && dims.size() <= most_dimensions;) {
            dims.push_back(read_varint(packed));
          }
          if (dims.size() > most_dimensions)
            refuse(fmt::format("a tensor of more than {} dimensions", most_dimensions));
          break;
        case field::tensor_type:
          require(field, varint);
          type = static_cast<uint32_t>(field.value);
          break;
        case field::tensor_name:
          name.assign(reinterpret_cast<const char*>(message(field).data()), field.bytes.size());
          break;
        case field::tensor_raw:
          raw_bytes = message(field).size();
          break;  // the last one counts
        case field::tensor_location:
          if (field.value != 0) refuse("its weights lie in another file; save it as one");
          break;
        case field::tensor_floats:
        case field::tensor_int32s:
        case field::tensor_strings:
        case field::tensor_int64s:
        case field::tensor_doubles:
        case field::tensor_uint64s:
          counts[field.number] += count_numbers(field);
          break;
        default:
          break;
      }
    });
    const auto found = type ? tensor_types().find(*type) : tensor_types().end();
    if (found == tensor_types().end()) return;  // OpenCV refuses these by their type
    uint64_t expected = 1;
    bool holds_them = true;
    for (const uint64_t dim : dims) holds_them = !__builtin_mul_overflow(expected, dim, &expected) && holds_them;
    const auto& [number_bytes, number_field] = found->second;
    const uint64_t as_bytes = raw_bytes / number_bytes, as_field = counts[number_field];
    for (const auto& [number, count] : counts) holds_them = holds_them && (count == 0 || number == number_field);
    holds_them = holds_them && raw_bytes % number_bytes == 0 && (as_bytes == 0 || as_field == 0);
    if (holds_them && as_bytes + as_field == expected) return;
    refuse(fmt::format("the tensor '{}' does not hold the {} numbers of its type that dimensions {} call for", name,
                       expected, dims));
  }

  const std::filesystem::path& path_;
};

}  // namespace

void check_onnx_tensors(const std::filesystem::path& path) {
  const MappedFile file(path);
  OnnxTensors(path).check_model(file.bytes());
}

}  // namespace degas
