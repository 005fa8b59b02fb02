// SPDX-License-Identifier: Apache-2.0
// Queries about a belief or a scene, and their answers. Plain values with JSON forms (prescene/belief/json.h).
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "prescene/belief/achieve.h"
#include "prescene/belief/alternative_poses.h"
#include "prescene/belief/belief.h"
#include "prescene/belief/effort.h"
#include "prescene/belief/observed_timeline.h"
#include "prescene/belief/prediction.h"
#include "prescene/belief/relations.h"
#include "prescene/core/status.h"
#include "prescene/geometry/image.h"

namespace prescene::belief {

/// Where is everything?
struct WhereQuery {
  std::optional<std::string> object;  ///< Empty: all.
  friend bool operator==(const WhereQuery&, const WhereQuery&) = default;
};
/// What a prediction reports besides probabilities. Where none of what needs places of rest or whole runs is asked
/// for (final poses, typical runs, contacts, paths), instances end as soon as their outcome is decided.
struct PredictDetail {
  bool final_poses = true;
  bool typical_runs = true;
  bool inputs = false;       ///< Which uncertain input decides.
  bool contacts = false;     ///< Who touches whom, when and how hard.
  bool chaos = false;        ///< Whether small differences decide; takes some more instances.
  bool model_error = false;  ///< What half and double steps and the ends of the priors change; takes many more.
  int paths = 0;             ///< So many instances' ways.
  friend bool operator==(const PredictDetail&, const PredictDetail&) = default;
};
/// What happens if...: simulate forward under actions, judge outcomes.
struct PredictQuery {
  std::vector<Action> actions;    ///< Times from now.
  std::vector<Outcome> outcomes;  ///< Empty: the scene's.
  std::vector<ExclusiveOutcomes> exclusive_outcomes;
  std::optional<double> duration;  ///< Empty: the scene's.
  Effort effort;
  PredictDetail detail;
  friend bool operator==(const PredictQuery&, const PredictQuery&) = default;
};
/// What an answer about stability has besides the probability; each takes instances of its own.
struct StabilityDetail {
  bool margin = false;   ///< How hard it may be knocked. Not of what is held.
  bool removal = false;  ///< Whether the others stay where it is taken away.
  friend bool operator==(const StabilityDetail&, const StabilityDetail&) = default;
};
/// Does it stay as it is (released now, if it is held)?
struct StabilityQuery {
  std::string object;
  double max_move = 0.01;    ///< m: stable means that it moves less...
  double max_turn = 0.0873;  ///< ...and turns less (rad).
  double duration = 3.0;     ///< s looked ahead
  Effort effort;
  StabilityDetail detail = {};
  friend bool operator==(const StabilityQuery&, const StabilityQuery&) = default;
};
/// What will the camera see after `actions`?
struct ViewQuery {
  std::vector<Action> actions;
  double time = 1.0;  ///< s from now
  friend bool operator==(const ViewQuery&, const ViewQuery&) = default;
};

struct Query {
  std::string id;  ///< Given back in the answer.
  std::variant<WhereQuery, PredictQuery, StabilityQuery, ViewQuery, AchieveQuery, RelationsQuery, TimelineQuery> what;
  friend bool operator==(const Query&, const Query&) = default;
};

struct WhereAnswer {
  struct Item {
    std::string object;
    std::string model;
    ObjectEstimate estimate;
    TrackState state = TrackState::kTracked;
    double existence = 1.0;
    /// What is believed of those of its physical parameters that its model leaves open, ...
    std::vector<ParameterEstimate> parameters = {};
    int lessons = 0;                                 ///< ... by so many pieces of evidence (0 = the priors), ...
    core::TimeNs learned_ns = 0;                     ///< ... the last of which ended at this stamp.
    std::vector<AlternativePose> alternatives = {};  ///< Where else it may be; those about the estimate are none.

    friend bool operator==(const Item&, const Item&) = default;
  };
  std::vector<Item> items;
  std::vector<JointEstimate> joints = {};  ///< Of the objects that were asked for.

  friend bool operator==(const WhereAnswer&, const WhereAnswer&) = default;
};
/// The least impulse, N s, that makes an object fall in a share of the instances. What is missing is above
/// StabilityMargin::most_speed.
struct FallImpulse {
  double share = 0.0;             ///< Of the instances that fall at it or below.
  std::optional<double> impulse;  ///< N s
  std::optional<double> low;      ///< Interval of this quantile at the effort's confidence, ...
  std::optional<double> high;     ///< ... N s.
  friend bool operator==(const FallImpulse&, const FallImpulse&) = default;
};
/// How hard an object may be knocked, horizontally at the height of its centre of mass, before it falls: before it ends
/// tilted by more than 30 degrees, or more than 5 cm lower.
struct StabilityMargin {
  struct Direction {
    Vector3d direction_W = Vector3d::UnitX();  ///< Unit vector across gravity.
    std::optional<double> impulse;             ///< N s at which it falls in half of the instances, roughly.
    friend bool operator==(const Direction&, const Direction&) = default;
  };
  Vector3d weakest_W = Vector3d::UnitX();  ///< Of the directions tried, where half fall at the least impulse.
  std::vector<FallImpulse> falls;          ///< In that direction, at 5 % and at 50 %.
  std::vector<Direction> directions;
  double most_speed = 0.0;  ///< m/s: impulses per mass up to here were tried.
  int starts = 0;           ///< Starts, each with an impulse of its own, that `falls` rests on; none of `directions`.
  int instances = 0;        ///< Simulated for all of it.
  friend bool operator==(const StabilityMargin&, const StabilityMargin&) = default;
};
/// What becomes of the others where an object is taken away at once.
struct Removal {
  OutcomeProbability others_stay;         ///< That all do, by StabilityQuery's limits at the end of its duration.
  std::vector<OutcomeProbability> moves;  ///< That it does not, of each other object by name.
  int instances = 0;
  friend bool operator==(const Removal&, const Removal&) = default;
};
struct StabilityAnswer : Basis {
  std::string object;
  OutcomeProbability stable;
  /// What happens in the typical run that is not stable; empty if none is, or if the time ran out before that was
  /// known, which the remarks say.
  std::string likely_event;
  std::optional<StabilityMargin> margin;  ///< Where asked for; missing if the time ran out, which the remarks say.
  std::optional<Removal> removal;         ///< The same.

  friend bool operator==(const StabilityAnswer&, const StabilityAnswer&) = default;
};
struct ViewAnswer {
  geometry::DepthImage depth;  ///< Of the most likely particle.
  geometry::LabelImage labels;
  std::vector<std::string> label_names;
  geometry::Image<float> presence;  ///< Probability per pixel that some object is there.
  /// Foreseen states that `presence` would be averaged over and that blew up in the simulator; it is that of the
  /// others.
  int failed_instances = 0;
  std::vector<std::string> remarks;  ///< What one should know before trusting the images, in sentences.

  friend bool operator==(const ViewAnswer&, const ViewAnswer&) = default;
};

struct Answer {
  std::string id;
  std::uint64_t step = 0;  ///< Of the belief that was asked.
  core::Status error;      ///< Not ok: could not be answered, and why.
  std::variant<std::monostate, WhereAnswer, PredictAnswer, StabilityAnswer, ViewAnswer, AchieveAnswer, RelationsAnswer,
               TimelineAnswer>
      what;

  friend bool operator==(const Answer&, const Answer&) = default;
};

}  // namespace prescene::belief
