#pragma once

namespace degas {

/// While one lives, Ctrl-C (SIGINT) and SIGTERM only set a flag, so that work can be saved; a second Ctrl-C ends the
/// program.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  static bool requested();
};

}  // namespace degas
