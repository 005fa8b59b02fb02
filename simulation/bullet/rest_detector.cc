// SPDX-License-Identifier: Apache-2.0
#include "rest_detector.h"

#include <cmath>

#include "prescene/simulation/rules/rest.h"

namespace prescene::simulation {

bool RestDetector::at_rest(InstanceWorld& world, const core::Cancellation* cancellation) {
  const int needed = static_cast<int>(std::ceil(world.scene().options.rest.time / world.dt()));
  for (int i = 0; i < world.object_count(); ++i) {
    if (world.free(i) && world.calm_steps(i) < needed) {
      tested_ = false;
      return false;
    }
  }
  if (!world.actions_finished()) return false;
  if (!tested_) {
    for (int i = 0; i < world.object_count(); ++i)
      if (world.free(i) && world.velocity(i).norm() > kCreepSpeed && (world.jointed(i) || stands_firmly(world, i)))
        return false;
    tested_ = true;
    stable_ = true;
    for (int i = 0; i < world.object_count() && stable_; ++i) {
      // What is jointed may stand on more than its own contacts, and carry more than itself.
      if (world.free(i))
        stable_ = (!world.jointed(i) && stands_firmly(world, i)) || returns_after_nudges(world, i, cancellation);
      if (cancellation && cancellation->requested()) tested_ = stable_ = false;
    }
  }
  return stable_;
}

bool RestDetector::stands_firmly(InstanceWorld& world, int object) {
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  const InstanceWorld::Footing footing = world.footing(object, down);
  if (footing.others) return false;
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  const Vector3d center = world.center_of_mass(object);
  points_.clear();
  for (const Vector3d& p : footing.points) points_.emplace_back(u.dot(p - center), v.dot(p - center));
  corners_.resize(2 * points_.size());
  return simulation::stands_firmly(points_, footing.height, corners_);
}

bool RestDetector::returns_after_nudges(InstanceWorld& world, int object, const core::Cancellation* cancellation) {
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  // A hinge is nudged both ways, a slider not at all: where it stands still it does so in a neighbourhood.
  const int joint = world.joint_of(object);
  const bool hinge =
      joint >= 0 && world.scene().joints[static_cast<std::size_t>(joint)].joint.type == belief::JointType::kHinge;
  if (joint >= 0 && !hinge) return true;
  before_.clear();
  double tallest = 0.0;
  for (int i = 0; i < world.object_count(); ++i) {
    if (cancellation && cancellation->requested()) return false;
    const Vector3d center = world.center_of_mass(i);
    before_.push_back({world.rotation(i), center, world.footing(i, down).height});
    if (i == object) tallest = before_.back().height;
  }
  if (hinge) tallest = world.swing_radius(joint);
  const int steps = static_cast<int>(std::ceil(nudge_window(tallest, gravity.norm()) / world.dt()));

  const auto runs_away = [&](int i) {
    const Before& before = before_[static_cast<std::size_t>(i)];
    const double drop = down.dot(world.center_of_mass(i) - before.center_of_mass);
    return may_topple(drop, before.height) &&
           topples(drop, before.height, geometry::log_rotation(world.rotation(i) * before.rotation.conjugate()), down);
  };
  saved_.clear();
  ByteWriter saved(saved_);
  world.save(saved);
  bool returns = true;
  for (int k = 0; k < (hinge ? 2 : kNudgeAxes) && returns; ++k) {
    hinge ? world.nudge_joint(joint, k == 0 ? kNudge : -kNudge) : world.nudge(object, nudge_axis(down, k), kNudge);
    for (int s = 0; s < steps && returns; ++s) {
      if (cancellation && cancellation->requested()) returns = false;
      returns = world.step(cancellation) && returns;
      for (int i = 0; i < world.object_count() && returns; ++i) returns = !world.free(i) || !runs_away(i);
    }
    ByteReader before(saved_);
    world.restore(before);
  }
  return returns;
}

}  // namespace prescene::simulation
