// SPDX-License-Identifier: Apache-2.0
// What a prediction holds: probabilities, where things end, typical runs, what decides, who touches whom, and how far
// all this can be trusted. Plain values; queries/ makes them, prescene/belief/json.h writes them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/trajectory.h"
#include "prescene/geometry/pose.h"

namespace prescene::belief {

/// Probability of an outcome with an interval of the wanted confidence.
struct OutcomeProbability {
  std::string name;
  std::string group;  ///< Name of the exclusive group, or empty.
  double probability = 0.0;
  double low = 0.0;
  double high = 1.0;
  friend bool operator==(const OutcomeProbability&, const OutcomeProbability&) = default;
};

/// Where an object ends: the share of each cell of a grid in W's xy plane (FinalPoses has mean and covariance of the
/// position).
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

/// What was known of the outcomes (in the answer's order) after so many instances.
struct ProbabilityStage {
  struct Share {
    double probability = 0.0, low = 0.0, high = 1.0;
    friend bool operator==(const Share&, const Share&) = default;
  };
  int instances = 0;
  std::vector<Share> outcomes;
  friend bool operator==(const ProbabilityStage&, const ProbabilityStage&) = default;
};

/// How much one uncertain input decides about a group of outcomes, or one outcome.
struct InputShare {
  /// Probability of an outcome where the input is in the lowest and the highest fifth of what it may be.
  struct Effect {
    std::string outcome;
    double low_fifth = 0.0, high_fifth = 0.0;
    friend bool operator==(const Effect&, const Effect&) = default;
  };
  std::string input;            ///< "carton: position x", "release of carton: spin y".
  double share = 0.0;           ///< Of the variance, explained by this input alone (first order), in [0, 1].
  double standard_error = 0.0;  ///< Of the share.
  std::vector<Effect> effects;
  friend bool operator==(const InputShare&, const InputShare&) = default;
};
struct DecidingInputs {
  std::string about;                 ///< The group's name, or the outcome's.
  std::vector<InputShare> inputs;    ///< Largest share first.
  double explained_by_single = 0.0;  ///< Sum of the shares, at most 1.
  /// Of the variance, what only several together decide. Nothing if the instances are too few to part that from what
  /// a single input does between the few values of it that can be distinguished.
  std::optional<double> by_several;
  friend bool operator==(const DecidingInputs&, const DecidingInputs&) = default;
};

/// Of pairs of starts that differ by a small displacement, how many end otherwise.
struct ChaosCheck {
  std::string about;  ///< The group's name, or the outcome's.
  int pairs = 0;
  double displacement = 0.0;     ///< Of every uncertain number, in its standard deviations.
  double changed = 0.0;          ///< Share of the pairs.
  double low = 0.0, high = 1.0;  ///< Its interval of the wanted confidence.
  /// More than a tenth of the pairs differ, beyond chance: the start does not decide the outcome more exactly, and
  /// every instance is as good as a random draw.
  bool chaotic = false;
  friend bool operator==(const ChaosCheck&, const ChaosCheck&) = default;
};

/// Two bodies, an object the first of them, that touch in some instances.
struct ContactForecast {
  std::string first, second;
  double probability = 0.0;             ///< That they touch at all.
  double low = 0.0, high = 1.0;         ///< Its interval.
  std::array<double, 3> first_touch{};  ///< s: 10 %, 50 % and 90 % quantiles, where they touch.
  /// N s: 5 %, 50 % and 95 % quantiles of the hardest knock (the largest impulse within one step), where they touch.
  std::array<double, 3> impulse{};
  std::vector<double> touching;  ///< Probability that they touch at each of PredictAnswer::contact_times.
  friend bool operator==(const ContactForecast&, const ContactForecast&) = default;
};

/// Why a start is followed as one object no further.
enum class FlightEnd {
  kMayTouch,     ///< Something may touch something.
  kPush,         ///< A push begins within a look (1/60 s), or what else drives objects but a rigid hold.
  kNotFollowed,  ///< Flights that last longer than this (10 s) are not followed.
  kRunEnds,      ///< Nothing does within the run, up to its last look.
};
/// "may_touch", "push", "not_followed", "run_ends".
std::string to_string(FlightEnd end);

/// For how long a start is one object: nothing can touch anything, and the motion of each object follows from moments
/// of its flight. What is in contact from the start ends it at 0.
struct FlightForecast {
  struct Pair {
    std::string first, second;
    double probability = 0.0, error = 0.0;  ///< That they touch just then, and two standard errors of it.
    friend bool operator==(const Pair&, const Pair&) = default;
  };
  double apart_until = 0.0;  ///< s
  FlightEnd end = FlightEnd::kRunEnds;
  std::vector<Pair> may_touch;  ///< Then, likeliest first; empty unless it ended with kMayTouch.
  friend bool operator==(const FlightForecast&, const FlightForecast&) = default;
};

/// What becomes of the probabilities when something that is not known is otherwise.
struct ModelError {
  struct Shift {
    std::string outcome, group;
    double shift = 0.0;            ///< Of the probability.
    double low = 0.0, high = 0.0;  ///< Its interval.
    friend bool operator==(const Shift&, const Shift&) = default;
  };
  /// What is otherwise: the simulator, whose error the probabilities do not contain, or one value of what the scene
  /// says is not known, over all of which they are already taken.
  enum class Kind { kStep, kPrior };
  struct Variant {
    Kind kind = Kind::kStep;
    std::string what;  ///< "half the step", "carton: friction at 0.27".
    std::vector<Shift> shifts;
    friend bool operator==(const Variant&, const Variant&) = default;
  };
  int instances = 0;  ///< Of each variant: the first of the answer's own, once more.
  std::vector<Variant> variants;
  friend bool operator==(const ModelError&, const ModelError&) = default;
};

/// Where one instance took an object.
struct ObjectPath {
  std::string object;
  std::string outcome;           ///< Class of the first group or outcome about it.
  std::vector<Vector3d> points;  ///< Of its origin in W, every 1/30 s, from when it is let go; m.
  friend bool operator==(const ObjectPath&, const ObjectPath&) = default;
};

/// Instances that were ended when their outcome was decided, and what running some of them to rest all the same found.
struct CertificateSummary {
  bool used = false;
  int certified = 0;
  int audited = 0;
  int mismatches = 0;         ///< Of the audited.
  bool switched_off = false;  ///< Too many: all were run to rest after all.
  friend bool operator==(const CertificateSummary&, const CertificateSummary&) = default;
};

/// What an answer's probabilities rest on, and how far they can be trusted.
struct Basis {
  std::vector<std::string> remarks;  ///< What one should know before trusting the numbers, in sentences.
  int instances = 0;
  int failed_instances = 0;  ///< Simulations that blew up: of no outcome; their share widens the intervals.
  double simulated_seconds = 0.0;
  double flown_seconds = 0.0;  ///< Of these, in free flight without looking for contacts.
  double step = 0.0;           ///< s of one simulated step; 0 = unknown.
  std::string stepper;         ///< Who simulated: "lockstep" or "bullet"; "" = unknown.
  std::string not_lockstep;    ///< Why the faster "lockstep" could not, where it was tried first; else "".
  double hull_error = 0.0;     ///< m: how far simulated hulls lie inside the scene's; 0 = they are the scene's.
  CertificateSummary certificates;
  /// Share of instances in which objects overlapped by more than 2 mm (they are parted gently), and the deepest
  /// of it, m.
  double overlapping_share = 0.0;
  double deepest_overlap = 0.0;
  /// Contacts that steps had no room for and were solved without, and in how many instances.
  std::int64_t dropped_contacts = 0;
  int crowded_instances = 0;
  double wall_seconds = 0.0;
  double cpu_seconds = 0.0;  ///< Of all threads of the process meanwhile.
  bool converged = false;    ///< All intervals reached the tolerance.
  std::string stopped;       ///< "converged", "max_instances", "exact", "time_limit", "cancelled".

  friend bool operator==(const Basis&, const Basis&) = default;
};

struct PredictAnswer : Basis {
  std::vector<OutcomeProbability> outcomes;
  std::vector<FinalPoses> final_poses;
  std::vector<JointForecast> joints;
  std::vector<TypicalRun> typical_runs;
  /// The scene's outcomes (groups by their name) that need an object which is lost or was never found.
  std::vector<std::string> left_out;
  std::vector<ProbabilityStage> history;  ///< At each growth of the net, the last being the answer.
  std::vector<DecidingInputs> inputs;
  std::vector<ChaosCheck> chaos;
  std::vector<double> contact_times;      ///< s
  std::vector<ContactForecast> contacts;  ///< Likeliest first.
  std::optional<FlightForecast> flight;
  std::optional<ModelError> model_error;
  std::vector<ObjectPath> paths;

  friend bool operator==(const PredictAnswer&, const PredictAnswer&) = default;
};

}  // namespace prescene::belief
