#pragma once

#include "model/data/capture.h"
#include "model/study/variant.h"

namespace degas {

/// encoders | views | face | losses | size | stability
std::vector<std::string> study_names();

/// The variants of one of the paper's studies around `base`; the first is the one that the others are compared with.
/// * encoders: all, and each of those that the base uses off
/// * views: all training cameras, and 12, 6 and 3 of them, spread evenly around the person
/// * face: the base's signal, and the others of code, expression, mesh, none
/// * losses: all terms, and each that the base uses off; the perceptual loss on where the base has none
/// * size: the base, and its width and resolution halved and doubled
/// * stability: the base on the capture as recorded, with and without a ramp of the learning rate, and on it with a bad
///   registration, wrong masks and missing codes (CorruptionConfig); of several seeds the worst one counts
/// Error when the base leaves nothing to compare.
std::vector<Variant> study_variants(const std::string& study, const Variant& base, const Capture& capture);

/// Of a study's variants the first, which the others are compared with, and those named. Error for an unknown name.
std::vector<Variant> named_variants(const std::vector<Variant>& variants, const std::vector<std::string>& names);

/// `count` of these cameras, spread evenly around the person: exchanges lower the sum of inverse squared distances
/// between their directions from the person in the first frame, until none lowers it. In the order of the list.
std::vector<int> spread_cameras(const std::vector<int>& cameras, const Capture& capture, int count);

}  // namespace degas
