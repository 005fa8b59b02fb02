// SPDX-License-Identifier: Apache-2.0
// Experiments whose outcome mechanics tells in closed form, for any stepper and any stand-in for a shape.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/simple_scenes.h"

namespace prescene::tests {

/// A block on a plank tilted by `angle` about y, with that friction between them; `half_height` is the block's.
inline Scene incline_scene(ObjectModel block, double half_height, double angle, double friction) {
  Scene scene;
  scene.name = "incline";
  const Quaterniond tilt = about(Vector3d::UnitY(), angle);
  scene.supports.push_back(support_of("plank", {belief::PrimitiveShape{geometry::BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                      Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
  block.contact.friction = belief::FixedScalar{friction};
  add_object(scene, block, "block");
  scene.objects[0].pose = belief::FixedPose{Pose{tilt, tilt * Vector3d(0.0, 0.0, half_height)}};
  return scene;
}

/// After a second on the incline: travel down along the plank, m, distance from the start, m, and speed, m/s.
struct Slide {
  double way, moved, speed;
};
inline Slide slide_for_a_second(simulation::Instance& instance, const Scene& scene) {
  const WorldState start = start_of(scene);
  instance.set_state(start);
  step_for(instance, 1.0);
  const belief::ObjectState end = instance.state().objects[0];
  const Vector3d down = start.objects[0].X_WO.rotation * Vector3d::UnitX();
  const Vector3d moved = end.X_WO.translation - start.objects[0].X_WO.translation;
  return {down.dot(moved), moved.norm(), down.dot(end.V_WO.linear)};
}

/// A box of that width and height (m), the scene's only object on the floor, tilted about its lower edge along y: it
/// falls over from the angle of its diagonal on. Searched to `resolution`, expected within `tolerance`, degrees.
inline void expect_tipping_at_the_diagonal(simulation::Instance& instance, const Scene& scene, double width,
                                           double height, double resolution, double tolerance) {
  const double expected = std::atan2(width, height) * 180.0 / kPi;
  const auto tips = [&](double degrees) {
    WorldState start = start_of(scene);
    const Quaterniond tilt = about(Vector3d::UnitY(), degrees * kPi / 180.0);
    start.objects[0].X_WO = Pose{tilt, -(tilt * Vector3d(0.5 * width, 0.0, -0.5 * height))};
    instance.set_state(start);
    step_for(instance, 2.0);
    const Vector3d up = instance.state().objects[0].X_WO.rotation * Vector3d::UnitZ();
    return up.z() < std::cos(0.5 * expected * kPi / 180.0) - 0.01;
  };
  double low = expected - 3.0;
  double high = expected + 3.0;
  ASSERT_FALSE(tips(low));
  ASSERT_TRUE(tips(high));
  while (high - low > resolution) {
    const double middle = 0.5 * (low + high);
    (tips(middle) ? high : low) = middle;
  }
  EXPECT_NEAR(0.5 * (low + high), expected, tolerance) << width << " x " << height;
}

/// How each box of a stack stands on the one below: shifted by x, y (m) and turned (rad).
struct StackOffset {
  double x = 0.004, y = -0.003, turn = 0.1;
};

/// The scene's boxes of 10 cm stand on each other, each turned and shifted a little against the one below; they stay
/// for some seconds within `distance` (m) and `turn` (rad).
inline void expect_stack_stays(simulation::Instance& instance, const Scene& scene, double distance, double turn,
                               double seconds = 10.0, const StackOffset& offset = {}) {
  WorldState start = start_of(scene);
  for (std::size_t i = 0; i < start.objects.size(); ++i) {
    const auto n = static_cast<double>(i);
    start.objects[i].X_WO =
        Pose{about(Vector3d::UnitZ(), offset.turn * n), {offset.x * n, offset.y * n, 0.05 + 0.1 * n}};
  }
  instance.set_state(start);
  step_for(instance, seconds);
  const WorldState end = instance.state();
  for (std::size_t i = 0; i < start.objects.size(); ++i) {
    EXPECT_LT((end.objects[i].X_WO.translation - start.objects[i].X_WO.translation).norm(), distance) << i;
    EXPECT_LT(geometry::angle_between(end.objects[i].X_WO.rotation, start.objects[i].X_WO.rotation), turn) << i;
  }
}

}  // namespace prescene::tests
