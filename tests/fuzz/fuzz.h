#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "tests/fuzz/mutation.h"

namespace degas::test {

/// The pieces of an input by name. They are damaged one by one, so that what stands around them (an archive, a
/// checksum, the other files of a folder) is whole and lets the damage in.
using Parts = std::map<std::string, Bytes>;

/// A reader and what it reads.
struct FuzzTarget {
  std::string input;         ///< name of the file, with its extension, or of the folder
  std::vector<Parts> seeds;  ///< valid inputs, each of one or more parts
  /// Makes an input of its parts. Empty: the one part is the file.
  std::function<void(const Parts&, const std::filesystem::path&)> write = {};
  std::function<void(const std::filesystem::path&)> read;  ///< as degas does, to the last byte that it would look at
  int rounds = 300;
  bool never_refuses = false;  ///< damage is taken for absence: not even an Error is right
};

/// Memory beyond four times the input that a reader may hold at once: what small inputs need in any case.
inline constexpr size_t free_bytes = size_t{32} << 20;

/// What is wrong with how `read` takes the input, "" when nothing: it must succeed, or throw an Error that names the
/// input, within ten seconds of the processor and with 4 x the input's bytes + free_bytes of memory from operator
/// new at most.
std::string fault_of(const FuzzTarget& target, const std::filesystem::path& input, bool* was_refused = nullptr);

/// An input of a search as parts: the number of a seed (one byte), that of its part, the bytes in that part's place.
/// What a short one lacks is 0.
Parts parts_of_input(const FuzzTarget& target, std::span<const std::byte> input);

/// Reads the seeds, which must succeed, the inputs kept of earlier searches, then so many damaged ones, and fails the
/// test case for every fault with what repeats it. DEGAS_FUZZ_FACTOR multiplies the rounds; DEGAS_FUZZ_ROUND=N runs
/// that round alone and keeps its input. DEGAS_FUZZ_LIST: prints the target's name and does nothing more.
/// DEGAS_FUZZ_CORPUS=FOLDER: hands the target to libFuzzer instead, see fuzz_by_coverage; DEGAS_FUZZ_TARGET=NAME: this
/// one alone; DEGAS_FUZZ_KEEP=FOLDER: searches no more but keeps there what the corpus holds of it, see keep_inputs.
void fuzz(const FuzzTarget& target);

/// libFuzzer's search for inputs that reach new code, DEGAS_FUZZ_SECONDS (600) long, and ends the program. What it goes
/// on from and finds lies in corpus/NAME, one file an input as parts_of_input takes it.
/// One that shows a fault is left there as fault-*, and its files in corpus/now. Throws std::logic_error where the
/// program is built without libFuzzer.
[[noreturn]] void fuzz_by_coverage(const FuzzTarget& target, const std::filesystem::path& corpus);

/// The files that a target reads, made of parts.
void write_input(const FuzzTarget& target, const Parts& parts, const std::filesystem::path& path);

Bytes bytes_of(const std::string& text);
/// A seed of one part: a file's bytes.
Parts whole(Bytes bytes);
Parts whole_file(const std::filesystem::path& path);

/// For FuzzTarget::write: the parts are entries of a stored zip archive; files of a folder.
void write_archive(const Parts& parts, const std::filesystem::path& path);
void write_folder(const Parts& parts, const std::filesystem::path& path);
/// The entries of an archive, the files of a folder.
Parts archive_parts(const std::filesystem::path& path);
Parts folder_parts(const std::filesystem::path& path);

}  // namespace degas::test
