// SPDX-License-Identifier: Apache-2.0
#include "particle_update.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "prescene/filter/proposals/facets.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using belief::Particle;

constexpr double kSmallestVariance = 1e-10;  // keeps covariances invertible: 10 um, 10 urad
constexpr double kFirstGate = 0.03;          // m; residuals beyond about half of it lose their weight ...
constexpr double kMostTurnInStep = 0.25;     // rad
constexpr double kMostShiftInStep = 0.03;    // m
constexpr double kSharedShift = 0.003;       // m; an outline serves for poses so near to where it was taken ...
constexpr double kSharedTurn = 0.03;         // rad
constexpr double kContactHeight = 0.001;     // m, error of a support's height where no frame can tell
constexpr double kUncertainTurn = 0.03;      // rad; turns that are known better are not questioned, ...
constexpr double kLeastTold = 0.01;          // of a variance; ... nor those of which the frame says less
constexpr double kSideways = 3.0;            // standard deviations to either side of a turn in question, ...
constexpr double kLeastSideways = 0.010;     // m; ... and so far that its surface moves by this, more than noise
constexpr double kConfirms = 0.5;            // share of the fall that is told; noise and other terms take the rest
constexpr double kLogConfirms = 3.0;         // nats; a fall by as much, some three times its noise, is enough
constexpr double kLogInSupport = -12.0;      // nats; kMostInSupport and more costs this; less in proportion

/// What the outline is worth: 0 where nothing ends at it, 1 where enough does.
double outline_worth(double outline, const WeightOptions& options) {
  return std::clamp((outline - options.min_outline) / (options.full_outline - options.min_outline), 0.0, 1.0);
}

}  // namespace

Gaussian gaussian(const Matrix6d& covariance) {
  Gaussian g;
  g.covariance = 0.5 * (covariance + covariance.transpose());
  g.covariance.diagonal().array() += kSmallestVariance;
  const geometry::Cholesky6 cholesky(g.covariance);
  g.root = cholesky.factor();
  g.information = cholesky.inverse();
  g.log_determinant = 2.0 * g.root.diagonal().array().log().sum();
  return g;
}

bool is_see_through(const SearchTarget& target) { return target.material.behind > target.material.hit; }

bool is_near(const Vector6d& d, double shift, double turn) {
  return d.head<3>().norm() < turn && d.tail<3>().norm() < shift;
}

double gate_at(double t) { return kFirstGate * std::pow(kLastGate / kFirstGate, t); }

double limited(double length, double limit) { return length > limit ? limit / length : 1.0; }

double outline_at(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CO,
                  const WeightOptions& options, const FilterTools& tools) {
  return outline_support(terms, depth_of(target, X_CO, terms.camera, *tools.renderer), options.outline_step,
                         OutlineHoles::kMayEnd);
}

Outline outline_of(const SearchTarget& target, const Pose& X_CO, const rendering::FrameTerms& terms,
                   const WeightContext& context, const FilterTools& tools) {
  Outline outline(target, X_CO, context.camera, *tools.renderer);
  if (context.color != nullptr) outline.see_colors(X_CO, *context.depth, *context.color, terms);
  return outline;
}

double worth(double log_ratio, double outline, const WeightOptions& options) {
  return log_ratio > 0.0 ? outline_worth(outline, options) * log_ratio : log_ratio;
}

double shown_share(const rendering::PoseEvidence& evidence) {
  return evidence.measured > 0 ? static_cast<double>(evidence.visible) / evidence.measured : 0.0;
}

void move_to(const Mode& mode, const Gaussian& predicted, Particle& particle) {
  const Matrix6d gain = particle.covariance.bottomLeftCorner<6, 6>() * predicted.information;
  const Vector6d dv = gain * mode.shift;
  particle.X_WO = geometry::normalized(mode.X_WO);
  particle.V_WO.angular += dv.head<3>();
  particle.V_WO.linear += dv.tail<3>();
  const Matrix6d twist = particle.covariance.bottomRightCorner<6, 6>() -
                         gain * (predicted.covariance - mode.covariance) * gain.transpose();
  particle.covariance.topLeftCorner<6, 6>() = mode.covariance;
  particle.covariance.bottomLeftCorner<6, 6>() = gain * mode.covariance;
  particle.covariance.topRightCorner<6, 6>() = particle.covariance.bottomLeftCorner<6, 6>().transpose();
  particle.covariance.bottomRightCorner<6, 6>() = 0.5 * (twist + twist.transpose());
}

bool within_reach(const Mode& mode, const Gaussian& predicted, double dt, const WeightOptions& options) {
  const double spread = std::sqrt(predicted.covariance.bottomRightCorner<3, 3>().trace());
  return mode.shift.tail<3>().norm() <= options.max_jump_speed * dt + 3.0 * spread;
}

rendering::PoseEvidence evidence_of(const rendering::FrameTerms& terms, const rendering::PoseHypothesis& hypothesis,
                                    const FilterTools& tools) {
  const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
  rendering::PoseEvidence evidence;
  tools.search->batch().evaluate(terms, std::span(&hypothesis, 1), *workspace, std::span(&evidence, 1));
  return evidence;
}

ParticleUpdate::ParticleUpdate(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CW,
                               double pixels, const WeightOptions& options, const FilterTools& tools,
                               const WeightContext& context, const TakenOutline* shared_outline,
                               rendering::LikelihoodWorkspace& workspace)
    : terms_(terms),
      target_(target),
      X_CW_(X_CW),
      pixels_(pixels),
      options_(options),
      tools_(tools),
      context_(context),
      shared_outline_(shared_outline),
      workspace_(workspace),
      information_share_(rendering::tempering(terms.tempering.information, pixels, terms.step)),
      weight_share_(rendering::tempering(terms.tempering.weight,
                                         context.weight_pixels > 0.0 ? context.weight_pixels : pixels, terms.step)) {}

Mode ParticleUpdate::climb(const Pose& X_WO_predicted, const Gaussian& predicted, const Vector6d& start) const {
  Mode mode;
  mode.X_WO = geometry::box_plus(X_WO_predicted, start);
  mode.shift = start;
  std::optional<Outline> own_outline;
  const Outline* outline = outline_near(mode.X_WO, own_outline);
  FrameEquations equations;
  // Newton's step towards the mode; how far it went, and zero where there is none.
  const auto step_on = [&] {
    const Vector6d gradient = equations.gradient - predicted.information * mode.shift;
    Vector6d d = geometry::Cholesky6(predicted.information + equations.information).solve(gradient);
    if (!d.allFinite()) return Vector6d(Vector6d::Zero());
    d *= std::min(limited(d.head<3>().norm(), kMostTurnInStep), limited(d.tail<3>().norm(), kMostShiftInStep));
    mode.X_WO = geometry::box_plus(mode.X_WO, d);
    mode.shift = geometry::box_minus(mode.X_WO, X_WO_predicted);
    return d;
  };
  for (int step = 0; step <= options_.steps; ++step) {
    const double t = options_.steps > 1 ? std::min(1.0, static_cast<double>(step) / (options_.steps - 1)) : 1.0;
    equations = equations_at(mode.X_WO, gate_at(t), outline);
    if (step == options_.steps) break;  // the last pass is for the information at the mode
    const Vector6d d = step_on();
    if (d.isZero(0.0) || (is_near(d, 1e-5, 1e-4) && t == 1.0)) break;
  }
  const auto measure_spread = [&] {
    const geometry::Cholesky6 cholesky(predicted.information + equations.information);
    mode.covariance = cholesky.inverse();
    mode.log_determinant = -2.0 * cholesky.factor().diagonal().array().log().sum();
  };
  measure_spread();
  if (keep_confirmed(mode.X_WO, mode.covariance, equations)) {
    step_on();
    measure_spread();
  }
  return mode;
}

FrameEquations ParticleUpdate::equations_at(const Pose& X_WO, double gate, const Outline* outline,
                                            bool with_evidence) const {
  rendering::LineariseOptions linearise;
  linearise.gate = gate;
  linearise.with_evidence = with_evidence;
  const Pose X_CO = X_CW_ * X_WO;
  const rendering::PoseHypothesis h = hypothesis(target_, X_CO, pixels_);
  rendering::PoseLinearisation residuals;
  tools_.search->batch().linearise(terms_, std::span(&h, 1), linearise, workspace_, std::span(&residuals, 1));
  Matrix6d H = information_share_ * residuals.H;
  Vector6d g = information_share_ * residuals.g;
  without_facets(target_.facet_lever, X_CO.rotation, target_.centre(), H, g);
  FrameEquations equations;
  if (outline != nullptr) {
    const OutlineEquations edges = outline->linearise(X_CO, *context_.depth, terms_, context_.color);
    H += edges.H;
    g += edges.g;
  }
  equations.information = information_in_world(H, X_CW_.rotation);
  equations.gradient = g;
  equations.gradient.tail<3>() = X_CW_.rotation.conjugate() * g.tail<3>();
  equations.evidence = residuals.evidence;
  return equations;
}

bool ParticleUpdate::keep_confirmed(const Pose& X_WO, const Matrix6d& covariance, FrameEquations& equations) const {
  const geometry::SymmetricEigen3 turns = geometry::symmetric_eigen_3(covariance.topLeftCorner<3, 3>());
  const double radius = std::max(1e-3, static_cast<double>(target_.mesh->radius));
  std::optional<double> log_here;
  bool taken = false;
  for (int i = 0; i < 3; ++i) {
    const double deviation = std::sqrt(std::max(0.0, turns.values[i]));
    if (!(deviation > kUncertainTurn)) continue;
    // The turn by one deviation, with what follows it.
    const Vector6d sideways = covariance.leftCols<3>() * turns.vectors.col(i) / deviation;
    const Vector6d slope = equations.information * sideways;
    const double told = sideways.dot(slope);
    if (!(told > kLeastTold)) continue;
    if (!log_here) log_here = evidence(X_WO).log_ratio;
    const double least = std::min(kLeastSideways / radius, kMostStartTurn);
    const double reach = std::clamp(kSideways * deviation, least, kMostStartTurn) / deviation;
    double fall = std::numeric_limits<double>::infinity();
    for (const double side : {-reach, reach})
      fall = std::min(fall, *log_here - evidence(geometry::box_plus(X_WO, side * sideways)).log_ratio);
    const double asked = std::min(kConfirms * 0.5 * reach * reach * told, kLogConfirms);
    const double confirmed = information_share_ * fall / asked;
    if (!(confirmed < 1.0)) continue;
    const double share = (1.0 - std::max(0.0, confirmed)) / told;
    equations.gradient -= share * sideways.dot(equations.gradient) * slope;
    equations.information -= share * slope * slope.transpose();
    taken = true;
  }
  return taken;
}

PoseEquations ParticleUpdate::standing_at(const Pose& X_WO, const FrameEquations& seen) const {
  if (context_.shape == nullptr || context_.supports == nullptr) return {};
  const auto radius = static_cast<double>(target_.mesh->radius);
  const auto height_at = [&](const Vector3d& p_WB, const Vector3d& normal_W) {
    if (context_.support_depth == nullptr) return SupportHeight{0.0, kContactHeight};
    return support_height(terms_, *context_.support_depth, X_CW_, p_WB, normal_W, radius, kSupportAround * radius);
  };
  return standing_equations(*context_.shape, *target_.mesh, *context_.supports, context_.up_W, X_WO, height_at,
                            {seen.information, seen.gradient}, kCommonError)
      .value_or(PoseEquations{});
}

const Outline* ParticleUpdate::outline_near(const Pose& X_WO, std::optional<Outline>& own) const {
  if (context_.depth == nullptr || is_see_through(target_)) return nullptr;
  if (shared_outline_ != nullptr &&
      is_near(geometry::box_minus(X_WO, shared_outline_->X_WO), kSharedShift, kSharedTurn))
    return &shared_outline_->outline;
  return &own.emplace(outline_of(target_, X_CW_ * X_WO, terms_, context_, tools_));
}

rendering::PoseEvidence ParticleUpdate::evidence(const Pose& X_WO) const {
  const rendering::PoseHypothesis h = hypothesis(target_, X_CW_ * X_WO, pixels_);
  rendering::PoseEvidence e;
  tools_.search->batch().evaluate(terms_, std::span(&h, 1), workspace_, std::span(&e, 1));
  return e;
}

double ParticleUpdate::outline(const Pose& X_WO) const {
  if (is_see_through(target_)) return 1.0;
  return outline_at(terms_, target_, X_CW_ * X_WO, options_, tools_);
}

double ParticleUpdate::log_inside(const SupportSurfaces* solids, const Pose& X_WO) const {
  if (solids == nullptr || solids->empty()) return 0.0;
  const double overlap = solids->overlap(*target_.mesh, X_WO, options_.support_tolerance);
  return kLogInSupport * std::min(1.0, overlap / kMostInSupport);
}

double ParticleUpdate::log_overlap(const belief::Particle& particle) const {
  const bool is_held = particle.mode == belief::MotionMode::kHeld;
  return log_inside(is_held || context_.solids == nullptr ? context_.supports : context_.solids, particle.X_WO);
}

Pose clear_of_support(const Pose& X_WO, double support_offset, const Vector3d& up_W) {
  return {X_WO.rotation, X_WO.translation + (kSunkAllowed - support_offset) * up_W};
}

double ParticleUpdate::log_in_support(const Pose& X_WO) const {
  return log_inside(context_.supports, clear_of_support(X_WO, context_.support_offset, context_.up_W));
}

}  // namespace prescene::filter
