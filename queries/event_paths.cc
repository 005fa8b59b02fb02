// SPDX-License-Identifier: Apache-2.0
#include "event_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/belief/body_names.h"
#include "prescene/belief/scene_size.h"
#include "prescene/simulation/own_actions.h"
#include "remarks.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using belief::Pose;
using geometry::Vector3d;

constexpr double kStillBody = 1e-3;                       // m, rad; a robot's body that moves by less stands still
constexpr double kFoundShift = 0.004, kFoundTurn = 0.03;  // m and rad: spread of a pose that was found
constexpr double kOpenAbsence = 0.5;     // probability that what the last frame leaves in doubt is not there, at least
constexpr double kNeverRefuted = 0.999;  // existence of what was seen for a second, and never refuted since
constexpr int kPutDimensions = 7;
constexpr int kRestFrames = 5;  // in which an object lay still, so that it is taken to go on so

/// The heaviest of the particles on the side that has most of the weight: of those that are held, or of those that are
/// not. The heaviest of all says little: in a hand some always move (filter::PredictOptions::wake_probability).
const belief::Particle& heaviest_of_most(const std::vector<belief::Particle>& particles) {
  double held = 0.0;
  for (const belief::Particle& particle : particles)
    held += particle.mode == belief::MotionMode::kHeld ? std::exp(particle.log_weight) : 0.0;
  const belief::Particle* heaviest = nullptr;
  for (const belief::Particle& particle : particles) {
    if ((particle.mode == belief::MotionMode::kHeld) != (held > 0.5)) continue;
    if (heaviest == nullptr || particle.log_weight > heaviest->log_weight) heaviest = &particle;
  }
  return heaviest != nullptr ? *heaviest : belief::heaviest(particles);
}

double to_uniform(double z) { return std::clamp(core::normal_cdf(z), 1e-12, 1.0 - 1e-12); }

/// Ends instances at the window's end.
class WindowEnd final : public simulation::EndRule {
 public:
  explicit WindowEnd(double end) : end_(end) {}
  bool ends(const belief::WorldState& state, double) const override { return state.time >= end_; }

 private:
  double end_;
};

}  // namespace

core::Result<std::unique_ptr<EventPaths>> EventPaths::create(const ExplainWindow& window, const ExplainContext& context,
                                                             const belief::EventPriors& priors, std::uint64_t seed) {
  std::unique_ptr<EventPaths> events(new EventPaths(window, context, priors, seed, prior_of(*window.start)));
  if (events->prior_.scene->objects.empty()) {
    events->follow_tracks();
    const bool none = std::all_of(events->tracks_.begin(), events->tracks_.end(),
                                  [](const SeenTrack& track) { return track.times.empty(); });
    if (none)
      return core::not_found(
          "the belief holds no object at the window's start, and none is found in it: begin the window later");
    return core::not_found(
        "the belief holds no object at the window's start: begin the window after the first has been found");
  }
  remark_on_loose_joints(*window.start, events->remarks_);
  events->take_actions();
  events->set_scene();
  events->follow_tracks();
  events->note_directions();
  if (!context.simulation.make_simulator) return core::unavailable("no simulator: this service was set up without one");
  PRESCENE_TRY(events->simulator_, context.simulation.make_simulator(*events->scene_, 1.0));
  events->world_radius_ = belief::world_radius(*events->scene_);
  events->local_ = std::make_unique<LocalRuns>(*events->scene_, events->shapes_, events->prior_.likeliest,
                                               *events->simulator_, context.simulation.make_simulator);
  return events;
}

EventPaths::EventPaths(const ExplainWindow& window, const ExplainContext& context, const belief::EventPriors& priors,
                       std::uint64_t seed, Prior prior)
    : window_(window),
      context_(context),
      priors_(priors),
      prior_(std::move(prior)),
      present_(*window.start),
      stream_(seed, core::Purpose::kAction) {
  std::erase_if(present_.objects, [](const belief::ObjectBelief& object) { return !queries::is_present(object); });
  duration_ = core::seconds_of(window.frames.back().observation.stamp_ns - window.start->stamp_ns);
  objects_ = prior_.scene->objects;
  seating_ = std::make_unique<Seating>(present_, *prior_.scene);
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    auto one = std::make_unique<belief::Belief>();
    one->scene = present_.scene;
    one->objects = {present_.objects[i]};
    samplers_.push_back(std::make_unique<belief::BeliefSampler>(*one));
    alone_.push_back(std::move(one));
    shapes_.push_back(belief::collision_mesh(prior_.scene->model_of(objects_[i])));
    const belief::ObjectBelief& object = present_.objects[i];
    belief::ObjectState& start = prior_.likeliest.objects[i];
    if (prior_.scene->objects[i].held_by) {
      const belief::Particle& of_most = heaviest_of_most(object.particles);
      if ((of_most.mode == belief::MotionMode::kHeld) != (start.mode == belief::MotionMode::kHeld))
        start = {of_most.X_WO, of_most.V_WO, of_most.mode, start.physical};
    }
    if (!is_held(i) && object.motion.still_frames < kRestFrames) still_ = false;
  }
}

void EventPaths::take_actions() {
  for (const auto& [stamp_ns, action] : window_.actions) {
    belief::Action known = action;
    known.time = core::seconds_of(stamp_ns - window_.start->stamp_ns);
    // Where a hand goes is in its poses; what is left of carrying is that it ends.
    const std::string object = belief::object_of(known);
    const auto index = belief::find_object(*prior_.scene, object);
    const bool in_hand = index && prior_.scene->objects[static_cast<std::size_t>(*index)].held_by.has_value();
    if (!object.empty() && !index) continue;
    if (auto* release = std::get_if<belief::Release>(&known.what)) release->retreat.setZero();
    if (const auto* place = std::get_if<belief::Place>(&known.what); place != nullptr && in_hand) {
      known.time += place->duration;
      known.what = belief::Release{place->object, Vector3d::Zero(), 0.2, {}};
    }
    if (const auto* insert = std::get_if<belief::Insert>(&known.what); insert != nullptr && in_hand) {
      known.time += insert->duration;
      known.what = belief::Release{insert->object, Vector3d::Zero(), 0.2, {}};
    }
    if (in_hand &&
        (std::holds_alternative<belief::Transport>(known.what) || std::holds_alternative<belief::Pour>(known.what) ||
         std::holds_alternative<belief::Tilt>(known.what)))
      continue;
    if (std::holds_alternative<belief::Grasp>(known.what))
      remarks_.push_back(object +
                         " is grasped in the window: an event after that finds it where the hand had it then.");
    actions_.push_back(std::move(known));
  }
  std::stable_sort(actions_.begin(), actions_.end(),
                   [](const belief::Action& a, const belief::Action& b) { return a.time < b.time; });
  if (!actions_.empty()) still_ = false;
}

void EventPaths::set_scene() {
  auto scene = std::make_shared<belief::Scene>(*prior_.scene);
  for (std::size_t body = 0; body < scene->robot.size(); ++body) {
    std::vector<belief::KinematicBody::Waypoint>& timeline = scene->robot[body].timeline;
    timeline = {{0.0, window_.start->robot.size() > body ? window_.start->robot[body]
                                                         : belief::pose_at(window_.start->scene->robot[body], 0.0)}};
    bool moves = false;
    for (const WindowFrame& frame : window_.frames) {
      if (frame.belief->robot.size() <= body) continue;
      const Pose& X_WG = frame.belief->robot[body];
      timeline.push_back({core::seconds_of(frame.observation.stamp_ns - window_.start->stamp_ns), X_WG});
      moves = moves || geometry::box_minus(X_WG, timeline.front().X_WG).norm() > kStillBody;
    }
    if (!moves) timeline.resize(1);
    if (moves) still_ = false;
  }
  scene->actions.clear();
  scene->outcomes.clear();
  scene->exclusive_outcomes.clear();
  for (const belief::Support& support : scene->supports)
    supports_.push_back(geometry::transformed(belief::collision_mesh(support.collision), support.X_WS));
  scene_ = std::move(scene);
}

void EventPaths::follow_tracks() {
  // What was not there at the start may be put in, if it is found later, by the tracker or by note_found().
  for (const belief::ObjectBelief& object : window_.start->objects) {
    if (queries::is_present(object)) continue;
    belief::SceneObject absent;
    absent.name = object.name;
    absent.model = object.model;
    objects_.push_back(std::move(absent));
    shapes_.push_back(belief::collision_mesh(prior_.scene->model_of(objects_.back())));
  }
  tracks_.assign(objects_.size(), {});
  seen_.assign(objects_.size(), {});
  seen_in_the_end_.assign(objects_.size(), 0);
  for (std::size_t i = 0; i < objects_.size(); ++i)
    for (const WindowFrame& frame : window_.frames) {
      const auto index = belief::find_object(*frame.belief, objects_[i].name);
      if (!index) continue;
      const belief::ObjectBelief& object = frame.belief->objects[static_cast<std::size_t>(*index)];
      if (object.state != belief::TrackState::kTracked && object.state != belief::TrackState::kDoubtful) continue;
      tracks_[i].times.push_back(core::seconds_of(frame.observation.stamp_ns - window_.start->stamp_ns));
      tracks_[i].estimates.push_back(belief::estimate(*frame.belief, object));
    }
}

void EventPaths::note_found(std::size_t object, const Pose& X_WO, std::vector<double> times) {
  belief::ObjectEstimate estimate;
  estimate.mean = estimate.mode = X_WO;
  estimate.covariance.diagonal().head<3>().setConstant(kFoundTurn * kFoundTurn);
  estimate.covariance.diagonal().tail<3>().setConstant(kFoundShift * kFoundShift);
  tracks_[object].estimates.assign(times.size(), estimate);
  tracks_[object].times = std::move(times);
}

void EventPaths::note_directions() {
  const Vector3d up = belief::up_of(*scene_);
  const Vector3d x = horizontal_x(up);
  directions_.assign(objects_.size(), 0.0);
  put_in_at_.assign(objects_.size(), {});
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (!is_present(i)) {
      const auto index = belief::find_object(*window_.start, objects_[i].name);
      const belief::ObjectBelief& object = window_.start->objects[static_cast<std::size_t>(*index)];
      if (!object.particles.empty()) put_in_at_[i] = belief::estimate(*window_.start, object).mean;
      continue;
    }
    put_in_at_[i] = *start_pose(i);
    const TrackedMotion motion = motion_of(i);
    const Vector3d d = motion.first_step - up * up.dot(motion.first_step);
    if (motion.moved && d.norm() > 1e-3) directions_[i] = std::atan2(up.cross(x).dot(d), x.dot(d));
  }
}

bool EventPaths::is_held(std::size_t object) const {
  return is_present(object) && prior_.likeliest.objects[object].mode == belief::MotionMode::kHeld;
}

double EventPaths::may_be_absent(std::size_t object) const {
  if (is_held(object)) return 0.0;
  const auto index = belief::find_object(*window_.start, objects_[object].name);
  const belief::ObjectBelief& believed = window_.start->objects[static_cast<std::size_t>(*index)];
  // Of what is lost, existence speaks of the place where it was, not of others; and it follows slowly: the state says
  // what the last frame did. What was refuted is out of sight next to where it was, or gone.
  if (!is_present(object)) return kOpenAbsence;
  const bool refuted = believed.state == belief::TrackState::kUnseen && believed.existence < kNeverRefuted;
  const bool open = refuted || believed.state == belief::TrackState::kDoubtful;
  return open ? std::max(kOpenAbsence, 1.0 - believed.existence) : 1.0 - believed.existence;
}

std::optional<Pose> EventPaths::start_pose(std::size_t object) const {
  if (!is_present(object)) return std::nullopt;
  return prior_.likeliest.objects[object].X_WO;
}

std::vector<belief::Trajectory> EventPaths::run(std::span<const belief::WorldState> starts,
                                                std::span<const std::vector<belief::Action>> actions,
                                                std::optional<std::size_t> moved) {
  std::vector<belief::Trajectory> runs(starts.size());
  const double until = std::max(duration_, horizon_);
  const WindowEnd end(until);
  simulation::RunRequest request;
  request.stop.duration = until + kEventInterval;
  request.stop.stop_at_rest = actions_.empty();
  request.stop.world_radius = world_radius_;
  request.sample_interval = kEventInterval;
  request.end_rule = &end;
  core::ThreadPool& pool = *context_.simulation.pool;
  if (moved && still_) {
    const auto count =
        local_->run(*moved, {starts, actions, &request, stream_, &pool, context_.simulation.cancellation}, runs);
    if (!count && failure_.ok()) failure_ = count.status();
    if (!count)
      for (std::size_t i = 0; i < runs.size(); ++i) runs[i].states = {starts[i]};
    simulated_ += count ? *count : 0;
    return runs;
  }
  simulation::run_own_actions(*simulator_, starts, actions, request, stream_, 0, pool, runs,
                              context_.simulation.cancellation);
  simulated_ += static_cast<int>(runs.size());
  return runs;
}

std::vector<belief::Action> EventPaths::actions_from(double time) const {
  std::vector<belief::Action> left;
  for (const belief::Action& action : actions_) {
    belief::Action later = action;
    later.time -= time;
    // A push that is over takes part in no step, and every instance has the same ones.
    if (later.time >= 0.0 || std::holds_alternative<belief::Push>(later.what)) left.push_back(std::move(later));
  }
  return left;
}

std::vector<ObjectPath> EventPaths::base() {
  base_.assign(objects_.size(), ObjectPath(times_.size()));
  belief::Trajectory likeliest;
  likeliest.states = {prior_.likeliest};
  if (!still_) {
    const belief::WorldState start = likeliest_start();
    const std::vector<std::vector<belief::Action>> actions = {actions_from(0.0)};
    likeliest = run(std::span(&start, 1), actions).front();
  }
  for (std::size_t i = 0; i < present(); ++i)
    for (std::size_t k = 0; k < times_.size(); ++k) base_[i][k] = pose_in(likeliest, i, times_[k]);
  return base_;
}

int EventPaths::event_dimensions(const Hypothesis& hypothesis) const {
  // What was there already stands where it may be put in.
  if (hypothesis.begins_otherwise && !is_present(hypothesis.object)) return kPutDimensions;
  switch (hypothesis.kind) {
    case EventKind::kPushed:
      return 6;
    case EventKind::kBumped:
      return 5;
    case EventKind::kSlipped:
      return 7;
    case EventKind::kMoved:
    case EventKind::kPutIn:
      return kPutDimensions;
    case EventKind::kTakenAway:
    case EventKind::kExchanged:
      return 1;
    default:
      return 0;
  }
}

int EventPaths::dimensions(const Hypothesis& hypothesis) const {
  const bool starts = is_present(hypothesis.object) && !hypothesis.begins_otherwise;
  const int start = starts ? samplers_[hypothesis.object]->dimensions() : 0;
  return event_dimensions(hypothesis) + start;
}

EventDraw EventPaths::decode(const Hypothesis& hypothesis, const LatentPoint& z) const {
  EventDraw draw;
  if (event_dimensions(hypothesis) == 0) return draw;
  draw.time = hypothesis.begins_otherwise ? 0.0 : duration_ * to_uniform(z[0]);
  const auto log_normal = [](double median, double spread, double x) { return median * std::exp(spread * x); };
  switch (hypothesis.kind) {
    case EventKind::kPushed:
    case EventKind::kBumped: {
      // Uniform, counted from where the guess is, so that a posterior about it has no ends.
      draw.direction = directions_[hypothesis.object] + 2.0 * std::numbers::pi * (to_uniform(z[1]) - 0.5);
      draw.height = priors_.lowest_touch + (priors_.highest_touch - priors_.lowest_touch) * to_uniform(z[2]);
      draw.sideways = priors_.sideways_touch * (2.0 * to_uniform(z[3]) - 1.0);
      const bool pushed = hypothesis.kind == EventKind::kPushed;
      draw.speed = pushed ? log_normal(priors_.push_speed, priors_.push_speed_spread, z[4])
                          : log_normal(priors_.bump_speed, priors_.bump_speed_spread, z[4]);
      if (pushed) draw.duration = log_normal(priors_.push_duration, priors_.push_duration_spread, z[5]);
      break;
    }
    case EventKind::kSlipped:
      draw.added.linear = priors_.slip_speed * Vector3d(z[1], z[2], z[3]);
      draw.added.angular = priors_.slip_rate * Vector3d(z[4], z[5], z[6]);
      break;
    case EventKind::kNothing:
    case EventKind::kMoved:
    case EventKind::kPutIn:
      draw.duration = hypothesis.kind == EventKind::kMoved
                          ? log_normal(priors_.carry_duration, priors_.carry_duration_spread, z[1])
                          : 0.0;
      draw.shift = Vector3d(priors_.carry_distance * z[2], priors_.carry_distance * z[3], priors_.carry_height * z[4]);
      draw.turn = 2.0 * std::numbers::pi * (to_uniform(z[5]) - 0.5);
      draw.other_face = z[6] > 0.0;
      break;
    default:
      break;
  }
  return draw;
}

Pose EventPaths::start_at(const Hypothesis& hypothesis, const LatentPoint& z) const {
  return start_of(hypothesis.object, z, static_cast<std::size_t>(event_dimensions(hypothesis)))
      .objects[hypothesis.object]
      .X_WO;
}

belief::WorldState EventPaths::likeliest_start() const {
  belief::WorldState state = prior_.likeliest;
  state.time = 0.0;
  return state;
}

belief::WorldState EventPaths::start_of(std::size_t object, const LatentPoint& z, std::size_t first) const {
  belief::WorldState state = likeliest_start();
  if (!is_present(object)) return state;
  std::vector<double> uniforms;
  for (std::size_t i = first; i < z.size(); ++i) uniforms.push_back(to_uniform(z[i]));
  state.objects[object] = samplers_[object]->draw(uniforms).objects.front();
  if (prior_.likeliest.objects[object].mode == belief::MotionMode::kHeld)
    state.objects[object].mode = belief::MotionMode::kHeld;
  if (seating_->any()) seating_->apply(state);
  return state;
}

}  // namespace prescene::queries
