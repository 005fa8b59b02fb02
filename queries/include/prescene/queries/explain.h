// SPDX-License-Identifier: Apache-2.0
// Observation explanation: which event makes the frames of a window most probable?
//
//   ExplainWindow window;                     // the belief at its start, frames with the beliefs after them, actions
//   PRESCENE_TRY(ExplainAnswer answer, explain(window, {.object = "carton"}, context));
//   answer.explanations.front().sentence;     // "The carton was pushed at 2.31 s ..."
//
// Events are schemas with parameters (prescene/belief/event.h). For each schema and object, parameters are drawn, the
// event is simulated from the belief at the window's start, and the frames of the window weigh it by the tempered
// likelihood; sequential Monte Carlo gives the posterior of the parameters and the evidence of the schema, evidence
// times prior its probability. docs/reference/explain.md says what is assumed.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/event.h"
#include "prescene/belief/observation.h"
#include "prescene/belief/outcome.h"
#include "prescene/belief/timeline.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/queries/query_engine.h"

namespace prescene::queries {

/// A frame of the window with the belief after it: what was tracked only proposes parameters, the frame weighs them.
struct WindowFrame {
  belief::Observation observation;
  std::shared_ptr<const belief::Belief> belief;
  /// The images hold every so-manyth pixel of the camera's, and the observation's camera is that of what they hold: the
  /// likelihood looks at no others, so that frames are kept like this (prescene/service/recording/frame_history.h).
  int sampled = 1;
};

struct ExplainWindow {
  std::shared_ptr<const belief::Belief> start;  ///< After the last frame at or before the window's start.
  std::vector<WindowFrame> frames;              ///< After that, in the order of their stamps.
  /// What the robot was commanded to do in the window, by the clock of the frames.
  std::vector<std::pair<core::TimeNs, belief::Action>> actions;
};

struct ExplainQuery {
  std::string object;  ///< Events that happen to it; empty = to any object that the frames show to be elsewhere.
  int frames = 10;     ///< That weigh, of all cameras; those between which most changes are taken. In [2, 64].
  int runs = 4;        ///< Independent runs of each schema that competes, more where intervals are wide. In [2, 64].
  int points = 24;     ///< Of each run. In [8, 4096].
  double confidence = 0.95;  ///< Of the intervals.
  double half_width = 0.05;  ///< Of a probability's interval that is good enough. In [0.001, 0.5].
  std::uint64_t seed = 1;
  belief::EventWeights weights;  ///< How probable events are before anything was seen.
  belief::EventPriors priors;    ///< Of their parameters.
  /// Also the smallest change of the first explanation, or of the start, that would have led to a wanted outcome: to
  /// `wanted`, or to the scene's that is called `wanted_name`; neither: that the object stays as it was.
  bool change = false;
  std::string wanted_name;
  std::optional<belief::Outcome> wanted;
  double wanted_probability = 0.9;  ///< In [0.5, 0.999].
};
/// kInvalidInput naming what is out of range.
core::Status validate(const ExplainQuery& query);

/// A parameter of an event under the posterior.
struct EventValue {
  double mean = 0.0;
  double low = 0.0, high = 0.0;  ///< 5 % of the posterior lie below, 5 % above.
};

struct Explanation {
  belief::EventKind kind = belief::EventKind::kNothing;
  std::string object;  ///< "" for nothing, but for what follows.
  /// Of nothing: `object` is there at the window's start, or is not, other than the belief had it. It came, or went,
  /// before.
  std::optional<bool> present_at_start;
  std::string partner;  ///< What it was exchanged with, else "".
  double probability = 0.0;
  double low = 0.0, high = 1.0;          ///< Interval of what more work would change.
  double log_bayes_factor = 0.0;         ///< Against nothing, nats: of the evidences, without priors.
  std::optional<EventValue> time;        ///< s from the window's start.
  std::optional<EventValue> towards;     ///< Horizontal direction of push or blow, degrees from W's x towards W's y.
  std::optional<EventValue> speed;       ///< Of the push, or impulse over mass, m/s.
  std::optional<EventValue> impulse;     ///< N s, of a blow.
  std::optional<EventValue> touched_at;  ///< Height above the object's lowest point, m.
  /// Shares of the posterior in which the object ends tilted by more than 30 degrees, or more than 5 cm lower.
  double tips = 0.0, falls = 0.0;
  belief::Timeline timeline;  ///< Of the most probable instance, about the object; s from the window's start.
  std::string sentence;
};

/// Where an object is at the window's end, over all explanations.
struct WhereItIs {
  std::string object;
  double present = 1.0;  ///< Probability that it is there at all.
  geometry::Vector3d mean = geometry::Vector3d::Zero();
  double radius_90 = 0.0;     ///< m about the mean within which it is with 90 %, if it is there.
  bool out_of_sight = false;  ///< The last frame of each camera shows less than 5 % of it.
};

struct DecidingFrame {
  double time = 0.0;      ///< s from the window's start.
  std::size_t frame = 0;  ///< Of the window.
  /// Where the objects are (of ExplainAnswer::objects) in the most probable instance of the best explanation; empty =
  /// it is not there.
  std::vector<std::optional<belief::Pose>> X_WO;
  double against_nothing = 0.0;  ///< Nats (tempered) that it speaks for the best explanation against nothing ...
  double against_second = 0.0;   ///< ... and against the second best.
};

/// A parameter of the event, or the start, that is changed.
struct ChangedPart {
  std::string name, unit;
  double from = 0.0, to = 0.0;  ///< Means of the posterior.
  double deviations = 0.0;      ///< Standard deviations of the prior; of the place at the start, of 5 cm each.
};

/// What would have led to a wanted outcome.
struct SmallestChange {
  std::string wanted;  ///< Its name, or "stays as it was".
  double wanted_probability = 0.9;
  bool found = false;  ///< The interval below is above it; else the change below is the best that was tried.
  double size = 0.0;   ///< Length of the change, standard deviations; 0 = nothing has to change.
  std::vector<ChangedPart> parts;
  /// Share of instances with the outcome, and its interval over all changes that were tested: of `instances` that had
  /// no part in finding the change, taken as independent.
  double probability = 0.0, low = 0.0, high = 1.0;
  int instances = 0;
  double unchanged_probability = 0.0;  ///< The share without the change, of the same instances.
  int instances_searched = 0;          ///< Simulated for all of it.
  std::string sentence;
};

struct ExplainAnswer {
  std::vector<Explanation> explanations;  ///< Most probable first; the probabilities sum to one.
  std::vector<WhereItIs> objects;
  std::vector<DecidingFrame> frames;  ///< In the order of time.
  /// Where it was asked for, and the first explanation is an event that is simulated, or nothing; else a remark says
  /// why not.
  std::optional<SmallestChange> change;
  std::string text;  ///< A paragraph.
  std::vector<std::string> remarks;
  /// Time ran out (QueryContext::simulate_until) before the intervals were narrow; the same question says something
  /// else on another machine then.
  bool cut_short = false;
  double duration = 0.0;  ///< s, from the window's start to its last frame.
  int simulated = 0;      ///< Instances.
  int evaluated = 0;      ///< Instances that were weighed.
  int failed = 0;         ///< That became unstable, or were impossible.
  std::string stepper;
};

struct ExplainContext {
  QueryContext simulation;  ///< Needs make_simulator, make_renderer, pool and meshes.
  rendering::LikelihoodBatch* likelihood = nullptr;
  filter::FilterSettings settings;  ///< Of the tracker: colours, sensor, tempering.
  /// Told what is known so far, from the thread that works; may be empty. Has the explanations without the parameters
  /// of their events, the text and the counts. What was not searched yet has an interval of all that it may be. Does
  /// not change the answer.
  std::function<void(const ExplainAnswer& so_far)> so_far = {};
};

/// kInvalidInput for a query out of range, a wanted outcome that can't be, and a window without frames, kNotFound for
/// an unknown object or outcome (with the nearest names), for one that is lost in the whole window, and where the
/// belief holds no object; errors of the simulator and the renderer; kCancelled. From QueryContext::simulate_until on
/// no search goes on: what was not searched to the end has an interval of all that it may be, and is named in the
/// remarks.
core::Result<ExplainAnswer> explain(const ExplainWindow& window, const ExplainQuery& query,
                                    const ExplainContext& context);

}  // namespace prescene::queries
