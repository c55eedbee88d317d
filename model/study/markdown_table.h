#pragma once

#include <string>
#include <vector>

namespace degas {

/// A table with its first row as heading: readable as text and by Markdown. The first column is aligned to the left,
/// the others to the right.
std::string markdown_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace degas
