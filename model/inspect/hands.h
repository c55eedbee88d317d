#pragma once

#include <optional>
#include <string>

#include "model/body/body_model.h"
#include "model/inspect/silhouette.h"

namespace degas {

/// How well hands cover those in the masks: sums over hands, with the finger angles as the capture says them to be
/// meant (flat_hand_mean) and the other way.
struct HandFit {
  int hands = 0;
  double as_registered = 0, otherwise = 0;

  HandFit& operator+=(const HandFit& more);
  /// What is wrong, in words, where the other way fits clearly better.
  std::optional<std::string> verdict(bool flat_hand_mean) const;
};

/// Compares both ways within the boxes around the hands of one picture; hands that reach out of it are left out.
HandFit compare_hands(const BodyModel& body, const BodySurface& as_registered, const BodySurface& otherwise,
                      const Camera& view, const Image8& mask);

}  // namespace degas
