#include "model/data/mannequin_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/random.h"
#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;

/// Where in its motion the subject is: a family of slow waves whose phases the seed draws.
class Waves {
 public:
  Waves(uint64_t seed, double time, double tempo) : random_(seed), time_(time), tempo_(tempo) {}

  /// A wave between low and high, about `cycles` times through the sequence. Every call draws a new phase.
  double between(double low, double high, double cycles) {
    const double phase = random_.uniform(), drift = 0.9 + 0.2 * random_.uniform();
    const double s = std::sin(2 * std::numbers::pi * (cycles * drift * tempo_ * time_ + phase));
    return low + (high - low) * 0.5 * (1 + s);
  }
  double time() const { return time_; }

 private:
  Random random_;
  double time_, tempo_;
};

double bump(double time, double center, double width) {
  const double x = (time - center) / width;
  return std::exp(-x * x);
}

/// Sets a left joint from the angles of the left side; the right side's are given as a left side's too.
void set_sides(MannequinPose& pose, int left_joint, const Vector3d& left, const Vector3d& right) {
  pose.axis_angles[left_joint] = left;
  const int right_joint = left_joint >= 25 ? left_joint + 15 : left_joint + 1;
  pose.axis_angles[right_joint] = Vector3d(right.x(), -right.y(), -right.z());
}

/// One arm as seen on the left: raise from the canonical 49 degrees below the horizon, swing forward, bend, twist.
struct ArmAngles {
  double raise, forward, bend, twist, wrist_bend, curl, thumb;
};

void set_arms(MannequinPose& pose, const ArmAngles& left, const ArmAngles& right) {
  const ArmFrame arm = mannequin_arm_frame();
  const Vector3d bend_axis = arm.along.cross(arm.front).normalized();
  const auto shoulder = [&](const ArmAngles& a) {
    return Vector3d(Vector3d(0, 0, 0.85 * a.raise) - Vector3d(0, a.forward, 0) + a.twist * arm.along);
  };
  const auto collar = [](const ArmAngles& a) { return Vector3d(0, -0.10 * a.forward, 0.15 * a.raise); };
  const auto elbow = [&](const ArmAngles& a) { return Vector3d(a.bend * bend_axis); };
  const auto wrist = [&](const ArmAngles& a) {
    return Vector3d(a.wrist_bend * arm.hand_across() + 0.4 * a.twist * arm.fore_along);
  };
  set_sides(pose, 13, collar(left), collar(right));
  set_sides(pose, 16, shoulder(left), shoulder(right));
  set_sides(pose, 18, elbow(left), elbow(right));
  set_sides(pose, 20, wrist(left), wrist(right));
  for (int joint = 25; joint < 40; ++joint) {
    // Fingers curl towards the palm about the hand's width; the thumb folds across it.
    const bool thumb = joint >= 37;
    const Vector3d axis = thumb ? Vector3d(-arm.hand_up()) : Vector3d(-arm.hand_across());
    const double share = (joint - 25) % 3 == 0 ? 0.8 : 1.0;
    const auto angle = [&](const ArmAngles& a) { return Vector3d((thumb ? a.thumb : share * a.curl) * axis); };
    set_sides(pose, joint, angle(left), angle(right));
  }
}

ArmAngles draw_arm(Waves& waves, MannequinSequence sequence) {
  ArmAngles arm{};
  if (sequence == MannequinSequence::Training) {
    arm.raise = waves.between(-0.62, 0.42, 2.3);
    arm.forward = waves.between(-0.25, 0.95, 1.7);
    arm.bend = waves.between(0.02, 1.75, 2.9) * (0.75 + 0.25 * smoothstep(-0.5, 0.3, arm.raise));
    arm.twist = waves.between(-0.40, 0.45, 1.9);
    arm.wrist_bend = waves.between(-0.40, 0.35, 2.1);
    arm.curl = waves.between(0.02, 0.95, 2.6);
  } else {
    arm.raise = waves.between(-0.55, 0.05, 1.5);
    arm.forward = waves.between(0.00, 0.70, 1.3);
    arm.bend = waves.between(0.65, 1.50, 1.8);
    arm.twist = waves.between(-0.30, 0.30, 1.4);
    arm.wrist_bend = waves.between(-0.30, 0.25, 1.6);
    arm.curl = waves.between(0.10, 0.75, 1.5);
  }
  arm.thumb = 0.35 * arm.curl;
  return arm;
}

void set_legs_and_torso(MannequinPose& pose, Waves& waves, MannequinSequence sequence) {
  const double reach = sequence == MannequinSequence::Training ? 1.0 : 0.55;
  const double step = reach * waves.between(-1, 1, 1.6), crouch = reach * waves.between(0, 0.32, 1.2);
  const double spread = reach * waves.between(-0.02, 0.16, 1.1);
  const auto leg = [&](double lift) {
    const double hip = crouch + 0.55 * lift, knee = 2 * crouch + 0.95 * lift;
    return std::pair(hip, knee);
  };
  const auto [left_hip, left_knee] = leg(std::max(0.0, step));
  const auto [right_hip, right_knee] = leg(std::max(0.0, -step));
  set_sides(pose, 1, {-left_hip, 0, spread}, {-right_hip, 0, spread});
  set_sides(pose, 4, {left_knee, 0, 0}, {right_knee, 0, 0});
  set_sides(pose, 7, {left_hip - left_knee, 0, -spread}, {right_hip - right_knee, 0, -spread});
  const Vector3d torso(reach * waves.between(-0.10, 0.42, 1.3), reach * waves.between(-0.38, 0.38, 1.5),
                       reach * waves.between(-0.22, 0.22, 1.8));
  pose.axis_angles[3] = 0.35 * torso;
  pose.axis_angles[6] = 0.35 * torso;
  pose.axis_angles[9] = 0.30 * torso;
  const double nod = sequence == MannequinSequence::Training ? 1.0 : 0.7;
  const Vector3d head(nod * waves.between(-0.28, 0.30, 2.2), nod * waves.between(-0.42, 0.42, 1.9),
                      nod * waves.between(-0.18, 0.18, 1.7));
  pose.axis_angles[12] = 0.4 * head;
  pose.axis_angles[15] = 0.6 * head;
  pose.axis_angles[0] = Vector3d(0, reach * waves.between(-0.20, 0.20, 0.9), 0);
  pose.translation = {reach * waves.between(-0.04, 0.04, 1.1), 0, reach * waves.between(-0.04, 0.04, 1.3)};
  const Vector3d gaze(waves.between(-0.14, 0.14, 3.1), waves.between(-0.30, 0.30, 2.7), 0);
  pose.axis_angles[23] = pose.axis_angles[24] = gaze;
}

void set_face(MannequinPose& pose, Waves& waves, MannequinSequence sequence) {
  const double time = waves.time();
  auto& expression = pose.expression;
  const auto at = [&](MannequinExpression e) -> double& { return expression[static_cast<int>(e)]; };
  using enum MannequinExpression;
  const bool training = sequence == MannequinSequence::Training;
  const double talking = training ? smoothstep(0.42, 0.54, time) : 1.0;
  double jaw = 0;
  if (training) {
    // The tour: one expression after the other, opening of the mouth among them, each with a companion.
    constexpr std::array<MannequinExpression, 11> tour{JawOpen,       Smile,   LipPucker,   BrowRaise,
                                                       MouthFrown,    LipWide, BrowFrown,   CheekPuff,
                                                       UpperLipRaise, Squint,  LowerLipDrop};
    for (size_t k = 0; k < tour.size(); ++k) {
      const double here = bump(time, 0.025 + 0.042 * static_cast<double>(k), 0.024);
      at(tour[k]) += 0.95 * here;
      if (tour[k] == JawOpen) jaw += 0.34 * here;
      if (tour[k] == BrowRaise) jaw += 0.16 * here;
      if (tour[k] == Smile) at(Squint) += 0.4 * here;
    }
  }
  // Talking: syllables open the jaw, vowels change between wide and round.
  const double syllable = waves.between(0, 1, training ? 9.0 : 4.3), vowel = waves.between(-1, 1, training ? 5.3 : 2.9);
  const double stress = waves.between(0.35, 1, training ? 3.7 : 2.2);
  jaw += talking * 0.24 * stress * syllable;
  at(JawOpen) += talking * 0.45 * stress * syllable;
  at(LipWide) += talking * 0.75 * std::max(0.0, vowel);
  at(LipPucker) += talking * 0.80 * std::max(0.0, -vowel);
  at(UpperLipRaise) += talking * waves.between(0, 0.55, training ? 4.4 : 2.5);
  at(LowerLipDrop) += talking * waves.between(0, 0.60, training ? 6.1 : 3.1);
  at(Smile) += talking * std::max(0.0, waves.between(-0.6, 0.75, training ? 2.3 : 1.4));
  at(BrowRaise) += talking * std::max(0.0, waves.between(-0.5, 0.80, training ? 3.3 : 1.9));
  at(BrowFrown) += talking * std::max(0.0, waves.between(-0.8, 0.75, training ? 2.8 : 1.7));
  constexpr std::array<double, 5> blinks{0.10, 0.31, 0.55, 0.72, 0.93};
  for (const double blink : blinks) {
    at(LidsClose) += bump(time, blink + (training ? 0.0 : 0.04), training ? 0.014 : 0.03);
  }
  for (double& value : expression) value = std::clamp(value, 0.0, 1.0);
  pose.axis_angles[22] = Vector3d(std::min(jaw, 0.36), 0.04 * talking * waves.between(-1, 1, 3.9), 0);
}

}  // namespace

MannequinPose mannequin_motion(MannequinSequence sequence, double time, uint64_t seed,
                               const MannequinSkeleton& skeleton) {
  const uint64_t stream = seed * 2 + (sequence == MannequinSequence::Novel ? 1 : 0);
  Waves waves(stream * 0x9E3779B97F4A7C15ULL + 1, time, 1.0);
  MannequinPose pose;
  const ArmAngles left = draw_arm(waves, sequence), right = draw_arm(waves, sequence);
  set_arms(pose, left, right);
  set_legs_and_torso(pose, waves, sequence);
  set_face(pose, waves, sequence);
  // The lower foot stands on the floor.
  const auto transforms = pose_joints(skeleton, pose);
  double lowest = 1e9;
  for (const int joint : {7, 8, 10, 11}) {
    const Vector3d& rest = skeleton.joints[joint];
    lowest = std::min(lowest, (transforms[joint] * rest).y() - rest.y());
  }
  pose.translation.y() -= lowest;
  return pose;
}

}  // namespace degas
