// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/weight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "particle_update.h"
#include "still_particles.h"

namespace prescene::filter {
namespace {

using belief::Particle;

constexpr double kFewestPixels = 12;  // the tempering's pixel count is at least this

/// A start drawn about the prediction, kept near it.
Vector6d random_start(const Gaussian& predicted, const WeightOptions& options, core::RandomStream& stream) {
  Vector6d z;
  for (int i = 0; i < 6; ++i) z[i] = stream.normal();
  Vector6d d = options.start_spread * (predicted.root * z);
  d.head<3>() *= limited(d.head<3>().norm(), kMostStartTurn);
  d.tail<3>() *= limited(d.tail<3>().norm(), kMostStartShift);
  return d;
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
               frame.log_overlap(particle);
  }

  const Mode mode =
      frame.climb(particle.X_WO, predicted, first ? Vector6d::Zero() : random_start(predicted, options, stream));
  ParticleWeight moved;
  moved.evidence = frame.evidence(mode.X_WO);
  moved.outline = frame.outline(mode.X_WO);
  double log_moved = -std::numeric_limits<double>::infinity();
  if (within_reach(mode, predicted, dt, options)) {
    if (near != nullptr && near->covers(mode.X_WO) && near->covers(particle.X_WO))
      log_moved = near->log_frame_evidence(near->update_by_frame(particle.X_WO, predicted.covariance));
    else
      log_moved = frame.weight_share() * worth(moved.evidence.log_ratio, moved.outline, options) -
                  0.5 * mode.shift.dot(predicted.information * mode.shift) +
                  0.5 * (mode.log_determinant - predicted.log_determinant);
    log_moved += log_appears + frame.log_in_support(mode.X_WO);
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

void report_heaviest(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC,
                     const WeightOptions& options, const FilterTools& tools, const std::vector<Particle>& particles,
                     WeightReport& report) {
  const auto by_weight = [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; };
  report.heaviest =
      static_cast<int>(std::max_element(particles.begin(), particles.end(), by_weight) - particles.begin());
  report.hidden_weight = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (report.particles[i].hidden) report.hidden_weight += std::exp(particles[i].log_weight);
  const ParticleWeight& heaviest = report.particles[static_cast<std::size_t>(report.heaviest)];
  report.evidence_per_pixel = supported_evidence(heaviest.evidence, heaviest.outline, options);
  const rendering::ExpectedEvidence expected = expected_evidence_of(
      terms, target, X_WC.inverse() * particles[static_cast<std::size_t>(report.heaviest)].X_WO, *tools.renderer);
  report.expected_evidence = expected.of_visible;
  report.evidence_deviation = expected.deviation;
  report.visible_pixels = heaviest.evidence.visible;
  report.visible_share =
      heaviest.evidence.in_view > 0 ? static_cast<double>(heaviest.evidence.visible) / heaviest.evidence.in_view : 0.0;
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

double tempering_pixels(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CO,
                        const FilterTools& tools) {
  const rendering::PoseEvidence evidence = evidence_of(terms, hypothesis(target, X_CO), tools);
  return std::max(kFewestPixels, static_cast<double>(evidence.measured));
}

void evidence_of_heaviest(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC,
                          const WeightOptions& options, const FilterTools& tools,
                          const std::vector<Particle>& particles, WeightReport& report) {
  const auto best = static_cast<std::size_t>(&belief::heaviest(particles) - particles.data());
  const Pose X_CO = X_WC.inverse() * particles[best].X_WO;
  ParticleWeight& heaviest = report.particles[best];
  heaviest.evidence = evidence_of(terms, hypothesis(target, X_CO, tempering_pixels(terms, target, X_CO, tools)), tools);
  if (!heaviest.hidden && !is_see_through(target)) heaviest.outline = outline_at(terms, target, X_CO, options, tools);
  report_heaviest(terms, target, X_WC, options, tools, particles, report);
}

WeightReport weight(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC, double dt,
                    const WeightOptions& options, const FilterTools& tools, const core::RandomStream& stream,
                    std::vector<Particle>& particles, const WeightContext& context) {
  WeightReport report;
  report.particles.resize(particles.size());
  const Pose X_CW = X_WC.inverse();
  const auto by_weight = [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; };
  const auto best = std::max_element(particles.begin(), particles.end(), by_weight) - particles.begin();
  const auto terms_of = [&](std::size_t i) -> const rendering::FrameTerms& {
    return context.terms_of.empty() ? terms : *context.terms_of[i];
  };
  const Pose X_WO_best = particles[static_cast<std::size_t>(best)].X_WO;
  // One pixel count for all particles, so that their weights compare.
  const double pixels = tempering_pixels(terms_of(static_cast<std::size_t>(best)), target, X_CW * X_WO_best, tools);
  std::optional<TakenOutline> outline;
  if (context.depth != nullptr && !is_see_through(target)) {
    outline.emplace(TakenOutline{
        X_WO_best, outline_of(target, X_CW * X_WO_best, terms_of(static_cast<std::size_t>(best)), context, tools)});
  }
  const StillGroups groups = still_groups_of(particles, context.terms_of);
  // The likeliest group comes first: while the object lies still, all that is near is compared by what it finds.
  double resting_weight = 0.0;
  for (const auto& members : groups.still)
    for (const std::size_t i : members) resting_weight += std::exp(particles[i].log_weight);
  std::optional<FrameLikelihood> near;
  const std::size_t tasks = groups.still.size() + groups.others.size();
  const auto run = [&](std::size_t task) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    const bool is_group = task < groups.still.size();
    const std::size_t leader = is_group ? groups.still[task].front() : groups.others[task - groups.still.size()];
    const ParticleUpdate frame(terms_of(leader), target, X_CW, pixels, options, tools, context,
                               outline ? &*outline : nullptr, *workspace);
    // What the frame says where something else is in front is another matter.
    const bool compares = near && &terms_of(leader) == &terms_of(groups.still.front().front());
    const FrameLikelihood* others = task > 0 && compares ? &*near : nullptr;
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
  report_heaviest(terms_of(static_cast<std::size_t>(std::max_element(particles.begin(), particles.end(), by_weight) -
                                                    particles.begin())),
                  target, X_WC, options, tools, particles, report);
  return report;
}

}  // namespace prescene::filter
