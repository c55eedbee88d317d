#include "host/io/video.h"

#include "host/io/without_opencv/lacks_opencv.h"

namespace degas {

struct VideoReader::Stream {};

VideoReader::VideoReader(const std::filesystem::path& path) {
  lacks_opencv(path.string() + ": videos cannot be read");
}
VideoReader::~VideoReader() = default;
void VideoReader::seek(int) {}
bool VideoReader::read(Image8&) {
  return false;
}

struct VideoWriter::Stream {};

VideoWriter::VideoWriter(const std::filesystem::path& path, int, int, double, VideoQuality) {
  lacks_opencv(path.string() + ": videos cannot be written");
}
VideoWriter::~VideoWriter() = default;
void VideoWriter::write(const Image8&) {}
void VideoWriter::finish() {}

}  // namespace degas
