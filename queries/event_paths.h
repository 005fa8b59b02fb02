// SPDX-License-Identifier: Apache-2.0
// Events as paths: from a point of the standard normal prior of a schema's parameters to where every object is in each
// frame of the window, by simulation where an event sets things in motion. Three sources: event_paths.cc has the set-up
// and the parameters, event_guess.cc what the tracker's path suggests of them, event_simulation.cc what follows.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/event.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/local_runs.h"
#include "prescene/queries/tempered_smc.h"
#include "prior.h"
#include "seating.h"
#include "window_likelihood.h"

namespace prescene::queries {

/// One schema with the objects that it happens to.
struct Hypothesis {
  belief::EventKind kind = belief::EventKind::kNothing;
  std::size_t object = 0;              ///< Of the objects of EventPaths.
  std::optional<std::size_t> partner;  ///< Of exchanged.
  double prior = 0.0;                  ///< Of all hypotheses they sum to one.
  /// Of nothing: that the object is not there at the start while the belief holds it to be, or the other way round.
  bool begins_otherwise = false;
};

/// The parameters at a point; what a schema does not have is 0.
struct EventDraw {
  double time = 0.0;                                          ///< s from the window's start.
  double direction = 0.0;                                     ///< rad from W's x towards W's y.
  double height = 0.0;                                        ///< Share of the object's height.
  double sideways = 0.0;                                      ///< Share of its half width.
  double speed = 0.0;                                         ///< m/s
  double duration = 0.0;                                      ///< s
  geometry::Twist added;                                      ///< By a hand that lets go.
  geometry::Vector3d shift = geometry::Vector3d::Zero();      ///< Of where it is put down, m.
  double turn = 0.0;                                          ///< About the vertical, rad.
  bool other_face = false;                                    ///< It is put down turned over, as it was tracked last.
  geometry::Vector3d touched_W = geometry::Vector3d::Zero();  ///< Where it is touched; by simulate().
  double touched_height = 0.0;                                ///< The same above its lowest point, m.
  double mass = 0.0;                                          ///< Of the object, kg.
};

/// Of one object, what the tracker had of it after each frame of the window: proposals for events.
struct SeenTrack {
  std::vector<double> times;                      ///< s, of the frames in which it was tracked.
  std::vector<belief::ObjectEstimate> estimates;  ///< In these.
};

/// What the frames say of when an object left where it was at the start, and was where it was tracked last: a tracker
/// notices either some frames late.
struct SeenTimes {
  double left_after = 0.0, left_before = 0.0;  ///< s
  double came_after = 0.0, came_before = 0.0;  ///< s; both the duration = it did not come.
};

/// What a track says of when and how an object began to move.
struct TrackedMotion {
  bool moved = false;   ///< It was tracked elsewhere than at the start.
  bool lost = false;    ///< It was not tracked any more, before it was tracked elsewhere.
  double before = 0.0;  ///< s; still tracked where it was, ...
  double after = 0.0;   ///< ... the next frame, in which it is not.
  double onset = 0.0;   ///< s, between the two, by its speed.
  double speed = 0.0;   ///< m/s, at first.
  double until = 0.0;   ///< s, when it moves no more.
  double back = 0.0;    ///< s, when it is tracked elsewhere first.
  geometry::Vector3d first_step = geometry::Vector3d::Zero();  ///< m, within a third of a second from `after` on.
  belief::Pose last;                                           ///< Where it was tracked last.
};

/// By what an object is off a simulated instance, both about W's axes and at the origin of O.
struct StateError {
  geometry::Vector6d pose = geometry::Vector6d::Zero();   ///< Turn (rad) and shift (m).
  geometry::Vector6d twist = geometry::Vector6d::Zero();  ///< Of the velocities: rad/s and m/s.
};

/// Coordinates that pushes and blows have in common, the first ones: time, direction, height and side of the touch.
inline constexpr std::size_t kTouchDimensions = 4;
inline constexpr double kEventInterval = 1.0 / 60.0;  ///< s between the states of simulated instances.
/// Between the states of a run; before the first and after the last, these.
belief::Pose pose_in(const belief::Trajectory& run, std::size_t object, double time);
/// The kept state of a run before a time.
belief::WorldState state_in(const belief::Trajectory& run, double time);
/// W's x, laid flat: what directions count from.
geometry::Vector3d horizontal_x(const geometry::Vector3d& up);

class EventPaths {
 public:
  /// `window` must outlive it; times of `stamps` are those of the frames that weigh. Objects: those that are present at
  /// the start, then those that are not.
  static core::Result<std::unique_ptr<EventPaths>> create(const ExplainWindow& window, const ExplainContext& context,
                                                          const belief::EventPriors& priors, std::uint64_t seed);

  const std::vector<belief::SceneObject>& objects() const { return objects_; }
  std::size_t present() const { return prior_.scene->objects.size(); }
  bool is_present(std::size_t object) const { return object < present(); }
  const belief::Scene& scene() const { return *scene_; }
  double duration() const { return duration_; }
  /// Nothing moves by itself in the window, and nothing is known to be done in it.
  bool is_still() const { return still_; }
  const SeenTrack& track(std::size_t object) const { return tracks_[object]; }
  /// Whether particles that a hand holds have more than half of its weight at the start.
  bool is_held(std::size_t object) const;
  /// Probability that it is not there at the start: by its existence, but at least 1/2 of what the frame at the start
  /// leaves in doubt, and 1/2 of what the tracker has not found, or has lost.
  double may_be_absent(std::size_t object) const;
  /// Where it is at the start, most probably; empty where it is not.
  std::optional<belief::Pose> start_pose(std::size_t object) const;
  /// Where what was not there is put in, but for its shift.
  const belief::Pose& put_in_place(std::size_t object) const { return put_in_at_[object]; }
  const belief::ObjectModel& model(std::size_t object) const { return scene_->model_of(objects_[object]); }

  /// Times of the frames that weigh, s from the start; before anything below.
  void set_times(std::vector<double> times) { times_ = std::move(times); }
  /// For guesses of kinds in which it is carried.
  void note_seen(std::size_t object, const SeenTimes& times) { seen_[object] = times; }
  /// The last frame sees where the object is put down, if it is: nothing to guess.
  void note_seen_in_the_end(std::size_t object) { seen_in_the_end_[object] = 1; }
  /// m by which its lowest point is above what it would rest on there: the surface under its centre of mass that is
  /// nearest to that height, of supports and of the other objects at the start. Empty where none is.
  std::optional<double> lift(std::size_t object, const belief::Pose& X_WO) const;
  /// Log density with which somebody puts it down about there, so that it rests: of m^3, and rad of turns that change
  /// something. The height is known to `height_variance`, m^2.
  double log_put_down(std::size_t object, const belief::Pose& X_WO, double height_variance) const;
  /// What was not there at the start was found in the last frame, and in those of `times` something is there, too.
  void note_found(std::size_t object, const belief::Pose& X_WO, std::vector<double> times);
  /// Where objects are in those frames if nothing happens, from the most probable start.
  std::vector<ObjectPath> base();

  int event_dimensions(const Hypothesis& hypothesis) const;
  int dimensions(const Hypothesis& hypothesis) const;
  /// A guess of the event's parameters from the track, into `target`.
  void guess(const Hypothesis& hypothesis, TemperedTarget& target) const;
  EventDraw decode(const Hypothesis& hypothesis, const LatentPoint& z) const;
  /// Where its object is at the start.
  belief::Pose start_at(const Hypothesis& hypothesis, const LatentPoint& z) const;
  /// Runs go on so long after the window's end, s: for who asks what comes of an event.
  void go_on_for(double seconds) { horizon_ = duration_ + seconds; }
  /// With its outcomes.
  const belief::Scene& known_scene() const { return *prior_.scene; }
  const std::vector<std::string>& left_out() const { return prior_.left_out; }

  /// paths[i] at points[i]; `draws`, where given, get the touched places too, `runs` the simulated instances from the
  /// event on (kinds that are simulated, and nothing; else empty ones). `moved`, where given: so far from where it is
  /// drawn the object is at the start, m in W; of what is held only where all is still, and then its hand is, too.
  void simulate(const Hypothesis& hypothesis, std::span<const LatentPoint> points, std::span<ScenePath> paths,
                std::span<EventDraw> draws = {}, std::span<belief::Trajectory> runs = {},
                std::span<const geometry::Vector3d> moved = {});

  /// Instances of simulate() once more from a time after their events on, with the hypothesis' object off by `errors`:
  /// poses of all that the paths move, in frames after that time. `runs`: as simulate() gave them.
  void go_on(const Hypothesis& hypothesis, double time, std::span<const EventDraw> draws,
             std::span<const StateError> errors, std::span<const belief::Trajectory> runs, std::span<ScenePath> paths);

  int simulated() const { return simulated_; }
  int failed() const { return failed_; }
  /// The first error of a simulator that was to be made; what was simulated is worth nothing then.
  const core::Status& failure() const { return failure_; }
  std::string stepper() const { return simulator_->stepper().name; }
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  EventPaths(const ExplainWindow& window, const ExplainContext& context, const belief::EventPriors& priors,
             std::uint64_t seed, Prior prior);
  void set_scene();
  void take_actions();
  void follow_tracks();
  void note_directions();
  TrackedMotion motion_of(std::size_t object) const;
  /// A guess of a blow that leads to a motion.
  struct Hit {
    double height = 0.5;  // share of the object's
    double speed = 0.0;   // m/s; 0 = the motion does not say
  };
  Hit hit_of(std::size_t object, const TrackedMotion& motion) const;
  belief::WorldState likeliest_start() const;
  belief::WorldState start_of(std::size_t object, const LatentPoint& z, std::size_t first) const;
  /// `moved`: the only object that moves at first, if all else lies still.
  std::vector<belief::Trajectory> run(std::span<const belief::WorldState> starts,
                                      std::span<const std::vector<belief::Action>> actions,
                                      std::optional<std::size_t> moved = {});
  std::vector<belief::Action> actions_from(double time) const;
  bool touch(std::size_t object, const belief::WorldState& state, EventDraw& draw) const;
  /// In W, of a push or a blow.
  geometry::Vector3d direction_of(const EventDraw& draw) const;
  belief::Push push_of(const EventDraw& draw) const;
  void begin_event(const Hypothesis& hypothesis, belief::WorldState& state, EventDraw& draw,
                   std::vector<belief::Action>& actions, bool* possible) const;
  std::vector<belief::Action> let_go_at(std::size_t object, const belief::Pose& X_WO, const EventDraw& draw) const;
  std::optional<belief::Pose> put_down(const Hypothesis& hypothesis, const EventDraw& draw,
                                       const belief::Pose& X_WO) const;

  const ExplainWindow& window_;
  const ExplainContext& context_;
  belief::EventPriors priors_;
  Prior prior_;
  std::shared_ptr<const belief::Scene> scene_;  // with the robot's timeline and all models
  std::unique_ptr<simulation::Simulator> simulator_;
  std::unique_ptr<Seating> seating_;
  std::unique_ptr<LocalRuns> local_;
  belief::Belief present_;
  std::vector<std::unique_ptr<belief::Belief>> alone_;            // each with one object
  std::vector<std::unique_ptr<belief::BeliefSampler>> samplers_;  // of these
  std::vector<geometry::TriangleMesh> shapes_;                    // of the objects, in O
  std::vector<geometry::TriangleMesh> supports_;                  // in W
  std::vector<belief::SceneObject> objects_;
  std::vector<SeenTrack> tracks_;
  std::vector<std::optional<SeenTimes>> seen_;  // by object
  std::vector<std::uint8_t> seen_in_the_end_;   // by object
  std::vector<double> directions_;       // by object: in which it was tracked to move, rad; directions count from it
  std::vector<belief::Pose> put_in_at_;  // by object: where what was not there is put in, but for its shift
  std::vector<belief::Action> actions_;  // known ones, times from the start
  std::vector<double> times_;
  double duration_ = 0.0;
  double world_radius_ = 0.0;  // m
  double horizon_ = 0.0;       // s; until then runs go on, if that is later
  bool still_ = true;          // nothing moves by itself and nothing is done
  std::vector<ObjectPath> base_;
  core::RandomStream stream_;
  int simulated_ = 0;
  int failed_ = 0;
  core::Status failure_;  // the first of a run
  std::vector<std::string> remarks_;
};

}  // namespace prescene::queries
