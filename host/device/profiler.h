#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <string>
#include <utility>
#include <vector>

namespace degas {

/// Times launches by their OpenCL events, summed by kernel name.
class Profiler {
 public:
  struct Row {
    std::string kernel;
    size_t launches = 0;
    double milliseconds = 0;
  };

  /// Takes ownership of the event.
  void record(std::string kernel, cl_event event) { events_.emplace_back(std::move(kernel), event); }
  /// Rows since the last call, slowest first. All recorded work must have finished.
  std::vector<Row> take_rows();
  ~Profiler() { take_rows(); }

 private:
  std::vector<std::pair<std::string, cl_event>> events_;
};

}  // namespace degas
