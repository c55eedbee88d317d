#pragma once

namespace degas {

/// The commit that this program was built from, "-dirty" behind it where the tree had changes; the project's version
/// where there is no git.
const char* version();

}  // namespace degas
