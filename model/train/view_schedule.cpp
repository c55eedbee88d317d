#include "model/train/view_schedule.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "host/random.h"

namespace degas {

ViewSchedule::ViewSchedule(std::vector<LoadRequest> views_of_frame, int views_per_step, uint64_t seed)
    : views_of_frame_(std::move(views_of_frame)), views_per_step_(views_per_step), seed_(seed) {
  if (views_of_frame_.empty()) throw std::logic_error("[view_schedule] no frame to train on");
}

LoadRequest ViewSchedule::plan(int64_t step) const {
  const int64_t epoch = step / steps_per_epoch();
  std::vector<size_t> order(views_of_frame_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  Random::of_step(seed_, 1, epoch).shuffle(order);
  const LoadRequest& views = views_of_frame_[order[step % steps_per_epoch()]];

  const auto count = static_cast<int64_t>(views.cameras.size());
  LoadRequest plan{views.frame, {}};
  // The frame has been visited `epoch` times, so its deck stands at this card. A view may come twice in a step only
  // where the deck ends within it, or when the frame has fewer cameras than a step wants; it is then left out.
  for (int64_t card = epoch * views_per_step_; card < (epoch + 1) * views_per_step_; ++card) {
    std::vector<int> deck = views.cameras;
    Random::of_step(seed_ ^ static_cast<uint64_t>(views.frame), 2, card / count).shuffle(deck);
    const int camera = deck[card % count];
    if (std::find(plan.cameras.begin(), plan.cameras.end(), camera) == plan.cameras.end())
      plan.cameras.push_back(camera);
  }
  return plan;
}

}  // namespace degas
