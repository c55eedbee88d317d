#include "host/io/npy_header.h"

#include <charconv>
#include <limits>

#include "host/error.h"

namespace degas {
namespace {

/// A reader of the Python literal that NumPy writes: one dictionary of a string, a bool and a tuple of integers.
class Literal {
 public:
  Literal(std::string_view text, const std::string& label) : text_(text), label_(label) {}

  [[noreturn]] void fail(const std::string& reason) const {
    throw Error::format("{}: bad npy header at byte {}: {}", label_, position_, reason);
  }
  bool accept(char wanted) {
    while (position_ < text_.size() && (text_[position_] == ' ' || text_[position_] == '\n')) ++position_;
    if (position_ >= text_.size() || text_[position_] != wanted) return false;
    ++position_;
    return true;
  }
  void expect(char wanted) {
    if (!accept(wanted)) fail(fmt::format("expected '{}'", wanted));
  }
  std::string string() {
    const char quote = accept('\'') ? '\'' : '"';
    if (quote == '"') expect('"');
    const size_t end = text_.find(quote, position_);
    if (end == std::string_view::npos) fail("a string does not end");
    const std::string value(text_.substr(position_, end - position_));
    position_ = end + 1;
    return value;
  }
  bool boolean() {
    accept(' ');
    for (const bool value : {true, false}) {
      const std::string_view word = value ? "True" : "False";
      if (text_.substr(position_).starts_with(word)) {
        position_ += word.size();
        return value;
      }
    }
    fail("expected True or False");
  }
  Shape tuple() {
    Shape shape;
    expect('(');
    while (!accept(')')) {
      int64_t size = 0;
      const char* begin = text_.data() + position_;
      const auto [end, status] = std::from_chars(begin, text_.data() + text_.size(), size);
      if (status != std::errc() || size < 0) fail("a size is no whole number");
      position_ += static_cast<size_t>(end - begin);
      shape.push_back(size);
      if (shape.size() > 32) fail("more than 32 axes");
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return shape;
  }
  /// Is the next value a list, as in a structured dtype?
  bool at_list() { return accept('['); }
  void expect_end() {
    accept(' ');
    if (position_ != text_.size()) fail("text after the dictionary");
  }

 private:
  std::string_view text_;
  const std::string& label_;
  size_t position_ = 0;
};

void parse_type(const std::string& type, NpyHeader& header, const Literal& literal, const std::string& label) {
  const auto unknown = [&] { return Error::format("{}: has dtype '{}', which is not read", label, type); };
  if (type.ends_with("O")) throw Error::format("{}: is an array of Python objects, which are never unpickled", label);
  if (type.size() < 3) throw unknown();
  header.byte_order = type[0] == '=' ? '<' : type[0];
  header.kind = type[1];
  int64_t count = 0;
  const auto [end, status] = std::from_chars(type.data() + 2, type.data() + type.size(), count);
  if (status != std::errc() || end != type.data() + type.size() || count < 0) literal.fail("the dtype has no size");
  const bool is_text = header.kind == 'U' || header.kind == 'S';
  const bool fits =
      (header.kind == 'f' && (count == 2 || count == 4 || count == 8)) ||
      ((header.kind == 'i' || header.kind == 'u') && (count == 1 || count == 2 || count == 4 || count == 8)) ||
      (header.kind == 'b' && count == 1) || (is_text && count >= 1 && count <= std::numeric_limits<int32_t>::max() / 4);
  if (!fits || (header.byte_order != '<' && header.byte_order != '>' && header.byte_order != '|')) throw unknown();
  header.unit_bytes = header.kind == 'U' ? 4 : header.kind == 'S' ? 1 : count;
  header.item_bytes = is_text ? count * header.unit_bytes : count;
  if (header.byte_order == '|' && header.unit_bytes > 1) throw unknown();
}

}  // namespace

NpyHeader parse_npy_header(std::string_view text, const std::string& label) {
  NpyHeader header;
  Literal literal(text, label);
  bool has_type = false, has_order = false, has_shape = false;
  literal.expect('{');
  while (!literal.accept('}')) {
    const std::string key = literal.string();
    literal.expect(':');
    if (key == "descr" && !has_type) {
      if (literal.at_list()) throw Error::format("{}: is a structured array, which is not read", label);
      parse_type(literal.string(), header, literal, label);
      has_type = true;
    } else if (key == "fortran_order" && !has_order) {
      header.fortran_order = literal.boolean();
      has_order = true;
    } else if (key == "shape" && !has_shape) {
      header.shape = literal.tuple();
      has_shape = true;
    } else {
      literal.fail(fmt::format("unexpected or repeated key '{}'", key));
    }
    if (!literal.accept(',')) {
      literal.expect('}');
      break;
    }
  }
  literal.expect_end();
  if (!has_type || !has_order || !has_shape) literal.fail("descr, fortran_order and shape are all needed");
  return header;
}

}  // namespace degas
