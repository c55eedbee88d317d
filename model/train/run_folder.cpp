#include "model/train/run_folder.h"

#include <fstream>
#include <string>

#include "host/error.h"
#include "host/io/file_bytes.h"

namespace degas {

namespace fs = std::filesystem;

void RunFolder::create(const Config& config, const fs::path& body) const {
  if (has_checkpoint()) {
    throw Error::format("{}: already holds a trained run; continue it with --resume, or name another folder with --out",
                        path_.string());
  }
  std::error_code failure;
  fs::create_directories(path_, failure);
  if (failure) throw Error::format("{}: cannot be made: {}", path_.string(), failure.message());
  fs::copy_file(body, body_file(), fs::copy_options::overwrite_existing, failure);
  if (failure) throw Error::format("{}: cannot be copied to {}: {}", body.string(), path_.string(), failure.message());
  // The body may come from a read-only place; its copy must not hinder a later run into the same folder.
  fs::permissions(body_file(), fs::perms::owner_write, fs::perm_options::add, failure);
  write_config(config);
  std::ofstream(history_file(), std::ios::trunc);
  fs::remove(tuning_file(), failure);
}

TuneMode RunFolder::tuning() const {
  return TuningTable(tuning_file()).mode().value_or(TuneMode::Off);
}

void RunFolder::write_config(const Config& config) const {
  const std::string text = config_text(config) + '\n';
  write_text(config_file(), text);
}

void RunFolder::require_same_body(const fs::path& body) const {
  require_trained();
  if (read_file_bytes(body) != read_file_bytes(body_file())) {
    throw Error::format("{}: is another body than the run was trained with; give that one (a copy is {})",
                        body.string(), body_file().string());
  }
}

void RunFolder::require_trained() const {
  const char* missing = !has_checkpoint() ? "checkpoint.bin" : !fs::exists(body_file()) ? "body.npz" : nullptr;
  if (missing) {
    throw Error::format("{}: no {}: not the folder of a trained run (degas train --out)", path_.string(), missing);
  }
}

void RunFolder::save(const Checkpoint& checkpoint) const {
  write_checkpoint(checkpoint_file(), checkpoint, previous_checkpoint_file());
}

Checkpoint RunFolder::read_newest(bool* is_damaged) const {
  *is_damaged = false;
  try {
    return read_checkpoint(checkpoint_file());
  } catch (const Error& damage) {
    if (!fs::exists(previous_checkpoint_file())) throw;
    Checkpoint previous;
    try {
      previous = read_checkpoint(previous_checkpoint_file());
    } catch (const Error&) {
      throw damage;
    }
    *is_damaged = true;
    fmt::print(stderr, "warning: {}; going back to the one before, {}, step {}\n", damage.what(),
               previous_checkpoint_file().filename().string(), previous.header.value("step", nlohmann::json()).dump());
    return previous;
  }
}

Checkpoint RunFolder::newest_checkpoint() const {
  bool is_damaged;
  return read_newest(&is_damaged);
}

Checkpoint RunFolder::checkpoint_to_resume() const {
  bool is_damaged;
  Checkpoint checkpoint = read_newest(&is_damaged);
  if (is_damaged && fs::exists(checkpoint_file())) fs::rename(checkpoint_file(), path_ / "checkpoint.damaged.bin");
  return checkpoint;
}

void RunFolder::remove_leftovers() const {
  for (const fs::path& file :
       {checkpoint_file(), previous_checkpoint_file(), config_file(), history_file(), tuning_file()}) {
    remove_leftovers_of(file);
  }
}

void RunFolder::truncate_history(int64_t step) const {
  std::ifstream stream(history_file());
  std::string kept;
  for (std::string line; std::getline(stream, line);) {
    const nlohmann::json row = nlohmann::json::parse(line, nullptr, false);
    // A line cut by a kill does not parse: what follows it cannot be trusted either.
    if (!row.is_object() || !row.contains("step") || !row["step"].is_number_integer()) break;
    if (row["step"].get<int64_t>() > step) break;
    kept += line + '\n';
  }
  stream.close();
  write_text(history_file(), kept);
}

void RunFolder::append_history(const nlohmann::json& line) const {
  std::ofstream stream(history_file(), std::ios::app);
  stream << line.dump() << '\n' << std::flush;
  if (!stream) throw Error::format("{}: cannot be written; is the disk full?", history_file().string());
}

}  // namespace degas
