#include "host/io/zip_archive.h"

#include <zip.h>

#include <algorithm>
#include <string_view>

#include "host/error.h"
#include "host/io/input_limits.h"

namespace degas {
namespace {

/// Would a program that unpacks the archive write beside the folder it was told?
bool leads_out(std::string_view name) {
  if (name.starts_with('/') || name.find('\\') != name.npos) return true;
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('/', begin), name.size());
    if (name.substr(begin, end - begin) == "..") return true;
    begin = end + 1;
  }
  return false;
}

std::string text_of(int code) {
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string text = zip_error_strerror(&error);
  zip_error_fini(&error);
  return text;
}

struct FileCloser {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
struct SourceReleaser {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};

}  // namespace

struct ZipReader::Archive {
  std::vector<std::byte> bytes;  // outlives the handle that reads from it
  zip_t* handle = nullptr;
  ~Archive() {
    if (handle) zip_discard(handle);
  }
};

ZipReader::ZipReader(const std::filesystem::path& path) : label_(path.string()), archive_(new Archive) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) throw Error::format("{}: no such file", label_);
  archive_bytes_ = std::filesystem::file_size(path, failure);
  int code = 0;
  archive_->handle = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (!archive_->handle) throw Error::format("{}: no readable zip archive: {}", label_, text_of(code));
  list_entries();
}

ZipReader::ZipReader(std::vector<std::byte> bytes, std::string label)
    : label_(std::move(label)), archive_bytes_(bytes.size()), archive_(new Archive) {
  archive_->bytes = std::move(bytes);
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(archive_->bytes.data(), archive_->bytes.size(), 0, &error);
  if (source) archive_->handle = zip_open_from_source(source, ZIP_RDONLY, &error);
  const std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  if (!archive_->handle) {
    if (source) zip_source_free(source);
    throw Error::format("{}: no readable zip archive: {}", label_, reason);
  }
  list_entries();
}

ZipReader::~ZipReader() = default;

void ZipReader::list_entries() {
  const zip_int64_t count = zip_get_num_entries(archive_->handle, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(archive_->handle, static_cast<zip_uint64_t>(i), 0);
    if (!name) throw Error::format("{}: entry {} of the zip archive has no readable name", label_, i);
    if (leads_out(name)) throw Error::format("{}: holds '{}', a path out of the archive; it is not read", label_, name);
    if (!index_.emplace(name, static_cast<size_t>(i)).second) {
      throw Error::format("{}: holds '{}' twice", label_, name);
    }
    names_.emplace_back(name);
  }
}

std::vector<std::byte> ZipReader::read(const std::string& name) const {
  const auto found = index_.find(name);
  if (found == index_.end()) throw Error::format("{}: has no entry '{}'", label_, name);
  const std::lock_guard lock(mutex_);
  const auto fail = [&](const std::string& reason) { return Error::format("{}: '{}': {}", label_, name, reason); };

  zip_stat_t stat;
  constexpr zip_uint64_t needed = ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD;
  if (zip_stat_index(archive_->handle, found->second, 0, &stat) != 0 || (stat.valid & needed) != needed) {
    throw fail("its size is not given");
  }
  if (stat.comp_size > archive_bytes_) throw fail("claims more bytes than the archive has; the file is damaged");
  if (stat.comp_method != ZIP_CM_STORE && stat.comp_method != ZIP_CM_DEFLATE) {
    throw fail(fmt::format("is compressed by method {}; stored and deflated entries are read", stat.comp_method));
  }
  if (!is_plausible_expansion(stat.comp_size, stat.size)) {
    throw fail(
        fmt::format("claims {} bytes of {} compressed ones and is not read; if that is right, save it uncompressed",
                    stat.size, stat.comp_size));
  }

  const std::unique_ptr<zip_file_t, FileCloser> file(zip_fopen_index(archive_->handle, found->second, 0));
  if (!file) throw fail(zip_error_strerror(zip_get_error(archive_->handle)));
  std::vector<std::byte> bytes(stat.size);
  for (zip_uint64_t done = 0; done < stat.size;) {
    const zip_int64_t got = zip_fread(file.get(), bytes.data() + done, stat.size - done);
    if (got < 0) throw fail(zip_error_strerror(zip_file_get_error(file.get())));
    if (got == 0) throw fail("ends early; the file is damaged");
    done += static_cast<zip_uint64_t>(got);
  }
  // libzip compares the checksum on the read that meets the end.
  std::byte beyond;
  const zip_int64_t rest = zip_fread(file.get(), &beyond, 1);
  if (rest < 0) throw fail(zip_error_strerror(zip_file_get_error(file.get())));
  if (rest > 0) throw fail("is longer than its size says; the file is damaged");
  return bytes;
}

std::vector<std::byte> make_zip(std::span<const ZipEntry> entries, bool compress) {
  zip_error_t error;
  zip_error_init(&error);
  const std::unique_ptr<zip_source_t, SourceReleaser> target(zip_source_buffer_create(nullptr, 0, 0, &error));
  zip_t* archive = target ? zip_open_from_source(target.get(), ZIP_TRUNCATE, &error) : nullptr;
  if (!archive) throw std::logic_error(std::string("[zip] cannot start an archive: ") + zip_error_strerror(&error));
  zip_source_keep(target.get());  // zip_close gives up its own hold
  const auto check = [&](bool fine) {
    if (fine) return;
    const std::string reason = zip_strerror(archive);
    zip_discard(archive);
    throw std::logic_error("[zip] " + reason);
  };
  for (const ZipEntry& entry : entries) {
    zip_source_t* source = zip_source_buffer(archive, entry.bytes.data(), entry.bytes.size(), 0);
    check(source);
    const zip_int64_t index = zip_file_add(archive, entry.name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) zip_source_free(source);
    check(index >= 0);
    const auto place = static_cast<zip_uint64_t>(index);
    // The fastest level: these arrays are either mostly zeros or do not compress at all.
    check(zip_set_file_compression(archive, place, compress ? ZIP_CM_DEFLATE : ZIP_CM_STORE, compress ? 1 : 0) == 0);
    check(zip_file_set_dostime(archive, place, 0, (1 << 5) | 1, 0) == 0);  // 1980-01-01
  }
  check(zip_close(archive) == 0);

  zip_stat_t stat;
  zip_stat_init(&stat);
  std::vector<std::byte> bytes;
  if (zip_source_open(target.get()) != 0) return bytes;  // no entries: libzip leaves nothing
  zip_source_seek(target.get(), 0, SEEK_END);
  bytes.resize(static_cast<size_t>(zip_source_tell(target.get())));
  zip_source_seek(target.get(), 0, SEEK_SET);
  const zip_int64_t got = zip_source_read(target.get(), bytes.data(), bytes.size());
  zip_source_close(target.get());
  if (got != static_cast<zip_int64_t>(bytes.size())) throw std::logic_error("[zip] the archive cannot be read back");
  return bytes;
}

}  // namespace degas
