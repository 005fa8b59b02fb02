// SPDX-License-Identifier: Apache-2.0
// Outcomes: named predicates over a trajectory, and their evaluation (pure functions).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "prescene/belief/distribution.h"
#include "prescene/belief/joint.h"
#include "prescene/core/status.h"

namespace prescene::belief {

struct Trajectory;
struct Scene;

/// When a predicate has to hold.
enum class When { kAtEnd, kEver, kAlways };

/// The object's frame origin (or its whole bounding box, if `whole`) is inside a box fixed in W.
struct InsideVolume {
  Pose X_WV;      ///< Centre of the box.
  Vector3d size;  ///< Full edges, m.
  bool whole = false;
  /// The support whose hollow the box is; "" = the box stands by itself. Until complete_outcome() the box is not known.
  std::string hollow_of = {};
  friend bool operator==(const InsideVolume&, const InsideVolume&) = default;
};
/// In contact with the named support (or object, or robot body), from above, and not moving.
struct RestingOn {
  std::string support;
  friend bool operator==(const RestingOn&, const RestingOn&) = default;
};
/// The body axis is within `max_angle` of W's +z, whatever gravity is.
struct UprightWithin {
  Vector3d axis_O = Vector3d::UnitZ();
  double max_angle = 0.26;  ///< rad
  friend bool operator==(const UprightWithin&, const UprightWithin&) = default;
};
/// The face or axis of the body (unit vector in O) is the one of +-x, +-y, +-z that points most along W's +z, whatever
/// gravity is.
struct FaceUp {
  Vector3d axis_O = Vector3d::UnitZ();
  friend bool operator==(const FaceUp&, const FaceUp&) = default;
};
struct BelowHeight {
  double height = 0.0;  ///< The origin's z in W, m.
  friend bool operator==(const BelowHeight&, const BelowHeight&) = default;
};
struct MovedMoreThan {
  double distance = 0.0;  ///< m from the start
  friend bool operator==(const MovedMoreThan&, const MovedMoreThan&) = default;
};
struct TurnedMoreThan {
  double angle = 0.0;  ///< rad from the start
  friend bool operator==(const TurnedMoreThan&, const TurnedMoreThan&) = default;
};
struct Touched {
  std::string other;  ///< Object, support or robot body; at any time, whatever Condition::when says.
  friend bool operator==(const Touched&, const Touched&) = default;
};
struct StillMoving {
  friend bool operator==(const StillMoving&, const StillMoving&) = default;
};
/// The position of a joint is between two ends, rad or m as its type says. Any object can be the one that is judged;
/// complete_outcome() takes the joint's child.
struct JointWithin {
  std::string joint;
  JointType type = JointType::kSlider;  ///< Of the joint; validate() finds another.
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  friend bool operator==(const JointWithin&, const JointWithin&) = default;
};

using Predicate = std::variant<InsideVolume, RestingOn, UprightWithin, FaceUp, BelowHeight, MovedMoreThan,
                               TurnedMoreThan, Touched, StillMoving, JointWithin>;

/// A predicate, when it has to hold, and whether it is turned round: negated = not (predicate at/ever/always).
struct Condition {
  Predicate predicate;
  When when = When::kAtEnd;
  bool negated = false;
  friend bool operator==(const Condition&, const Condition&) = default;
};
struct Outcome {
  std::string name;
  std::string object;             ///< Whose trajectory is judged; "" until complete_outcome().
  std::vector<Condition> all_of;  ///< Each of these holds. At least one here or in any_of.
  /// At least one of these holds, too; empty = nothing more is asked.
  std::vector<Condition> any_of = {};
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

/// Outcomes of which the first that holds counts; "other" is added for the rest, so their probabilities sum to one.
struct ExclusiveOutcomes {
  std::string name;
  std::vector<Outcome> outcomes;
  friend bool operator==(const ExclusiveOutcomes&, const ExclusiveOutcomes&) = default;
};
/// Which of the body's six faces (+x, -x, +y, -y, +z, -z in O) is up at the end, as exclusive outcomes.
ExclusiveOutcomes which_face_up(const std::string& name, const std::string& object);

/// Slower than this (m/s of the origin, rad/s) is not moving: what creep and the last rocking of a resting body reach.
inline constexpr double kMovingSpeed = 0.02;
inline constexpr double kMovingTurn = 0.2;

/// Fills in what only the scene says of an outcome that came from outside: the object where none is named and the scene
/// has just one, and the boxes of volumes that are named by a support's hollow. kNotFound naming a support that the
/// scene lacks, kInvalidInput a support without a hollow or an outcome without an object.
core::Status complete_outcome(const Scene& scene, Outcome& outcome);

/// Those of all_of, then those of any_of.
std::vector<Condition> all_conditions(const Outcome& outcome);
/// Whether judging needs states between the first and the last: simulators keep these only when asked to.
bool needs_states_along_the_way(const Outcome& outcome);
bool holds(const Scene& scene, const Trajectory& trajectory, const Outcome& outcome);
/// Index of the first outcome that holds, or outcomes.size() for "other".
int classify(const Scene& scene, const Trajectory& trajectory, const ExclusiveOutcomes& exclusive);

}  // namespace prescene::belief
