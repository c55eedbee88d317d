#include "host/io/torch_archive.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <utility>

#include "host/error.h"
#include "host/io/pickle.h"
#include "host/io/zip_archive.h"

namespace degas {
namespace {

using Kind = PickleValue::Kind;

constexpr std::array<std::pair<const char*, const char*>, 9> storage_types = {{{"FloatStorage", "<f4"},
                                                                               {"DoubleStorage", "<f8"},
                                                                               {"HalfStorage", "<f2"},
                                                                               {"LongStorage", "<i8"},
                                                                               {"IntStorage", "<i4"},
                                                                               {"ShortStorage", "<i2"},
                                                                               {"CharStorage", "|i1"},
                                                                               {"ByteStorage", "|u1"},
                                                                               {"BoolStorage", "|b1"}}};

constexpr size_t longest_name = 1024;  ///< of a tensor, the dictionaries that it is in included

/// Collects the tensors of a pickled value.
class TensorCollector {
 public:
  TensorCollector(const ZipReader& archive, std::string prefix) : archive_(archive), prefix_(std::move(prefix)) {}

  void collect(const PickleValue& value, const std::string& name, int depth) {
    // Values may contain themselves or each other many times over.
    if (depth > 16 || ++visited_ > 1'000'000) fail(name, "is nested too deeply");
    if (name.size() > longest_name) fail(name.substr(0, 40), "and so on is too long for a name");
    if (value.kind == Kind::Tensor) {
      if (!tensors_.emplace(name, tensor(value, name)).second) fail(name, "is there twice");
    } else if (value.kind == Kind::Dictionary) {
      for (size_t i = 0; i < value.items.size(); i += 2) {
        const PickleValue& key = *value.items[i];
        if (key.kind != Kind::Text && key.kind != Kind::Integer) continue;
        if (key.text.size() > longest_name) fail(key.text.substr(0, 40), "and so on is too long for a name");
        const std::string part = key.kind == Kind::Text ? key.text : std::to_string(key.integer);
        collect(*value.items[i + 1], name.empty() ? part : name + "." + part, depth + 1);
      }
    }
  }
  TorchTensors take() { return std::move(tensors_); }

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& reason) const {
    throw Error::format("{}: '{}': {}", archive_.label(), name, reason);
  }

  std::vector<int64_t> sizes(const PickleValue& tuple, const std::string& name) const {
    std::vector<int64_t> out;
    for (const PickleValue* item : tuple.items) {
      if (item->kind != Kind::Integer || item->integer < 0) fail(name, "has a size or stride that is none");
      out.push_back(item->integer);
    }
    if (out.size() > 16) fail(name, "has more than 16 axes");
    return out;
  }

  NpyArray tensor(const PickleValue& value, const std::string& name) {
    const PickleValue& storage = *value.items[0];
    const std::string type = storage.items[1]->text.substr(storage.items[1]->text.find(' ') + 1);
    const auto* known =
        std::find_if(storage_types.begin(), storage_types.end(), [&](const auto& t) { return t.first == type; });
    if (known == storage_types.end()) fail(name, fmt::format("has elements of {}, which are not read", type));
    const size_t item = static_cast<size_t>(known->second[2] - '0');
    const std::vector<std::byte>& bytes = storage_bytes(storage.items[2]->text);
    const auto count = static_cast<int64_t>(bytes.size() / item);

    NpyArray array{sizes(*value.items[1], name), known->second, {}, fmt::format("{}: '{}'", archive_.label(), name)};
    const std::vector<int64_t> strides = sizes(*value.items[2], name);
    if (strides.size() != array.shape.size()) fail(name, "has other numbers of sizes and strides");
    int64_t elements = 1, last = value.integer;
    bool fits = last >= 0 && last <= count;
    const bool is_empty = std::find(array.shape.begin(), array.shape.end(), 0) != array.shape.end();
    for (size_t axis = 0; fits && !is_empty && axis < strides.size(); ++axis) {
      // An expanded tensor (stride 0) would claim more elements than were stored; each factor stays below 2^31.
      fits = array.shape[axis] <= count && strides[axis] <= count && elements <= count / array.shape[axis] &&
             (array.shape[axis] == 1 || strides[axis] == 0 || array.shape[axis] - 1 <= (count - last) / strides[axis]);
      if (fits) {
        elements *= array.shape[axis];
        last += (array.shape[axis] - 1) * strides[axis];
      }
    }
    if (!fits || (!is_empty && last >= count)) fail(name, "does not fit its storage; the file is damaged");
    if (is_empty) {
      for (const int64_t size : array.shape)
        if (size > count + 1) fail(name, "does not fit its storage");
    } else {
      // Tensors may share a storage; as often as that is no sharing.
      gathered_bytes_ += static_cast<size_t>(elements) * item;
      if (gathered_bytes_ / 4 > archive_.bytes()) fail(name, "and others claim their storages many times over");
      array.data = gather(bytes, item, array.shape, strides, value.integer, elements);
    }
    return array;
  }

  const std::vector<std::byte>& storage_bytes(const std::string& key) {
    auto found = storages_.find(key);
    if (found == storages_.end()) found = storages_.emplace(key, archive_.read(prefix_ + "data/" + key)).first;
    return found->second;
  }

  static std::vector<std::byte> gather(const std::vector<std::byte>& source, size_t item, const Shape& shape,
                                       const std::vector<int64_t>& strides, int64_t offset, int64_t elements) {
    std::vector<std::byte> out(static_cast<size_t>(elements) * item);
    std::vector<int64_t> index(shape.size(), 0);
    for (size_t to = 0; to < out.size(); to += item) {
      std::memcpy(out.data() + to, source.data() + static_cast<size_t>(offset) * item, item);
      for (size_t axis = shape.size(); axis-- > 0;) {
        offset += strides[axis];
        if (++index[axis] < shape[axis]) break;
        offset -= strides[axis] * shape[axis];
        index[axis] = 0;
      }
    }
    return out;
  }

  const ZipReader& archive_;
  std::string prefix_;
  std::map<std::string, std::vector<std::byte>> storages_;
  TorchTensors tensors_;
  size_t gathered_bytes_ = 0;  // of tensors made up to now
  int visited_ = 0;
};

/// What torch.save wrote before version 1.6, and pickle.dump ever.
void require_no_bare_pickle(char first_byte, const std::string& label) {
  constexpr char protocol = '\x80';
  if (first_byte != protocol) return;
  throw Error::format(
      "{}: is a bare pickle, not a torch archive (of torch 1.6 and later); load it there and torch.save its tensors "
      "again",
      label);
}

TorchTensors read(const ZipReader& archive) {
  std::string prefix;
  bool found = false;
  for (const std::string& name : archive.names()) {
    if (name != "data.pkl" && !name.ends_with("/data.pkl")) continue;
    prefix = name.substr(0, name.size() - std::strlen("data.pkl"));
    found = true;
    break;
  }
  if (!found) throw Error::format("{}: is no torch archive: it has no data.pkl", archive.label());
  if (archive.contains(prefix + "byteorder")) {
    const std::vector<std::byte> order = archive.read(prefix + "byteorder");
    if (std::string_view(reinterpret_cast<const char*>(order.data()), order.size()) != "little") {
      throw Error::format("{}: was saved on a big-endian machine, which is not read", archive.label());
    }
  }
  // An opcode may make a value of a hundred bytes. A tensor takes about 40 opcodes and, with a storage of its own, no
  // less than 300 bytes; views of one storage, or lists of numbers, live on what any archive may have.
  const size_t most_opcodes = (size_t{1} << 17) + archive.bytes() / 32;
  const Pickle pickle = read_pickle(archive.read(prefix + "data.pkl"), archive.label(), most_opcodes);
  TensorCollector collector(archive, prefix);
  collector.collect(*pickle.result, "", 0);
  TorchTensors tensors = collector.take();
  if (tensors.empty()) throw Error::format("{}: holds no tensor", archive.label());
  return tensors;
}

}  // namespace

TorchTensors read_torch_archive(const std::filesystem::path& path) {
  char first = 0;
  std::ifstream(path, std::ios::binary).read(&first, 1);
  require_no_bare_pickle(first, path.string());
  return read(ZipReader(path));
}

TorchTensors read_torch_archive(std::vector<std::byte> bytes, const std::string& label) {
  if (!bytes.empty()) require_no_bare_pickle(static_cast<char>(bytes.front()), label);
  return read(ZipReader(std::move(bytes), label));
}

std::vector<std::byte> make_torch_archive(const TorchTensors& tensors, const std::string& name) {
  std::string pickle = "\x80\x02}(";
  const auto integer = [&](int64_t value) {
    pickle += "\x8a\x08";
    for (int i = 0; i < 8; ++i) pickle += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i));
  };
  const auto text = [&](const std::string& value) {
    pickle += 'X';
    for (int i = 0; i < 4; ++i) pickle += static_cast<char>(value.size() >> (8 * i));
    pickle += value;
  };
  std::vector<ZipEntry> entries(1);
  for (const auto& [key, array] : tensors) {
    const auto* known = std::find_if(storage_types.begin(), storage_types.end(),
                                     [&dtype = array.dtype](const auto& t) { return t.second == dtype; });
    if (known == storage_types.end()) throw std::logic_error("[torch archive] no tensor holds " + array.dtype);
    const std::string storage = std::to_string(entries.size() - 1);
    text(key);
    pickle += "ctorch._utils\n_rebuild_tensor_v2\n((";
    text("storage");
    pickle += std::string("ctorch\n") + known->first + "\n";
    text(storage);
    text("cpu");
    integer(element_count(array.shape));
    pickle += "tQ";
    integer(0);
    pickle += '(';
    for (const int64_t size : array.shape) integer(size);
    pickle += "t(";
    for (size_t axis = 0; axis < array.shape.size(); ++axis) {
      integer(element_count(Shape(array.shape.begin() + static_cast<ptrdiff_t>(axis) + 1, array.shape.end())));
    }
    pickle +=
        "t\x89"
        "ccollections\nOrderedDict\n)RtR";
    entries.push_back({name + "/data/" + storage, array.data});
  }
  pickle += "u.";
  const auto bytes_of = [](const std::string& value) {
    const auto bytes = std::as_bytes(std::span<const char>(value));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  };
  entries[0] = {name + "/data.pkl", bytes_of(pickle)};
  entries.push_back({name + "/version", bytes_of("3\n")});
  return make_zip(entries, false);
}

}  // namespace degas
