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
#include "prescene/belief/next_view.h"
#include "prescene/belief/observed_timeline.h"
#include "prescene/belief/prediction.h"
#include "prescene/belief/relations.h"
#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
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
/// What an answer about a view has besides the likeliest images and the presence.
struct ViewDetail {
  bool spread = false;   ///< Mean depth and its standard deviation.
  bool objects = false;  ///< The probability of each object, pixel by pixel.
  bool color = false;    ///< The expected colour.
  friend bool operator==(const ViewDetail&, const ViewDetail&) = default;
};
/// What will a camera see after `actions`?
struct ViewQuery {
  std::vector<Action> actions;
  double time = 1.0;                                  ///< s from now
  std::optional<Pose> X_WC;                           ///< Empty: where the scene's camera was seen last.
  std::optional<geometry::PinholeCamera> intrinsics;  ///< Empty: those of the scene's camera.
  int draws = 64;                                     ///< Predicted states that are averaged over.
  ViewDetail detail;
  bool compact = false;  ///< Images in 8 and 16 bits: see ViewAnswer.
  friend bool operator==(const ViewQuery&, const ViewQuery&) = default;
};

struct Query {
  std::string id;  ///< Given back in the answer.
  std::variant<WhereQuery, PredictQuery, StabilityQuery, ViewQuery, AchieveQuery, RelationsQuery, TimelineQuery,
               NextViewQuery>
      what;
  /// Answers so far are wanted, too, as soon as there is anything to tell. Does not change the answer, unless its time
  /// runs out: the number of instances can differ then.
  bool stream = false;
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
  /// Of one object.
  struct ObjectShare {
    std::string object;
    double existence = 1.0;
    geometry::Image<float> probability;  ///< That a pixel shows it.
    friend bool operator==(const ObjectShare&, const ObjectShare&) = default;
  };
  /// Where the colour of a thing is from.
  struct ColorSource {
    std::string name;
    std::string from;  ///< "texture", "model" (one colour), "learned" (from frames), or "" = it is not known.
    friend bool operator==(const ColorSource&, const ColorSource&) = default;
  };
  geometry::DepthImage depth;  ///< Of the most likely particle.
  geometry::LabelImage labels;
  std::vector<std::string> label_names;
  geometry::Image<float> presence;  ///< Probability per pixel that some object is there.
  /// Where asked for. Mean and standard deviation are of the states in which the pixel shows anything; 0 where it does
  /// in fewer than half of them.
  std::optional<geometry::DepthImage> mean_depth, depth_deviation;
  std::vector<ObjectShare> objects;  ///< Where asked for.
  /// Where asked for: sRGB, the mean in linear light of the states in which the pixel shows something of known colour;
  /// black where it does in fewer than half of them. Missing if no colour is known of anything.
  std::optional<geometry::ColorImage> color;
  std::vector<ColorSource> color_sources;  ///< Where colour was asked for: of each thing in label_names.
  /// In JSON, depths are in mm, deviations in 0.1 mm (16 bits) and probabilities in 1/255 (8 bits).
  bool compact = false;
  /// Foreseen states that `presence` would be averaged over and that blew up in the simulator; it is that of the
  /// others.
  int failed_instances = 0;
  std::vector<std::string> remarks;  ///< What one should know before trusting the images, in sentences.

  friend bool operator==(const ViewAnswer&, const ViewAnswer&) = default;
};

struct Answer {
  std::string id;
  std::uint64_t step = 0;  ///< Of the belief that was asked.
  /// Of a query that is to be streamed: whether this is the answer, or what is known so far. Else nothing.
  std::optional<bool> is_final = {};
  core::Status error;  ///< Not ok: could not be answered, and why.
  std::variant<std::monostate, WhereAnswer, PredictAnswer, StabilityAnswer, ViewAnswer, AchieveAnswer, RelationsAnswer,
               TimelineAnswer, NextViewAnswer>
      what;

  friend bool operator==(const Answer&, const Answer&) = default;
};

}  // namespace prescene::belief
