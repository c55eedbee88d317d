#pragma once

#include <memory>
#include <vector>

#include "model/body/body_model.h"
#include "model/body/uv_atlas.h"
#include "model/config.h"
#include "model/data/capture.h"
#include "model/drive/driving_signal.h"
#include "model/gaussians/posing.h"
#include "model/net/map_network.h"

namespace degas {

/// One person's drivable avatar: body, atlas, base maps and network on one device. Data flows through it as
/// DrivingSignal -> upload -> decode (Gaussian maps) -> pose (splats in the world).
class Avatar {
 public:
  /// A driving signal in device memory.
  struct Signal {
    MapNetwork::Inputs network;
    DevicePose body;             ///< as driven_pose makes it
    Tensor canonical_positions;  ///< (N,3) metres, in place of the base's; undefined unless the face moves the mesh
  };

  Avatar(Device& device, const Config& config, BodyModel body, std::vector<double> betas, int face_code_size);

  Device& device() const { return device_; }
  const BodyModel& body() const { return body_; }
  const std::vector<double>& betas() const { return betas_; }
  const UvAtlas& atlas() const { return atlas_; }
  MapNetwork& network() { return *network_; }
  const MapNetwork& network() const { return *network_; }
  const GaussianBase& base() const { return base_; }
  /// The joint that moves each Gaussian most, (N).
  std::vector<int32_t> main_joints() const;
  int64_t gaussian_count() const { return base_.texels.size(); }

  /// The capture's pose of a frame with its finger angles whole; errors of BodyModel::with_hands.
  Pose registered_pose(const Capture& capture, int frame) const;
  /// What of a registered pose moves the body: driven_pose by face.signal.
  Pose driven_pose(const Pose& registered) const { return degas::driven_pose(registered, config_.face.signal); }
  /// The signal of a registered pose and a face code; host work, any thread.
  DrivingSignal signal(const Pose& registered, std::vector<float> face_code) const;
  DrivingSignal signal(const Capture& capture, int frame, std::vector<float> face_code) const;
  Signal upload(const DrivingSignal& signal) const;
  struct Decoded {
    CanonicalGaussians gaussians;
    Tensor divergence;  ///< of the latent from a unit Gaussian, for the KL term; undefined where it has no weight
  };
  /// noise_seed: draws the latent's noise in training; none at evaluation.
  Decoded decode(Tape& tape, const Signal& signal, std::optional<uint64_t> noise_seed = {}) const;
  /// LBS by a pose that the caller may have refined.
  Splats pose(Tape& tape, const CanonicalGaussians& gaussians, const DevicePose& body) const;

  /// Radians between the direction the head faces and the direction from the head to the camera.
  double frontal_angle(const Pose& pose, const Camera& camera) const;

 private:
  Device& device_;
  Config config_;
  BodyModel body_;
  std::vector<double> betas_;
  UvAtlas atlas_;
  GaussianBase base_;
  SkinningWeights skinning_;
  Skeleton skeleton_;
  std::unique_ptr<MapNetwork> network_;
};

}  // namespace degas
