#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/device/tuning_table.h"
#include "host/io/checkpoint.h"
#include "model/config.h"

namespace degas {

/// What a training run leaves on disk: config.json (every key), body.npz (a copy of the body model, so that a run is
/// complete in itself), history.jsonl (one JSON object a line), checkpoint.bin (the newest state),
/// checkpoint.previous.bin (the one before, for when a disk damages the newest) and, where kernels were tuned,
/// tuning.json (the choices of parameters that it was trained with).
class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) {}

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path config_file() const { return path_ / "config.json"; }
  std::filesystem::path body_file() const { return path_ / "body.npz"; }
  std::filesystem::path history_file() const { return path_ / "history.jsonl"; }
  std::filesystem::path checkpoint_file() const { return path_ / "checkpoint.bin"; }
  std::filesystem::path previous_checkpoint_file() const { return path_ / "checkpoint.previous.bin"; }
  std::filesystem::path tuning_file() const { return path_ / "tuning.json"; }
  /// How the run was tuned; Off where it was not.
  TuneMode tuning() const;
  bool has_checkpoint() const {
    return std::filesystem::exists(checkpoint_file()) || std::filesystem::exists(previous_checkpoint_file());
  }

  /// Makes the folder with its config and body. Throws Error when it already holds a checkpoint (remedy: --resume or
  /// another --out) or cannot be written.
  void create(const Config& config, const std::filesystem::path& body) const;
  /// Writes config.json anew, for a run that goes on with another length.
  void write_config(const Config& config) const;
  /// Throws Error when `body` is missing or is not the one that the run was created with.
  void require_same_body(const std::filesystem::path& body) const;
  /// Throws Error naming the folder and the file it lacks.
  void require_trained() const;

  /// Writes checkpoint.bin; the one that stood there becomes the previous. Throws Error when the disk refuses.
  void save(const Checkpoint& checkpoint) const;
  /// checkpoint.bin, or the previous one with a warning where that cannot be read. Throws Error naming what is wrong
  /// with checkpoint.bin where neither can.
  Checkpoint newest_checkpoint() const;
  /// The same for training to go on from: a damaged checkpoint.bin is renamed to checkpoint.damaged.bin, so that the
  /// next save does not put it in the place of the good one.
  Checkpoint checkpoint_to_resume() const;

  /// Removes what a killed run was about to write: a checkpoint's first half may be as large as the whole.
  void remove_leftovers() const;
  /// Drops the lines of history.jsonl after `step`, so that a resumed run continues the record of its checkpoint.
  void truncate_history(int64_t step) const;
  /// Throws Error when the disk refuses.
  void append_history(const nlohmann::json& line) const;

 private:
  Checkpoint read_newest(bool* is_damaged) const;

  std::filesystem::path path_;
};

}  // namespace degas
