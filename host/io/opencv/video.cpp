#include "host/io/video.h"

#include <limits>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/opencv/opencv_image.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

/// Jumps forward of up to this many frames are decoded through rather than sought.
constexpr int longest_skip = 16;

/// What OpenCV would print about files that do not open is said in our errors instead.
void quiet_opencv() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
}

}  // namespace

struct VideoReader::Stream {
  cv::VideoCapture capture;
  cv::Mat frame;
};

VideoReader::VideoReader(const fs::path& path) : path_(path), stream_(new Stream) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure)) throw Error::format("{}: no such file", path.string());
  quiet_opencv();
  cv::VideoCapture& capture = stream_->capture;
  if (!capture.open(path.string(), cv::CAP_FFMPEG)) {
    throw Error::format("{}: cannot be opened as a video; the file is damaged or cut short", path.string());
  }
  width_ = static_cast<int>(capture.get(cv::CAP_PROP_FRAME_WIDTH));
  height_ = static_cast<int>(capture.get(cv::CAP_PROP_FRAME_HEIGHT));
  const double frames = capture.get(cv::CAP_PROP_FRAME_COUNT);
  frame_count_ = frames >= 1 && frames <= std::numeric_limits<int>::max() ? static_cast<int>(frames) : 0;
  frames_per_second_ = capture.get(cv::CAP_PROP_FPS);
  if (width_ <= 0 || height_ <= 0 || frame_count_ <= 0) throw Error::format("{}: holds no video frames", path.string());
  const uintmax_t bytes = fs::file_size(path, failure);
  if (!failure && static_cast<uintmax_t>(frame_count_) > bytes) {
    throw Error::format("{}: claims {} frames in {} bytes; the file is damaged", path.string(), frame_count_, bytes);
  }
}

VideoReader::~VideoReader() = default;

void VideoReader::seek(int frame) {
  if (frame < 0 || frame >= frame_count_) {
    throw Error::format("{}: no frame {}; the video has {}", path_.string(), frame, frame_count_);
  }
  if (frame >= position_ && frame <= position_ + longest_skip) {
    while (position_ < frame && stream_->capture.grab()) ++position_;
  } else {
    stream_->capture.set(cv::CAP_PROP_POS_FRAMES, frame);
    position_ = static_cast<int>(stream_->capture.get(cv::CAP_PROP_POS_FRAMES));
  }
  if (position_ != frame)
    throw Error::format("{}: frame {} cannot be reached; the file is damaged", path_.string(), frame);
}

bool VideoReader::read(Image8& frame) {
  bool got = false;
  try {
    got = stream_->capture.read(stream_->frame) && !stream_->frame.empty();
  } catch (const cv::Exception&) {
    got = false;
  }
  if (!got) return false;
  ++position_;
  frame = image_of(stream_->frame);
  return true;
}

struct VideoWriter::Stream {
  cv::VideoWriter writer;
  cv::Size size;  // of the encoded frames
};

VideoWriter::VideoWriter(const fs::path& path, int width, int height, double frames_per_second, VideoQuality quality)
    : path_(path), stream_(new Stream), width_(width), height_(height) {
  std::error_code ignored;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), ignored);
  quiet_opencv();
  // The muxer follows the extension. PNG frames need the QuickTime flavour of the same container: OpenCV's mp4 has no
  // tag for them. Readers go by content.
  const bool lossless = quality == VideoQuality::Lossless;
  temporary_ = temporary_name(path).replace_extension(lossless ? ".mov" : ".mp4");
  const cv::Size size = stream_->size = cv::Size(width + width % 2, height + height % 2);
  const auto open = [&](const char* code) {
    return stream_->writer.open(temporary_.string(), cv::CAP_FFMPEG,
                                cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]), frames_per_second, size,
                                true);
  };
  if (lossless ? open("png ") : open("avc1") || open("mp4v")) return;
  fs::remove(temporary_, ignored);
  throw Error::format("{}: cannot be written as a video ({}x{}); is the folder writable, and OpenCV built with FFmpeg?",
                      path.string(), width, height);
}

VideoWriter::~VideoWriter() {
  if (!stream_) return;
  stream_->writer.release();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void VideoWriter::write(const Image8& frame) {
  if (frame.width != width_ || frame.height != height_) {
    throw std::logic_error(
        fmt::format("[video] a frame of {}x{} in a video of {}x{}", frame.width, frame.height, width_, height_));
  }
  cv::Mat matrix = matrix_of(frame);
  if (frame.channels == 1) cv::cvtColor(matrix, matrix, cv::COLOR_GRAY2BGR);
  if (stream_->size != matrix.size()) {
    const cv::Size grown = stream_->size - matrix.size();
    cv::copyMakeBorder(matrix, matrix, 0, grown.height, 0, grown.width, cv::BORDER_REPLICATE);
  }
  stream_->writer.write(matrix);
  ++frames_written_;
}

void VideoWriter::finish() {
  stream_->writer.release();
  stream_.reset();
  std::error_code failure;
  if (frames_written_ > 0) fs::rename(temporary_, path_, failure);
  if (frames_written_ == 0 || failure) {
    std::error_code ignored;
    fs::remove(temporary_, ignored);
    throw Error::format("{}: cannot be written: {}", path_.string(), failure ? failure.message() : "no frames");
  }
}

}  // namespace degas
