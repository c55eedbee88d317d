#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/io/image.h"
#include "host/ops/image.h"

namespace degas {

/// A picture that an evaluation compares, and where in it the person and the face are.
struct EvaluatedPicture {
  std::string camera;
  int frame = 0;
  bool refined = false;  ///< drawn with a pose that training refined
  Rectangle person;
  std::optional<Rectangle> face, mouth;

  /// The stem of its files: "cam02_000012".
  std::string name() const;
};

/// What `degas eval` leaves on disk: metrics.json, per_frame.csv, boxes.json (the pictures with their boxes), truth/,
/// render/ and sheets/{camera}_{frame}.png, worst.png.
class EvaluationFolder {
 public:
  explicit EvaluationFolder(std::filesystem::path path) : path_(std::move(path)) {}

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path truth(const EvaluatedPicture& picture) const { return file("truth", picture); }
  std::filesystem::path render(const EvaluatedPicture& picture) const { return file("render", picture); }
  std::filesystem::path sheet(const EvaluatedPicture& picture) const { return file("sheets", picture); }

  void write_pictures(const std::vector<EvaluatedPicture>& pictures) const;
  /// Throws Error naming boxes.json and what is wrong with it.
  std::vector<EvaluatedPicture> read_pictures() const;
  void write_text(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path file(const char* folder, const EvaluatedPicture& picture) const {
    return path_ / folder / (picture.name() + ".png");
  }
  std::filesystem::path path_;
};

}  // namespace degas
