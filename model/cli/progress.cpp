#include "model/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace degas {

std::string clock_text(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

void Progress::show(double fraction, const std::string& text) {
  const bool terminal = isatty(STDOUT_FILENO);
  const auto now = Clock::now();
  if (first_fraction_ < 0) first_fraction_ = fraction;
  if (fraction < 1 && now - last_shown_ < (terminal ? std::chrono::milliseconds(200) : std::chrono::seconds(15)))
    return;
  last_shown_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double gained = fraction - first_fraction_;
  const std::string left = gained > 0 ? clock_text(elapsed * (1 - fraction) / gained) : std::string("?");
  constexpr int width = 24;
  const int filled = std::clamp(static_cast<int>(fraction * width), 0, width);
  const std::string line = fmt::format("[{}{}] {:3.0f}%  {}  ETA {}", std::string(filled, '#'),
                                       std::string(width - filled, '.'), 100 * fraction, text, left);
  std::printf(terminal ? "\r\033[K%s" : "%s\n", line.c_str());
  std::fflush(stdout);
  open_ = terminal;
}

void Progress::finish() {
  if (open_) std::printf("\n");
  open_ = false;
}

}  // namespace degas
