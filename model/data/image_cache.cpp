#include "model/data/image_cache.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/mapped_file.h"
#include "model/data/person_pixels.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

/// The head of a camera's file. Then frames + 1 offsets (uint64; equal neighbours: no picture), the packed frames
/// they bound, and the warning about frames that have none.
struct Header {
  char magic[8] = {'D', 'E', 'G', 'A', 'S', 'I', 'M', '1'};
  int32_t width = 0, height = 0, frames = 0, warning_bytes = 0;
};

}  // namespace

/// One camera's file, mapped into memory.
class CachedCapture::Store {
 public:
  /// False when the file is not there or not whole: it is then written again.
  bool open(const fs::path& path, const Camera& camera, int frames) {
    std::error_code failure;
    if (!fs::is_regular_file(path, failure) || fs::file_size(path, failure) < sizeof(Header)) return false;
    mapped_.emplace(path);
    return is_whole(camera, frames);
  }

  std::span<const std::byte> frame(int index) const {
    return mapped_->bytes().subspan(offset(index), offset(index + 1) - offset(index));
  }
  std::string warning() const {
    const auto text = mapped_->bytes().last(static_cast<size_t>(header_.warning_bytes));
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }

 private:
  uint64_t offset(int index) const {
    uint64_t value;
    std::memcpy(&value, mapped_->bytes().data() + sizeof(Header) + sizeof(value) * static_cast<size_t>(index),
                sizeof(value));
    return value;
  }
  bool is_whole(const Camera& camera, int frames) {
    std::memcpy(&header_, mapped_->bytes().data(), sizeof(header_));
    const size_t begin = sizeof(Header) + sizeof(uint64_t) * (static_cast<size_t>(frames) + 1);
    if (std::memcmp(header_.magic, Header().magic, sizeof(header_.magic)) != 0 || header_.width != camera.width ||
        header_.height != camera.height || header_.frames != frames || header_.warning_bytes < 0 ||
        mapped_->bytes().size() < begin) {
      return false;
    }
    if (offset(0) != begin) return false;
    for (int i = 0; i < frames; ++i) {
      if (offset(i + 1) < offset(i)) return false;
    }
    if (offset(frames) > mapped_->bytes().size()) return false;  // the sum below must not wrap around
    return offset(frames) + static_cast<uint64_t>(header_.warning_bytes) == mapped_->bytes().size();
  }

  std::optional<MappedFile> mapped_;
  Header header_;
};

CachedCapture::CachedCapture(std::unique_ptr<Capture> source, const fs::path& folder,
                             std::function<void(const std::string&)> warn)
    : WrappedCapture(std::move(source)), folder_(folder / picture_identity()), warn_(std::move(warn)) {
  for (size_t i = 0; i < camera_names().size(); ++i) mutexes_.push_back(std::make_unique<std::mutex>());
  stores_.resize(mutexes_.size());
}

CachedCapture::~CachedCapture() = default;

bool CachedCapture::has_image(int frame, int camera) const {
  return source().has_image(frame, camera) && !store(camera).frame(frame).empty();
}

Sample CachedCapture::load(int frame, int camera) const {
  // What the source does not have is its to explain, and so is what it cannot decode.
  if (frame < 0 || frame >= frame_count() || camera < 0 || camera >= static_cast<int>(stores_.size()) ||
      !has_image(frame, camera)) {
    return source().load(frame, camera);
  }
  Sample sample{frame, camera, source().camera(camera), {}, {}};
  if (!unpack_person(store(camera).frame(frame), sample.view.width, sample.view.height, sample.image, sample.mask)) {
    throw Error::format("{}: the cached picture of frame {} of {} is damaged; delete this folder", folder_.string(),
                        frame, camera_names()[static_cast<size_t>(camera)]);
  }
  return sample;
}

const CachedCapture::Store& CachedCapture::store(int camera) const {
  const auto place = static_cast<size_t>(camera);
  const std::lock_guard lock(*mutexes_[place]);
  if (stores_[place]) return *stores_[place];
  const fs::path path = folder_ / (camera_names()[place] + ".pixels");
  auto opened = std::make_unique<Store>();
  if (!opened->open(path, source().camera(camera), frame_count())) {
    decode(camera, path);
    opened = std::make_unique<Store>();
    if (!opened->open(path, source().camera(camera), frame_count())) {
      throw Error::format("{}: cannot be read back; is the disk full?", path.string());
    }
  }
  if (const std::string warning = opened->warning(); !warning.empty()) warn_(warning);
  stores_[place] = std::move(opened);
  return *stores_[place];
}

void CachedCapture::decode(int camera, const fs::path& path) const {
  std::error_code failure;
  fs::create_directories(folder_, failure);
  const fs::path temporary = temporary_name(path);
  const auto fail = [&] {
    const int reason = errno;
    fs::remove(temporary, failure);
    return Error::format("{}: cannot be written: {}; another place can be given for the cache by DEGAS_CACHE",
                         path.string(), std::strerror(reason));
  };
  std::ofstream stream(temporary, std::ios::binary);
  if (!stream) throw fail();

  const Camera view = source().camera(camera);
  Header header;
  header.width = view.width;
  header.height = view.height;
  header.frames = frame_count();
  std::vector<uint64_t> offsets(static_cast<size_t>(frame_count()) + 1);
  offsets[0] = sizeof(header) + sizeof(uint64_t) * offsets.size();
  stream.seekp(static_cast<std::streamoff>(offsets[0]));
  int skipped = 0;
  std::string first_reason;
  for (int frame = 0; frame < frame_count(); ++frame) {
    std::vector<std::byte> packed;
    try {
      if (source().has_image(frame, camera)) {
        const Sample sample = source().load(frame, camera);
        packed = pack_person(sample.image, sample.mask);
      }
    } catch (const Error& reason) {
      if (skipped++ == 0) first_reason = reason.what();
    }
    stream.write(reinterpret_cast<const char*>(packed.data()), static_cast<std::streamsize>(packed.size()));
    offsets[static_cast<size_t>(frame) + 1] = offsets[static_cast<size_t>(frame)] + packed.size();
  }
  std::string warning;
  if (skipped > 0)
    warning = fmt::format("{} (skipped: {} of {} frames of this camera)", first_reason, skipped, frame_count());
  header.warning_bytes = static_cast<int32_t>(warning.size());
  stream << warning;
  stream.seekp(0);
  stream.write(reinterpret_cast<const char*>(&header), sizeof(header));
  stream.write(reinterpret_cast<const char*>(offsets.data()),
               static_cast<std::streamsize>(sizeof(uint64_t) * offsets.size()));
  stream.close();
  if (!stream || std::rename(temporary.c_str(), path.c_str()) != 0) throw fail();
}

}  // namespace degas
