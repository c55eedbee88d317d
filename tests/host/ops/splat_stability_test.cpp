// The ways in which splatters are known to fail: each case here is one of them.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/ops/splat.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Six splats within the left twelve columns of plain_camera.
SplatScene left_scene() {
  SplatScene scene;
  for (int n = 0; n < 6; ++n) {
    scene.add({-0.9 - 0.02 * n, -0.4 + 0.15 * n, 2 + 0.01 * n}, {1, 0.1 * n, 0.2, 0.3}, {-3.2, -3.6, -3.4}, 0.6,
              {0.1 * n, 0.5, 0.9});
  }
  return scene;
}

}  // namespace

TEST_CASE("splats at and behind the near plane are culled before any division") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SplatScene base = random_scene(50, 2);
  const Camera camera = plain_camera();
  const Drawn alone = draw(device, base, camera);
  SplatScene behind = base;
  const double near_plane = SplatOptions{}.near_plane;
  const std::vector<double> depths = {near_plane * (1 - 1e-5), 1e-20, 0.0, -0.0, -1e-20, -0.05, -3};
  for (double z : depths) behind.add({0.001, 0, z}, upright, {-2, -2, -2}, 0.9, {1, 0, 0});
  const Drawn drawn = draw(device, behind, camera);
  CHECK(drawn.color == alone.color);
  CHECK(drawn.alpha == alone.alpha);
  for (int f = 0; f < 5; ++f) {
    const std::vector<double>& with = drawn.gradients[f];
    const size_t kept = alone.gradients[f].size();
    CHECK(std::vector<double>(with.begin(), with.begin() + kept) == alone.gradients[f]);
    CHECK(all_zero(std::vector<double>(with.begin() + kept, with.end())));
  }
  SplatScene before = base;
  before.add({0, 0, near_plane * (1 + 1e-5)}, upright, {-5, -5, -5}, 0.9, {1, 0, 0});
  const Drawn visible = draw(device, before, camera);
  CHECK(visible.color != alone.color);
  CHECK(all_finite(visible));
}

TEST_CASE("a bad number in any slot leaves the rest of the image and its gradients unchanged") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SplatScene base = left_scene();
  const Camera camera = plain_camera();
  const Drawn expected = draw(device, base, camera);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), infinity, -infinity, 1e-40, 1e30, -1e30}) {
    for (int slot = 0; slot < 14; ++slot) {
      CAPTURE(bad, slot);
      if (bad == 1e-40 && slot >= 7 && slot <= 9) continue;  // a scale of one metre is no fault, and covers the image
      SplatScene scene;
      scene.add({0.6, 0.1, 1.5}, {1, 0.2, 0.1, 0.3}, {-2.5, -2.7, -2.6}, 0.8, {0.3, 0.6, 0.9});
      std::vector<double>* fields[] = {&scene.positions, &scene.rotations, &scene.log_scales, &scene.opacities,
                                       &scene.colors};
      int field = 0, element = slot;
      while (element >= static_cast<int>(fields[field]->size())) element -= static_cast<int>(fields[field++]->size());
      (*fields[field])[element] = bad;
      scene.append(base);
      const Drawn drawn = draw(device, scene, camera);
      bool same = true;
      for (int row = 0; row < 32; ++row) {
        for (int column = 0; column < 12; ++column) {
          const int pixel = row * 48 + column;
          same &= drawn.alpha[pixel] == expected.alpha[pixel];
          for (int c = 0; c < 3; ++c) same &= drawn.color[3 * pixel + c] == expected.color[3 * pixel + c];
        }
      }
      CHECK(same);
      CHECK(all_finite(drawn));
      for (int f = 0; f < 5; ++f) {
        const std::vector<double>& with = drawn.gradients[f];
        CHECK(std::vector<double>(with.end() - static_cast<long>(expected.gradients[f].size()), with.end()) ==
              expected.gradients[f]);
      }
    }
  }
}

TEST_CASE("huge and tiny scales stay finite") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  for (const double log_scale :
       {40.0, 30.0, 20.0, 10.0, std::log(1e-4), std::log(1e-5), std::log(1e-6), std::log(1e-7), -60.0}) {
    CAPTURE(log_scale);
    for (int axes = 1; axes < 8; ++axes) {
      SplatScene scene = left_scene();
      const auto axis = [&](int bit) { return axes & bit ? log_scale : -3.0; };
      scene.add({0.1, 0.05, 2}, {0.8, 0.1, -0.3, 0.4}, {axis(1), axis(2), axis(4)}, 0.7, {0.9, 0.1, 0.4});
      const Drawn drawn = draw(device, scene, plain_camera(), options);
      CHECK(all_finite(drawn));
      CHECK(*std::max_element(drawn.alpha.begin(), drawn.alpha.end()) <= 1);
    }
  }
}

TEST_CASE("determinants of tiny scales do not underflow, with denormals kept or flushed to zero") {
  DeviceOptions device_options;
  device_options.kernel_set = GENERATE(from_range(kernel_sets()));
  device_options.flush_denormals = true;
  Device flushing(device_options);
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  options.blur = GENERATE(0.3, 0.0);
  for (const double scale : {1e-4, 1e-5, 1e-6, 1e-7}) {
    for (int axes = 1; axes < 8; ++axes) {
      CAPTURE(scale, axes);
      SplatScene scene = left_scene();
      const auto axis = [&](int bit) { return axes & bit ? std::log(scale) : -3.0; };
      scene.add({0.6, 0.05, 2}, {0.8, 0.1, -0.3, 0.4}, {axis(1), axis(2), axis(4)}, 0.7, {0.9, 0.1, 0.4});
      const Drawn kept = draw(test::device(*device_options.kernel_set), scene, plain_camera(), options);
      const Drawn flushed = draw(flushing, scene, plain_camera(), options);
      CHECK(all_finite(kept));
      CHECK(all_finite(flushed));
      CHECK(flushed.color == kept.color);
      CHECK(flushed.gradients == kept.gradients);
      if (options.blur == 0) continue;  // the reference's determinants are not guarded
      const ReferenceImage expected = reference_render(scene, plain_camera(), drawing_background, options);
      CHECK(largest_difference(kept.color, expected.color) < 2e-5);
    }
  }
}

TEST_CASE("a needle whose centre is out of sight keeps the direction that is documented") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Camera camera = plain_camera();
  const double limit = (1.15 * 48 - camera.cx) / camera.fx;
  // Radians between the x axis and the long axis of what is seen, by second moments.
  const auto seen_angle = [&](double ratio, const Eigen::Vector3d& direction) {
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), direction);
    SplatScene scene;
    scene.add({2 * ratio, 0.1, 2}, {turn.w(), turn.x(), turn.y(), turn.z()}, {1, -6, -6}, 0.95, {1, 1, 1});
    const std::vector<double> alpha = draw(device, scene, camera).alpha;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for (int pixel = 0; pixel < 48 * 32; ++pixel) {
      const Eigen::Vector2d at(pixel % 48, pixel / 48);
      first += alpha[pixel] * Eigen::Vector3d(1, at.x(), at.y());
      second += alpha[pixel] * at * at.transpose();
    }
    CHECK(first[0] > 5);
    const Eigen::Vector2d mean = first.tail<2>() / first[0];
    const Eigen::Vector2d axis =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(second / first[0] - mean * mean.transpose())
            .eigenvectors()
            .col(1);
    return std::atan(axis.y() / axis.x());
  };
  const double tolerance = 0.01;
  for (const double ratio : {0.5, 0.7, 0.77, 0.79, 0.9, 1.0}) {
    CAPTURE(ratio);
    const Eigen::Vector3d flat(std::cos(0.15), std::sin(0.15), 0), deep = Eigen::Vector3d(0.8, 0.15, 0.5).normalized();
    CHECK(seen_angle(ratio, flat) == Approx(0.15).margin(tolerance));
    const double place = std::min(ratio, limit), y_ratio = 0.05;
    CHECK(seen_angle(ratio, deep) ==
          Approx(std::atan((deep.y() - y_ratio * deep.z()) / (deep.x() - place * deep.z()))).margin(tolerance));
  }
}

TEST_CASE("a splat of overwhelming size covers the image with its opacity") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  SplatScene scene;
  scene.add({0.1, 0.05, 2}, {0.8, 0.1, -0.3, 0.4}, {40, 40, 40}, 0.7, {0.9, 0.1, 0.4});
  for (double alpha : draw(device, scene, plain_camera()).alpha) CHECK(alpha == Approx(0.7));
}

TEST_CASE("tiny quaternions are culled, others only count by direction") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto with_norm = [&](double norm) {
    SplatScene scene;
    scene.add({0.1, 0.05, 2}, {0.8 * norm, 0, 0.6 * norm, 0}, {-1, -2, -1.5}, 0.7, {0.9, 0.1, 0.4});
    return draw(device, scene, plain_camera());
  };
  const Drawn unit = with_norm(1);
  const auto largest = [](const Drawn& drawn) { return *std::max_element(drawn.alpha.begin(), drawn.alpha.end()); };
  CHECK(largest(unit) > 0.6f);
  CHECK(largest(unit) <= 0.7f);
  for (const double norm : {0.0, 1e-20, 1e-6, 0.99e-3}) {
    const Drawn culled = with_norm(norm);
    CHECK(all_zero(culled.alpha));
    for (const auto& gradient : culled.gradients) CHECK(all_zero(gradient));
  }
  for (const double norm : {1.01e-3, 0.1, 100.0, 1e6}) {
    const Drawn drawn = with_norm(norm);
    CHECK(all_finite(drawn));
    CHECK(largest(drawn) == Approx(largest(unit)).epsilon(1e-5));
  }
}

TEST_CASE("nothing visible gives the background and zero gradients") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int count = GENERATE(0, 3);
  SplatScene scene;
  for (int n = 0; n < count; ++n) scene.add({100.0, -100.0 * n, 1}, upright, {-3, -3, -3}, 0.9, {1, 1, 1});
  Camera camera = plain_camera();
  camera.width = camera.height = 512;
  CHECK(is_untouched(draw(device, scene, camera)));
}

TEST_CASE("a tiny turn of the camera changes the image little") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SplatScene scene = random_scene(200, 7);
  Camera camera = test_camera(64, 48);
  const Drawn before = draw(device, scene, camera);
  const double angle = 1e-5;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(0, 2) = angle;
  turn(2, 0) = -angle;
  camera.rotation = turn * camera.rotation;
  const Drawn after = draw(device, scene, camera);
  double largest = 0;
  for (size_t i = 0; i < before.color.size(); ++i) {
    largest = std::max(largest, std::abs(after.color[i] - before.color[i]));
  }
  CHECK(largest > 0);
  // A splat that enters or leaves a pixel at the cut-off counts 1/255.
  CHECK(largest < 0.01);
}
