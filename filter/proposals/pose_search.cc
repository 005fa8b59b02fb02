// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/pose_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

constexpr std::size_t kStartsInBlock = 4;  // enough for a batch to share work, few enough to balance threads
constexpr int kMinPixels = 6;              // fewer residuals than unknowns say nothing
constexpr double kMostShift = 0.03;        // m, of the centre in one step (trust region)
constexpr double kMostTurn = 0.25;         // rad in one step
constexpr double kSettledShift = 1e-4;     // m; below this and kSettledTurn at the last gate a start stops early
constexpr double kSettledTurn = 1e-3;      // rad
constexpr double kPolishShift = 0.004;     // m, standard deviation of the first moves per axis; shrinks to a quarter
constexpr double kPolishTurn = 0.06;       // rad

double gate_at(const RefineOptions& options, int step) {
  // The last quarter of the steps works at the final gate.
  const double shrinking = std::max(1.0, 0.75 * options.steps - 1.0);
  const double t = std::min(1.0, step / shrinking);
  return options.first_gate * std::pow(options.last_gate / options.first_gate, t);
}

/// The step d (about the centre) of the damped normal equations within the trust region; zero when they are singular.
Vector6d bounded_step(const rendering::PoseLinearisation& equations, const Matrix6d& A, double radius) {
  Matrix6d H = A.transpose() * equations.H * A;
  const Vector6d g = A.transpose() * equations.g;
  // Directions that depth does not see (a can's turn about its axis) are held by a damping that a seen one outweighs.
  const double scale = 1e-3 * H.diagonal().tail<3>().mean();
  H.diagonal().tail<3>().array() += scale + 1e-9;
  H.diagonal().head<3>().array() += scale * radius * radius + 1e-9;
  Vector6d d = geometry::solve_symmetric_6(H, g);
  if (!d.allFinite()) return Vector6d::Zero();
  const double turn = d.head<3>().norm(), shift = d.tail<3>().norm();
  const double factor = std::min({1.0, kMostTurn / std::max(turn, 1e-12), kMostShift / std::max(shift, 1e-12)});
  return factor * d;
}

void sort_best_first(std::vector<PoseCandidate>& candidates, std::size_t count) {
  std::stable_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
                   [](const auto& a, const auto& b) { return a.evidence.log_ratio > b.evidence.log_ratio; });
}

std::size_t polish_count(const std::vector<PoseCandidate>& candidates, const SearchOptions& options) {
  return std::min(candidates.size(), static_cast<std::size_t>(std::max(0, options.polish_candidates)));
}

/// A stream of its own for each candidate, whatever position the caller's stream is at.
core::RandomStream polish_stream(const core::RandomStream& stream, std::size_t candidate) {
  core::RandomStream draws = stream;
  return core::RandomStream(draws.next_u64(), core::Purpose::kProposal, candidate);
}

}  // namespace

rendering::PoseHypothesis hypothesis(const SearchTarget& target, const Pose& X_CO, double tempering_pixels) {
  rendering::PoseHypothesis h;
  h.mesh = target.mesh.get();
  h.X_CO = X_CO;
  h.material = &target.material;
  h.color_model = target.color_model;
  h.tempering_pixels = tempering_pixels;
  return h;
}

Matrix6d from_point_coordinates(const geometry::Quaterniond& R_PO, const Vector3d& p_OQ) {
  Matrix6d A = Matrix6d::Identity();
  A.bottomLeftCorner<3, 3>() = R_PO.toRotationMatrix() * geometry::cross_matrix(p_OQ);
  return A;
}

Pose moved_about(const Pose& X_PO, const Vector3d& p_OQ, const Vector6d& d) {
  const Vector3d p_PQ = X_PO * p_OQ + d.tail<3>();
  Pose moved;
  moved.rotation = (X_PO.rotation * geometry::exp_rotation(d.head<3>())).normalized();
  moved.translation = p_PQ - moved.rotation * p_OQ;
  return moved;
}

std::vector<Pose> disturbed_starts(const Pose& X_CO, const Vector3d& p_OQ, double shift, double turn, int count,
                                   const core::RandomStream& stream) {
  core::RandomStream draws = stream;
  std::vector<Pose> starts;
  starts.reserve(static_cast<std::size_t>(std::max(count, 0)));
  for (int i = 0; i < count; ++i) {
    Vector6d d = Vector6d::Zero();
    if (i > 0) {
      d.head<3>() = turn * geometry::normal_vector(draws);
      d.tail<3>() = shift * geometry::normal_vector(draws);
    }
    starts.push_back(moved_about(X_CO, p_OQ, d));
  }
  return starts;
}

void PoseSearch::refine(const rendering::FrameTerms& terms, const SearchTarget& target, const RefineOptions& options,
                        rendering::LikelihoodWorkspace& workspace, std::span<Pose> poses_CO) const {
  const Vector3d centre = target.centre();
  const double radius = std::max(1e-3, static_cast<double>(target.mesh->radius));
  std::vector<std::size_t> active(poses_CO.size());
  std::iota(active.begin(), active.end(), std::size_t{0});
  std::vector<rendering::PoseHypothesis> hypotheses;
  std::vector<rendering::PoseLinearisation> equations;
  for (int step = 0; step < options.steps && !active.empty(); ++step) {
    rendering::LineariseOptions linearise;
    linearise.gate = gate_at(options, step);
    hypotheses.clear();
    for (const std::size_t i : active) hypotheses.push_back(hypothesis(target, poses_CO[i]));
    equations.assign(active.size(), {});
    batch_->linearise(terms, hypotheses, linearise, workspace, equations);
    std::vector<std::size_t> still_active;
    for (std::size_t k = 0; k < active.size(); ++k) {
      if (equations[k].pixels < kMinPixels) continue;
      Pose& pose = poses_CO[active[k]];
      const Vector6d d = bounded_step(equations[k], from_point_coordinates(pose.rotation, centre), radius);
      pose = moved_about(pose, centre, d);
      const bool settled = linearise.gate <= options.last_gate * 1.0001 && d.head<3>().norm() < kSettledTurn &&
                           d.tail<3>().norm() < kSettledShift;
      if (!settled) still_active.push_back(active[k]);
    }
    active = std::move(still_active);
  }
}

void PoseSearch::polish(const rendering::FrameTerms& terms, const SearchTarget& target, const SearchOptions& options,
                        core::RandomStream stream, rendering::LikelihoodWorkspace& workspace,
                        PoseCandidate& candidate) const {
  const Vector3d centre = target.centre();
  for (int draw = 0; draw < options.polish_draws; ++draw) {
    const double size = std::pow(0.25, static_cast<double>(draw) / std::max(1, options.polish_draws - 1));
    Vector6d d;
    d.head<3>() = size * kPolishTurn * geometry::normal_vector(stream);
    d.tail<3>() = size * kPolishShift * geometry::normal_vector(stream);
    PoseCandidate trial;
    trial.X_CO = moved_about(candidate.X_CO, centre, d);
    const rendering::PoseHypothesis h = hypothesis(target, trial.X_CO);
    batch_->evaluate(terms, std::span(&h, 1), workspace, std::span(&trial.evidence, 1));
    if (trial.evidence.log_ratio > candidate.evidence.log_ratio) candidate = trial;
  }
}

std::vector<PoseCandidate> PoseSearch::scored(const rendering::FrameTerms& terms, const SearchTarget& target,
                                              std::span<const Pose> starts_CO, const RefineOptions& options,
                                              rendering::LikelihoodWorkspace& workspace) const {
  std::vector<Pose> poses(starts_CO.begin(), starts_CO.end());
  refine(terms, target, options, workspace, poses);
  std::vector<rendering::PoseHypothesis> hypotheses;
  for (const Pose& pose : poses) hypotheses.push_back(hypothesis(target, pose));
  std::vector<rendering::PoseEvidence> evidences(poses.size());
  batch_->evaluate(terms, hypotheses, workspace, evidences);
  std::vector<PoseCandidate> candidates(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) candidates[i] = {poses[i], evidences[i]};
  return candidates;
}

std::vector<PoseCandidate> PoseSearch::run_serial(const rendering::FrameTerms& terms, const SearchTarget& target,
                                                  std::span<const Pose> starts_CO, const SearchOptions& options,
                                                  const core::RandomStream& stream,
                                                  rendering::LikelihoodWorkspace& workspace) const {
  std::vector<PoseCandidate> candidates = scored(terms, target, starts_CO, options.refine, workspace);
  sort_best_first(candidates, candidates.size());
  const std::size_t polished = polish_count(candidates, options);
  for (std::size_t i = 0; i < polished; ++i)
    polish(terms, target, options, polish_stream(stream, i), workspace, candidates[i]);
  sort_best_first(candidates, polished);
  return candidates;
}

std::vector<PoseCandidate> PoseSearch::run(const rendering::FrameTerms& terms, const SearchTarget& target,
                                           std::span<const Pose> starts_CO, const SearchOptions& options,
                                           const core::RandomStream& stream) {
  std::vector<PoseCandidate> candidates(starts_CO.size());
  // Candidates do not depend on the blocks.
  const std::size_t in_block = std::max(kStartsInBlock, batch_->info().good_call);
  threads_->for_blocks(starts_CO.size(), in_block, [&](std::size_t begin, std::size_t end) {
    const rendering::WorkspacePool::Loan workspace(workspaces_);
    const auto block = scored(terms, target, starts_CO.subspan(begin, end - begin), options.refine, *workspace);
    std::copy(block.begin(), block.end(), candidates.begin() + static_cast<std::ptrdiff_t>(begin));
  });
  sort_best_first(candidates, candidates.size());
  const std::size_t polished = polish_count(candidates, options);
  threads_->for_each_index(polished, [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(workspaces_);
    polish(terms, target, options, polish_stream(stream, i), *workspace, candidates[i]);
  });
  sort_best_first(candidates, polished);
  return candidates;
}

}  // namespace prescene::filter
