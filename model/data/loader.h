#pragma once

#include <any>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "model/data/capture.h"

namespace degas {

/// What one training step looks at: some cameras of one frame.
struct LoadRequest {
  int frame = 0;
  std::vector<int> cameras;
};

/// One step's data, ready before the step is.
struct LoadedStep {
  int64_t step = 0;
  LoadRequest request;
  std::vector<Sample> samples;  ///< one a camera of the request, in its order
  std::any maps;                ///< what Loader::Prepare made of them
};

/// Reads a capture on a thread of its own, up to `depth` steps ahead of the one that trains. What is delivered depends
/// on the step's number alone, never on timing: the schedule is a function of it.
class Loader {
 public:
  using Schedule = std::function<LoadRequest(int64_t step)>;
  /// Runs on the loader's thread, so it may not touch the device; empty: nothing is prepared.
  using Prepare = std::function<std::any(int64_t step, const LoadRequest&, const std::vector<Sample>&)>;

  /// Delivers steps first_step .. end_step - 1. The capture must outlive the loader.
  Loader(const Capture& capture, Schedule schedule, Prepare prepare, int64_t first_step, int64_t end_step,
         int depth = 4);
  /// Stops the thread after the picture it is at.
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  /// The next step in order; waits for it. What the thread threw at that step is thrown here, and again at every later
  /// call. std::logic_error after the last step.
  LoadedStep next();

 private:
  void work(int64_t first_step);
  LoadedStep load(int64_t step) const;

  const Capture& capture_;
  Schedule schedule_;
  Prepare prepare_;
  int64_t next_step_, end_step_;
  size_t depth_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<LoadedStep> ready_;
  std::exception_ptr failure_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace degas
