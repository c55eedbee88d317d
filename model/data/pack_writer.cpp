#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npy.h"
#include "model/data/pack_header.h"
#include "model/data/person_pixels.h"

namespace degas {
namespace {

class PackWriter {
 public:
  PackWriter(const std::filesystem::path& path, const Capture& capture, const PackOptions& options)
      : capture_(capture),
        options_(options),
        file_(path),
        frames_(capture.frame_count()),
        cameras_(static_cast<int>(capture.camera_names().size())),
        skipped_(static_cast<size_t>(cameras_)) {}

  PackSummary write() {
    file_.append(std::as_bytes(std::span(&header_, 1)));
    for (int frame = 0; frame < frames_; ++frame) {
      if (options_.stop_requested && options_.stop_requested()) {
        summary_.interrupted = true;
        return summary_;
      }
      write_pictures(frame);
      if (options_.progress) options_.progress(frame + 1, summary_.pictures);
    }
    warn_of_skipped();
    if (summary_.pictures == 0) throw Error("the capture has no picture to pack");
    write_description();
    write_cameras();
    write_poses();
    write_codes();
    write_array(PackSection::Pictures, {frames_, cameras_, 3}, std::span<const int64_t>(pictures_));
    header_.file_bytes = summary_.bytes = file_.size();
    header_.sum = header_.computed_sum();
    file_.overwrite(0, std::as_bytes(std::span(&header_, 1)));
    file_.commit();
    return summary_;
  }

 private:
  struct Skipped {
    int count = 0;
    std::string first_reason;
  };

  /// A picture as it is written, or why there is none.
  struct Picture {
    std::vector<std::byte> bytes;
    uint64_t sum = 0;
    std::string reason;
    std::exception_ptr failure;
  };

  Picture picture(int frame, int camera) const {
    Picture out;
    try {
      if (!capture_.has_image(frame, camera)) return out;
      const Sample sample = capture_.load(frame, camera);
      out.bytes = pack_person(sample.image, sample.mask);
      out.sum = Checksum::of(out.bytes);
    } catch (const Error& reason) {
      out.reason = reason.what();
    } catch (...) {
      out.failure = std::current_exception();
    }
    return out;
  }

  /// One frame of all cameras, shared out among the threads as they come free; written in the cameras' order.
  void write_pictures(int frame) {
    std::vector<Picture> pictures(static_cast<size_t>(cameras_));
    std::atomic<int> next{0};
    const auto work = [&] {
      for (int camera = next++; camera < cameras_; camera = next++) {
        pictures[static_cast<size_t>(camera)] = picture(frame, camera);
      }
    };
    {
      std::vector<std::jthread> workers;
      for (int i = 1; i < std::min(options_.threads, cameras_); ++i) workers.emplace_back(work);
      work();
    }
    for (size_t camera = 0; camera < pictures.size(); ++camera) {
      const Picture& done = pictures[camera];
      if (done.failure) std::rethrow_exception(done.failure);
      if (!done.reason.empty() && skipped_[camera].count++ == 0) skipped_[camera].first_reason = done.reason;
      pictures_.insert(pictures_.end(), {static_cast<int64_t>(file_.size()), static_cast<int64_t>(done.bytes.size()),
                                         std::bit_cast<int64_t>(done.sum)});
      file_.append(done.bytes);
      summary_.pictures += !done.bytes.empty();
    }
  }

  void warn_of_skipped() const {
    for (const Skipped& skipped : skipped_) {
      if (skipped.count == 0) continue;
      options_.warn(
          fmt::format("{} (skipped: {} of {} frames of this camera)", skipped.first_reason, skipped.count, frames_));
    }
  }

  void write_section(PackSection which, std::span<const std::byte> bytes) {
    header_.sections[static_cast<size_t>(which)] = {file_.size(), bytes.size(), Checksum::of(bytes)};
    file_.append(bytes);
  }
  template <typename Value>
  void write_array(PackSection which, Shape shape, std::span<const Value> values) {
    write_section(which, make_npy(NpyArray::from(std::move(shape), values)));
  }

  void write_description() {
    const nlohmann::ordered_json description = {{"identity", capture_.identity()},
                                                {"picture_identity", capture_.picture_identity()},
                                                {"image_scale", options_.image_scale},
                                                {"cameras", capture_.camera_names()},
                                                {"joints", capture_.pose(0).axis_angles.size()},
                                                {"hand_coefficients", capture_.pose(0).hand_coefficients[0].size()},
                                                {"flat_hand_mean", capture_.flat_hand_mean() ? 1 : 0},
                                                {"code_size", capture_.face_code_size()}};
    const std::string text = description.dump();
    write_section(PackSection::Description, std::as_bytes(std::span(text)));
  }

  void write_cameras() {
    std::vector<double> numbers;
    for (int i = 0; i < cameras_; ++i) {
      const Camera c = capture_.camera(i);
      numbers.insert(numbers.end(),
                     {static_cast<double>(c.width), static_cast<double>(c.height), c.fx, c.fy, c.cx, c.cy});
      for (int k = 0; k < 9; ++k) numbers.push_back(c.rotation(k / 3, k % 3));
      numbers.insert(numbers.end(), c.translation.data(), c.translation.data() + 3);
    }
    write_array(PackSection::Cameras, {cameras_, pack_camera_numbers}, std::span<const double>(numbers));
  }

  void write_poses() {
    std::vector<double> numbers;
    std::vector<int64_t> frame_numbers;
    for (int frame = 0; frame < frames_; ++frame) {
      const Pose pose = capture_.pose(frame);
      for (const Eigen::Vector3d& angles : pose.axis_angles) {
        numbers.insert(numbers.end(), angles.data(), angles.data() + 3);
      }
      numbers.insert(numbers.end(), pose.translation.data(), pose.translation.data() + 3);
      for (const std::vector<double>& values : pose.hand_coefficients) {
        numbers.insert(numbers.end(), values.begin(), values.end());
      }
      numbers.insert(numbers.end(), pose.expression.begin(), pose.expression.end());
      frame_numbers.push_back(capture_.frame_number(frame));
    }
    const std::vector<double> betas = capture_.betas();
    write_array(PackSection::Poses, {frames_, static_cast<int64_t>(numbers.size()) / frames_},
                std::span<const double>(numbers));
    write_array(PackSection::FrameNumbers, {frames_}, std::span<const int64_t>(frame_numbers));
    write_array(PackSection::Betas, {static_cast<int64_t>(betas.size())}, std::span<const double>(betas));
  }

  void write_codes() {
    std::vector<float> codes;
    std::vector<int64_t> rows;
    for (int frame = 0; frame < frames_; ++frame) {
      for (int camera = 0; camera < cameras_; ++camera) {
        const auto code = capture_.has_face_code(frame, camera) ? capture_.face_code(frame, camera) : std::nullopt;
        rows.push_back(code ? summary_.codes++ : -1);
        if (code) codes.insert(codes.end(), code->begin(), code->end());
      }
    }
    write_array(PackSection::Codes, {summary_.codes, capture_.face_code_size()}, std::span<const float>(codes));
    write_array(PackSection::CodeRows, {frames_, cameras_}, std::span<const int64_t>(rows));
  }

  const Capture& capture_;
  const PackOptions& options_;
  AtomicFile file_;
  PackHeader header_;
  int frames_, cameras_;
  std::vector<Skipped> skipped_;  // by camera
  std::vector<int64_t> pictures_;
  PackSummary summary_;
};

}  // namespace

PackSummary write_pack(const std::filesystem::path& path, const Capture& capture, const PackOptions& options) {
  remove_leftovers_of(path);
  return PackWriter(path, capture, options).write();
}

}  // namespace degas
