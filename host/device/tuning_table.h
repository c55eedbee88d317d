#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace degas {

/// Launch and build parameters of a kernel, by name.
using Parameters = std::map<std::string, int>;
/// "pixels=6 vectors=2"
std::string to_string(const Parameters& parameters);

/// How hard `degas --tune` looks: not at all, a few candidates for each launch, or every one, timed for longer.
enum class TuneMode { Off, Fast, Full };

/// What the best parameters of a launch depend on.
struct TuningKey {
  std::string device, driver;
  std::string kernel, shape;
  std::string source;  ///< hash of the kernel's text
};

/// Parameters that were found best, and the times that say so.
struct TuningChoice {
  Parameters parameters;
  TuneMode mode = TuneMode::Fast;
  double milliseconds = 0, default_milliseconds = 0;
};

/// Choices in a JSON file. Its text is {"version": 1, "choices": [{"device", "driver", "kernel", "shape", "source",
/// "parameters": {NAME: NUMBER}, "mode", "ms", "default_ms"}]}. Choices of other devices and drivers stay beside each
/// other; one of another source is replaced. Any number of processes may share a file without locks: each writes what
/// the file holds by then and what it knows itself, and readers see whole files. Of two that write at the same moment
/// the later may leave out what the earlier has added; that is back when the earlier adds again, or is found anew by
/// whoever needs it.
class TuningTable {
 public:
  /// Reads the file, if there is one. A damaged one counts as empty, is said to be so on standard error, and is
  /// written anew by the next add().
  explicit TuningTable(std::filesystem::path file);

  std::optional<TuningChoice> find(const TuningKey& key) const;
  /// False where the file cannot be written; the choice is kept in memory all the same.
  bool add(const TuningKey& key, const TuningChoice& choice);
  /// The hardest that any of the choices was looked for; none in an empty table.
  std::optional<TuneMode> mode() const;
  size_t size() const { return choices_.size(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  struct Entry {
    TuningKey key;
    TuningChoice choice;
  };
  using Entries = std::map<std::string, Entry>;  // by all of the key but the source
  Entries read();
  static std::string text(const Entries& entries);

  std::filesystem::path file_;
  bool damage_told_ = false;
  Entries choices_, added_;
};

}  // namespace degas
