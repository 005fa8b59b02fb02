// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/clearance.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace prescene::simulation {
namespace {

using geometry::Pose;
using geometry::Vector3d;

// Of the shifts that are tried: the least, m, and the ratio of one to the next.
constexpr double kLeastShift = 5e-4;
constexpr double kShiftRatio = 1.15;
// Of a contact's normal: beyond it the contact holds something up.
constexpr double kSupports = 0.5;

/// Which of the poses, at rest, touch something below or above them in the first step.
std::vector<bool> touching(const std::vector<Pose>& poses, const belief::Scene& scene, const Simulator& simulator,
                           core::ThreadPool& pool) {
  std::vector<belief::WorldState> starts(poses.size(), belief::mean_start(scene));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    belief::ObjectState& object = starts[i].objects[0];
    object.mode = belief::MotionMode::kMoving;
    object.X_WO = poses[i];
    object.V_WO = {};
  }
  RunRequest request;
  request.stop.duration = 1e-3;
  request.stop.stop_at_rest = false;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, runs);
  std::vector<bool> touches;
  for (const belief::Trajectory& run : runs)
    touches.push_back(std::ranges::any_of(
        run.contacts, [](const belief::ContactInterval& contact) { return std::abs(contact.normal_z) > kSupports; }));
  return touches;
}

}  // namespace

std::optional<double> clearance_of(const Pose& X_WO, const belief::Scene& scene, const Simulator& simulator,
                                   core::ThreadPool& pool) {
  const Vector3d up = -scene.gravity_W.normalized();
  // Downwards, where it is, and upwards.
  std::vector<double> lifts = {0.0};
  for (double shift = kLeastShift; shift <= kFarthestClearance; shift *= kShiftRatio) {
    lifts.insert(lifts.begin(), -shift);
    lifts.push_back(shift);
  }
  std::vector<Pose> poses(lifts.size(), X_WO);
  for (std::size_t i = 0; i < lifts.size(); ++i) poses[i].translation += lifts[i] * up;
  const std::vector<bool> touches = touching(poses, scene, simulator, pool);
  const std::size_t here = lifts.size() / 2;
  if (!touches[here]) {
    for (std::size_t i = here; i-- > 0;)
      if (touches[i]) return -lifts[i];
    // All supports are above it: it is below what should hold it up.
    for (std::size_t i = lifts.size(); i-- > here;)
      if (touches[i]) return -lifts[i];
    return std::nullopt;
  }
  for (std::size_t i = here + 1; i < lifts.size(); ++i)
    if (!touches[i]) return -lifts[i - 1];
  return -kFarthestClearance;
}

std::size_t frames_inside(std::span<const TimedPose> frames, double lift, const belief::Scene& scene,
                          const Simulator& simulator, core::ThreadPool& pool) {
  std::vector<Pose> poses;
  for (const TimedPose& frame : frames) {
    poses.push_back(frame.X_WO);
    poses.back().translation -= lift * scene.gravity_W.normalized();
  }
  return static_cast<std::size_t>(std::ranges::count(touching(poses, scene, simulator, pool), true));
}

}  // namespace prescene::simulation
