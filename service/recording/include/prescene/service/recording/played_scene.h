// SPDX-License-Identifier: Apache-2.0
// One instance of a scene, played from its start to its duration, with what happens in it that no action says: things
// that are taken away, moved by somebody, or put in.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/simulation/simulator.h"

namespace prescene::service {

/// Something that happens to an object and is announced to nobody.
struct UnannouncedChange {
  double time = 0.0;  ///< s since the scene's start, in [0, its duration]; taken to the nearest frame.
  std::string object;
  /// Where it is from then on, at rest and in nobody's hand; empty = it is taken away. At time 0, empty: it is not
  /// there until it is put in.
  std::optional<geometry::Pose> X_WO;
  /// Else: it stays where it is, is in nobody's hand any more, and its velocity changes by this: a blow, or a hand that
  /// lets go. X_WO is not looked at.
  std::optional<geometry::Twist> added_velocity = {};
};

/// "SECONDS:OBJECT", as of something that is taken away; kInvalidInput with the form that is expected.
core::Result<UnannouncedChange> removal_from_text(const std::string& text);
/// "SECONDS:OBJECT:X,Y,Z" or "SECONDS:OBJECT:X,Y,Z,YAW_DEG".
core::Result<UnannouncedChange> put_from_text(const std::string& text);

/// The scene between two changes.
struct PlayedPart {
  belief::Scene scene;            ///< With the objects that are there, in the order of the whole scene.
  belief::Trajectory trajectory;  ///< A state each frame, up to the frame before the next change.
  /// What is done in it, as drawn; times from its first state's. A push is in each part that it goes on in.
  std::vector<belief::Action> actions = {};
};

/// X_WG of robot body number `body` at `time` (s since the scene's start), as what it holds has been drawn and grasped:
/// between two states of a part, too. `parts` are of play_scene().
geometry::Pose robot_pose_in(std::span<const PlayedPart> parts, int body, double time);

/// When a change that is to be at `time` (s) takes place in a scene that is sampled every `interval` s: at the nearest
/// frame, or the scene's end.
double frame_of_change(const belief::Scene& scene, double time, double interval);

/// One instance of `scene`, drawn with `seed`, sampled every `interval` s. It goes on after everything has come to
/// rest. kInvalidInput where a change names no object of the scene, lies outside its duration, or, it or its frame,
/// within an action other than a push; errors of the factory; kCancelled.
core::Result<std::vector<PlayedPart>> play_scene(const belief::Scene& scene, std::vector<UnannouncedChange> changes,
                                                 const simulation::SimulatorFactory& simulators, double interval,
                                                 std::uint64_t seed, core::ThreadPool& pool,
                                                 const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::service
