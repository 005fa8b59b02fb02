// SPDX-License-Identifier: Apache-2.0
// Queries about a belief or a scene, and their answers. Plain values with JSON forms (prescene/belief/json.h).
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "prescene/belief/achieve.h"
#include "prescene/belief/belief.h"
#include "prescene/belief/effort.h"
#include "prescene/belief/prediction.h"
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
/// Does it stay as it is (released now, if it is held)?
struct StabilityQuery {
  std::string object;
  double max_move = 0.01;    ///< m: stable means that it moves less...
  double max_turn = 0.0873;  ///< ...and turns less (rad).
  double duration = 3.0;     ///< s looked ahead
  Effort effort;
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
  std::variant<WhereQuery, PredictQuery, StabilityQuery, ViewQuery, AchieveQuery> what;
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
    int lessons = 0;              ///< ... by so many pieces of evidence (0 = the priors), ...
    core::TimeNs learned_ns = 0;  ///< ... the last of which ended at this stamp.

    friend bool operator==(const Item&, const Item&) = default;
  };
  std::vector<Item> items;

  friend bool operator==(const WhereAnswer&, const WhereAnswer&) = default;
};
struct StabilityAnswer : Basis {
  std::string object;
  OutcomeProbability stable;
  /// What happens in the typical run that is not stable; empty if none is, or if the time ran out before that was
  /// known, which the remarks say.
  std::string likely_event;

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
  std::variant<std::monostate, WhereAnswer, PredictAnswer, StabilityAnswer, ViewAnswer, AchieveAnswer> what;

  friend bool operator==(const Answer&, const Answer&) = default;
};

}  // namespace prescene::belief
