#pragma once

#include <chrono>
#include <string>

namespace degas {

/// One line that is redrawn on a terminal, or a plain line now and then where the output is a file.
class Progress {
 public:
  /// Shows a bar at `fraction` (0..1) with the text behind it and the time left, estimated from the fraction gained
  /// since the start.
  void show(double fraction, const std::string& text);
  /// Ends the line.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now(), last_shown_{};
  double first_fraction_ = -1;
  bool open_ = false;
};

/// "1:02:03" or "2:03".
std::string clock_text(double seconds);

}  // namespace degas
