#pragma once

#include <string>
#include <vector>

namespace degas {

// Which frames and cameras of a capture are used. A selection is a list of single ones and of ranges FIRST:LAST:STRIDE;
// LAST is left out, and each of the three may be empty: "0,4,8:20:2", "cam00,cam03", "Cam001:Cam100:4", "::2". An empty
// list takes all. `option` is the option or key that the selection comes from: every Error begins with it, names the
// part that is wrong and says what there is. Nothing may be selected twice.

/// The parts of a selection typed as one text, split at commas; of "" none.
std::vector<std::string> selection_parts(const std::string& text);

/// Rows of a capture with `frame_count` frames, in the order of the selection.
std::vector<int> selected_frames(const std::vector<std::string>& parts, int frame_count, const std::string& option);

/// Indices of cameras by `names`, in the order of the selection; ranges go by the order of `names`.
std::vector<int> selected_cameras(const std::vector<std::string>& parts, const std::vector<std::string>& names,
                                  const std::string& option);

}  // namespace degas
