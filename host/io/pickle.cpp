#include "host/io/pickle.h"

#include <cstring>
#include <map>

#include "host/error.h"

namespace degas {
namespace {

using Kind = PickleValue::Kind;

/// The stack machine. Every opcode either succeeds on checked operands or throws.
class Machine {
 public:
  Machine(std::span<const std::byte> bytes, const std::string& label) : bytes_(bytes), label_(label) {}

  Pickle run(size_t most_opcodes) {
    for (size_t opcodes = 0;; ++opcodes) {
      if (opcodes == most_opcodes) fail(fmt::format("it has more than {} opcodes", most_opcodes));
      const auto code = static_cast<uint8_t>(integer(1));
      if (code == '.') break;
      if (!plain_value(code) && !container(code) && !memo(code) && !call(code)) {
        fail(fmt::format("opcode {:#04x} is not of the kind that tensors need", code));
      }
    }
    pickle_.result = pop();
    return std::move(pickle_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw Error::format("{}: its pickle is not read at byte {}: {}", label_, position_, reason);
  }
  std::span<const std::byte> take(size_t count) {
    if (count > bytes_.size() - position_) fail("it ends early; the file is damaged");
    position_ += count;
    return bytes_.subspan(position_ - count, count);
  }
  /// Little endian, unsigned.
  uint64_t integer(size_t count) {
    uint64_t value = 0;
    const auto raw = take(count);
    for (size_t i = 0; i < count; ++i) value |= std::to_integer<uint64_t>(raw[i]) << (8 * i);
    return value;
  }
  std::string text(size_t count) {
    const auto raw = take(count);
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }
  std::string line() {
    std::string out;
    for (char c; (c = static_cast<char>(integer(1))) != '\n';) out += c;
    return out;
  }

  PickleValue* make(Kind kind) {
    pickle_.values.push_back(std::make_unique<PickleValue>());
    pickle_.values.back()->kind = kind;
    return pickle_.values.back().get();
  }
  PickleValue* push(Kind kind) { return stack_.emplace_back(make(kind)); }
  void push_integer(int64_t value, Kind kind = Kind::Integer) { push(kind)->integer = value; }
  PickleValue* pop() {
    if (stack_.empty() || stack_.back()->kind == Kind::Mark) fail("its stack is empty");
    PickleValue* value = stack_.back();
    stack_.pop_back();
    return value;
  }
  PickleValue* top(Kind kind) {
    if (stack_.empty() || stack_.back()->kind != kind) fail("a value has the wrong type");
    return stack_.back();
  }
  std::vector<PickleValue*> pop_to_mark() {
    size_t begin = stack_.size();
    while (begin > 0 && stack_[begin - 1]->kind != Kind::Mark) --begin;
    if (begin == 0) fail("a mark is missing");
    std::vector<PickleValue*> items(stack_.begin() + static_cast<ptrdiff_t>(begin), stack_.end());
    stack_.resize(begin - 1);
    return items;
  }

  bool plain_value(uint8_t code) {
    switch (code) {
      case 0x80:  // PROTO
        if (const uint64_t version = integer(1); version < 2 || version > 5) fail(fmt::format("protocol {}", version));
        return true;
      case 0x95:
        integer(8);
        return true;  // FRAME: a hint
      case 'N':
        push(Kind::None);
        return true;
      case 0x88:
        push_integer(1, Kind::Boolean);
        return true;
      case 0x89:
        push_integer(0, Kind::Boolean);
        return true;
      case 'J':
        push_integer(static_cast<int32_t>(integer(4)));
        return true;
      case 'K':
        push_integer(static_cast<int64_t>(integer(1)));
        return true;
      case 'M':
        push_integer(static_cast<int64_t>(integer(2)));
        return true;
      case 0x8a: {  // LONG1: two's complement of a given length
        const size_t count = integer(1);
        if (count > 8) fail("an integer of more than 64 bits");
        const uint64_t raw = integer(count);
        const int unused = static_cast<int>(64 - 8 * count);
        push_integer(count == 0 ? 0 : static_cast<int64_t>(raw << unused) >> unused);
        return true;
      }
      case 'G':
        take(8);
        push(Kind::Float);
        return true;  // passed over
      case 'X':
        push(Kind::Text)->text = text(integer(4));
        return true;
      case 0x8c:
        push(Kind::Text)->text = text(integer(1));
        return true;
      case 'C':
        push(Kind::Bytes)->text = text(integer(1));
        return true;
      case 'B':
        push(Kind::Bytes)->text = text(integer(4));
        return true;
    }
    return false;
  }

  void set_items(PickleValue* dictionary, const std::vector<PickleValue*>& items) {
    if (items.size() % 2) fail("a dictionary with a key but no value");
    dictionary->items.insert(dictionary->items.end(), items.begin(), items.end());
  }

  bool container(uint8_t code) {
    switch (code) {
      case '(':
        push(Kind::Mark);
        return true;
      case ')':
        push(Kind::Tuple);
        return true;
      case ']':
        push(Kind::List);
        return true;
      case '}':
        push(Kind::Dictionary);
        return true;
      case 't': {
        auto items = pop_to_mark();
        push(Kind::Tuple)->items = std::move(items);
        return true;
      }
      case 0x85:
      case 0x86:
      case 0x87: {
        std::vector<PickleValue*> items(code - 0x84);
        for (size_t i = items.size(); i-- > 0;) items[i] = pop();
        push(Kind::Tuple)->items = std::move(items);
        return true;
      }
      case 'a': {
        PickleValue* item = pop();
        top(Kind::List)->items.push_back(item);
        return true;
      }
      case 'e': {
        const auto items = pop_to_mark();
        auto& list = top(Kind::List)->items;
        list.insert(list.end(), items.begin(), items.end());
        return true;
      }
      case 's': {
        PickleValue* value = pop();
        PickleValue* key = pop();
        set_items(top(Kind::Dictionary), {key, value});
        return true;
      }
      case 'u': {
        const auto items = pop_to_mark();
        set_items(top(Kind::Dictionary), items);
        return true;
      }
    }
    return false;
  }

  void remember(uint64_t place) {
    if (stack_.empty()) fail("its stack is empty");
    memo_[place] = stack_.back();
  }
  void recall(uint64_t place) {
    const auto found = memo_.find(place);
    if (found == memo_.end()) fail("it refers to a value that is not there");
    stack_.push_back(found->second);
  }

  bool memo(uint8_t code) {
    switch (code) {
      case 'q':
        remember(integer(1));
        return true;
      case 'r':
        remember(integer(4));
        return true;
      case 0x94:
        remember(memo_.size());
        return true;
      case 'h':
        recall(integer(1));
        return true;
      case 'j':
        recall(integer(4));
        return true;
    }
    return false;
  }

  void push_global(const std::string& module, const std::string& name) {
    const bool storage = (module == "torch" || module == "torch.cuda") && name.ends_with("Storage");
    if (!storage && !(module == "torch._utils" && name == "_rebuild_tensor_v2") &&
        !(module == "torch._utils" && name == "_rebuild_parameter") &&
        !(module == "collections" && name == "OrderedDict") && !(module == "argparse" && name == "Namespace")) {
      fail(fmt::format("it asks for '{}.{}'; only tensors and dictionaries of them are read: save those alone", module,
                       name));
    }
    push(Kind::Global)->text = module + " " + name;
  }

  bool call(uint8_t code) {
    switch (code) {
      case 'c': {
        const std::string module = line();
        push_global(module, line());
        return true;
      }
      case 0x93: {  // STACK_GLOBAL
        const std::string name = top(Kind::Text)->text;
        pop();
        const std::string module = top(Kind::Text)->text;
        pop();
        push_global(module, name);
        return true;
      }
      case 'Q': {  // BINPERSID: torch's only use is ('storage', type, key, location, element count)
        auto items = top(Kind::Tuple)->items;
        pop();
        const bool fits = items.size() == 5 && items[0]->kind == Kind::Text && items[0]->text == "storage" &&
                          items[1]->kind == Kind::Global && items[2]->kind == Kind::Text &&
                          items[4]->kind == Kind::Integer;
        if (!fits) fail("a persistent value is no tensor storage");
        push(Kind::Storage)->items = std::move(items);
        return true;
      }
      case 'R':
      case 0x81:  // NEWOBJ
        reduce();
        return true;
      case 'b':
        pop();
        top(Kind::Dictionary);
        return true;  // BUILD: a state dictionary's _metadata, or a command line's options; not needed
    }
    return false;
  }

  void reduce() {
    const auto arguments = top(Kind::Tuple)->items;
    pop();
    const std::string callee = top(Kind::Global)->text;
    pop();
    if (callee == "collections OrderedDict" || callee == "argparse Namespace") {
      if (!arguments.empty()) fail(fmt::format("a '{}' made of arguments", callee));
      push(Kind::Dictionary);
    } else if (callee == "torch._utils _rebuild_tensor_v2") {
      const bool fits = arguments.size() >= 4 && arguments[0]->kind == Kind::Storage &&
                        arguments[1]->kind == Kind::Integer && arguments[2]->kind == Kind::Tuple &&
                        arguments[3]->kind == Kind::Tuple;
      if (!fits) fail("a tensor is not described as torch does");
      PickleValue* tensor = push(Kind::Tensor);
      tensor->integer = arguments[1]->integer;
      tensor->items = {arguments[0], arguments[2], arguments[3]};
    } else if (callee == "torch._utils _rebuild_parameter") {
      const bool fits = arguments.size() == 3 && arguments[0]->kind == Kind::Tensor;
      if (!fits) fail("a parameter is not described as torch does");
      stack_.push_back(arguments[0]);
    } else {
      fail("a storage type is called");
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& label_;
  size_t position_ = 0;
  Pickle pickle_;
  std::vector<PickleValue*> stack_;
  std::map<uint64_t, PickleValue*> memo_;
};

}  // namespace

Pickle read_pickle(std::span<const std::byte> bytes, const std::string& label, size_t most_opcodes) {
  return Machine(bytes, label).run(most_opcodes);
}

}  // namespace degas
