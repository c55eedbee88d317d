#include "host/device/profiler.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace degas {

std::vector<Profiler::Row> Profiler::take_rows() {
  std::map<std::tuple<std::string, bool, std::string>, Row> sums;
  for (const auto& [stage, kernel, event] : events_) {
    cl_ulong start = 0, end = 0;
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof(start), &start, nullptr);
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof(end), &end, nullptr);
    clReleaseEvent(event);
    Row& row = sums[{stage.name, stage.backward, kernel}];
    row.stage = stage;
    row.kernel = kernel;
    ++row.launches;
    row.milliseconds += static_cast<double>(end - start) * 1e-6;
  }
  events_.clear();
  std::vector<Row> rows;
  for (auto& [key, row] : sums) rows.push_back(row);
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.milliseconds > b.milliseconds; });
  return rows;
}

}  // namespace degas
