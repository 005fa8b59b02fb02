// SPDX-License-Identifier: Apache-2.0
#include "still_particles.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using belief::Particle;

constexpr double kAlikeShift = 0.003;     // m; resting particles so near to each other are compared with a frame ...
constexpr double kAlikeTurn = 0.03;       // rad; ... at one pose
constexpr double kComparedShift = 0.008;  // m; poses so near to where the frame's equations were taken ...
constexpr double kComparedTurn = 0.12;    // rad; ... are compared by these
constexpr double kQuietShift = 0.003;     // m; where the frame wants a particle no further from there than this ...
constexpr double kQuietTurn = 0.05;       // rad; ..., the equations are all there is to know, ...
constexpr double kQuietHits = 0.8;        // share; ... if so many of the visible pixels match
constexpr double kRidge = 1e-9;           // of the information, so that it can be inverted
constexpr double kOpenGain = 0.6;         // above this the frame decides, and one step may not reach its maximum

StillUpdate update_by(const PoseEquations& equations, const Pose& X_WO, const Pose& X_WO_before,
                      const Matrix6d& covariance) {
  const Vector6d since = geometry::box_minus(X_WO, X_WO_before);
  return still_update(covariance, equations.information, equations.gradient + equations.information * since,
                      kCommonError);
}

/// nats by which the frame's log likelihood at a pose is below its maximum.
double below_peak_at(const FrameLikelihood& likelihood, const Pose& X_WO) {
  Matrix6d ridged = likelihood.frame.information;
  ridged.diagonal().array() += kRidge * (1.0 + ridged.trace());
  const Vector6d slope =
      likelihood.frame.gradient - likelihood.frame.information * geometry::box_minus(X_WO, likelihood.X_WO);
  return 0.5 * slope.dot(geometry::Cholesky6(ridged).solve(slope));
}

/// Takes down what the frame says of the likelihood's pose.
void look_at(const ParticleUpdate& frame, const FrameEquations& equations, FrameLikelihood& likelihood) {
  const PoseEquations stands = frame.standing_at(likelihood.X_WO, equations);
  likelihood.frame = {equations.information, equations.gradient};
  likelihood.resting = {equations.information + stands.information, equations.gradient + stands.gradient};
}

}  // namespace

bool FrameLikelihood::covers(const Pose& other_X_WO) const {
  return is_near(geometry::box_minus(other_X_WO, X_WO), kComparedShift, kComparedTurn);
}

StillUpdate FrameLikelihood::update(const Pose& X_WO_before, const Matrix6d& covariance) const {
  return update_by(resting, X_WO, X_WO_before, covariance);
}

StillUpdate FrameLikelihood::update_by_frame(const Pose& X_WO_before, const Matrix6d& covariance) const {
  return update_by(frame, X_WO, X_WO_before, covariance);
}

bool update_quietly(const FrameLikelihood& near, Particle& particle) {
  if (near.report.evidence.hit_share() < kQuietHits || !near.covers(particle.X_WO)) return false;
  const Gaussian predicted = gaussian(particle.covariance.topLeftCorner<6, 6>());
  const StillUpdate update = near.update_by_frame(particle.X_WO, predicted.covariance);
  Mode mode;
  mode.shift = update.shift;
  mode.X_WO = geometry::box_plus(particle.X_WO, update.shift);
  mode.covariance = update.covariance;
  if (!is_near(geometry::box_minus(mode.X_WO, near.X_WO), kQuietShift, kQuietTurn)) return false;
  move_to(mode, predicted, particle);
  particle.log_weight += near.log_frame_evidence(update);
  return true;
}

std::optional<FrameLikelihood> update_still(const ParticleUpdate& frame, double dt,
                                            std::span<const std::size_t> members, const WeightOptions& options,
                                            const FrameLikelihood* near, std::vector<Particle>& particles,
                                            std::vector<ParticleWeight>& reports) {
  const Particle first = particles[members.front()];
  const Gaussian predicted = gaussian(first.covariance.topLeftCorner<6, 6>());
  std::optional<Outline> own_outline;
  const Outline* outline = frame.outline_near(first.X_WO, own_outline);
  FrameEquations equations = frame.equations_at(first.X_WO, kLastGate, outline, true);
  if (shown_share(equations.evidence) < options.hidden_share) return std::nullopt;
  frame.keep_confirmed(first.X_WO, predicted.covariance, equations);
  FrameLikelihood likelihood;
  likelihood.X_WO = first.X_WO;
  look_at(frame, equations, likelihood);
  StillUpdate update = likelihood.update(first.X_WO, predicted.covariance);
  if (update.largest_gain > kOpenGain) {
    for (int step = 0; step < options.steps && update.shift.allFinite(); ++step) {
      const double t = options.steps > 1 ? static_cast<double>(step) / (options.steps - 1) : 1.0;
      if (step > 0) likelihood.X_WO = geometry::box_plus(first.X_WO, update.shift);
      equations = frame.equations_at(likelihood.X_WO, gate_at(t), outline);
      frame.keep_confirmed(likelihood.X_WO, predicted.covariance, equations);
      look_at(frame, equations, likelihood);
      update = likelihood.update(first.X_WO, predicted.covariance);
      update.shift *= std::min(limited(update.shift.head<3>().norm(), kMostStartTurn),
                               limited(update.shift.tail<3>().norm(), kMostStartShift));
    }
  }
  if (!update.shift.allFinite() || !update.covariance.allFinite()) return std::nullopt;
  Mode mode;
  mode.shift = update.shift;
  if (!within_reach(mode, predicted, dt, options)) return std::nullopt;
  ParticleWeight report;
  const Pose X_WO_after = geometry::normalized(geometry::box_plus(first.X_WO, update.shift));
  report.evidence = frame.evidence(X_WO_after);
  report.outline = frame.outline(X_WO_after);
  likelihood.report = report;
  const double log_here = frame.weight_share() * worth(report.evidence.log_ratio, report.outline, options);
  likelihood.log_peak = log_here + update.below_peak;
  likelihood.log_frame_peak = log_here + below_peak_at(likelihood, X_WO_after);
  const FrameLikelihood& weighing =
      near != nullptr && near->covers(X_WO_after) && near->covers(first.X_WO) ? *near : likelihood;
  for (const std::size_t i : members) {
    Particle& particle = particles[i];
    const bool alike = particle.X_WO == first.X_WO && particle.covariance == first.covariance;
    const Gaussian own = alike ? predicted : gaussian(particle.covariance.topLeftCorner<6, 6>());
    const StillUpdate mine = alike ? update : likelihood.update(particle.X_WO, own.covariance);
    const double log_evidence =
        weighing.log_evidence(&weighing == &likelihood ? mine : weighing.update(particle.X_WO, own.covariance));
    Mode moved;
    moved.shift = mine.shift;
    moved.X_WO = geometry::box_plus(particle.X_WO, mine.shift);
    moved.covariance = mine.covariance;
    move_to(moved, own, particle);
    particle.log_weight += log_evidence;
    reports[i] = report;
  }
  return likelihood;
}

StillGroups still_groups_of(const std::vector<Particle>& particles,
                            std::span<const rendering::FrameTerms* const> terms_of) {
  StillGroups groups;
  std::vector<std::size_t> resting;
  for (std::size_t i = 0; i < particles.size(); ++i)
    (particles[i].mode == belief::MotionMode::kResting ? resting : groups.others).push_back(i);
  std::stable_sort(resting.begin(), resting.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  for (const std::size_t i : resting) {
    const auto group = std::find_if(groups.still.begin(), groups.still.end(), [&](const auto& members) {
      return (terms_of.empty() || terms_of[i] == terms_of[members.front()]) &&
             is_near(geometry::box_minus(particles[i].X_WO, particles[members.front()].X_WO), kAlikeShift, kAlikeTurn);
    });
    if (group != groups.still.end())
      group->push_back(i);
    else
      groups.still.push_back({i});
  }
  return groups;
}

}  // namespace prescene::filter
