#include "model/data/packed_capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/error.h"
#include "host/io/input_limits.h"
#include "host/io/json_node.h"
#include "host/io/npy.h"
#include "model/data/pack_header.h"
#include "model/data/person_pixels.h"

namespace degas {
namespace {

constexpr const char* remedy = "make it again with `degas pack`";
constexpr const char* section_names[pack_section_count] = {"description", "cameras", "poses",     "frame numbers",
                                                           "betas",       "codes",   "code rows", "pictures"};
constexpr int largest_side = 65535;      ///< of a picture: person_pixels.h counts in 16 bits
constexpr double most_pixels = 1 << 28;  ///< of a picture

PackHeader read_header(std::span<const std::byte> file) {
  PackHeader header;
  std::memcpy(&header, file.data(), sizeof(header));
  return header;
}

/// Error unless the header and every section are whole.
void check_file(std::span<const std::byte> file, const std::string& path) {
  if (file.size() < 8 || std::memcmp(file.data(), PackHeader().magic, 8) != 0) {
    throw Error::format("{}: is no pack; --data takes a capture's folder or a file that `degas pack` made", path);
  }
  if (file.size() < sizeof(PackHeader)) throw Error::format("{}: is cut short; {}", path, remedy);
  const PackHeader header = read_header(file);
  if (header.sum != header.computed_sum()) throw Error::format("{}: its header is damaged; {}", path, remedy);
  if (header.file_bytes != file.size()) {
    throw Error::format("{}: has {} bytes instead of {}: cut short or lengthened; {}", path, file.size(),
                        header.file_bytes, remedy);
  }
  for (int i = 0; i < pack_section_count; ++i) {
    const PackHeader::Section& section = header.sections[i];
    if (section.offset > file.size() || section.bytes > file.size() - section.offset ||
        Checksum::of(file.subspan(section.offset, section.bytes)) != section.sum) {
      throw Error::format("{}: its {} are damaged; {}", path, section_names[i], remedy);
    }
  }
}

/// A section's array, of the expected shape (-1: any size).
NpyArray read_array(std::span<const std::byte> bytes, const std::string& path, PackSection which, const Shape& shape) {
  const std::string label = fmt::format("{}: its {}", path, section_names[static_cast<size_t>(which)]);
  NpyArray array = parse_npy(bytes, label);
  bool fits = array.shape.size() == shape.size();
  for (size_t i = 0; fits && i < shape.size(); ++i) fits = shape[i] < 0 || shape[i] == array.shape[i];
  if (!fits) throw Error::format("{} have another shape than expected; {}", label, remedy);
  return array;
}

}  // namespace

PackedCapture::PackedCapture(const std::filesystem::path& path, double image_scale) : path_(path), file_(path) {
  check_file(file_.bytes(), path.string());
  read_description(image_scale);
  read_cameras();
  read_poses();
  read_codes();
  read_pictures();
}

std::span<const std::byte> PackedCapture::section(PackSection which) const {
  const PackHeader::Section place = read_header(file_.bytes()).sections[static_cast<size_t>(which)];
  return file_.bytes().subspan(place.offset, place.bytes);
}

void PackedCapture::read_description(double image_scale) {
  const std::span<const std::byte> bytes = section(PackSection::Description);
  const auto json = nlohmann::ordered_json::parse(checked_json(bytes, path_.string()), nullptr, false);
  const JsonNode description(json, path_.string());
  if (json.is_discarded()) description.fail("its description is no JSON");
  identity_ = description["identity"].text();
  picture_identity_ = description["picture_identity"].text();
  const double packed_scale = description["image_scale"].number();
  if (packed_scale != image_scale) {
    throw Error::format(
        "{}: its pictures were packed at image_scale {}, but data.image_scale is {}; pack the capture again with "
        "--image-scale {}, or set data.image_scale={}",
        path_.string(), packed_scale, image_scale, image_scale, packed_scale);
  }
  const JsonNode cameras = description["cameras"];
  for (size_t i = 0; i < cameras.size(); ++i) names_.push_back(cameras[i].text());
  joints_ = description["joints"].integer(1, 10000);
  // Packs of before have angles for all fingers.
  if (description.has("hand_coefficients")) hand_coefficients_ = description["hand_coefficients"].integer(0, 10000);
  code_size_ = description["code_size"].integer(0, 1 << 20);
  flat_hand_mean_ = description["flat_hand_mean"].integer(0, 1) == 1;
}

void PackedCapture::read_cameras() {
  const auto count = static_cast<int64_t>(names_.size());
  const std::vector<double> numbers =
      read_array(section(PackSection::Cameras), path_.string(), PackSection::Cameras, {count, pack_camera_numbers})
          .doubles();
  for (const double* c = numbers.data(); c < numbers.data() + numbers.size(); c += pack_camera_numbers) {
    if (!(c[0] >= 1 && c[0] <= largest_side && c[1] >= 1 && c[1] <= largest_side && c[0] * c[1] <= most_pixels)) {
      throw Error::format("{}: has a camera of {} x {} pixels; {}", path_.string(), c[0], c[1], remedy);
    }
    if (!std::all_of(c, c + pack_camera_numbers, [](double number) { return std::isfinite(number); })) {
      throw Error::format("{}: has a camera that is not finite; {}", path_.string(), remedy);
    }
    Camera camera{static_cast<int>(c[0]), static_cast<int>(c[1]), c[2], c[3], c[4], c[5], {}, {}};
    camera.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(c + 6);
    camera.translation = Eigen::Map<const Eigen::Vector3d>(c + 15);
    cameras_.push_back(camera);
  }
}

void PackedCapture::read_poses() {
  const NpyArray array = read_array(section(PackSection::Poses), path_.string(), PackSection::Poses, {-1, -1});
  const int64_t frames = array.shape[0], width = array.shape[1];
  const int64_t hands = 3 * joints_ + 3, body = hands + 2 * hand_coefficients_;
  if (width < body) throw Error::format("{}: its poses have {} numbers; {}", path_.string(), width, remedy);
  const std::vector<double> numbers = array.doubles();
  for (int64_t frame = 0; frame < frames; ++frame) {
    const double* next = numbers.data() + frame * width;
    Pose pose;
    for (int j = 0; j < joints_; ++j) pose.axis_angles.emplace_back(next[3 * j], next[3 * j + 1], next[3 * j + 2]);
    pose.translation = Eigen::Map<const Eigen::Vector3d>(next + 3 * joints_);
    pose.hand_coefficients[0].assign(next + hands, next + hands + hand_coefficients_);
    pose.hand_coefficients[1].assign(next + hands + hand_coefficients_, next + body);
    pose.expression.assign(next + body, next + width);
    poses_.push_back(std::move(pose));
  }
  frame_numbers_ =
      read_array(section(PackSection::FrameNumbers), path_.string(), PackSection::FrameNumbers, {frames}).integers();
  betas_ = read_array(section(PackSection::Betas), path_.string(), PackSection::Betas, {-1}).doubles();
}

void PackedCapture::read_codes() {
  const NpyArray codes = read_array(section(PackSection::Codes), path_.string(), PackSection::Codes, {-1, code_size_});
  codes_ = codes.floats();
  const Shape shape = {frame_count(), static_cast<int64_t>(names_.size())};
  code_rows_ = read_array(section(PackSection::CodeRows), path_.string(), PackSection::CodeRows, shape).integers();
  for (const int64_t row : code_rows_) {
    if (row < -1 || row >= codes.shape[0]) throw Error::format("{}: has no code {}; {}", path_.string(), row, remedy);
  }
}

void PackedCapture::read_pictures() {
  const Shape shape = {frame_count(), static_cast<int64_t>(names_.size()), 3};
  pictures_ = read_array(section(PackSection::Pictures), path_.string(), PackSection::Pictures, shape).integers();
  const auto size = static_cast<int64_t>(file_.bytes().size());
  for (size_t i = 0; i < pictures_.size(); i += 3) {
    const int64_t offset = pictures_[i], bytes = pictures_[i + 1];
    if (offset < 0 || bytes < 0 || offset > size || bytes > size - offset) {
      throw Error::format("{}: picture {} lies outside of the file; {}", path_.string(), i / 3, remedy);
    }
  }
}

bool PackedCapture::is_known(int frame, int camera) const {
  return frame >= 0 && frame < frame_count() && camera >= 0 && camera < static_cast<int>(names_.size());
}

bool PackedCapture::has_image(int frame, int camera) const {
  return is_known(frame, camera) && pictures_[3 * place(frame, camera) + 1] > 0;
}

Sample PackedCapture::load(int frame, int camera) const {
  if (!has_image(frame, camera)) {
    throw Error::format("{}: has no picture of frame {} of {}", path_.string(), frame,
                        is_known(frame, camera) ? names_[static_cast<size_t>(camera)] : std::to_string(camera));
  }
  const int64_t* entry = pictures_.data() + 3 * place(frame, camera);
  const std::span<const std::byte> bytes =
      file_.bytes().subspan(static_cast<size_t>(entry[0]), static_cast<size_t>(entry[1]));
  Sample sample{frame, camera, cameras_[static_cast<size_t>(camera)], {}, {}};
  if (Checksum::of(bytes) != std::bit_cast<uint64_t>(entry[2]) ||
      !unpack_person(bytes, sample.view.width, sample.view.height, sample.image, sample.mask)) {
    throw Error::format("{}: the picture of frame {} of {} is damaged; {}", path_.string(), frame,
                        names_[static_cast<size_t>(camera)], remedy);
  }
  return sample;
}

bool PackedCapture::has_face_code(int frame, int camera) const {
  return is_known(frame, camera) && code_rows_[place(frame, camera)] >= 0;
}

std::optional<std::vector<float>> PackedCapture::face_code(int frame, int camera) const {
  if (!has_face_code(frame, camera)) return std::nullopt;
  const float* code = codes_.data() + code_rows_[place(frame, camera)] * code_size_;
  return std::vector<float>(code, code + code_size_);
}

}  // namespace degas
