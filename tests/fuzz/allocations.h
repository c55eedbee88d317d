#pragma once

#include <cstddef>

namespace degas::test {

/// Counts what this program takes by operator new while it lives, and lets nothing go beyond a limit: the request that
/// would is refused by std::bad_alloc, so that an absurd size is seen and costs nothing. One at a time.
class AllocationLimit {
 public:
  /// live_bytes: that may be held at once, above what is held now.
  explicit AllocationLimit(size_t live_bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;

  /// Most bytes that were held at once, the refused request included.
  size_t peak_bytes() const;
  /// Was a request refused, whoever caught what it threw?
  bool was_exceeded() const;
};

}  // namespace degas::test
