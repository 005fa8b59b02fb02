// SPDX-License-Identifier: Apache-2.0
// Queries about a belief or a scene, and their answers. Plain values with JSON forms (prescene/belief/json.h).
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/trajectory.h"
#include "prescene/geometry/image.h"

namespace prescene::belief {

/// Accuracy wanted and the limits of the work.
struct Effort {
  double tolerance = 0.02;   ///< Half width of the outcome intervals at which to stop.
  double confidence = 0.95;  ///< Of the intervals.
  int max_instances = 4096;
  std::optional<double> max_seconds;   ///< Wall time; the answer says how many instances it was worth.
  std::optional<int> exact_instances;  ///< Replay: run just this many.
  friend bool operator==(const Effort&, const Effort&) = default;
};

/// Where is everything?
struct WhereQuery {
  std::optional<std::string> object;  ///< Empty: all.
  friend bool operator==(const WhereQuery&, const WhereQuery&) = default;
};
/// What happens if...: simulate forward under actions, judge outcomes.
struct PredictQuery {
  std::vector<Action> actions;    ///< Times from now.
  std::vector<Outcome> outcomes;  ///< Empty: the scene's.
  std::vector<ExclusiveOutcomes> exclusive_outcomes;
  std::optional<double> duration;  ///< Empty: the scene's.
  Effort effort;
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
  std::variant<WhereQuery, PredictQuery, StabilityQuery, ViewQuery> what;
  friend bool operator==(const Query&, const Query&) = default;
};

/// Probability of an outcome with an interval of the wanted confidence.
struct OutcomeProbability {
  std::string name;
  std::string group;  ///< Name of the exclusive group, or empty.
  double probability = 0.0;
  double low = 0.0;
  double high = 1.0;
  friend bool operator==(const OutcomeProbability&, const OutcomeProbability&) = default;
};

/// Where an object ends: mean and covariance of its final position and the share of each 2 cm cell of a grid in W's xy
/// plane.
struct HeatMap {
  double cell = 0.02;         ///< m
  double x0 = 0.0, y0 = 0.0;  ///< Lower corner of cell (0, 0), W.
  int nx = 0, ny = 0;
  std::vector<double> mass;  ///< Row-major (iy * nx + ix), sums to one.
  friend bool operator==(const HeatMap&, const HeatMap&) = default;
};
/// A Gaussian of final poses inside one outcome.
struct PoseComponent {
  double weight = 0.0;
  std::string outcome;
  Pose mean;
  Matrix6d covariance = Matrix6d::Zero();
  friend bool operator==(const PoseComponent&, const PoseComponent&) = default;
};
struct FinalPoses {
  std::string object;
  Vector3d mean_position = Vector3d::Zero();
  geometry::Matrix3d position_covariance = geometry::Matrix3d::Zero();
  std::vector<PoseComponent> components;  ///< Heaviest first.
  HeatMap heat_map;
  friend bool operator==(const FinalPoses&, const FinalPoses&) = default;
};
/// A typical run of an outcome: the instance nearest to the middle of those that ended so.
struct TypicalRun {
  std::string outcome;
  std::string group;  ///< Of exclusive outcomes; "" = none.
  double share = 0.0;
  Timeline timeline;
  Trajectory trajectory;

  friend bool operator==(const TypicalRun&, const TypicalRun&) = default;
};

struct PredictAnswer {
  std::vector<OutcomeProbability> outcomes;
  std::vector<FinalPoses> final_poses;
  std::vector<TypicalRun> typical_runs;
  /// The scene's outcomes (groups by their name) that need an object which is lost or was never found.
  std::vector<std::string> left_out;
  int instances = 0;
  double simulated_seconds = 0.0;
  double wall_seconds = 0.0;
  bool converged = false;  ///< All intervals reached the tolerance.

  friend bool operator==(const PredictAnswer&, const PredictAnswer&) = default;
};
struct WhereAnswer {
  struct Item {
    std::string object;
    std::string model;
    ObjectEstimate estimate;
    TrackState state = TrackState::kTracked;
    double existence = 1.0;

    friend bool operator==(const Item&, const Item&) = default;
  };
  std::vector<Item> items;

  friend bool operator==(const WhereAnswer&, const WhereAnswer&) = default;
};
struct StabilityAnswer {
  std::string object;
  OutcomeProbability stable;
  std::string likely_event;  ///< What happens in the typical run that is not stable; empty if none.
  int instances = 0;
  double simulated_seconds = 0.0;
  double wall_seconds = 0.0;

  friend bool operator==(const StabilityAnswer&, const StabilityAnswer&) = default;
};
struct ViewAnswer {
  geometry::DepthImage depth;  ///< Of the most likely particle.
  geometry::LabelImage labels;
  std::vector<std::string> label_names;
  geometry::Image<float> presence;  ///< Probability per pixel that some object is there.

  friend bool operator==(const ViewAnswer&, const ViewAnswer&) = default;
};

struct Answer {
  std::string id;
  std::uint64_t step = 0;  ///< Of the belief that was asked.
  std::string error;       ///< Not empty: could not be answered, and why.
  std::variant<std::monostate, WhereAnswer, PredictAnswer, StabilityAnswer, ViewAnswer> what;

  friend bool operator==(const Answer&, const Answer&) = default;
};

}  // namespace prescene::belief
