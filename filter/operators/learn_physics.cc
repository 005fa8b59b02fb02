// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/learn_physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "episode_evidence.h"
#include "falling_particles.h"
#include "motion_following.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

using belief::EpisodeKind;
using belief::MotionEpisode;
using belief::MotionSample;
using belief::PhysicalDraw;
using geometry::Vector6d;

constexpr double kSampleInterval = 1.0 / 60.0;  // s, of simulated states; between them poses are interpolated
constexpr double kTouchMargin = 0.02;           // m; what is further apart than bounding balls and this does not touch
constexpr double kMostSquares = 49.0;           // a sample that is further off than 7 standard deviations says no more

/// Nats; draws whose likelihoods differ by less say nothing.
constexpr double kLeastDifference = 0.5;

// All of the following are chosen, none is measured.
constexpr int kRunsPerDraw = 4;  // each from a start of its own that is drawn from the start's covariance
// Errors of the simulator, by which the standard deviations of the tracked poses are enlarged: this share of the path
// and of the turn since the start, and the two floors.
constexpr double kModelShare = 0.025;
constexpr double kShiftFloor = 0.0015;     // m
constexpr double kTurnFloor = 0.015;       // rad
constexpr double kCorrelationTime = 0.15;  // s; samples nearer to each other count as one
// Standard deviations of the velocities of what is let go, about the tracked ones.
constexpr double kReleaseSpeedError = 0.05;  // m/s
constexpr double kReleaseTurnError = 0.3;    // rad/s
constexpr double kLargestMisfit = 12.0;  // if the best run's mean squared standardised error is larger, none explains
constexpr double kOtherCause = 0.01;     // probability that something else moved the object, whatever its parameters

double seconds_of(const MotionEpisode& episode, const MotionSample& sample) {
  return 1e-9 * static_cast<double>(sample.stamp_ns - episode.samples.front().stamp_ns);
}

/// One episode of one object, and how to simulate it.
class Judge {
 public:
  Judge(const belief::Belief& belief, std::size_t object)
      : belief_(belief), object_(object), episode_(*belief.objects[object].motion.episode) {
    const belief::ObjectModel& model = belief::model_of(belief, belief.objects[object]);
    symmetry_ = &model.symmetry;
    p_OQ_ = model.visual ? geometry::facts_of(model.visual).box.center() : belief::mean(model.center_of_mass);
    for (std::size_t i = 0; i < belief.objects.size(); ++i) {
      const belief::ObjectBelief& other = belief.objects[i];
      if (i != object && (!is_present(other) || i >= episode_.others.size())) continue;
      present_.push_back(i);
    }
    keep_within_reach();
    place_ = static_cast<std::size_t>(std::find(present_.begin(), present_.end(), object) - present_.begin());
    choose_samples();
  }

  double duration() const { return seconds_of(episode_, episode_.samples.back()); }

  /// Robot bodies move as they did, actions are over, and nothing is asked.
  belief::Scene scene() const {
    belief::Scene scene = *belief_.scene;
    std::vector<belief::SceneObject> kept;
    for (const std::size_t i : present_) kept.push_back(scene.objects[i]);
    scene.objects = std::move(kept);
    keep_joints_of_present(scene);
    for (std::size_t i = 0; i < scene.robot.size(); ++i) {
      std::vector<belief::KinematicBody::Waypoint> seen;
      for (const MotionSample& sample : episode_.samples)
        if (i < sample.robot.size()) seen.push_back({seconds_of(episode_, sample), sample.robot[i]});
      if (!seen.empty()) scene.robot[i].timeline = with_corners(seen);
    }
    scene.actions.clear();
    scene.outcomes.clear();
    scene.exclusive_outcomes.clear();
    return scene;
  }

  int samples() const { return static_cast<int>(compared_.size()); }
  std::size_t error_size() const { return kErrorSize * compared_.size(); }

  /// Whether these can be errors of whole runs, as far as they were simulated.
  bool fits(const std::vector<double>& errors) const { return !compared_.empty() && errors.size() % error_size() == 0; }

  /// The start of a run under a draw: no two runs of an episode have the same. Without a run's number, the mean.
  belief::WorldState start(const PhysicalDraw& draw, std::optional<std::size_t> run) const {
    belief::WorldState state;
    for (const std::size_t i : present_) {
      const belief::ObjectBelief& other = belief_.objects[i];
      const belief::ObjectModel& model = belief::model_of(belief_, other);
      belief::ObjectState to;
      to.mode =
          holder_of(*belief_.scene, static_cast<int>(i)) ? belief::MotionMode::kHeld : belief::MotionMode::kMoving;
      if (i == object_) {
        to = run ? drawn_start(*run) : mean_start();
        to.physical = belief::physical_at(model, draw.uniforms);
      } else {
        to.X_WO = episode_.others[i];
        to.physical = belief::PhysicalSampler(model, other.physics).mean();
      }
      state.objects.push_back(to);
    }
    return state;
  }

  /// Appends by how many standard deviations a run is off each sample that is compared, to three decimals, as the
  /// belief keeps them meanwhile; kNoPrediction throughout where it is no prediction.
  void add_errors(const belief::Trajectory& run, std::vector<double>& errors) const {
    const std::size_t begin = errors.size();
    bool whole = run.end == belief::TrajectoryEnd::kDuration && run.states.size() >= 2;
    for (const Compared& at : compared_) {
      if (!whole) break;
      const MotionSample& sample = episode_.samples[at.sample];
      const Pose X_WO =
          geometry::closest_equivalent(pose_at(run, seconds_of(episode_, sample)), sample.X_WO, *symmetry_);
      Vector6d off;
      off.head<3>() = geometry::log_rotation(sample.X_WO.rotation.conjugate() * X_WO.rotation) / at.turn;
      off.tail<3>() = (X_WO * p_OQ_ - sample.X_WO * p_OQ_) / at.shift;
      whole = off.allFinite();
      for (int i = 0; i < kErrorSize; ++i) errors.push_back(1e-3 * std::round(1e3 * off[i]));
    }
    if (whole) return;
    errors.resize(begin);
    errors.resize(begin + error_size(), kNoPrediction);
  }

  /// How many of the samples count as independent.
  double independent_samples() const {
    return std::min(1.0 + duration() / kCorrelationTime, static_cast<double>(compared_.size()));
  }

  /// Errors of these runs beside each other.
  EpisodeRuns runs(std::span<const double> errors) const {
    const double step = duration() / static_cast<double>(compared_.size());
    return {errors, samples(), independent_samples(), kMostSquares, std::exp(-step / kCorrelationTime)};
  }

 private:
  struct Ball {
    geometry::Vector3d p_W;
    double radius;
  };
  Ball ball_of(std::size_t i, const Pose& X_WO) const {
    const belief::ObjectModel& model = belief::model_of(belief_, belief_.objects[i]);
    if (!model.visual) return {X_WO.translation, std::numeric_limits<double>::infinity()};
    const geometry::MeshFacts facts = geometry::facts_of(model.visual);
    return {X_WO * facts.box.center(), facts.radius};
  }

  /// Of the others, leaves out those that neither the object on its way nor what it may push can touch.
  void keep_within_reach() {
    std::vector<Ball> way;
    for (const MotionSample& sample : episode_.samples) way.push_back(ball_of(object_, sample.X_WO));
    std::vector<std::size_t> kept = {object_}, left;
    for (const std::size_t i : present_)
      if (i != object_) left.push_back(i);
    for (bool grew = true; grew;) {
      grew = false;
      for (auto i = left.begin(); i != left.end();) {
        const Ball ball = ball_of(*i, episode_.others[*i]);
        const bool near = std::any_of(way.begin(), way.end(), [&](const Ball& other) {
          return (other.p_W - ball.p_W).norm() < other.radius + ball.radius + kTouchMargin;
        });
        if (!near) {
          ++i;
          continue;
        }
        way.push_back(ball);
        kept.push_back(*i);
        i = left.erase(i);
        grew = true;
      }
    }
    std::sort(kept.begin(), kept.end());
    present_ = std::move(kept);
  }

  static Pose pose_of(const belief::WorldState& state, std::size_t place) { return state.objects[place].X_WO; }

  Pose pose_at(const belief::Trajectory& run, double time) const {
    const double begin = run.states.front().time;
    const auto after = std::find_if(run.states.begin() + 1, run.states.end() - 1,
                                    [&](const belief::WorldState& state) { return state.time - begin >= time; });
    const belief::WorldState& from = *(after - 1);
    const double length = after->time - from.time;
    const double share = length > 0.0 ? std::clamp((time - (from.time - begin)) / length, 0.0, 1.0) : 1.0;
    return geometry::interpolate(pose_of(from, place_), pose_of(*after, place_), share);
  }

  /// Samples half a correlation time apart, and how well each is known and can be foreseen.
  void choose_samples() {
    double path = 0.0, turned = 0.0, last = 0.0;
    const auto deviation = [&](double seen, double share, double floor) {
      return std::sqrt(seen * seen + share * share + floor * floor);
    };
    for (std::size_t k = 1; k < episode_.samples.size(); ++k) {
      const MotionSample& sample = episode_.samples[k];
      const MotionSample& before = episode_.samples[k - 1];
      path += (sample.X_WO * p_OQ_ - before.X_WO * p_OQ_).norm();
      turned += geometry::symmetric_angle(sample.X_WO, before.X_WO, *symmetry_);
      const double time = seconds_of(episode_, sample);
      if (time - last < 0.5 * kCorrelationTime && k + 1 < episode_.samples.size()) continue;
      last = time;
      compared_.push_back(
          {k, deviation(sample.deviation.tail<3>().norm() / std::sqrt(3.0), kModelShare * path, kShiftFloor),
           deviation(sample.deviation.head<3>().norm() / std::sqrt(3.0), kModelShare * turned, kTurnFloor)});
    }
  }

  belief::ObjectState mean_start() const {
    belief::ObjectState state;
    state.mode = belief::MotionMode::kMoving;
    state.X_WO = episode_.samples.front().X_WO;
    state.V_WO = episode_.V_start;
    return state;
  }

  /// What lies on something before it is pushed is shifted along the plane across gravity and turned about gravity
  /// only: it lies. Whether something lies still may depend on how it stands, for example where it leans.
  belief::ObjectState drawn_start(std::size_t run) const {
    const MotionSample& first = episode_.samples.front();
    const geometry::Vector3d gravity = belief_.scene->gravity_W;
    const bool lies = episode_.kind == EpisodeKind::kMotion && gravity.norm() > 0.0;
    const core::RandomStream stream(belief_.seed, core::Purpose::kLearning, static_cast<std::uint64_t>(first.stamp_ns));
    belief::ObjectState state = mean_start();
    core::RandomStream mine = stream.at(static_cast<std::uint64_t>(first.stamp_ns), static_cast<std::uint32_t>(run));
    Vector6d d;
    for (int k = 0; k < 6; ++k) d[k] = mine.normal() * first.deviation[k];
    if (lies) {
      const geometry::Vector3d up = -gravity.normalized();
      const geometry::Vector3d shift = d.tail<3>() - up * up.dot(d.tail<3>());
      const geometry::Vector3d p_WQ = first.X_WO * p_OQ_;
      // The deviations are those about the body's axes.
      const geometry::Vector3d up_O = first.X_WO.rotation.conjugate() * up;
      state.X_WO.rotation = (geometry::exp_rotation(up * up_O.dot(d.head<3>())) * first.X_WO.rotation).normalized();
      state.X_WO.translation = p_WQ + shift - state.X_WO.rotation * p_OQ_;
    } else {
      state.X_WO = geometry::normalized(geometry::box_plus(first.X_WO, d));
      if (episode_.kind == EpisodeKind::kRest) return state;
      for (int k = 0; k < 3; ++k) state.V_WO.linear[k] += kReleaseSpeedError * mine.normal();
      for (int k = 0; k < 3; ++k) state.V_WO.angular[k] += kReleaseTurnError * mine.normal();
    }
    return state;
  }

  struct Compared {
    std::size_t sample;  // of the episode
    double shift, turn;  // standard deviations, m and rad
  };
  const belief::Belief& belief_;
  std::size_t object_;
  MotionEpisode episode_;  // a copy: the belief's own ends while this judges
  const geometry::SymmetryGroup* symmetry_ = nullptr;
  geometry::Vector3d p_OQ_;
  std::vector<std::size_t> present_;  // indices of the belief's objects in the simulated scene
  std::size_t place_ = 0;             // of the object among them
  std::vector<Compared> compared_;
};

/// The draws at the ends of each coordinate: where even these end alike, there is nothing to learn.
std::vector<std::size_t> extreme_draws(const std::vector<PhysicalDraw>& draws) {
  std::vector<std::size_t> extreme;
  for (std::size_t k = 0; k < draws.front().uniforms.size(); ++k) {
    const auto [low, high] = std::minmax_element(
        draws.begin(), draws.end(),
        [k](const PhysicalDraw& a, const PhysicalDraw& b) { return a.uniforms[k] < b.uniforms[k]; });
    extreme.push_back(static_cast<std::size_t>(low - draws.begin()));
    extreme.push_back(static_cast<std::size_t>(high - draws.begin()));
  }
  return extreme;
}

/// Simulates the motion from these starts and appends the errors.
core::Status add_runs(const Judge& judge, std::span<const belief::WorldState> starts, const belief::Belief& belief,
                      const simulation::SimulatorFactory& simulators, core::ThreadPool& threads,
                      std::vector<double>& errors) {
  PRESCENE_TRY(const auto simulator, simulators(judge.scene(), 1.0));
  simulation::RunRequest request;
  request.stop.duration = judge.duration();
  request.stop.stop_at_rest = false;
  request.stop.world_radius = std::numeric_limits<double>::infinity();
  request.sample_interval = kSampleInterval;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator->run(starts, request, core::RandomStream(belief.seed, core::Purpose::kLearning), 0, threads, runs);
  for (const belief::Trajectory& run : runs) judge.add_errors(run, errors);
  return core::ok_status();
}

/// Of a rest that a few draws at the ends of each coordinate were simulated for: whether it says anything.
void probe_rest(const Judge& judge, std::span<const double> errors, belief::MotionRecord& motion, LearnReport& report) {
  const std::vector<double> misfits = misfits_of(judge.runs(errors));
  const auto [low, high] = std::minmax_element(misfits.begin(), misfits.end());
  if (0.5 * judge.independent_samples() * (*high - *low) < kLeastDifference) {  // it stays whatever they are
    motion.episode.reset();
  } else if (*low > kLargestMisfit) {
    motion.episode.reset();
    ++motion.episodes_unexplained;
    ++report.unexplained;
  } else {
    motion.episode->probed = true;
  }
}

/// Simulates some more runs of an object's closed episode; ends it when there are all.
void go_on_judging(std::size_t index, const simulation::SimulatorFactory& simulators, core::ThreadPool& threads,
                   int& runs_left, belief::Belief& belief, LearnReport& report) {
  belief::ObjectBelief& object = belief.objects[index];
  MotionEpisode& episode = *object.motion.episode;
  const belief::ObjectModel& model = belief::model_of(belief, object);
  const std::vector<PhysicalDraw> draws = belief::draws_of(model, object.physics, belief.seed + index);
  const Judge judge(belief, index);
  std::vector<belief::WorldState> starts;
  const bool probe = episode.kind == EpisodeKind::kRest && !episode.probed;
  const std::size_t wanted = draws.size() * static_cast<std::size_t>(kRunsPerDraw);
  if (!judge.fits(episode.run_errors)) {  // nothing to compare, or begun by another version
    object.motion.episode.reset();
    return;
  }
  if (probe) {
    for (const std::size_t i : extreme_draws(draws)) starts.push_back(judge.start(draws[i], std::nullopt));
  } else {
    const std::size_t first = episode.run_errors.size() / judge.error_size();
    for (std::size_t r = first; r < std::min(wanted, first + static_cast<std::size_t>(runs_left)); ++r)
      starts.push_back(judge.start(draws[r % draws.size()], r));
  }
  std::vector<double> errors = probe ? std::vector<double>{} : std::move(episode.run_errors);
  const core::Status done = add_runs(judge, starts, belief, simulators, threads, errors);
  runs_left -= static_cast<int>(starts.size());
  report.runs += static_cast<int>(starts.size());
  if (!done.ok()) {
    report.failure = "what was learned of '" + object.name + "' is incomplete: " + done.message();
    object.motion.episode.reset();
    return;
  }
  if (probe) {
    probe_rest(judge, errors, object.motion, report);
    return;
  }
  if (errors.size() < wanted * judge.error_size()) {
    episode.run_errors = std::move(errors);
    return;
  }
  const core::TimeNs began_ns = episode.samples.front().stamp_ns;
  const core::TimeNs ended_ns = std::min(episode.samples.back().stamp_ns, belief.stamp_ns);
  object.motion.episode.reset();
  const core::RandomStream stream(belief.seed, core::Purpose::kLearning, static_cast<std::uint64_t>(began_ns) + 1);
  const EpisodeEvidence evidence = evidence_of(judge.runs(errors), draws, kOtherCause, stream);
  if (!(evidence.least_misfit <= kLargestMisfit)) {
    ++object.motion.episodes_unexplained;
    ++report.unexplained;
    return;
  }
  const auto [low, high] = std::minmax_element(evidence.log_likelihoods.begin(), evidence.log_likelihoods.end());
  if (*high - *low < kLeastDifference) return;
  object.physics =
      belief::after_evidence(model, object.physics, belief.seed + index, evidence.log_likelihoods, ended_ns);
  ++report.lessons;
}

}  // namespace

LearnReport learn_physics(belief::Belief& belief, const LearnPhysicsOptions& options,
                          const simulation::SimulatorFactory& simulators, core::ThreadPool& threads) {
  LearnReport report;
  int runs_left = options.runs_per_frame;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    follow_motion(belief, static_cast<int>(i), belief.objects[i].motion);
    auto& episode = belief.objects[i].motion.episode;
    // How a joint's own friction goes along with the object's is not separated.
    if (!options.enabled || !simulators || belief::joint_of(*belief.scene, belief.objects[i].name) ||
        belief::physical_dimensions(belief::model_of(belief, belief.objects[i])) == 0)
      episode.reset();
    if (episode && episode->closed && runs_left > 0) go_on_judging(i, simulators, threads, runs_left, belief, report);
  }
  return report;
}

}  // namespace prescene::filter
