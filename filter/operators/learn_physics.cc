// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/learn_physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "motion_following.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/predict.h"
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

double seconds_of(const MotionEpisode& episode, const MotionSample& sample) {
  return 1e-9 * static_cast<double>(sample.stamp_ns - episode.samples.front().stamp_ns);
}

/// A body that is seen at each frame starts and stops between frames. Where its velocity changes, the interval gets the
/// corner at which the straight motions before and after it meet: joining the frames by straight lines would let a
/// pusher brake for a frame's length, and what it pushes leave it too early.
std::vector<belief::KinematicBody::Waypoint> with_corners(const std::vector<belief::KinematicBody::Waypoint>& seen) {
  std::vector<belief::KinematicBody::Waypoint> path;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    path.push_back(seen[k]);
    if (k == 0 || k + 2 >= seen.size()) continue;
    const auto velocity = [&](std::size_t from) -> geometry::Vector3d {
      return (seen[from + 1].X_WG.translation - seen[from].X_WG.translation) / (seen[from + 1].time - seen[from].time);
    };
    const geometry::Vector3d before = velocity(k - 1), after = velocity(k + 1), change = before - after;
    const double fastest = std::max(before.norm(), after.norm());
    if (!(change.norm() > 0.2 * fastest)) continue;
    const double length = seen[k + 1].time - seen[k].time;
    const geometry::Vector3d step = seen[k + 1].X_WG.translation - seen[k].X_WG.translation;
    const double corner = (step - length * after).dot(change) / change.squaredNorm();
    if (!(corner > 0.02 * length && corner < 0.98 * length)) continue;
    Pose X_WG = geometry::interpolate(seen[k].X_WG, seen[k + 1].X_WG, corner / length);
    X_WG.translation =
        0.5 * (seen[k].X_WG.translation + corner * before + seen[k + 1].X_WG.translation - (length - corner) * after);
    path.push_back({seen[k].time + corner, X_WG});
  }
  return path;
}

/// One episode of one object, and how to simulate it.
class Judge {
 public:
  Judge(const belief::Belief& belief, std::size_t object, const LearnPhysicsOptions& options)
      : belief_(belief), object_(object), options_(options), episode_(*belief.objects[object].motion.episode) {
    const belief::ObjectModel& model = belief::model_of(belief, belief.objects[object]);
    symmetry_ = &model.symmetry;
    p_OQ_ = model.visual ? geometry::bounding_box(*model.visual).center() : belief::mean(model.center_of_mass);
    for (std::size_t i = 0; i < belief.objects.size(); ++i) {
      const belief::ObjectBelief& other = belief.objects[i];
      if (i != object && (other.existence < 0.5 || other.state == belief::TrackState::kLost ||
                          i >= episode_.others.size() || other.particles.empty()))
        continue;
      present_.push_back(i);
    }
    keep_within_reach();
    place_ = static_cast<std::size_t>(std::find(present_.begin(), present_.end(), object) - present_.begin());
    draw_starts();
  }

  double duration() const { return seconds_of(episode_, episode_.samples.back()); }

  /// Robot bodies move as they did, actions are over, and nothing is asked.
  belief::Scene scene() const {
    belief::Scene scene = *belief_.scene;
    std::vector<belief::SceneObject> kept;
    for (const std::size_t i : present_) kept.push_back(scene.objects[i]);
    scene.objects = std::move(kept);
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

  int variants() const { return static_cast<int>(starts_.size()); }

  /// The start of one variant under one draw.
  belief::WorldState start(const PhysicalDraw& draw, int variant) const {
    belief::WorldState state;
    for (const std::size_t i : present_) {
      const belief::ObjectBelief& other = belief_.objects[i];
      const belief::ObjectModel& model = belief::model_of(belief_, other);
      belief::ObjectState to;
      to.mode =
          holder_of(*belief_.scene, static_cast<int>(i)) ? belief::MotionMode::kHeld : belief::MotionMode::kMoving;
      if (i == object_) {
        to = starts_[static_cast<std::size_t>(variant)];
        to.physical = belief::physical_at(model, draw.uniforms);
      } else {
        to.X_WO = episode_.others[i];
        to.physical = belief::PhysicalSampler(model, other.physics).mean();
      }
      state.objects.push_back(to);
    }
    return state;
  }

  /// Mean squared standardised error of a run, or nothing where it is no prediction.
  std::optional<double> misfit(const belief::Trajectory& run) const {
    if (run.end != belief::TrajectoryEnd::kDuration || run.states.size() < 2) return std::nullopt;
    double sum = 0.0, path = 0.0, turned = 0.0;
    const MotionSample* before = &episode_.samples.front();
    for (std::size_t k = 1; k < episode_.samples.size(); ++k) {
      const MotionSample& sample = episode_.samples[k];
      path += (sample.X_WO * p_OQ_ - before->X_WO * p_OQ_).norm();
      turned += geometry::symmetric_angle(sample.X_WO, before->X_WO, *symmetry_);
      before = &sample;
      const Pose X_WO = pose_at(run, seconds_of(episode_, sample));
      if (!X_WO.is_finite()) return std::nullopt;
      const auto variance = [&](double deviation, double share, double floor) {
        return deviation * deviation + share * share + floor * floor;
      };
      const double shift = variance(sample.deviation.tail<3>().norm() / std::sqrt(3.0), options_.model_share * path,
                                    options_.shift_floor);
      const double turn = variance(sample.deviation.head<3>().norm() / std::sqrt(3.0), options_.model_share * turned,
                                   options_.turn_floor);
      const double angle = geometry::symmetric_angle(X_WO, sample.X_WO, *symmetry_);
      const double square = (X_WO * p_OQ_ - sample.X_WO * p_OQ_).squaredNorm() / shift + angle * angle / turn;
      sum += std::min(square, kMostSquares);
    }
    return sum / static_cast<double>(episode_.samples.size() - 1);
  }

  /// How many of the samples count as independent.
  double independent_samples() const {
    return std::min(1.0 + duration() / options_.correlation_time, static_cast<double>(episode_.samples.size() - 1));
  }

 private:
  struct Ball {
    geometry::Vector3d p_W;
    double radius;
  };
  Ball ball_of(std::size_t i, const Pose& X_WO) const {
    const belief::ObjectModel& model = belief::model_of(belief_, belief_.objects[i]);
    if (!model.visual) return {X_WO.translation, std::numeric_limits<double>::infinity()};
    const geometry::Vector3d middle = geometry::bounding_box(*model.visual).center();
    return {X_WO * middle, geometry::radius_about(*model.visual, middle)};
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

  /// What lies on something is shifted along the plane across gravity and turned about gravity only: it lies.
  void draw_starts() {
    const MotionSample& first = episode_.samples.front();
    const geometry::Vector3d gravity = belief_.scene->gravity_W;
    const bool lies = episode_.kind != EpisodeKind::kRelease && gravity.norm() > 0.0;
    const core::RandomStream stream(belief_.seed, core::Purpose::kLearning, static_cast<std::uint64_t>(first.stamp_ns));
    const int wanted = episode_.kind == EpisodeKind::kRest ? 1 : std::max(1, options_.variants);
    for (int v = 0; v < wanted; ++v) {
      belief::ObjectState state;
      state.mode = belief::MotionMode::kMoving;
      state.X_WO = first.X_WO;
      state.V_WO = episode_.V_start;
      core::RandomStream mine = stream.at(static_cast<std::uint64_t>(first.stamp_ns), static_cast<std::uint32_t>(v));
      Vector6d d;
      for (int k = 0; k < 6; ++k) d[k] = mine.normal() * first.deviation[k];
      if (v > 0 && lies) {
        const geometry::Vector3d up = -gravity.normalized();
        const geometry::Vector3d shift = d.tail<3>() - up * up.dot(d.tail<3>());
        const geometry::Vector3d p_WQ = first.X_WO * p_OQ_;
        state.X_WO.rotation = (geometry::exp_rotation(up * d[2]) * first.X_WO.rotation).normalized();
        state.X_WO.translation = p_WQ + shift - state.X_WO.rotation * p_OQ_;
      } else if (v > 0) {
        state.X_WO = geometry::normalized(geometry::box_plus(first.X_WO, d));
        for (int k = 0; k < 3; ++k) state.V_WO.linear[k] += options_.release_speed_error * mine.normal();
      }
      starts_.push_back(state);
    }
  }

  const belief::Belief& belief_;
  std::size_t object_;
  const LearnPhysicsOptions& options_;
  MotionEpisode episode_;  // a copy: the belief's own ends while this judges
  const geometry::SymmetryGroup* symmetry_ = nullptr;
  geometry::Vector3d p_OQ_;
  std::vector<std::size_t> present_;  // indices of the belief's objects in the simulated scene
  std::size_t place_ = 0;             // of the object among them
  std::vector<belief::ObjectState> starts_;
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

/// Simulates these draws; the logarithm of the mean likelihood over the variants, and the least misfit, of each.
struct Judged {
  std::vector<double> log_likelihoods;
  std::vector<double> misfits;
};
core::Result<Judged> judge_draws(const Judge& judge, const std::vector<PhysicalDraw>& draws,
                                 std::span<const std::size_t> chosen, const belief::Belief& belief,
                                 const simulation::SimulatorFactory& simulators, core::ThreadPool& threads) {
  PRESCENE_TRY(const auto simulator, simulators(judge.scene(), 1.0));
  std::vector<belief::WorldState> starts;
  for (const std::size_t i : chosen)
    for (int v = 0; v < judge.variants(); ++v) starts.push_back(judge.start(draws[i], v));
  simulation::RunRequest request;
  request.stop.duration = judge.duration();
  request.stop.stop_at_rest = false;
  request.stop.world_radius = std::numeric_limits<double>::infinity();
  request.sample_interval = kSampleInterval;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator->run(starts, request, core::RandomStream(belief.seed, core::Purpose::kLearning), 0, threads, runs);
  Judged judged;
  const double count = judge.independent_samples();
  const auto variants = static_cast<std::size_t>(judge.variants());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    std::vector<double> logs;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < variants; ++v) {
      const std::optional<double> misfit = judge.misfit(runs[i * variants + v]);
      if (!misfit) continue;
      least = std::min(least, *misfit);
      logs.push_back(-0.5 * count * *misfit);
    }
    double log_mean = -std::numeric_limits<double>::infinity();
    if (!logs.empty()) {
      const double largest = *std::max_element(logs.begin(), logs.end());
      double sum = 0.0;
      for (const double value : logs) sum += std::exp(value - largest);
      log_mean = largest + std::log(sum / static_cast<double>(variants));
    }
    judged.log_likelihoods.push_back(log_mean);
    judged.misfits.push_back(least);
  }
  return judged;
}

/// Judges some more draws of an object's closed episode; ends it when all are judged.
void go_on_judging(std::size_t index, const LearnPhysicsOptions& options,
                   const simulation::SimulatorFactory& simulators, core::ThreadPool& threads, int& runs_left,
                   belief::Belief& belief, LearnReport& report) {
  belief::ObjectBelief& object = belief.objects[index];
  MotionEpisode& episode = *object.motion.episode;
  const belief::ObjectModel& model = belief::model_of(belief, object);
  const std::vector<PhysicalDraw> draws = belief::draws_of(model, object.physics, belief.seed + index);
  const Judge judge(belief, index, options);
  std::vector<std::size_t> chosen;
  const bool probe = episode.kind == EpisodeKind::kRest && !episode.probed;
  if (probe) {
    chosen = extreme_draws(draws);
  } else {
    const std::size_t first = episode.log_likelihoods.size();
    const auto most = static_cast<std::size_t>(std::max(1, runs_left / judge.variants()));
    for (std::size_t i = first; i < std::min(draws.size(), first + most); ++i) chosen.push_back(i);
  }
  const auto judged = judge_draws(judge, draws, chosen, belief, simulators, threads);
  const int runs = static_cast<int>(chosen.size()) * judge.variants();
  runs_left -= runs;
  report.runs += runs;
  if (!judged) {
    report.failure = "what was learned of '" + object.name + "' is incomplete: " + judged.status().message();
    object.motion.episode.reset();
    return;
  }
  if (probe) {
    const auto [low, high] = std::minmax_element(judged->misfits.begin(), judged->misfits.end());
    if (0.5 * judge.independent_samples() * (*high - *low) < kLeastDifference) {  // it stays whatever they are
      object.motion.episode.reset();
    } else if (*low > options.largest_misfit) {
      object.motion.episode.reset();
      ++object.motion.episodes_unexplained;
      ++report.unexplained;
    } else {
      episode.probed = true;
    }
    return;
  }
  episode.log_likelihoods.insert(episode.log_likelihoods.end(), judged->log_likelihoods.begin(),
                                 judged->log_likelihoods.end());
  if (episode.log_likelihoods.size() < draws.size()) return;
  std::vector<double> logs = std::move(episode.log_likelihoods);
  const core::TimeNs ended_ns = std::min(episode.samples.back().stamp_ns, belief.stamp_ns);
  object.motion.episode.reset();
  const double best = *std::max_element(logs.begin(), logs.end());
  if (!(best >= -0.5 * judge.independent_samples() * options.largest_misfit)) {
    ++object.motion.episodes_unexplained;
    ++report.unexplained;
    return;
  }
  if (best - *std::min_element(logs.begin(), logs.end()) < kLeastDifference) return;
  // Something else would have moved it so whatever its parameters are: with that probability, before and after.
  double evidence = 0.0;
  for (std::size_t i = 0; i < draws.size(); ++i) evidence += std::exp(draws[i].log_weight + logs[i] - best);
  for (double& value : logs) value = std::log(std::exp(value - best) + options.other_cause * evidence);
  object.physics = belief::after_evidence(model, object.physics, belief.seed + index, logs, ended_ns);
  ++report.lessons;
}

}  // namespace

LearnReport learn_physics(belief::Belief& belief, const LearnPhysicsOptions& options,
                          const simulation::SimulatorFactory& simulators, core::ThreadPool& threads) {
  LearnReport report;
  int runs_left = options.runs_per_frame;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    follow_motion(belief, static_cast<int>(i), options, belief.objects[i].motion);
    auto& episode = belief.objects[i].motion.episode;
    if (!options.enabled || !simulators ||
        belief::physical_dimensions(belief::model_of(belief, belief.objects[i])) == 0)
      episode.reset();
    if (episode && episode->closed && runs_left > 0)
      go_on_judging(i, options, simulators, threads, runs_left, belief, report);
  }
  return report;
}

}  // namespace prescene::filter
