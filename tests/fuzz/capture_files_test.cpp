// Captures: calibrations and parameters of each format, face codes, packs, caches.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/torch_archive.h"
#include "model/data/actorshq_capture.h"
#include "model/data/avatarrex_capture.h"
#include "model/data/dreams_calibration.h"
#include "model/data/dreams_codes.h"
#include "model/data/image_cache.h"
#include "model/data/pack_header.h"
#include "model/data/smplx_parameters.h"
#include "tests/fuzz/fuzz.h"
#include "tests/model/data/small_picture_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

/// A capture of pictures, all views looked at.
void read_all(const Capture& capture) {
  capture.betas();
  for (int frame = 0; frame < capture.frame_count(); ++frame) {
    capture.pose(frame);
    for (int camera = 0; camera < static_cast<int>(capture.camera_names().size()); ++camera) {
      capture.camera(camera);
      capture.face_code(frame, camera);
      if (capture.has_image(frame, camera)) capture.load(frame, camera);
    }
  }
}

CaptureOptions quiet() {
  CaptureOptions options;
  options.warn = [](const std::string&) {};
  return options;
}

/// The small capture as ActorsHQ has it, one camera and two frames of it: enough to damage.
void write_seed_actorshq(const fs::path& folder) {
  const fs::path scale = write_small_actorshq(folder);
  for (const char* part : {"rgbs", "masks"}) {
    for (const auto& entry : fs::recursive_directory_iterator(scale / part)) {
      const std::string name = entry.path().filename();
      if (entry.is_regular_file() && name != "Cam001_rgb000000.png" && name != "Cam001_mask000000.png") {
        fs::remove(entry.path());
      }
    }
  }
}

const char* avatarrex_calibration = R"({"22010708": {"K": [30, 0, 9, 0, 31, 6.5, 0, 0, 1],
 "R": [1, 0, 0, 0, 1, 0, 0, 0, 1], "T": [0.1, 0.2, 3], "distCoeff": [0.1, -0.02, 0, 0, 0], "imgSize": [21, 13]},
"22010709": {"K": [30, 0, 9, 0, 31, 6.5, 0, 0, 1], "R": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "T": [0, 0, 3],
 "distCoeff": [[0.0, 0.0, 0, 0]], "imgSize": [21, 13]}})";

/// The sections of a pack, and its pictures as "pictures.bin".
Parts pack_parts(const Bytes& pack) {
  PackHeader header;
  std::memcpy(&header, pack.data(), sizeof(header));
  const auto part = [&](size_t begin, size_t bytes) {
    return Bytes(pack.begin() + static_cast<ptrdiff_t>(begin), pack.begin() + static_cast<ptrdiff_t>(begin + bytes));
  };
  Parts parts = {{"pictures.bin", part(sizeof(header), header.sections[0].offset - sizeof(header))}};
  for (size_t i = 0; i < header.sections.size(); ++i) {
    parts[fmt::format("section {}", i)] = part(header.sections[i].offset, header.sections[i].bytes);
  }
  return parts;
}

/// A pack whose checksums hold, whatever its parts are.
void write_sealed_pack(const Parts& parts, const fs::path& path) {
  PackHeader header;
  Bytes bytes(sizeof(header));
  const auto append = [&](const Bytes& part) { bytes.insert(bytes.end(), part.begin(), part.end()); };
  append(parts.at("pictures.bin"));
  for (size_t i = 0; i < header.sections.size(); ++i) {
    const Bytes& part = parts.at(fmt::format("section {}", i));
    header.sections[i] = {bytes.size(), part.size(), Checksum::of(part)};
    append(part);
  }
  header.file_bytes = bytes.size();
  header.sum = header.computed_sum();
  std::memcpy(bytes.data(), &header, sizeof(header));
  write_folder({{path.filename().string(), bytes}}, path.parent_path());
}

}  // namespace

TEST_CASE("damaged calibrations of DREAMS") {
  const TemporaryFolder folder;
  write_small_capture(folder.path());
  const std::string description =
      R"({"frame_convention": {"offset_d": 1}, "video": {"rgb_width": 21, "background": "black"}, "cameras_present": [0, 1]})";
  fuzz({"cameras.json",
        {whole_file(folder / "cameras.json")},
        {},
        [](const fs::path& path) { read_dreams_cameras(path); },
        5000});
  fuzz({"capture.json",
        {whole(bytes_of(description)), whole_file(folder / "capture.json")},
        {},
        [](const fs::path& path) { read_dreams_description(path); },
        5000});
}

TEST_CASE("damaged body parameters") {
  const TemporaryFolder folder;
  write_small_capture(folder.path());
  fuzz({"smplx.npz",
        {archive_parts(folder / "smplx.npz")},
        write_archive,
        [](const fs::path& path) { read_smplx_parameters(path); },
        3000});
}

TEST_CASE("a damaged capture of ActorsHQ") {
  const TemporaryFolder folder;
  write_seed_actorshq(folder.path());
  const auto read = [](const fs::path& path) { read_all(*open_uncached_capture(path, quiet())); };
  fuzz({"actorshq", {folder_parts(folder.path())}, write_folder, read, 1500});
}

TEST_CASE("damaged calibrations of AvatarReX") {
  const Parts seed = {{"calibration_full.json", bytes_of(avatarrex_calibration)},
                      {"missing_img_files.txt", bytes_of("22010708\\00000003.jpg\r\n22010709/00000004.jpg\n")}};
  fuzz({"avatarrex", {seed}, write_folder, [](const fs::path& path) { find_avatarrex_layout(path); }, 5000});
}

TEST_CASE("damaged face codes") {
  const std::vector<int64_t> numbers = {0, 1};
  const auto read = [&](const fs::path& path) {
    const DreamsCodes codes(path, numbers, 2);
    for (int frame = 0; frame < 2; ++frame) codes.code(frame, 0), codes.code(frame, 1);
  };
  const std::vector<float> values = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const std::vector<uint8_t> valid = {1, 0, 1, 1};
  const Parts table = {{"codes.npy", make_npy(NpyArray::from({2, 2, 3}, values))},
                       {"valid.npy", make_npy(NpyArray::from({2, 2}, valid))}};
  fuzz({"expression_codes.npz", {table}, write_archive, read, 2000});
  fuzz({"expression_codes.npy", {whole(make_npy(NpyArray::from({2, 6}, values)))}, {}, read, 2000});
  const NpyArray code = NpyArray::from({1, 12}, values);
  const Parts bundle = {{"dpe-000000-cam00.pt", make_torch_archive({{"exp", code}})},
                        {"dpe-000001-cam01.npy", make_npy(code)}};
  fuzz({"dpe.zip", {bundle}, write_archive, read, 2000});
}

TEST_CASE("damaged packs") {
  const TemporaryFolder folder;
  write_seed_actorshq(folder / "source");
  write_pack(folder / "seed.pack", *open_uncached_capture(folder / "source", quiet()), {});
  const auto read = [](const fs::path& path) { read_all(*open_capture(path, quiet())); };
  fuzz({"raw.pack", {whole_file(folder / "seed.pack")}, {}, read, 1000});
  fuzz({"sealed.pack", {pack_parts(read_file_bytes(folder / "seed.pack"))}, write_sealed_pack, read, 4000});
}

TEST_CASE("a damaged cache of pictures is made again, whatever the damage") {
  const TemporaryFolder folder;
  write_seed_actorshq(folder / "source");
  const auto open = [&](const fs::path& cache) {
    return std::make_unique<CachedCapture>(open_uncached_capture(folder / "source", quiet()), cache, quiet().warn);
  };
  read_all(*open(folder / "seed"));
  const auto source = open_uncached_capture(folder / "source", quiet());
  const auto read = [&](const fs::path& path) {
    const auto cached = open(path);
    read_all(*cached);
    for (int frame = 0; frame < source->frame_count(); ++frame) {
      if (!source->has_image(frame, 0)) continue;
      const Sample right = source->load(frame, 0), found = cached->load(frame, 0);
      if (found.image.pixels != right.image.pixels || found.mask.pixels != right.mask.pixels)
        throw std::logic_error("another picture came out of the cache");
    }
  };
  fuzz({.input = "cache",
        .seeds = {folder_parts(folder / "seed")},
        .write = write_folder,
        .read = read,
        .rounds = 500,
        .never_refuses = true});
}
