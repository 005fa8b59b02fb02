// SPDX-License-Identifier: Apache-2.0
#include "rival_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "particle_update.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/proposals/facets.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using geometry::Matrix3d;
using geometry::SymmetryGroup;

constexpr int kTurnSteps = 24;            // in a full turn
constexpr double kSameAxis = 0.996;       // cosine; about 5 degrees
constexpr std::size_t kPosesInBlock = 4;  // of a thread; results do not depend on it

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

/// How far a mesh reaches in a direction of W from its pose's origin, m.
double reach_along(const rendering::RenderMesh& mesh, const Pose& X_WO, const Vector3d& direction_W) {
  const Eigen::Vector3f direction_O = (X_WO.rotation.conjugate() * direction_W).cast<float>();
  float most = -std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& vertex : mesh.vertices) most = std::max(most, direction_O.dot(vertex));
  return static_cast<double>(most) + direction_W.dot(X_WO.translation);
}

}  // namespace

bool is_apart(const Pose& a_WO, const Pose& b_WO, const SymmetryGroup& symmetry) {
  return geometry::symmetric_angle(a_WO, b_WO, symmetry) >= kRivalTurn;
}

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

void add_apart(std::span<const Pose> X_WO, std::span<const rendering::PoseEvidence> evidence,
               const SymmetryGroup& symmetry, std::size_t most, std::vector<Pose>& chosen) {
  std::vector<std::size_t> order(X_WO.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return evidence[a].log_ratio > evidence[b].log_ratio; });
  for (const std::size_t i : order) {
    if (chosen.size() >= most) return;
    // A little less than apart: neighbours on the grid of turns are all tried.
    const bool is_new = std::all_of(chosen.begin(), chosen.end(), [&](const Pose& other) {
      return geometry::symmetric_angle(X_WO[i], other, symmetry) > 0.9 * kRivalTurn;
    });
    if (is_new) chosen.push_back(X_WO[i]);
  }
}

RivalSearch::RivalSearch(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                         const WeightOptions& weighting, const FilterTools& tools)
    : frame_(frame),
      terms_(terms),
      target_(target),
      weighting_(weighting),
      tools_(tools),
      in_block_(std::max(kPosesInBlock, tools.search->batch().info().good_call)) {}

std::vector<rendering::PoseEvidence> RivalSearch::evaluate(std::span<const Pose> X_WO) {
  std::vector<rendering::PoseHypothesis> hypotheses;
  hypotheses.reserve(X_WO.size());
  for (const Pose& pose : X_WO) hypotheses.push_back(hypothesis(target_, frame_.X_CW * pose));
  std::vector<rendering::PoseEvidence> evidence(hypotheses.size());
  tools_.search->threads().for_blocks(X_WO.size(), in_block_, [&](std::size_t begin, std::size_t end) {
    const rendering::WorkspacePool::Loan workspace(tools_.search->workspaces());
    tools_.search->batch().evaluate(terms_, std::span(hypotheses).subspan(begin, end - begin), *workspace,
                                    std::span(evidence).subspan(begin, end - begin));
  });
  return evidence;
}

void RivalSearch::refine(const RefineOptions& options, std::span<Pose> X_WO) {
  tools_.search->threads().for_blocks(X_WO.size(), in_block_, [&](std::size_t begin, std::size_t end) {
    const rendering::WorkspacePool::Loan workspace(tools_.search->workspaces());
    const std::span<Pose> poses = X_WO.subspan(begin, end - begin);
    for (Pose& pose : poses) pose = frame_.X_CW * pose;
    tools_.search->refine(terms_, target_, options, *workspace, poses);
    for (Pose& pose : poses) pose = geometry::normalized(frame_.X_WC * pose);
  });
}

double RivalSearch::worth(const rendering::PoseEvidence& evidence, const Pose& X_WO) {
  if (!(evidence.log_ratio > 0.0)) return evidence.log_ratio;
  const double outline =
      is_see_through(target_) ? 1.0 : outline_at(terms_, target_, frame_.X_CW * X_WO, weighting_, tools_);
  return filter::worth(evidence.log_ratio, outline, weighting_);
}

Matrix6d RivalSearch::covariance_at(const Pose& X_WO, double pixels, const InitialiseOptions& spread) {
  const rendering::PoseHypothesis h = hypothesis(target_, frame_.X_CW * X_WO, pixels);
  rendering::PoseLinearisation residuals;
  const rendering::WorkspacePool::Loan workspace(tools_.search->workspaces());
  tools_.search->batch().linearise(terms_, std::span(&h, 1), {}, *workspace, std::span(&residuals, 1));
  Matrix6d H = rendering::tempering(terms_.tempering.information, pixels, terms_.step) * residuals.H;
  Vector6d unused = Vector6d::Zero();
  without_facets(target_.facet_lever, h.X_CO.rotation, target_.centre(), H, unused);
  Matrix6d information = information_in_world(H, frame_.X_CW.rotation);
  information.diagonal().head<3>().array() += 1.0 / (spread.first_turn * spread.first_turn);
  information.diagonal().tail<3>().array() += 1.0 / (spread.first_shift * spread.first_shift);
  return geometry::Cholesky6(information).inverse();
}

}  // namespace prescene::filter
