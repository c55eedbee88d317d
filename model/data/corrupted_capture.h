#pragma once

#include <memory>

#include "model/config.h"
#include "model/data/capture.h"

namespace degas {

/// Whether anything is to be wrong.
bool corrupts(const CorruptionConfig& corruption);

/// The capture as a bad tracker, segmenter and face encoder would have delivered it: what `degas ablate --study
/// stability` trains on. What is wrong where is a function of its seed alone: a run goes on with what it began, and
/// runs of other seeds meet the same.
///
/// * registration_degrees, registration_metres: in every frame each joint is turned by an angle up to the one, and the
///   body moved by a length up to the other, evenly spread and of any direction. Fingers given by principal components
///   keep theirs.
/// * wrong_masks: the share of pictures whose mask is shifted by a sixteenth of the picture's height, lacks a rectangle
///   of a quarter of its height and width, or has such a rectangle too much, grey, as if furniture were taken for the
///   person: a third of them each.
/// * missing_codes: the share of frames without a face code in any camera.
///
/// identity() changes with what is wrong; picture_identity() does not, as the recording is the same. The source itself
/// comes back where nothing is to be wrong.
std::unique_ptr<Capture> corrupted(std::unique_ptr<Capture> source, const CorruptionConfig& corruption);

}  // namespace degas
