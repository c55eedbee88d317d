#include "model/data/registration.h"

#include "host/error.h"
#include "host/io/checksum.h"
#include "host/io/mapped_file.h"
#include "model/data/smplx_parameters.h"
#include "model/data/wrapped_capture.h"

namespace degas {
namespace {

class RegisteredCapture final : public WrappedCapture {
 public:
  RegisteredCapture(std::unique_ptr<Capture> source, SmplxParameters parameters, std::string suffix)
      : WrappedCapture(std::move(source)), parameters_(std::move(parameters)), suffix_(std::move(suffix)) {}

  std::string identity() const override { return source().identity() + suffix_; }
  std::string picture_identity() const override { return source().picture_identity() + suffix_; }
  Pose pose(int frame) const override { return parameters_.poses.at(static_cast<size_t>(frame)); }
  std::vector<double> betas() const override { return parameters_.betas; }
  bool flat_hand_mean() const override { return parameters_.flat_hand_mean; }
  bool has_poses() const override { return true; }

 private:
  SmplxParameters parameters_;
  std::string suffix_;
};

/// What the file leaves unsaid is as in the capture's own.
SmplxConventions conventions_of(const Capture& capture) {
  SmplxConventions conventions;
  conventions.has_eye_poses = false;
  if (capture.has_poses()) conventions.flat_hand_mean = capture.flat_hand_mean();
  return conventions;
}

}  // namespace

std::unique_ptr<Capture> with_registration(std::unique_ptr<Capture> source, const std::filesystem::path& file,
                                           const std::function<void(const std::string&)>& warn) {
  SmplxParameters parameters = read_smplx_parameters(file, conventions_of(*source), warn);
  const auto rows = static_cast<int>(parameters.poses.size());
  if (rows != source->frame_count()) {
    throw Error::format("{}: has parameters of {} frames, the capture has {}; name a file made of this very capture",
                        file.string(), rows, source->frame_count());
  }
  for (int frame = 0; frame < rows; ++frame) {
    const int64_t named = parameters.frame_numbers[static_cast<size_t>(frame)];
    if (named == source->frame_number(frame)) continue;
    throw Error::format(
        "{}: row {} is of frame {} (by 'frames', or counted from 0 without), the capture's is {}; name a file made of "
        "this very capture",
        file.string(), frame, named, source->frame_number(frame));
  }
  const MappedFile bytes(file);
  std::string suffix = fmt::format(", registered by {:016x}", Checksum::of(bytes.bytes()));
  return std::make_unique<RegisteredCapture>(std::move(source), std::move(parameters), std::move(suffix));
}

}  // namespace degas
