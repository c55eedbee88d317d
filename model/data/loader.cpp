#include "model/data/loader.h"

#include <algorithm>
#include <stdexcept>

namespace degas {

Loader::Loader(const Capture& capture, Schedule schedule, Prepare prepare, int64_t first_step, int64_t end_step,
               int depth)
    : capture_(capture),
      schedule_(std::move(schedule)),
      prepare_(std::move(prepare)),
      next_step_(first_step),
      end_step_(end_step),
      depth_(static_cast<size_t>(std::max(1, depth))),
      thread_([this, first_step] { work(first_step); }) {}

Loader::~Loader() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

LoadedStep Loader::load(int64_t step) const {
  LoadedStep loaded{step, schedule_(step), {}, {}};
  for (const int camera : loaded.request.cameras) loaded.samples.push_back(capture_.load(loaded.request.frame, camera));
  if (prepare_) loaded.maps = prepare_(step, loaded.request, loaded.samples);
  return loaded;
}

void Loader::work(int64_t first_step) {
  for (int64_t step = first_step; step < end_step_; ++step) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stopping_ || ready_.size() < depth_; });
      if (stopping_) return;
    }
    try {
      LoadedStep loaded = load(step);
      const std::lock_guard lock(mutex_);
      ready_.push_back(std::move(loaded));
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
    changed_.notify_all();
    const std::lock_guard lock(mutex_);
    if (failure_) return;
  }
}

LoadedStep Loader::next() {
  std::unique_lock lock(mutex_);
  if (next_step_ >= end_step_) throw std::logic_error("[loader] no step is left");
  changed_.wait(lock, [this] { return !ready_.empty() || failure_; });
  if (ready_.empty()) std::rethrow_exception(failure_);
  LoadedStep loaded = std::move(ready_.front());
  ready_.pop_front();
  ++next_step_;
  lock.unlock();
  changed_.notify_all();
  return loaded;
}

}  // namespace degas
