#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "host/error.h"
#include "model/data/wrapped_capture.h"

namespace degas {

/// A capture whose pictures come from files of decoded frames, one file a camera, in `folder`/{picture identity
/// of the capture}: two captures, or two ways of opening one, never share a file. A camera is decoded when it is first
/// asked for (in frame order, once), written under a temporary name and renamed, so that an interrupted run or two runs
/// at a time do no harm. Frames whose picture is unusable (an empty mask, a frame that does not decode) count as
/// missing, with one warning a camera. Only the person's pixels are stored, without loss, and with checksums: a camera
/// whose file is damaged is decoded anew.
class CachedCapture final : public WrappedCapture {
 public:
  CachedCapture(std::unique_ptr<Capture> source, const std::filesystem::path& folder,
                std::function<void(const std::string&)> warn);
  ~CachedCapture() override;

  bool has_image(int frame, int camera) const override;
  Sample load(int frame, int camera) const override;

 private:
  class Store;
  std::filesystem::path file(int camera) const;
  std::shared_ptr<const Store> store(int camera) const;
  /// In place of one that was found damaged.
  std::shared_ptr<const Store> remade_store(int camera, const std::shared_ptr<const Store>& damaged) const;
  std::shared_ptr<Store> decoded_store(int camera) const;
  Error unreadable(int camera) const;
  void decode(int camera, const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  std::function<void(const std::string&)> warn_;
  mutable std::vector<std::unique_ptr<std::mutex>> mutexes_;  // one a camera
  mutable std::vector<std::shared_ptr<const Store>> stores_;
};

}  // namespace degas
