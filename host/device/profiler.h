#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <string>
#include <vector>

namespace degas {

/// What launches are part of: a stage of a step, forward or (set by the tape) backward.
struct Stage {
  const char* name = "";  ///< a literal
  bool backward = false;
};

/// Times commands by their OpenCL events, summed by stage and kernel.
class Profiler {
 public:
  struct Row {
    Stage stage;
    std::string kernel;  ///< "file/name" of a kernel; "memory/fill", "memory/copy", "memory/upload"
    size_t launches = 0;
    double milliseconds = 0;
  };

  /// Takes ownership of the event. kernel: stays where it is.
  void record(Stage stage, const char* kernel, cl_event event) { events_.push_back({stage, kernel, event}); }
  /// Rows since the last call, slowest first. All recorded work must have finished.
  std::vector<Row> take_rows();
  ~Profiler() { take_rows(); }

 private:
  struct Recorded {
    Stage stage;
    const char* kernel;
    cl_event event;
  };
  std::vector<Recorded> events_;
};

}  // namespace degas
