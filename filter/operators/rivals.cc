// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/rivals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "particle_update.h"
#include "prescene/filter/proposals/facets.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;
using geometry::Matrix3d;
using geometry::SymmetryGroup;

constexpr int kTurnSteps = 24;            // in a full turn
constexpr double kSameAxis = 0.996;       // cosine; about 5 degrees
constexpr std::size_t kMostRefined = 24;  // of the turned poses, the best
constexpr std::size_t kMostRivals = 8;
constexpr double kFewestRivalPixels = 12;  // the tempering's pixel count is at least this, as in weight()
constexpr std::size_t kMostStanding = 6;   // particles from which the likeliest turn is fitted to the frame
constexpr RefineOptions kRivalRefine = {.steps = 5, .first_gate = 0.03, .last_gate = 0.012};
constexpr double kMostInSupport = 0.25;  // share of a rival; as of finds
constexpr double kTrackedLogOdds = 2.5;  // nats; of a frame, for a rival of what was followed
constexpr double kFirstLogOdds = -3.5;   // nats; one frame alone makes it no likelier than this
constexpr double kOpenLogOdds = -3.0;    // nats; a turn that is less likely was decided against: the prior counts
constexpr double kCommonShare = 0.5;     // of the variance of a frame's errors, as of what lies still
constexpr double kHeldShift = 0.01;      // m; a turn that is held further off than this is proposed again
constexpr double kMemory = 0.05;         // weight of the newest frame: twenty frames count

/// The principal axes of a mesh's surface, in its frame; empty where it has no area.
std::vector<Vector3d> principal_axes(const rendering::RenderMesh& mesh) {
  Vector3d sum = Vector3d::Zero();
  Matrix3d squares = Matrix3d::Zero();
  double area_sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d pa = mesh.vertices[a].cast<double>(), pb = mesh.vertices[b].cast<double>(),
                   pc = mesh.vertices[c].cast<double>();
    const double area = 0.5 * (pb - pa).cross(pc - pa).norm();
    // The edges' midpoints integrate squares over a triangle exactly.
    for (const Vector3d& p : {Vector3d(0.5 * (pa + pb)), Vector3d(0.5 * (pb + pc)), Vector3d(0.5 * (pc + pa))}) {
      sum += area / 3.0 * p;
      squares += area / 3.0 * p * p.transpose();
    }
    area_sum += area;
  }
  if (!(area_sum > 0.0)) return {};
  const Vector3d mean = sum / area_sum;
  const geometry::SymmetricEigen3 eigen = geometry::symmetric_eigen_3(squares / area_sum - mean * mean.transpose());
  return {eigen.vectors.col(0), eigen.vectors.col(1), eigen.vectors.col(2)};
}

/// Rotation vectors in O: steps about the principal axes and the vertical, and what else turns a cube along the axes
/// into itself, about its diagonals and those of its faces.
std::vector<Vector3d> tried_turns(const rendering::RenderMesh& mesh, const Vector3d& up_O) {
  constexpr double kThird = 2.0 * std::numbers::pi / 3.0;
  const std::vector<Vector3d> axes = principal_axes(mesh);
  std::vector<Vector3d> turns;
  const auto add_steps = [&](const Vector3d& axis) {
    for (int step = 1; step < kTurnSteps; ++step) turns.emplace_back(2.0 * std::numbers::pi * step / kTurnSteps * axis);
  };
  for (const Vector3d& axis : axes) add_steps(axis);
  if (std::none_of(axes.begin(), axes.end(),
                   [&](const Vector3d& axis) { return std::abs(axis.dot(up_O)) > kSameAxis; }))
    add_steps(up_O);
  if (axes.empty()) return turns;
  for (const double y : {-1.0, 1.0})
    for (const double z : {-1.0, 1.0}) {
      const Vector3d diagonal = (axes[0] + y * axes[1] + z * axes[2]).normalized();
      turns.emplace_back(kThird * diagonal);
      turns.emplace_back(-kThird * diagonal);
    }
  for (std::size_t i = 0; i < 3; ++i)
    for (const double sign : {-1.0, 1.0})
      turns.emplace_back(std::numbers::pi * (axes[i] + sign * axes[(i + 1) % 3]).normalized());
  return turns;
}

bool is_apart(const Pose& a, const Pose& b, const SymmetryGroup& symmetry) {
  return geometry::symmetric_angle(a, b, symmetry) >= kRivalTurn;
}

/// How far a mesh reaches in a direction of W from its pose's origin, m.
double reach_along(const rendering::RenderMesh& mesh, const Pose& X_WO, const Vector3d& direction_W) {
  const Eigen::Vector3f direction_O = (X_WO.rotation.conjugate() * direction_W).cast<float>();
  float most = -std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& vertex : mesh.vertices) most = std::max(most, direction_O.dot(vertex));
  return static_cast<double>(most) + direction_W.dot(X_WO.translation);
}

/// X_WO turned about the target's middle and moved along the view until it reaches as far to the camera as before, X_WO
/// itself first.
std::vector<Pose> turned_poses(const Pose& X_WO, const SearchTarget& target, const SymmetryGroup& symmetry,
                               const FilterFrame& frame) {
  std::vector<Pose> poses = {X_WO};
  const Vector3d to_camera = (frame.X_WC.translation - X_WO * target.centre()).normalized();
  const double reached = reach_along(*target.mesh, X_WO, to_camera);
  for (const Vector3d& turn : tried_turns(*target.mesh, X_WO.rotation.conjugate() * frame.up_W)) {
    Vector6d d = Vector6d::Zero();
    d.head<3>() = turn;
    Pose turned = moved_about(X_WO, target.centre(), d);
    turned.translation += (reached - reach_along(*target.mesh, turned, to_camera)) * to_camera;
    if (geometry::symmetric_angle(turned, X_WO, symmetry) > 0.5 * kRivalTurn) poses.push_back(turned);
  }
  return poses;
}

class RivalSearch {
 public:
  RivalSearch(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
              const WeightOptions& weighting, const FilterTools& tools)
      : frame_(frame),
        terms_(terms),
        target_(target),
        weighting_(weighting),
        tools_(tools),
        workspace_(tools.search->workspaces()) {}

  std::vector<rendering::PoseEvidence> evaluate(const std::vector<Pose>& X_WO) {
    std::vector<rendering::PoseHypothesis> hypotheses;
    hypotheses.reserve(X_WO.size());
    for (const Pose& pose : X_WO) hypotheses.push_back(hypothesis(target_, frame_.X_CW * pose));
    std::vector<rendering::PoseEvidence> evidence(hypotheses.size());
    tools_.search->batch().evaluate(terms_, hypotheses, *workspace_, evidence);
    return evidence;
  }

  void refine(std::vector<Pose>& X_WO) {
    for (Pose& pose : X_WO) pose = frame_.X_CW * pose;
    tools_.search->refine(terms_, target_, kRivalRefine, *workspace_, X_WO);
    for (Pose& pose : X_WO) pose = geometry::normalized(frame_.X_WC * pose);
  }

  /// As weight() counts it, before tempering: evidence in favour is worth less where nothing ends at the outline.
  double worth(const rendering::PoseEvidence& evidence, const Pose& X_WO) {
    if (!(evidence.log_ratio > 0.0)) return evidence.log_ratio;
    const double outline =
        is_see_through(target_) ? 1.0 : outline_at(terms_, target_, frame_.X_CW * X_WO, weighting_, tools_);
    return filter::worth(evidence.log_ratio, outline, weighting_);
  }

  Matrix6d covariance_at(const Pose& X_WO, double pixels, const InitialiseOptions& spread) {
    const rendering::PoseHypothesis h = hypothesis(target_, frame_.X_CW * X_WO, pixels);
    rendering::PoseLinearisation residuals;
    tools_.search->batch().linearise(terms_, std::span(&h, 1), {}, *workspace_, std::span(&residuals, 1));
    Matrix6d H = rendering::tempering(terms_.tempering.information, pixels, terms_.step) * residuals.H;
    Vector6d unused = Vector6d::Zero();
    without_facets(target_.facet_lever, h.X_CO.rotation, target_.centre(), H, unused);
    Matrix6d information = information_in_world(H, frame_.X_CW.rotation);
    information.diagonal().head<3>().array() += 1.0 / (spread.first_turn * spread.first_turn);
    information.diagonal().tail<3>().array() += 1.0 / (spread.first_shift * spread.first_shift);
    return geometry::Cholesky6(information).inverse();
  }

 private:
  const FilterFrame& frame_;
  const rendering::FrameTerms& terms_;
  const SearchTarget& target_;
  const WeightOptions& weighting_;
  const FilterTools& tools_;
  rendering::WorkspacePool::Loan workspace_;
};

/// Adds poses up to `most`, best evidence first, each apart from all before it.
void add_apart(const std::vector<Pose>& poses, const std::vector<rendering::PoseEvidence>& evidence,
               const SymmetryGroup& symmetry, std::size_t most, std::vector<Pose>& chosen) {
  std::vector<std::size_t> order(poses.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return evidence[a].log_ratio > evidence[b].log_ratio; });
  for (const std::size_t i : order) {
    if (chosen.size() >= most) return;
    // A little less than apart: neighbours on the grid of turns are all tried.
    const bool is_new = std::all_of(chosen.begin(), chosen.end(), [&](const Pose& other) {
      return geometry::symmetric_angle(poses[i], other, symmetry) > 0.9 * kRivalTurn;
    });
    if (is_new) chosen.push_back(poses[i]);
  }
}

double log_sum(double a, double b) {
  const double larger = std::max(a, b);
  if (!std::isfinite(larger)) return larger;
  return larger + std::log(std::exp(a - larger) + std::exp(b - larger));
}

/// Particles of about one turn, by the heaviest of them.
struct Turn {
  std::size_t leader;
  double log_before = -std::numeric_limits<double>::infinity();
  double log_after = -std::numeric_limits<double>::infinity();
};

/// For each particle the index of its turn.
std::vector<std::size_t> turns_of(const std::vector<Particle>& particles, const SymmetryGroup& symmetry,
                                  std::vector<Turn>& turns) {
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  std::vector<std::size_t> turn_of(particles.size(), 0);
  for (const std::size_t i : order) {
    const auto found = std::find_if(turns.begin(), turns.end(), [&](const Turn& turn) {
      return !is_apart(particles[i].X_WO, particles[turn.leader].X_WO, symmetry);
    });
    turn_of[i] = static_cast<std::size_t>(found - turns.begin());
    if (found == turns.end()) turns.push_back({i});
  }
  return turn_of;
}

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
  search.refine(poses);
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

void share_among_turns(std::span<const double> log_weights_before, const SymmetryGroup& symmetry,
                       std::vector<Particle>& particles, int cameras, double turned_log_odds) {
  if (symmetry.ball || log_weights_before.size() != particles.size()) return;
  std::vector<Turn> turns;
  const std::vector<std::size_t> turn_of = turns_of(particles, symmetry, turns);
  if (turns.size() < 2) return;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Turn& turn = turns[turn_of[i]];
    turn.log_before = log_sum(turn.log_before, log_weights_before[i]);
    turn.log_after = log_sum(turn.log_after, particles[i].log_weight);
  }
  double log_leading = -std::numeric_limits<double>::infinity();
  for (const Turn& turn : turns) log_leading = std::max(log_leading, turn.log_before);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Turn& turn = turns[turn_of[i]];
    if (!std::isfinite(turn.log_before) || !std::isfinite(turn.log_after)) continue;
    const double frame = cameras * (turn.log_after - turn.log_before);
    const double prior = turn.log_before < log_leading + kOpenLogOdds ? turned_log_odds : 0.0;
    const double shared = log_leading + (1.0 - kMemory) * (turn.log_before - log_leading) + kMemory * (prior + frame);
    particles[i].log_weight += shared - turn.log_after;
  }
  belief::normalize(particles);
}

std::vector<std::size_t> turn_numbers(const std::vector<Particle>& particles, const SymmetryGroup& symmetry) {
  std::vector<Turn> turns;
  return symmetry.ball ? std::vector<std::size_t>(particles.size(), 0) : turns_of(particles, symmetry, turns);
}

bool resample_within_turns(const ResampleOptions& options, const core::RandomStream& stream,
                           const SymmetryGroup& symmetry, std::vector<Particle>& particles) {
  std::vector<Turn> turns;
  const std::vector<std::size_t> turn_before = turns_of(particles, symmetry, turns);
  if (symmetry.ball || turns.size() < 2) return resample(options, stream, particles);
  const std::vector<Particle> before = particles;
  for (std::size_t i = 0; i < before.size(); ++i) {
    Turn& turn = turns[turn_before[i]];
    turn.log_before = log_sum(turn.log_before, before[i].log_weight);
  }
  if (!resample(options, stream, particles)) return false;
  std::vector<std::vector<std::size_t>> members(turns.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    std::size_t turn = 0;
    while (turn + 1 < turns.size() && is_apart(particles[i].X_WO, before[turns[turn].leader].X_WO, symmetry)) ++turn;
    members[turn].push_back(i);
  }
  for (std::size_t turn = 0; turn < turns.size(); ++turn) {
    if (!members[turn].empty() || !(turns[turn].log_before > kSlipLogOdds)) continue;
    const auto richest = std::max_element(members.begin(), members.end(),
                                          [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (richest->size() < 2) break;
    members[turn].push_back(richest->back());
    richest->pop_back();
    particles[members[turn].front()] = before[turns[turn].leader];
  }
  for (std::size_t turn = 0; turn < turns.size(); ++turn)
    for (const std::size_t i : members[turn])
      particles[i].log_weight = turns[turn].log_before - std::log(static_cast<double>(members[turn].size()));
  belief::normalize(particles);
  return true;
}

}  // namespace prescene::filter
