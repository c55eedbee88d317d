#include "model/data/selected_capture.h"

#include <fmt/ranges.h>

#include "model/data/identity.h"
#include "model/data/wrapped_capture.h"

namespace degas {
namespace {

class SelectedCapture : public WrappedCapture {
 public:
  SelectedCapture(std::unique_ptr<Capture> whole, const std::vector<int>& frames, const std::vector<int>& cameras)
      : WrappedCapture(std::move(whole)), frames_(frames), cameras_(cameras) {
    for (const int camera : cameras_) names_.push_back(source().camera_names().at(static_cast<size_t>(camera)));
  }

  std::string identity() const override { return identity_of(source().identity()); }
  std::string picture_identity() const override { return identity_of(source().picture_identity()); }
  int frame_count() const override { return static_cast<int>(frames_.size()); }
  int64_t frame_number(int frame) const override { return source().frame_number(row(frame)); }
  const std::vector<std::string>& camera_names() const override { return names_; }
  Camera camera(int camera) const override { return source().camera(index(camera)); }
  bool has_image(int frame, int camera) const override { return source().has_image(row(frame), index(camera)); }
  Sample load(int frame, int camera) const override {
    Sample sample = source().load(row(frame), index(camera));
    sample.frame = frame;
    sample.camera = camera;
    return sample;
  }
  Pose pose(int frame) const override { return source().pose(row(frame)); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return source().face_code(row(frame), index(camera));
  }
  bool has_face_code(int frame, int camera) const override { return source().has_face_code(row(frame), index(camera)); }

 private:
  int row(int frame) const { return frames_.at(static_cast<size_t>(frame)); }
  int index(int camera) const { return cameras_.at(static_cast<size_t>(camera)); }
  std::string identity_of(const std::string& whole) const {
    Identity identity;
    identity.add(fmt::format("{} frames {} cameras {}", whole, fmt::join(frames_, ","), fmt::join(names_, ",")));
    return identity.text();
  }

  std::vector<int> frames_, cameras_;
  std::vector<std::string> names_;
};

bool is_all(const std::vector<int>& selection, size_t count) {
  if (selection.size() != count) return false;
  for (size_t i = 0; i < count; ++i)
    if (selection[i] != static_cast<int>(i)) return false;
  return true;
}

}  // namespace

std::unique_ptr<Capture> selected(std::unique_ptr<Capture> source, const std::vector<int>& frames,
                                  const std::vector<int>& cameras) {
  if (is_all(frames, static_cast<size_t>(source->frame_count())) && is_all(cameras, source->camera_names().size()))
    return source;
  return std::make_unique<SelectedCapture>(std::move(source), frames, cameras);
}

}  // namespace degas
