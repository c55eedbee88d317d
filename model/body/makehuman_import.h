#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "model/body/body_npz.h"

namespace degas {

/// The files that a body is made of. MakeHuman's are CC0; see docs/bodies.md.
struct MakeHumanSource {
  std::filesystem::path base;     ///< base.obj: decimetres, Y up, facing +Z
  std::filesystem::path rig;      ///< default.mhskel
  std::filesystem::path weights;  ///< default_weights.mhw
  /// Targets that shape the body, with the weight of each: sex, build, proportions.
  std::vector<std::pair<std::filesystem::path, double>> shapes;
  std::filesystem::path targets;  ///< folder whose *.target become columns of expression; empty: none
};

struct MakeHumanBody {
  BodyArrays arrays;
  std::vector<std::string> expression_names;  ///< of the targets, in order of the columns: that of the names
};

/// A body in SMPL-X's 55 joints: the skin, eyes, teeth and tongue of the base mesh (its other helpers and joint cubes
/// are left out), its vertices in their order, shaped, in metres, standing on y = 0; quads as two triangles. A bone
/// moves the SMPL-X joint of its nearest ancestor that has one (docs/bodies.md lists them); joints lie where their
/// bones' heads do and are regressed from the skin around them. The atlas is packed anew, the head in its top-left
/// quarter. Error naming file and key for what does not fit together.
MakeHumanBody import_makehuman(const MakeHumanSource& source);

}  // namespace degas
