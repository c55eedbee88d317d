#include "host/io/npy.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "host/error.h"
#include "host/io/npy_header.h"

namespace degas {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are kept in little endian and read in place");

/// IEEE half precision.
double half_to_double(uint16_t bits) {
  const int exponent = (bits >> 10) & 31, mantissa = bits & 1023;
  double value = exponent == 31  ? (mantissa ? NAN : INFINITY)
                 : exponent == 0 ? std::ldexp(mantissa, -24)
                                 : std::ldexp(mantissa + 1024, exponent - 25);
  return bits >> 15 ? -value : value;
}

template <typename Source, typename Target>
void convert(const NpyArray& array, std::vector<Target>& out) {
  for (size_t i = 0; i < out.size(); ++i) {
    Source value;
    std::memcpy(&value, array.data.data() + i * sizeof(Source), sizeof(Source));
    out[i] = static_cast<Target>(value);
  }
}

/// "file: 'key'" or a stand-in for arrays that came from no file.
std::string label_of(const NpyArray& array) {
  return array.label.empty() ? "array" : array.label;
}

template <typename Target>
bool convert_integers(const NpyArray& array, std::vector<Target>& out) {
  const std::string& type = array.dtype;
  if (type == "|b1" || type == "|u1")
    convert<uint8_t>(array, out);
  else if (type == "|i1")
    convert<int8_t>(array, out);
  else if (type == "<i2")
    convert<int16_t>(array, out);
  else if (type == "<u2")
    convert<uint16_t>(array, out);
  else if (type == "<i4")
    convert<int32_t>(array, out);
  else if (type == "<u4")
    convert<uint32_t>(array, out);
  else if (type == "<i8")
    convert<int64_t>(array, out);
  else if (type == "<u8")
    convert<uint64_t>(array, out);
  else
    return false;
  return true;
}

template <typename Target>
std::vector<Target> convert_numbers(const NpyArray& array) {
  std::vector<Target> out(static_cast<size_t>(element_count(array.shape)));
  if (array.dtype == "<f4")
    convert<float>(array, out);
  else if (array.dtype == "<f8")
    convert<double>(array, out);
  else if (array.dtype == "<f2") {
    for (size_t i = 0; i < out.size(); ++i) {
      uint16_t bits;
      std::memcpy(&bits, array.data.data() + 2 * i, 2);
      out[i] = static_cast<Target>(half_to_double(bits));
    }
  } else if (!convert_integers(array, out)) {
    throw Error::format("{}: holds text ({}) where numbers are expected", label_of(array), array.dtype);
  }
  return out;
}

template <typename Value>
NpyArray make_array(Shape shape, std::span<const Value> values, const char* dtype) {
  if (element_count(shape) != static_cast<int64_t>(values.size())) {
    throw std::logic_error(fmt::format("[npy] {} values do not fill shape {}", values.size(), to_string(shape)));
  }
  NpyArray array{std::move(shape), dtype, {}, {}};
  const auto bytes = std::as_bytes(values);
  array.data.assign(bytes.begin(), bytes.end());
  return array;
}

void append_utf8(std::string& text, uint32_t code, const std::string& label) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xc0 | code >> 6);
    text += static_cast<char>(0x80 | (code & 63));
  } else if (code < 0x10000) {
    text += static_cast<char>(0xe0 | code >> 12);
    text += static_cast<char>(0x80 | (code >> 6 & 63));
    text += static_cast<char>(0x80 | (code & 63));
  } else if (code < 0x110000) {
    text += static_cast<char>(0xf0 | code >> 18);
    text += static_cast<char>(0x80 | (code >> 12 & 63));
    text += static_cast<char>(0x80 | (code >> 6 & 63));
    text += static_cast<char>(0x80 | (code & 63));
  } else {
    throw Error::format("{}: holds a character that is none ({:#x})", label, code);
  }
}

/// Element (i0, i1, ...) of the Fortran-ordered source goes to its place in C order.
std::vector<std::byte> to_c_order(std::span<const std::byte> source, const Shape& shape, size_t item_bytes) {
  std::vector<std::byte> target(source.size());
  const size_t axes = shape.size();
  std::vector<size_t> source_stride(axes, item_bytes), index(axes, 0);
  for (size_t axis = 1; axis < axes; ++axis) source_stride[axis] = source_stride[axis - 1] * shape[axis - 1];
  size_t from = 0;
  for (size_t to = 0; to < target.size(); to += item_bytes) {
    std::memcpy(target.data() + to, source.data() + from, item_bytes);
    for (size_t axis = axes; axis-- > 0;) {
      from += source_stride[axis];
      if (++index[axis] < static_cast<size_t>(shape[axis])) break;
      from -= source_stride[axis] * index[axis];
      index[axis] = 0;
    }
  }
  return target;
}

}  // namespace

std::vector<float> NpyArray::floats() const {
  return convert_numbers<float>(*this);
}
std::vector<double> NpyArray::doubles() const {
  return convert_numbers<double>(*this);
}

std::vector<int64_t> NpyArray::integers() const {
  std::vector<int64_t> out(static_cast<size_t>(element_count(shape)));
  if (!convert_integers(*this, out)) {
    throw Error::format("{}: has dtype '{}' where integers are expected", label_of(*this), dtype);
  }
  if (dtype == "<u8" && std::any_of(out.begin(), out.end(), [](int64_t value) { return value < 0; })) {
    throw Error::format("{}: holds an unsigned integer above 2^63", label_of(*this));
  }
  return out;
}

std::string NpyArray::text() const {
  const bool wide = dtype.starts_with("<U"), narrow = dtype.starts_with("|S");
  if ((!wide && !narrow) || element_count(shape) != 1) {
    throw Error::format("{}: has dtype '{}' and shape {} where one text is expected", label_of(*this), dtype,
                        degas::to_string(shape));
  }
  std::string out;
  if (narrow) {
    out.assign(reinterpret_cast<const char*>(data.data()), data.size());
    out.resize(out.find_last_not_of('\0') + 1);
    return out;
  }
  for (size_t i = 0; i + 4 <= data.size(); i += 4) {
    uint32_t code;
    std::memcpy(&code, data.data() + i, 4);
    append_utf8(out, code, label_of(*this));
  }
  out.resize(out.find_last_not_of('\0') + 1);  // NumPy pads text with zeros
  return out;
}

NpyArray NpyArray::from(Shape shape, std::span<const float> values) {
  return make_array(std::move(shape), values, "<f4");
}
NpyArray NpyArray::from(Shape shape, std::span<const double> values) {
  return make_array(std::move(shape), values, "<f8");
}
NpyArray NpyArray::from(Shape shape, std::span<const int32_t> values) {
  return make_array(std::move(shape), values, "<i4");
}
NpyArray NpyArray::from(Shape shape, std::span<const int64_t> values) {
  return make_array(std::move(shape), values, "<i8");
}
NpyArray NpyArray::from(Shape shape, std::span<const uint8_t> values) {
  return make_array(std::move(shape), values, "|u1");
}

NpyArray NpyArray::from_text(const std::string& text) {
  std::vector<uint32_t> codes;
  for (size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    uint32_t code = length == 1 ? lead : lead & (0xffu >> (length + 1));
    for (size_t k = 1; k < length && i + k < text.size(); ++k)
      code = code << 6 | (static_cast<unsigned char>(text[i + k]) & 63);
    codes.push_back(code);
    i += length;
  }
  if (codes.empty()) codes.push_back(0);  // NumPy has no text of width 0
  NpyArray array{{}, fmt::format("<U{}", codes.size()), {}, {}};
  const auto bytes = std::as_bytes(std::span<const uint32_t>(codes));
  array.data.assign(bytes.begin(), bytes.end());
  return array;
}

NpyArray parse_npy(std::span<const std::byte> file, const std::string& label) {
  constexpr std::string_view magic = "\x93NUMPY";
  const auto* characters = reinterpret_cast<const char*>(file.data());
  if (file.size() < 10 || std::string_view(characters, magic.size()) != magic)
    throw Error::format("{}: is no npy data", label);
  const int version = std::to_integer<int>(file[6]);
  if (version < 1 || version > 3) throw Error::format("{}: npy version {} is not known", label, version);
  const size_t length_bytes = version == 1 ? 2 : 4, begin = 8 + length_bytes;
  uint32_t header_bytes = 0;
  if (file.size() >= begin) std::memcpy(&header_bytes, file.data() + 8, length_bytes);
  if (file.size() < begin || header_bytes > file.size() - begin)
    throw Error::format("{}: ends within its npy header", label);
  const NpyHeader header = parse_npy_header({characters + begin, header_bytes}, label);

  const std::span<const std::byte> payload = file.subspan(begin + header_bytes);
  // Sizes are multiplied in long double first: a hostile shape must not wrap around, not even beside a size of 0.
  long double bytes = static_cast<long double>(header.item_bytes), without_zeros = bytes;
  for (const int64_t size : header.shape) {
    bytes *= static_cast<long double>(size);
    without_zeros *= static_cast<long double>(std::max<int64_t>(size, 1));
  }
  if (bytes != static_cast<long double>(payload.size()) || without_zeros > 0x1p62L) {
    throw Error::format("{}: shape {} needs {:.0f} bytes but {} follow; the file is damaged", label,
                        to_string(header.shape), static_cast<double>(bytes), payload.size());
  }
  NpyArray array{header.shape, {}, {}, label};
  const bool is_text = header.kind == 'U' || header.kind == 'S';
  array.dtype = fmt::format("{}{}{}", header.unit_bytes > 1 ? '<' : '|', header.kind,
                            is_text ? header.item_bytes / header.unit_bytes : header.item_bytes);
  if (header.fortran_order && header.shape.size() > 1 && !payload.empty()) {
    array.data = to_c_order(payload, header.shape, static_cast<size_t>(header.item_bytes));
  } else {
    array.data.assign(payload.begin(), payload.end());
  }
  if (header.byte_order == '>') {
    const auto unit = static_cast<size_t>(header.unit_bytes);
    for (size_t i = 0; i + unit <= array.data.size(); i += unit) {
      std::reverse(array.data.begin() + static_cast<ptrdiff_t>(i),
                   array.data.begin() + static_cast<ptrdiff_t>(i + unit));
    }
  }
  return array;
}

std::vector<std::byte> make_npy(const NpyArray& array) {
  std::string shape;
  for (const int64_t size : array.shape) shape += fmt::format("{}, ", size);
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", array.dtype, shape);
  // NumPy aligns the data to 64 bytes and ends the header with a line feed.
  header.append((64 - (10 + header.size() + 1) % 64) % 64, ' ');
  header += '\n';
  std::vector<std::byte> file(10 + header.size() + array.data.size());
  const auto length = static_cast<uint16_t>(header.size());
  std::memcpy(file.data(), "\x93NUMPY\x01\x00", 8);
  std::memcpy(file.data() + 8, &length, 2);
  std::memcpy(file.data() + 10, header.data(), header.size());
  std::copy(array.data.begin(), array.data.end(), file.begin() + 10 + static_cast<ptrdiff_t>(header.size()));
  return file;
}

}  // namespace degas
