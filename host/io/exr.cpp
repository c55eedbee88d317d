#include "host/io/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

#include "host/error.h"
#include "host/io/exr_header.h"
#include "host/io/file_bytes.h"

namespace degas {
namespace fs = std::filesystem;

void write_exr(const fs::path& path, const ExrImage& image) {
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  const fs::path temporary = temporary_name(path);
  std::error_code ignored;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), ignored);
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer buffer;
    for (const auto& [name, values] : image.channels) {
      if (values.size() != pixels) throw std::logic_error("[exr] channel '" + name + "' is of another size");
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      auto* data = const_cast<char*>(reinterpret_cast<const char*>(values.data()));
      buffer.insert(name,
                    Imf::Slice(Imf::FLOAT, data, sizeof(float), sizeof(float) * static_cast<size_t>(image.width)));
    }
    {
      Imf::OutputFile file(temporary.c_str(), header);
      file.setFrameBuffer(buffer);
      file.writePixels(image.height);
    }
    fs::rename(temporary, path);
  } catch (const std::logic_error&) {
    throw;
  } catch (const std::exception& failure) {
    fs::remove(temporary, ignored);
    throw Error::format("{}: cannot be written: {}", path.string(), failure.what());
  }
}

ExrImage read_exr(const fs::path& path) {
  check_exr_header(read_file_bytes(path), path.string());
  try {
    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    const int64_t width = int64_t{window.max.x} - window.min.x + 1, height = int64_t{window.max.y} - window.min.y + 1;
    for (auto channel = file.header().channels().begin(); channel != file.header().channels().end(); ++channel) {
      if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1) {
        throw Error::format("{}: channel '{}' is sub-sampled, which is not read", path.string(), channel.name());
      }
    }
    ExrImage image{static_cast<int>(width), static_cast<int>(height), {}};
    Imf::FrameBuffer buffer;
    for (auto channel = file.header().channels().begin(); channel != file.header().channels().end(); ++channel) {
      auto& values = image.channels[channel.name()];
      values.resize(static_cast<size_t>(width * height));
      const auto origin = static_cast<ptrdiff_t>(window.min.x) + static_cast<ptrdiff_t>(window.min.y) * width;
      char* base = reinterpret_cast<char*>(values.data()) - origin * static_cast<ptrdiff_t>(sizeof(float));
      buffer.insert(channel.name(),
                    Imf::Slice(Imf::FLOAT, base, sizeof(float), sizeof(float) * static_cast<size_t>(width)));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& failure) {
    throw Error::format("{}: cannot be read as OpenEXR: {}", path.string(), failure.what());
  }
}

}  // namespace degas
