// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/weight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "prescene/filter/proposals/facets.h"
#include "prescene/filter/proposals/outline.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

using belief::Particle;
using geometry::Matrix3d;

constexpr double kSmallestVariance = 1e-10;  // keeps covariances invertible: 10 um, 10 urad
constexpr double kFirstGate = 0.03;          // m; residuals beyond about half of it lose their weight ...
constexpr double kLastGate = 0.012;          // m; ... in the last steps
constexpr double kMostStartShift = 0.03;     // m; a start is never further off, however wide the prediction is, ...
constexpr double kMostStartTurn = 0.35;      // rad; ... nor turned further
constexpr double kFewestPixels = 12;         // the tempering's pixel count is at least this
constexpr double kFullOverlap = 0.25;        // share of a hidden pose's overlap with a support from which ...
constexpr double kLogInSupport = -12.0;      // nats; ... it costs this; less in proportion

struct Gaussian {
  Matrix6d covariance;
  Matrix6d information;
  Matrix6d root;  ///< Lower Cholesky factor of the covariance.
  double log_determinant = 0.0;
};

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

/// A mode near the prediction, with the covariance about it.
struct Mode {
  Pose X_WO;
  Vector6d shift = Vector6d::Zero();  ///< From the prediction, box_plus coordinates.
  Matrix6d covariance;
  double log_determinant = 0.0;
};

double limited(double length, double limit) { return length > limit ? limit / length : 1.0; }

/// A start drawn about the prediction, kept near it.
Vector6d random_start(const Gaussian& predicted, const WeightOptions& options, core::RandomStream& stream) {
  Vector6d z;
  for (int i = 0; i < 6; ++i) z[i] = stream.normal();
  Vector6d d = options.start_spread * (predicted.root * z);
  d.head<3>() *= limited(d.head<3>().norm(), kMostStartTurn);
  d.tail<3>() *= limited(d.tail<3>().norm(), kMostStartShift);
  return d;
}

class ParticleUpdate {
 public:
  ParticleUpdate(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CW, double pixels,
                 const WeightOptions& options, const FilterTools& tools, const WeightContext& context,
                 rendering::LikelihoodWorkspace& workspace)
      : terms_(terms),
        target_(target),
        X_CW_(X_CW),
        pixels_(pixels),
        options_(options),
        tools_(tools),
        context_(context),
        workspace_(workspace),
        information_share_(rendering::tempering(terms.tempering.information, pixels, terms.step)),
        weight_share_(rendering::tempering(terms.tempering.weight, pixels, terms.step)) {}

  /// Climbs from box_plus(predicted, start) on the tempered likelihood times the prediction.
  Mode climb(const Pose& X_WO_predicted, const Gaussian& predicted, const Vector6d& start) const {
    Mode mode;
    mode.X_WO = geometry::box_plus(X_WO_predicted, start);
    mode.shift = start;
    std::optional<Outline> outline;
    if (context_.depth != nullptr && !is_see_through())
      outline.emplace(target_, X_CW_ * mode.X_WO, context_.camera, *tools_.renderer);
    Matrix6d information = predicted.information;
    for (int step = 0; step <= options_.steps; ++step) {
      const double t = options_.steps > 1 ? std::min(1.0, static_cast<double>(step) / (options_.steps - 1)) : 1.0;
      rendering::LineariseOptions linearise;
      linearise.gate = kFirstGate * std::pow(kLastGate / kFirstGate, t);
      const rendering::PoseHypothesis h = hypothesis(target_, X_CW_ * mode.X_WO, pixels_);
      rendering::PoseLinearisation equations;
      tools_.search->batch().linearise(terms_, std::span(&h, 1), linearise, workspace_, std::span(&equations, 1));
      Matrix6d H = information_share_ * equations.H;
      Vector6d g = information_share_ * equations.g;
      without_facets(target_.facet_lever, X_CW_.rotation * mode.X_WO.rotation, target_.centre(), H, g);
      if (outline) {
        const OutlineEquations edges = outline->linearise(X_CW_ * mode.X_WO, *context_.depth, terms_);
        H += edges.H;
        g += edges.g;
      }
      information = predicted.information + information_in_world(H, X_CW_.rotation);
      if (step == options_.steps) break;  // the last pass is for the information at the mode
      Vector6d gradient = g;
      gradient.tail<3>() = X_CW_.rotation.conjugate() * g.tail<3>();
      gradient -= predicted.information * mode.shift;
      Vector6d d = geometry::Cholesky6(information).solve(gradient);
      if (!d.allFinite()) break;
      d *= std::min(limited(d.head<3>().norm(), 0.25), limited(d.tail<3>().norm(), 0.03));
      mode.X_WO = geometry::box_plus(mode.X_WO, d);
      mode.shift = geometry::box_minus(mode.X_WO, X_WO_predicted);
      if (d.head<3>().norm() < 1e-4 && d.tail<3>().norm() < 1e-5 && t == 1.0) break;
    }
    const geometry::Cholesky6 cholesky(information);
    mode.covariance = cholesky.inverse();
    mode.log_determinant = -2.0 * cholesky.factor().diagonal().array().log().sum();
    return mode;
  }

  rendering::PoseEvidence evidence(const Pose& X_WO) const {
    const rendering::PoseHypothesis h = hypothesis(target_, X_CW_ * X_WO, pixels_);
    rendering::PoseEvidence e;
    tools_.search->batch().evaluate(terms_, std::span(&h, 1), workspace_, std::span(&e, 1));
    return e;
  }

  /// Of what is mostly seen through, the measured surface is the one behind, which goes on.
  double outline(const Pose& X_WO) const {
    if (is_see_through()) return 1.0;
    return outline_support(terms_, depth_of(target_, X_CW_ * X_WO, terms_.camera, *tools_.renderer),
                           options_.outline_step);
  }

  bool is_see_through() const { return target_.material.behind > target_.material.hit; }

  /// What it costs to be where a support is.
  double log_overlap(const Pose& X_WO) const {
    if (context_.supports == nullptr || context_.supports->empty()) return 0.0;
    const double overlap = context_.supports->overlap(*target_.mesh, X_WO, options_.support_tolerance);
    return kLogInSupport * std::min(1.0, overlap / kFullOverlap);
  }

  bool was_unseen() const { return context_.was_unseen; }
  double weight_share() const { return weight_share_; }

 private:
  const rendering::FrameTerms& terms_;
  const SearchTarget& target_;
  Pose X_CW_;
  double pixels_;
  const WeightOptions& options_;
  const FilterTools& tools_;
  const WeightContext& context_;
  rendering::LikelihoodWorkspace& workspace_;
  double information_share_;
  double weight_share_;
};

/// What the outline is worth: 0 where nothing ends at it, 1 where enough does.
double outline_worth(double outline, const WeightOptions& options) {
  return std::clamp((outline - options.min_outline) / (options.full_outline - options.min_outline), 0.0, 1.0);
}

/// Evidence in favour of the pose counts as much as its outline is worth; evidence against it counts in full.
double worth(double log_ratio, double outline, const WeightOptions& options) {
  return log_ratio > 0.0 ? outline_worth(outline, options) * log_ratio : log_ratio;
}

/// The share of the pixels that the pose should show that show it or something further away.
double shown_share(const rendering::PoseEvidence& evidence) {
  return evidence.measured > 0 ? static_cast<double>(evidence.visible) / evidence.measured : 0.0;
}

/// Moves the particle's Gaussian to the mode: the pose block becomes the mode's, the rest follows by the gain.
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

/// How far the mode may be from the prediction: what the motion allows in the time, and its spread.
bool within_reach(const Mode& mode, const Gaussian& predicted, double dt, const WeightOptions& options) {
  const double spread = std::sqrt(predicted.covariance.bottomRightCorner<3, 3>().trace());
  return mode.shift.tail<3>().norm() <= options.max_jump_speed * dt + 3.0 * spread;
}

ParticleWeight update(const ParticleUpdate& frame, double dt, bool first, const WeightOptions& options,
                      core::RandomStream stream, Particle& particle) {
  const Gaussian predicted = gaussian(particle.covariance.topLeftCorner<6, 6>());
  ParticleWeight stay;
  stay.evidence = frame.evidence(particle.X_WO);
  const bool hidden = shown_share(stay.evidence) < options.hidden_share;
  // What was hidden stays so more often than not; without this a pose that explains nothing would beat one that nothing
  // speaks against.
  const double log_becomes_hidden = frame.was_unseen() ? 0.0 : options.log_hidden;
  const double log_appears = frame.was_unseen() && hidden ? options.log_hidden : 0.0;
  // Pixels with something nearer are what a hidden pose predicts: they neither support nor refute it.
  double log_stay = -std::numeric_limits<double>::infinity();
  if (hidden) {
    stay.hidden = true;
    log_stay = log_becomes_hidden + frame.weight_share() * std::min(0.0, stay.evidence.visible_log_ratio) +
               frame.log_overlap(particle.X_WO);
  }

  const Mode mode =
      frame.climb(particle.X_WO, predicted, first ? Vector6d::Zero() : random_start(predicted, options, stream));
  ParticleWeight moved;
  moved.evidence = frame.evidence(mode.X_WO);
  moved.outline = frame.outline(mode.X_WO);
  const double log_moved = within_reach(mode, predicted, dt, options)
                               ? log_appears +
                                     frame.weight_share() * worth(moved.evidence.log_ratio, moved.outline, options) -
                                     0.5 * mode.shift.dot(predicted.information * mode.shift) +
                                     0.5 * (mode.log_determinant - predicted.log_determinant)
                               : -std::numeric_limits<double>::infinity();
  // A mode that is hidden as well explains nothing by having moved.
  const bool mode_hidden = shown_share(moved.evidence) < options.hidden_share;
  if (hidden && (mode_hidden || !(log_moved > log_stay))) {
    particle.log_weight += log_stay;
    return stay;
  }
  if (std::isinf(log_moved)) {  // out of reach, and not hidden either: it stays where it was, against the evidence
    particle.log_weight += frame.weight_share() * std::min(stay.evidence.log_ratio, 0.0) + options.log_hidden;
    return stay;
  }
  particle.log_weight += log_moved;
  move_to(mode, predicted, particle);
  return moved;
}

}  // namespace

geometry::Matrix6d information_in_world(const Matrix6d& H_C, const geometry::Quaterniond& R_CW) {
  Matrix6d J = Matrix6d::Identity();
  J.bottomRightCorner<3, 3>() = R_CW.toRotationMatrix();
  const Matrix6d H = J.transpose() * H_C * J;
  return 0.5 * (H + H.transpose());
}

double supported_evidence(const rendering::PoseEvidence& evidence, double outline, const WeightOptions& options) {
  return worth(evidence.log_ratio_per_visible_pixel(), outline, options);
}

WeightReport weight(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC, double dt,
                    const WeightOptions& options, const FilterTools& tools, const core::RandomStream& stream,
                    std::vector<Particle>& particles, const WeightContext& context) {
  WeightReport report;
  report.particles.resize(particles.size());
  const Pose X_CW = X_WC.inverse();
  const auto by_weight = [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; };
  const auto best = std::max_element(particles.begin(), particles.end(), by_weight) - particles.begin();
  // One pixel count for all particles, so that their weights compare.
  double pixels = 0.0;
  {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    const auto h = hypothesis(target, X_CW * particles[static_cast<std::size_t>(best)].X_WO);
    rendering::PoseEvidence e;
    tools.search->batch().evaluate(terms, std::span(&h, 1), *workspace, std::span(&e, 1));
    pixels = std::max(kFewestPixels, static_cast<double>(e.measured));
  }
  tools.search->threads().for_each_index(particles.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    const ParticleUpdate frame(terms, target, X_CW, pixels, options, tools, context, *workspace);
    core::RandomStream draws = stream;
    const core::RandomStream mine(draws.next_u64(), core::Purpose::kProposal, i);
    report.particles[i] = update(frame, dt, static_cast<std::ptrdiff_t>(i) == best, options, mine, particles[i]);
  });
  report.all_impossible = !belief::normalize(particles);
  report.heaviest =
      static_cast<int>(std::max_element(particles.begin(), particles.end(), by_weight) - particles.begin());
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (report.particles[i].hidden) report.hidden_weight += std::exp(particles[i].log_weight);
  const ParticleWeight& heaviest = report.particles[static_cast<std::size_t>(report.heaviest)];
  report.evidence_per_pixel = supported_evidence(heaviest.evidence, heaviest.outline, options);
  report.expected_evidence = expected_evidence_of(
      terms, target, X_CW * particles[static_cast<std::size_t>(report.heaviest)].X_WO, *tools.renderer);
  report.visible_pixels = heaviest.evidence.visible;
  report.visible_share =
      heaviest.evidence.in_view > 0 ? static_cast<double>(heaviest.evidence.visible) / heaviest.evidence.in_view : 0.0;
  return report;
}

}  // namespace prescene::filter
