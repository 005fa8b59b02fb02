// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/find_beginning.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prescene::simulation {
namespace {

// s of flight that are looked at.
constexpr double kLongestFlight = 2.0;
// What touches before so many frames does so from the beginning.
constexpr std::size_t kTouchingFrames = 2;
// Frames of a slide that its start is fitted to.
constexpr std::size_t kMostSliding = 10;

core::Status check(const std::vector<TimedPose>& frames) {
  if (frames.size() < kLeastBeginning + 2)
    return core::invalid_input("has " + std::to_string(frames.size()) + " frames; it takes at least " +
                               std::to_string(kLeastBeginning + 2));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!std::isfinite(frames[i].time) || !frames[i].X_WO.is_finite())
      return core::invalid_input("frame " + std::to_string(i) + " is not finite");
    if (i > 0 && !(frames[i].time > frames[i - 1].time))
      return core::invalid_input("the times do not ascend at frame " + std::to_string(i));
  }
  return core::ok_status();
}

}  // namespace

core::Result<RecordedMotion> find_beginning(std::string name, std::vector<TimedPose> frames, const belief::Scene& scene,
                                            const Simulator& simulator, core::ThreadPool& pool) {
  if (core::Status status = check(frames); !status.ok()) return status.at(name);
  const belief::Vector3Distribution& middle =
      scene.models[static_cast<std::size_t>(scene.objects[0].model)].center_of_mass;
  const geometry::Vector3d center(belief::mean(middle.x), belief::mean(middle.y), belief::mean(middle.z));
  const auto fit = fit_ballistic(std::span(frames).first(kLeastBeginning), center, scene.gravity_W);
  if (!fit) return fit.status().at(name);

  // Back to the first frame.
  const double back = fit->time - frames.front().time;
  belief::WorldState start = belief::mean_start(scene);
  belief::ObjectState& object = start.objects[0];
  object.mode = belief::MotionMode::kMoving;
  object.X_WO = frames.front().X_WO;
  const geometry::Vector3d arm = fit->X_WO.rotation * center;
  const geometry::Vector3d velocity = fit->V_WO.linear + fit->V_WO.angular.cross(arm) - back * scene.gravity_W;
  object.V_WO.angular = fit->V_WO.angular;
  object.V_WO.linear = velocity - fit->V_WO.angular.cross(object.X_WO.rotation * center);
  RunRequest request;
  request.stop.duration = std::min(kLongestFlight, frames.back().time - frames.front().time);
  request.stop.stop_at_rest = false;
  std::vector<belief::Trajectory> run(1);
  simulator.run(std::span(&start, 1), request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, run);
  double touched = request.stop.duration;
  for (const belief::ContactInterval& contact : run[0].contacts) touched = std::min(touched, contact.begin);
  const auto before = static_cast<std::size_t>(
      std::ranges::lower_bound(frames, frames.front().time + touched, {}, &TimedPose::time) - frames.begin());

  RecordedMotion motion{std::move(name), std::move(frames), MotionBeginning::kFlight, 0};
  if (before >= motion.frames.size())
    return core::invalid_input(motion.name + ": it touches nothing; give frames until after the first contact");
  if (before > kLeastBeginning) {
    motion.first_frames = before - 1;
  } else if (before <= kTouchingFrames) {
    motion.beginning = MotionBeginning::kSlide;
    motion.first_frames = std::clamp(motion.frames.size() / 4, kLeastBeginning, kMostSliding);
  } else {
    return core::invalid_input(motion.name + ": " + std::to_string(before) + " frames before it first touches a " +
                               "support; it takes " + std::to_string(kLeastBeginning + 1) +
                               ", or none (a slide): leave the frames before the contact out");
  }
  return motion;
}

}  // namespace prescene::simulation
