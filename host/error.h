#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace degas {

/// A fault of the input or the machine that the user can mend: the message is one line that names what, where
/// and the remedy. The command line prints it and exits with code 2. A broken invariant of ours is std::logic_error.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}

  /// Error::format("{}: no camera '{}'; cameras here: {}", file, name, list)
  template <typename... Arguments>
  static Error format(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
    return Error(fmt::format(text, std::forward<Arguments>(arguments)...));
  }
};

}  // namespace degas
