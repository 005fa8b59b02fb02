// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/turn_looks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "motion_following.h"
#include "prescene/belief/distribution.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/standing.h"
#include "prescene/geometry/dense_solvers.h"
#include "rival_search.h"
#include "turns.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;
using geometry::SymmetryGroup;

constexpr std::size_t kMostNear = 24;     // of the turned poses, the best as they are; refined narrowly, beside all
constexpr std::size_t kMostFine = 12;     // of the turned poses, the best in the coarse image; refined in the fine one
constexpr std::size_t kMostClimbing = 8;  // of these; they climb by evidence
constexpr std::size_t kMostTurns = 8;     // that are not held
// What is turned about its middle may be off by as much as the middle is off the axis that it seems to be turned about.
constexpr RefineOptions kCoarseTurnRefine = {.steps = 5, .first_gate = 0.05, .last_gate = 0.015};
constexpr RefineOptions kFineTurnRefine = {.steps = 6, .first_gate = 0.02, .last_gate = 0.006};
// First steps of the climb along and about each axis.
constexpr double kClimbShift = 0.002;  // m
constexpr double kClimbTurn = 0.05;    // rad
constexpr double kClimbGrowth = 0.5;   // of the steps, from round to round
constexpr int kClimbRounds = 3;
constexpr double kHopelessTurn = 15.0;          // nats behind what was followed
constexpr double kClearlyBetter = 1.0;          // nats
constexpr double kMostKnownBetter = 15.0;       // nats, of earlier frames against one
constexpr double kLeastTurnDeviation = 0.0175;  // rad, of a prior: scenes are no more exact
constexpr double kLeastLogWeight = -700.0;      // of a turn whose particles have none
constexpr double kNoEvidence = -std::numeric_limits<double>::infinity();

/// A pose, what the fine image says of it (tempered), and what else is known of its turn; nats.
struct TurnFit {
  Pose X_WO;
  rendering::PoseEvidence evidence;
  double log_frame = kNoEvidence;
  double log_prior = 0.0;
  double log_stands = 0.0;  ///< What physics says of it, against the likeliest particle.

  double log(int cameras) const { return cameras * log_frame + log_prior + log_stands; }
};

struct TurnFits {
  std::vector<TurnFit> all;  ///< Of the particles, in their order, as they are; then of poses of many turns, fitted.
  double pixels = 0.0;       ///< That tell of the object in the fine image ...
  double share = 0.0;        ///< ... and by how much their evidence is tempered.
};

/// Moves poses to where their evidence is largest near by: along and about the camera's axes and about the vertical.
void climb_by_evidence(const TurnLook& look, RivalSearch& search, std::span<Pose> X_WO) {
  std::vector<rendering::PoseEvidence> best = search.evaluate(X_WO);
  const Eigen::Matrix3d R_WC = look.frame.X_WC.rotation.toRotationMatrix();
  double scale = 1.0;
  for (int round = 0; round < kClimbRounds; ++round, scale *= kClimbGrowth)
    for (int axis = 0; axis < 6; ++axis) {
      // The camera's third axis of rotation is nearly one of the others for what stands and is looked down upon.
      const Vector3d direction_W = axis == 2 ? look.frame.up_W : Vector3d(R_WC.col(axis % 3));
      std::vector<Pose> moved;
      for (const Pose& pose : X_WO)
        for (const double sign : {-scale, scale}) {
          if (axis < 3) {
            Vector6d d = Vector6d::Zero();
            d.head<3>() = pose.rotation.conjugate() * (sign * kClimbTurn * direction_W);
            moved.push_back(moved_about(pose, look.fine_target.centre(), d));
          } else {
            moved.push_back({pose.rotation, pose.translation + sign * kClimbShift * direction_W});
          }
        }
      const std::vector<rendering::PoseEvidence> evidence = search.evaluate(moved);
      for (std::size_t i = 0; i < moved.size(); ++i)
        if (evidence[i].log_ratio > best[i / 2].log_ratio) best[i / 2] = evidence[i], X_WO[i / 2] = moved[i];
    }
}

TurnFits fits_in(const TurnLook& look, RivalSearch& coarse, RivalSearch& fine, const SymmetryGroup& symmetry,
                 const std::vector<Particle>& particles, const std::vector<Turn>& turns, const WeightOptions& weighting,
                 const FilterTools& tools) {
  const std::vector<Pose> turned =
      turned_poses(particles[turns.front().leader].X_WO, look.target, symmetry, look.frame);
  std::vector<Pose> tried = turned, near, fitted, best, X_WO;
  coarse.refine(kCoarseTurnRefine, tried);
  add_apart(turned, coarse.evaluate(turned), symmetry, kMostNear, near);
  coarse.refine(kRivalRefine, near);
  tried.insert(tried.end(), near.begin(), near.end());
  for (const Turn& turn : turns) fitted.push_back(particles[turn.leader].X_WO);
  add_apart(tried, coarse.evaluate(tried), symmetry, kMostFine + turns.size(), fitted);
  fine.refine(kFineTurnRefine, fitted);
  add_apart(fitted, fine.evaluate(fitted), symmetry, kMostClimbing, best);
  climb_by_evidence(look, fine, best);
  for (const Particle& particle : particles) X_WO.push_back(particle.X_WO);
  X_WO.insert(X_WO.end(), fitted.begin(), fitted.end());
  X_WO.insert(X_WO.end(), best.begin(), best.end());

  const std::vector<rendering::PoseEvidence> evidence = fine.evaluate(X_WO);
  const Particle& followed = particles[turns.front().leader];
  const std::shared_ptr<const RestingShape> shape = tools.meshes->resting_shape(*look.target.mesh);
  std::optional<StandingOdds> odds;
  if (followed.mode == belief::MotionMode::kResting)
    odds.emplace(*shape, *look.target.mesh, *look.frame.surfaces, look.frame.up_W, followed.X_WO);
  TurnFits fits;
  fits.pixels = std::max(kFewestRivalPixels, static_cast<double>(evidence[turns.front().leader].measured));
  fits.share = rendering::tempering(look.fine_terms.tempering.weight, fits.pixels, look.fine_terms.step);
  for (std::size_t i = 0; i < X_WO.size(); ++i) {
    TurnFit fit{X_WO[i], evidence[i], fits.share * evidence[i].log_ratio, look.prior.log(X_WO[i])};
    if (odds) fit.log_stands = odds->log_of(X_WO[i]);
    if (i >= particles.size() &&
        look.frame.surfaces->overlap(*look.target.mesh, X_WO[i], weighting.support_tolerance) > kMostInSupport)
      fit.log_frame = kNoEvidence;
    fits.all.push_back(fit);
  }
  return fits;
}

struct JudgedTurn {
  const TurnFit* fit;  ///< The best that is turned so.
  double log_odds;     ///< nats, against the likeliest.
};

/// Of the turns that are held, in their order, then of those that are new, best first: as they were before.
std::vector<JudgedTurn> turns_before(const std::vector<TurnFit>& fits, const std::vector<Particle>& particles,
                                     const std::vector<Turn>& turns, const SymmetryGroup& symmetry, int cameras) {
  std::vector<const TurnFit*> order;
  for (const TurnFit& fit : fits) order.push_back(&fit);
  std::stable_sort(order.begin(), order.end(),
                   [&](const TurnFit* a, const TurnFit* b) { return a->log(cameras) > b->log(cameras); });
  std::vector<JudgedTurn> judged;
  for (const Turn& turn : turns) {
    const Pose& X_WO = particles[turn.leader].X_WO;
    const auto fit = std::find_if(order.begin(), order.end(),
                                  [&](const TurnFit* other) { return !is_apart(other->X_WO, X_WO, symmetry); });
    judged.push_back({*fit, turn.log_before - turns.front().log_before});
  }
  for (const TurnFit* fit : order) {
    if (judged.size() >= turns.size() + kMostTurns || !std::isfinite(fit->log_frame)) break;
    if (std::all_of(judged.begin(), judged.end(),
                    [&](const JudgedTurn& other) { return is_apart(fit->X_WO, other.fit->X_WO, symmetry); }))
      judged.push_back({fit, kFoundLogOdds});
  }
  return judged;
}

/// What earlier frames say against a pose, nats: of what looks before this one had part in.
double log_known(const Particle& particle, const Pose& X_WO, double gain) {
  const Vector6d off = geometry::box_minus(X_WO, particle.X_WO);
  const geometry::Cholesky6 covariance(particle.covariance.topLeftCorner<6, 6>());
  if (!covariance.positive_definite()) return 0.0;
  return (1.0 - gain) * std::min(kMostKnownBetter, 0.5 * off.dot(covariance.solve(off)));
}

void put_at(const Pose& X_WO, const geometry::Matrix6d& covariance, Particle& particle) {
  particle.X_WO = X_WO;
  particle.covariance.topLeftCorner<6, 6>() = covariance;
  particle.covariance.bottomLeftCorner<6, 6>().setZero();
  particle.covariance.topRightCorner<6, 6>().setZero();
}

}  // namespace

TurnPrior::TurnPrior(const belief::SceneObject& object, const SymmetryGroup& symmetry)
    : symmetry_(symmetry), mean_(belief::mean(object.pose)) {
  if (has_wide_prior(object)) return;
  geometry::Matrix3d covariance = belief::covariance(object.pose).topLeftCorner<3, 3>();
  covariance.diagonal().array() += kLeastTurnDeviation * kLeastTurnDeviation;
  information_ = covariance.inverse();
}

double TurnPrior::log(const Pose& X_WO) const {
  if (!information_) return 0.0;
  const Vector3d turn = geometry::box_minus(geometry::closest_equivalent(X_WO, mean_, symmetry_), mean_).head<3>();
  return std::max(-0.5 * turn.dot(*information_ * turn), kSlipLogOdds);
}

int look_at_turns(const TurnLook& look, const SymmetryGroup& symmetry, const WeightOptions& weighting,
                  const InitialiseOptions& spread, const FilterTools& tools, ObjectBelief& object) {
  std::vector<Particle>& particles = object.particles;
  if (symmetry.ball || particles.empty()) return 1;
  const Pose before = belief::estimate(object, symmetry).mean;
  std::vector<Turn> turns;
  const std::vector<std::size_t> turn_of = turns_of(particles, symmetry, turns);
  for (Turn& turn : turns) turn.log_before = kLeastLogWeight;
  for (std::size_t i = 0; i < particles.size(); ++i)
    turns[turn_of[i]].log_before = log_sum(turns[turn_of[i]].log_before, particles[i].log_weight);
  RivalSearch coarse(look.frame, look.terms, look.target, weighting, tools);
  RivalSearch fine(look.frame, look.fine_terms, look.fine_target, weighting, tools);
  const TurnFits fits = fits_in(look, coarse, fine, symmetry, particles, turns, weighting, tools);
  std::vector<JudgedTurn> judged = turns_before(fits.all, particles, turns, symmetry, look.cameras);
  // What was followed and has been turned since the start is known better than the scene says.
  const TurnFit& followed = *judged.front().fit;
  const double otherwise = followed.log_prior > kSlipLogOdds ? 0.0 : kSlipLogOdds;
  // Evidence in favour is worth less where nothing ends at the outline; of a turn that is far behind it need not be
  // known.
  const auto log_of = [&](const TurnFit& fit) {
    if (fit.log_frame < followed.log_frame - kHopelessTurn) return fit.log(look.cameras);
    return look.cameras * fits.share * fine.worth(fit.evidence, fit.X_WO) + fit.log_prior + fit.log_stands;
  };
  const double log_followed = log_of(followed);
  double log_best = kNoEvidence;
  for (JudgedTurn& turn : judged) {
    const bool is_followed = &turn == &judged.front();
    const double now = is_followed ? 0.0 : log_of(*turn.fit) - log_followed + otherwise;
    turn.log_odds = (1.0 - look.gain) * turn.log_odds + look.gain * now;
    log_best = std::max(log_best, turn.log_odds);
  }

  for (std::size_t i = 0; i < particles.size(); ++i) {
    const JudgedTurn& turn = judged[turn_of[i]];
    const double better = turn.fit->log(look.cameras) - fits.all[i].log(look.cameras);
    if (better > kClearlyBetter && better > kClearlyBetter + log_known(particles[i], turn.fit->X_WO, look.gain))
      put_at(turn.fit->X_WO, fine.covariance_at(turn.fit->X_WO, fits.pixels, spread), particles[i]);
    particles[i].log_weight += turn.log_odds - turns[turn_of[i]].log_before;
  }
  std::vector<std::size_t> lightest(particles.size());
  std::iota(lightest.begin(), lightest.end(), std::size_t{0});
  std::stable_sort(lightest.begin(), lightest.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight < particles[b].log_weight; });
  const Particle pattern = particles[turns.front().leader];
  std::size_t replaced = 0;
  int likely = 0;
  for (std::size_t t = 0; t < judged.size(); ++t) {
    if (judged[t].log_odds < log_best + kFoundLogOdds) continue;
    ++likely;
    if (t < turns.size() || replaced >= particles.size() / 2) continue;
    Particle& particle = particles[lightest[replaced++]];
    particle = pattern;
    put_at(judged[t].fit->X_WO, fine.covariance_at(judged[t].fit->X_WO, fits.pixels, spread), particle);
    particle.log_weight = judged[t].log_odds;
  }
  belief::normalize(particles);
  const Pose after = belief::estimate(object, symmetry).mean;
  const Vector6d change = geometry::box_minus(after, before);
  if (change.head<3>().norm() > kStartTurn || change.tail<3>().norm() > kStartShift)
    note_known_better(after, object.motion);
  return likely;
}

}  // namespace prescene::filter
