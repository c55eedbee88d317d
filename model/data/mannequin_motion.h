#pragma once

#include <cstdint>

#include "model/data/mannequin_clothes.h"

namespace degas {

/// Training: arms, legs, torso and head through their range, a tour of expressions, then talking. Novel: gestures of a
/// conversation and other talking, within the training motion's range.
enum class MannequinSequence { Training, Novel };

/// The subject at `time` in 0..1 of a sequence; smooth in time, the lower foot on the floor, determined by the seed.
MannequinPose mannequin_motion(MannequinSequence sequence, double time, uint64_t seed,
                               const MannequinSkeleton& skeleton);

}  // namespace degas
