// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/rivals.h"

#include <algorithm>
#include <limits>

#include "prescene/filter/operators/standing.h"
#include "rival_search.h"
#include "turns.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;
using geometry::SymmetryGroup;

constexpr std::size_t kMostRefined = 24;  // of the turned poses, the best
constexpr std::size_t kMostRivals = 8;
constexpr std::size_t kMostStanding = 6;  // particles from which the likeliest turn is fitted to the frame
constexpr double kTrackedLogOdds = 2.5;   // nats; of a frame, for a rival of what was followed
constexpr double kFirstLogOdds = -3.5;    // nats; one frame alone makes it no likelier than this
constexpr double kHeldShift = 0.01;       // m; a turn that is held further off than this is proposed again

}  // namespace

std::vector<Rival> find_rivals(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                               const SymmetryGroup& symmetry, std::span<const Pose> X_WO, double least_log_odds,
                               const WeightOptions& weighting, const InitialiseOptions& spread,
                               const FilterTools& tools) {
  std::vector<Rival> rivals;
  if (symmetry.ball || X_WO.empty()) return rivals;
  RivalSearch search(frame, terms, target, weighting, tools);
  const std::vector<Pose> turned = turned_poses(X_WO.front(), target, symmetry, frame);
  const std::vector<rendering::PoseEvidence> first = search.evaluate(turned);
  std::vector<Pose> poses = {X_WO.front()};
  add_apart(turned, first, symmetry, kMostRefined + 1, poses);
  // What they are compared with is fitted to the frame as they are: it may have moved since the frame before.
  poses.insert(poses.end(), X_WO.begin(), X_WO.end());
  search.refine(kRivalRefine, poses);
  poses.insert(poses.end(), X_WO.begin(), X_WO.end());
  const std::vector<rendering::PoseEvidence> evidence = search.evaluate(poses);
  const double pixels = std::max(kFewestRivalPixels, static_cast<double>(first.front().measured));
  const double share = rendering::tempering(terms.tempering.weight, pixels, terms.step);
  std::size_t standing = poses.size() - X_WO.size();
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (evidence[i].log_ratio > evidence[standing].log_ratio && !is_apart(poses[i], X_WO.front(), symmetry))
      standing = i;
  const double worth = search.worth(evidence[standing], poses[standing]);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (share * (evidence[i].log_ratio - worth) < least_log_odds) continue;
    if (!is_apart(poses[i], X_WO.front(), symmetry)) continue;
    if (frame.surfaces->overlap(*target.mesh, poses[i], weighting.support_tolerance) > kMostInSupport) continue;
    const double log_odds = share * (search.worth(evidence[i], poses[i]) - worth);
    if (log_odds >= least_log_odds)
      rivals.push_back({poses[i], search.covariance_at(poses[i], pixels, spread), log_odds});
  }
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const Rival& a, const Rival& b) { return a.log_odds > b.log_odds; });
  std::vector<Rival> apart;
  for (Rival& rival : rivals) {
    if (apart.size() >= kMostRivals) break;
    if (std::none_of(apart.begin(), apart.end(), [&](const Rival& other) {
          return geometry::symmetric_angle(rival.X_WO, other.X_WO, symmetry) < 0.9 * kRivalTurn;
        }))
      apart.push_back(rival);
  }
  return apart;
}

int propose_rivals(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                   const SymmetryGroup& symmetry, RivalPrior prior, const WeightOptions& weighting,
                   const InitialiseOptions& spread, const FilterTools& tools, ObjectBelief& object) {
  const Particle best = belief::heaviest(object.particles);
  const bool is_found = prior == RivalPrior::kFound;
  const double least = is_found ? kFoundLogOdds : kTrackedLogOdds;
  std::vector<Pose> standing = {best.X_WO};
  for (const Particle& particle : object.particles) {
    if (standing.size() >= kMostStanding) break;
    if (particle.X_WO != best.X_WO && !is_apart(particle.X_WO, best.X_WO, symmetry)) standing.push_back(particle.X_WO);
  }
  std::vector<Rival> rivals = find_rivals(frame, terms, target, symmetry, standing, least, weighting, spread, tools);
  // What is held as a hypothesis already need not be proposed.
  std::erase_if(rivals, [&](const Rival& rival) {
    return std::any_of(object.particles.begin(), object.particles.end(), [&](const Particle& particle) {
      return particle.log_weight > best.log_weight + kSlipLogOdds && !is_apart(particle.X_WO, rival.X_WO, symmetry) &&
             (particle.X_WO * target.centre() - rival.X_WO * target.centre()).norm() < kHeldShift;
    });
  });
  if (rivals.empty()) return 0;
  // How high a find is above its support is not known to millimetres.
  if (!is_found) {
    const double sunk = log_sunk(*target.mesh, *frame.surfaces, frame.up_W, best.X_WO);
    for (Rival& rival : rivals)
      rival.log_odds += std::min(0.0, log_sunk(*target.mesh, *frame.surfaces, frame.up_W, rival.X_WO) - sunk);
  }
  if (best.mode == belief::MotionMode::kResting) {
    const std::shared_ptr<const RestingShape> shape = tools.meshes->resting_shape(*target.mesh);
    const StandingOdds odds(*shape, *target.mesh, *frame.surfaces, frame.up_W, best.X_WO);
    for (Rival& rival : rivals) rival.log_odds += odds.log_of(rival.X_WO);
  }
  std::erase_if(rivals, [&](const Rival& rival) { return rival.log_odds < least; });
  if (rivals.empty()) return 0;
  std::vector<Particle>& particles = object.particles;
  double log_best = -std::numeric_limits<double>::infinity();
  for (const Particle& particle : particles)
    if (!is_apart(particle.X_WO, best.X_WO, symmetry)) log_best = log_sum(log_best, particle.log_weight);
  std::stable_sort(particles.begin(), particles.end(),
                   [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; });
  const std::size_t count = std::min(rivals.size(), particles.size() / 2);
  for (std::size_t i = 0; i < count; ++i) {
    Particle& particle = particles[i];
    particle = best;
    particle.X_WO = rivals[i].X_WO;
    particle.covariance.topLeftCorner<6, 6>() = rivals[i].covariance;
    particle.covariance.bottomLeftCorner<6, 6>().setZero();
    particle.covariance.topRightCorner<6, 6>().setZero();
    particle.log_weight = log_best + (is_found ? std::min(0.0, rivals[i].log_odds)
                                               : std::min(kFirstLogOdds, rivals[i].log_odds + kSlipLogOdds));
  }
  belief::normalize(particles);
  return static_cast<int>(count);
}

}  // namespace prescene::filter
