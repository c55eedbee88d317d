#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/mutation.h"

namespace degas::test {

/// The folder corpus/ beside this file.
std::filesystem::path kept_inputs_folder();

/// What earlier searches found to reach something new, for a target: TARGET.zip in a folder, in the order
/// of size; an archive of one entry, each input with its length (four bytes, the lowest first) before it. Empty where
/// there is none.
std::vector<Bytes> kept_inputs(const std::string& target, const std::filesystem::path& folder = kept_inputs_folder());

/// Writes the files of a search's folder (but for its seed-* and fault-*) as TARGET.zip into another one. The same
/// files make the same bytes; none make no archive.
void keep_inputs(const std::filesystem::path& from, const std::string& target, const std::filesystem::path& folder);

}  // namespace degas::test
