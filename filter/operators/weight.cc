// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/weight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "prescene/filter/operators/still_update.h"
#include "prescene/filter/proposals/facets.h"
#include "prescene/filter/proposals/outline.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

using belief::Particle;
using geometry::Matrix3d;

// Share of the variance of what a frame says of a pose: errors that stay from frame to frame (calibration, a pattern in
// the depth), which do not average out over what lies still.
constexpr double kCommonError = 0.5;
constexpr double kSmallestVariance = 1e-10;  // keeps covariances invertible: 10 um, 10 urad
constexpr double kFirstGate = 0.03;          // m; residuals beyond about half of it lose their weight ...
constexpr double kLastGate = 0.012;          // m; ... in the last steps
constexpr double kMostStartShift = 0.03;     // m; a start is never further off, however wide the prediction is, ...
constexpr double kMostStartTurn = 0.35;      // rad; ... nor turned further
constexpr double kFewestPixels = 12;         // the tempering's pixel count is at least this
constexpr double kSharedShift = 0.003;       // m; an outline serves for poses so near to where it was taken ...
constexpr double kSharedTurn = 0.03;         // rad
constexpr double kAlikeShift = 0.003;        // m; resting particles so near to each other are compared with a frame ...
constexpr double kAlikeTurn = 0.03;          // rad; ... at one pose
constexpr double kComparedShift = 0.008;     // m; poses so near to where the frame's equations were taken ...
constexpr double kComparedTurn = 0.12;       // rad; ... are compared by these
constexpr double kQuietShift = 0.003;        // m; where the frame wants a particle no further from there than this ...
constexpr double kQuietTurn = 0.05;          // rad; ..., the equations are all there is to know, ...
constexpr double kQuietHits = 0.8;           // share; ... if so many of the visible pixels match
constexpr double kOpenGain = 0.6;            // above this the frame decides, and one step may not reach its maximum
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

/// What the frame says about a pose, in W.
struct FrameEquations {
  Matrix6d information;
  Vector6d gradient;
  rendering::PoseEvidence evidence;
};

/// Of such a thing, the measured surface is mostly the one behind, which goes on.
bool is_see_through(const SearchTarget& target) { return target.material.behind > target.material.hit; }

bool is_near(const Vector6d& d, double shift, double turn) {
  return d.head<3>().norm() < turn && d.tail<3>().norm() < shift;
}

/// Between these gates, at a share t of the way.
double gate_at(double t) { return kFirstGate * std::pow(kLastGate / kFirstGate, t); }

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

/// An outline and the pose that it was taken at.
struct TakenOutline {
  Pose X_WO;
  Outline outline;
};

class ParticleUpdate {
 public:
  ParticleUpdate(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CW, double pixels,
                 const WeightOptions& options, const FilterTools& tools, const WeightContext& context,
                 const TakenOutline* shared_outline, rendering::LikelihoodWorkspace& workspace)
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
        weight_share_(rendering::tempering(terms.tempering.weight, pixels, terms.step)) {}

  /// Climbs from box_plus(predicted, start) on the tempered likelihood times the prediction.
  Mode climb(const Pose& X_WO_predicted, const Gaussian& predicted, const Vector6d& start) const {
    Mode mode;
    mode.X_WO = geometry::box_plus(X_WO_predicted, start);
    mode.shift = start;
    std::optional<Outline> own_outline;
    const Outline* outline = outline_near(mode.X_WO, own_outline);
    Matrix6d information = predicted.information;
    for (int step = 0; step <= options_.steps; ++step) {
      const double t = options_.steps > 1 ? std::min(1.0, static_cast<double>(step) / (options_.steps - 1)) : 1.0;
      const FrameEquations equations = equations_at(mode.X_WO, gate_at(t), outline);
      information = predicted.information + equations.information;
      if (step == options_.steps) break;  // the last pass is for the information at the mode
      const Vector6d gradient = equations.gradient - predicted.information * mode.shift;
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

  /// Depth residuals up to the gate, tempered, and the outline if there is one.
  FrameEquations equations_at(const Pose& X_WO, double gate, const Outline* outline, bool with_evidence = false) const {
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
      const OutlineEquations edges = outline->linearise(X_CO, *context_.depth, terms_);
      H += edges.H;
      g += edges.g;
    }
    equations.information = information_in_world(H, X_CW_.rotation);
    equations.gradient = g;
    equations.gradient.tail<3>() = X_CW_.rotation.conjugate() * g.tail<3>();
    equations.evidence = residuals.evidence;
    return equations;
  }

  /// The shared outline where it serves, else one taken here; null where poses follow residuals alone.
  const Outline* outline_near(const Pose& X_WO, std::optional<Outline>& own) const {
    if (context_.depth == nullptr || is_see_through(target_)) return nullptr;
    if (shared_outline_ != nullptr &&
        is_near(geometry::box_minus(X_WO, shared_outline_->X_WO), kSharedShift, kSharedTurn))
      return &shared_outline_->outline;
    return &own.emplace(target_, X_CW_ * X_WO, context_.camera, *tools_.renderer);
  }

  rendering::PoseEvidence evidence(const Pose& X_WO) const {
    const rendering::PoseHypothesis h = hypothesis(target_, X_CW_ * X_WO, pixels_);
    rendering::PoseEvidence e;
    tools_.search->batch().evaluate(terms_, std::span(&h, 1), workspace_, std::span(&e, 1));
    return e;
  }

  double outline(const Pose& X_WO) const {
    if (is_see_through(target_)) return 1.0;
    return outline_support(terms_, depth_of(target_, X_CW_ * X_WO, terms_.camera, *tools_.renderer),
                           options_.outline_step);
  }

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
  const TakenOutline* shared_outline_;
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

/// What a frame says about all poses near one at which a resting object was compared with it: a Gaussian likelihood.
/// The pixels of the coarse image that poses happen to cover differ more than the poses; this does not.
struct FrameLikelihood {
  Pose X_WO;
  Matrix6d information;
  Vector6d gradient;
  double log_peak = 0.0;       ///< nats, at its maximum.
  ParticleWeight report = {};  ///< Where the resting object is after it.

  bool covers(const Pose& other_X_WO) const {
    return is_near(geometry::box_minus(other_X_WO, X_WO), kComparedShift, kComparedTurn);
  }
  /// nats, of what follows for a prediction.
  double log_evidence(const StillUpdate& update) const { return log_peak + update.log_evidence; }
  /// For a prediction about `X_WO_before`.
  StillUpdate update(const Pose& X_WO_before, const Matrix6d& covariance, double common) const {
    const Vector6d since = geometry::box_minus(X_WO, X_WO_before);
    return still_update(covariance, information, gradient + information * since, common);
  }
};

/// A particle for which the frame has nothing new: by what is known of the frame already. False, and nothing is done,
/// where it is to look for a mode of its own.
bool update_quietly(const FrameLikelihood& near, Particle& particle) {
  if (near.report.evidence.hit_share() < kQuietHits || !near.covers(particle.X_WO)) return false;
  const Gaussian predicted = gaussian(particle.covariance.topLeftCorner<6, 6>());
  const StillUpdate update = near.update(particle.X_WO, predicted.covariance, kCommonError);
  Mode mode;
  mode.shift = update.shift;
  mode.X_WO = geometry::box_plus(particle.X_WO, update.shift);
  mode.covariance = update.covariance;
  if (!is_near(geometry::box_minus(mode.X_WO, near.X_WO), kQuietShift, kQuietTurn)) return false;
  move_to(mode, predicted, particle);
  particle.log_weight += near.log_evidence(update);
  return true;
}

ParticleWeight update(const ParticleUpdate& frame, double dt, bool first, const WeightOptions& options,
                      const FrameLikelihood* near, core::RandomStream stream, Particle& particle) {
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
  double log_moved = -std::numeric_limits<double>::infinity();
  if (within_reach(mode, predicted, dt, options)) {
    if (near != nullptr && near->covers(mode.X_WO) && near->covers(particle.X_WO))
      log_moved = near->log_evidence(near->update(particle.X_WO, predicted.covariance, kCommonError));
    else
      log_moved = frame.weight_share() * worth(moved.evidence.log_ratio, moved.outline, options) -
                  0.5 * mode.shift.dot(predicted.information * mode.shift) +
                  0.5 * (mode.log_determinant - predicted.log_determinant);
    log_moved += log_appears;
  }
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

/// Resting particles that are about alike, of which the first stands for all: what the frame says is found out at its
/// pose (or taken from `near`, to weigh them), and each takes what follows for its own mean and covariance. Nothing,
/// and nothing is done, where that is not enough: at a pose that is hidden, or that the frame wants elsewhere than a
/// still object can be.
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
  FrameLikelihood likelihood{first.X_WO, equations.information, equations.gradient};
  StillUpdate update = likelihood.update(first.X_WO, predicted.covariance, kCommonError);
  if (update.largest_gain > kOpenGain) {
    for (int step = 0; step < options.steps && update.shift.allFinite(); ++step) {
      const double t = options.steps > 1 ? static_cast<double>(step) / (options.steps - 1) : 1.0;
      if (step > 0) likelihood.X_WO = geometry::box_plus(first.X_WO, update.shift);
      equations = frame.equations_at(likelihood.X_WO, gate_at(t), outline);
      likelihood.information = equations.information;
      likelihood.gradient = equations.gradient;
      update = likelihood.update(first.X_WO, predicted.covariance, kCommonError);
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
  likelihood.log_peak =
      frame.weight_share() * worth(report.evidence.log_ratio, report.outline, options) + update.below_peak;
  const FrameLikelihood& weighing =
      near != nullptr && near->covers(X_WO_after) && near->covers(first.X_WO) ? *near : likelihood;
  for (const std::size_t i : members) {
    Particle& particle = particles[i];
    const bool alike = particle.X_WO == first.X_WO && particle.covariance == first.covariance;
    const Gaussian own = alike ? predicted : gaussian(particle.covariance.topLeftCorner<6, 6>());
    const StillUpdate mine = alike ? update : likelihood.update(particle.X_WO, own.covariance, kCommonError);
    const double log_evidence = weighing.log_evidence(
        &weighing == &likelihood ? mine : weighing.update(particle.X_WO, own.covariance, kCommonError));
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

/// Resting particles in groups of those about alike, heaviest first; all others, one by one.
struct Groups {
  std::vector<std::vector<std::size_t>> still;
  std::vector<std::size_t> others;
};

Groups groups_of(const std::vector<Particle>& particles) {
  Groups groups;
  std::vector<std::size_t> resting;
  for (std::size_t i = 0; i < particles.size(); ++i)
    (particles[i].mode == belief::MotionMode::kResting ? resting : groups.others).push_back(i);
  std::stable_sort(resting.begin(), resting.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  for (const std::size_t i : resting) {
    const auto group = std::find_if(groups.still.begin(), groups.still.end(), [&](const auto& members) {
      return is_near(geometry::box_minus(particles[i].X_WO, particles[members.front()].X_WO), kAlikeShift, kAlikeTurn);
    });
    if (group != groups.still.end())
      group->push_back(i);
    else
      groups.still.push_back({i});
  }
  return groups;
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
  std::optional<TakenOutline> outline;
  if (context.depth != nullptr && !is_see_through(target)) {
    const Pose& X_WO = particles[static_cast<std::size_t>(best)].X_WO;
    outline.emplace(TakenOutline{X_WO, Outline(target, X_CW * X_WO, context.camera, *tools.renderer)});
  }
  const Groups groups = groups_of(particles);
  // The likeliest group comes first: while the object lies still, all that is near is compared by what it finds.
  double resting_weight = 0.0;
  for (const auto& members : groups.still)
    for (const std::size_t i : members) resting_weight += std::exp(particles[i].log_weight);
  std::optional<FrameLikelihood> near;
  const std::size_t tasks = groups.still.size() + groups.others.size();
  const auto run = [&](std::size_t task) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    const ParticleUpdate frame(terms, target, X_CW, pixels, options, tools, context, outline ? &*outline : nullptr,
                               *workspace);
    const FrameLikelihood* others = task > 0 && near ? &*near : nullptr;
    const bool is_group = task < groups.still.size();
    if (is_group) {
      const auto found = update_still(frame, dt, groups.still[task], options, others, particles, report.particles);
      if (task == 0 && resting_weight > 0.5) near = found;
      if (found) return;
    }
    const std::size_t other = task - groups.still.size();
    const auto one_by_one = is_group ? std::span(groups.still[task]) : std::span(&groups.others[other], 1);
    for (const std::size_t i : one_by_one) {
      if (others != nullptr && update_quietly(*others, particles[i])) {
        report.particles[i] = others->report;
        continue;
      }
      core::RandomStream draws = stream;
      const core::RandomStream mine(draws.next_u64(), core::Purpose::kProposal, i);
      report.particles[i] =
          update(frame, dt, static_cast<std::ptrdiff_t>(i) == best, options, others, mine, particles[i]);
    }
  };
  run(0);
  tools.search->threads().for_each_index(tasks - 1, [&](std::size_t i) { run(i + 1); });
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
