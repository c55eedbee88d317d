#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace degas {

/// A value of a pickle, as far as torch archives of tensors need them.
struct PickleValue {
  enum class Kind {
    None,
    Boolean,
    Integer,
    Float,
    Text,
    Bytes,
    Tuple,
    List,
    Dictionary,
    Global,
    Storage,
    Tensor,
    Mark
  };
  Kind kind = Kind::None;
  int64_t integer = 0;  ///< Integer, Boolean; Tensor: offset into its storage, in elements
  std::string text;     ///< Text; Global: "module name"
  /// Tuple, List; Dictionary: keys and values by turns; Storage: its description; Tensor: storage, sizes, strides
  std::vector<PickleValue*> items;
};

/// A pickle's values and which of them is the result. Values may be shared, even within themselves.
struct Pickle {
  std::vector<std::unique_ptr<PickleValue>> values;
  PickleValue* result = nullptr;
};

/// Interprets protocols 2 to 5 as far as torch.save uses them for plain data and tensors. No code is run: the only
/// callables are torch._utils._rebuild_tensor_v2, _rebuild_parameter and collections.OrderedDict, and storages are
/// named, not made; an argparse.Namespace, which trainers save beside their networks, is an empty dictionary. Error
/// beginning with `label` for every other global or opcode, for damaged data, and for more than `most_opcodes`: a byte
/// may ask for a value of a hundred.
Pickle read_pickle(std::span<const std::byte> bytes, const std::string& label, size_t most_opcodes);

}  // namespace degas
