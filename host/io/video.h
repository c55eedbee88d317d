#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "host/io/image.h"

namespace degas {

/// Reads the frames of a video as RGB. One thread at a time.
class VideoReader {
 public:
  /// Error naming the file when it is missing or no video.
  explicit VideoReader(const std::filesystem::path& path);
  ~VideoReader();

  int width() const { return width_; }
  int height() const { return height_; }
  double frames_per_second() const { return frames_per_second_; }
  /// As the container says; a damaged file may deliver fewer.
  int frame_count() const { return frame_count_; }
  /// The frame that read gives next.
  int position() const { return position_; }
  /// Makes `frame` the next one. Going forward by a few frames decodes them; other jumps cost a group of pictures.
  void seek(int frame);
  /// The next frame as RGB; false at the end of the video or of what can be decoded of it.
  bool read(Image8& frame);

 private:
  struct Stream;
  std::filesystem::path path_;
  std::unique_ptr<Stream> stream_;
  int width_ = 0, height_ = 0, frame_count_ = 0, position_ = 0;
  double frames_per_second_ = 0;
};

/// Lossless keeps every bit (PNG frames; for captures); Viewing is H.264, or MPEG-4 where there is no encoder for that,
/// which every player and browser (H.264) shows.
enum class VideoQuality { Lossless, Viewing };

/// Writes an mp4 under a temporary name; finish renames it. Without finish nothing is left.
class VideoWriter {
 public:
  /// Error naming the file when no encoder opens. Encoders take even sizes: odd
  /// ones grow by a repeated row or column.
  VideoWriter(const std::filesystem::path& path, int width, int height, double frames_per_second, VideoQuality quality);
  ~VideoWriter();

  /// An RGB or grey frame of the video's size.
  void write(const Image8& frame);
  int frames_written() const { return frames_written_; }
  void finish();

 private:
  struct Stream;
  std::filesystem::path path_, temporary_;
  std::unique_ptr<Stream> stream_;
  int width_, height_, frames_written_ = 0;
};

}  // namespace degas
