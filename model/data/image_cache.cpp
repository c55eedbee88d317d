#include "model/data/image_cache.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "host/error.h"
#include "host/io/checksum.h"
#include "host/io/file_bytes.h"
#include "host/io/mapped_file.h"
#include "model/data/person_pixels.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

/// Of all but the frames; head: up to this checksum's own place.
uint64_t checksum_of(std::span<const std::byte> head, std::string_view warning) {
  Checksum sum;
  sum.add(head.data(), head.size());
  sum.add(warning.data(), warning.size());
  return sum.value();
}

}  // namespace

/// One camera's file, mapped into memory.
class CachedCapture::Store {
 public:
  /// The head of the file. Then frames + 1 offsets (uint64; equal neighbours: no picture), as many checksums (uint64)
  /// of the frames and of all else (header, offsets, warning), the packed frames that the offsets bound, and the
  /// warning about frames that have none.
  struct Header {
    char magic[8] = {'D', 'E', 'G', 'A', 'S', 'I', 'M', '2'};
    int32_t width = 0, height = 0, frames = 0, warning_bytes = 0;
  };
  /// Before the first frame.
  static size_t head_bytes(int frames) {
    return sizeof(Header) + sizeof(uint64_t) * 2 * (static_cast<size_t>(frames) + 1);
  }

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
  bool is_intact(int index) const { return Checksum::of(frame(index)) == number(header_.frames + 1 + index); }
  std::string warning() const {
    const auto text = mapped_->bytes().last(static_cast<size_t>(header_.warning_bytes));
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }

 private:
  /// Of the offsets and checksums.
  uint64_t number(int index) const {
    uint64_t value;
    std::memcpy(&value, mapped_->bytes().data() + sizeof(Header) + sizeof(value) * static_cast<size_t>(index),
                sizeof(value));
    return value;
  }
  uint64_t offset(int index) const { return number(index); }
  bool is_whole(const Camera& camera, int frames) {
    std::memcpy(&header_, mapped_->bytes().data(), sizeof(header_));
    const size_t begin = head_bytes(frames);
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
    if (offset(frames) + static_cast<uint64_t>(header_.warning_bytes) != mapped_->bytes().size()) return false;
    return checksum_of(mapped_->bytes().first(begin - sizeof(uint64_t)), warning()) == number(2 * frames + 1);
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
  return source().has_image(frame, camera) && !store(camera)->frame(frame).empty();
}

Sample CachedCapture::load(int frame, int camera) const {
  // What the source does not have is its to explain, and so is what it cannot decode.
  if (frame < 0 || frame >= frame_count() || camera < 0 || camera >= static_cast<int>(stores_.size()) ||
      !has_image(frame, camera)) {
    return source().load(frame, camera);
  }
  Sample sample{frame, camera, source().camera(camera), {}, {}};
  const auto unpacks = [&](const Store& store) {
    return store.is_intact(frame) &&
           unpack_person(store.frame(frame), sample.view.width, sample.view.height, sample.image, sample.mask);
  };
  const std::shared_ptr<const Store> kept = store(camera);
  if (!unpacks(*kept) && !unpacks(*remade_store(camera, kept))) throw unreadable(camera);
  return sample;
}

fs::path CachedCapture::file(int camera) const {
  return folder_ / (camera_names()[static_cast<size_t>(camera)] + ".pixels");
}

Error CachedCapture::unreadable(int camera) const {
  return Error::format("{}: cannot be read back as it was written; is the disk full or failing?",
                       file(camera).string());
}

std::shared_ptr<const CachedCapture::Store> CachedCapture::store(int camera) const {
  const auto place = static_cast<size_t>(camera);
  const std::lock_guard lock(*mutexes_[place]);
  if (stores_[place]) return stores_[place];
  auto opened = std::make_shared<Store>();
  if (!opened->open(file(camera), source().camera(camera), frame_count())) opened = decoded_store(camera);
  if (const std::string warning = opened->warning(); !warning.empty()) warn_(warning);
  return stores_[place] = opened;
}

std::shared_ptr<const CachedCapture::Store> CachedCapture::remade_store(
    int camera, const std::shared_ptr<const Store>& damaged) const {
  const auto place = static_cast<size_t>(camera);
  const std::lock_guard lock(*mutexes_[place]);
  if (stores_[place] != damaged) return stores_[place];  // another thread was here
  warn_(fmt::format("{}: the cached pictures are damaged; decoding them again", file(camera).string()));
  return stores_[place] = decoded_store(camera);
}

std::shared_ptr<CachedCapture::Store> CachedCapture::decoded_store(int camera) const {
  decode(camera, file(camera));
  auto opened = std::make_shared<Store>();
  if (!opened->open(file(camera), source().camera(camera), frame_count())) throw unreadable(camera);
  return opened;
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
  Store::Header header;
  header.width = view.width;
  header.height = view.height;
  header.frames = frame_count();
  std::vector<uint64_t> offsets(static_cast<size_t>(frame_count()) + 1), checksums;
  offsets[0] = Store::head_bytes(frame_count());
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
    checksums.push_back(Checksum::of(packed));
    offsets[static_cast<size_t>(frame) + 1] = offsets[static_cast<size_t>(frame)] + packed.size();
  }
  std::string warning;
  if (skipped > 0)
    warning = fmt::format("{} (skipped: {} of {} frames of this camera)", first_reason, skipped, frame_count());
  header.warning_bytes = static_cast<int32_t>(warning.size());
  stream << warning;
  std::vector<std::byte> head;
  const auto append = [&](const void* data, size_t bytes) {
    const auto* begin = static_cast<const std::byte*>(data);
    head.insert(head.end(), begin, begin + bytes);
  };
  append(&header, sizeof(header));
  append(offsets.data(), sizeof(uint64_t) * offsets.size());
  append(checksums.data(), sizeof(uint64_t) * checksums.size());
  const uint64_t sum = checksum_of(head, warning);
  append(&sum, sizeof(sum));
  stream.seekp(0);
  stream.write(reinterpret_cast<const char*>(head.data()), static_cast<std::streamsize>(head.size()));
  stream.close();
  if (!stream || std::rename(temporary.c_str(), path.c_str()) != 0) throw fail();
}

}  // namespace degas
