// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/penetration.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "prescene/collision/distance_queries.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TriangleTree tree_of_origin() {
  core::ThreadPool pool(1);
  auto mesh = Mesh::make({Vector3f::Zero()}, {TriangleIndices{0, 0, 0}}, "point");
  PRESCENE_CHECK(mesh.ok());
  return TriangleTree::build(*mesh, {}, pool);
}

Transform moved(const Transform& X, const Vector3d& by) {
  Transform result = X;
  const Vector3d p = translation_vector(X) + by;
  for (int i = 0; i < 3; ++i) result.translation[static_cast<std::size_t>(i)] = static_cast<float>(p[i]);
  return result;
}

/// The box about the whole body, in its mesh's frame.
struct BodyBox {
  Vector3d centre;
  Matrix3d axes;  ///< Columns.
  Vector3d half;

  explicit BodyBox(const TriangleTreeNode& root) {
    for (int k = 0; k < 3; ++k) {
      axes.col(k) = Vector3f(root.axes_x[k], root.axes_y[k], root.axes_z[k]).cast<double>();
      half[k] = static_cast<double>(root.half_extent[k]);
    }
    centre = Vector3f(root.origin).cast<double>() + axes * half;
  }
  BodyBox placed(const Transform& X) const {
    BodyBox box = *this;
    box.centre = rotation_matrix(X) * centre + translation_vector(X);
    box.axes = rotation_matrix(X) * axes;
    return box;
  }
  bool contains(const Vector3d& p) const {
    return ((axes.transpose() * (p - centre)).cwiseAbs() - half).maxCoeff() <= 1e-6 * half.maxCoeff();
  }
  double reach(const Vector3d& direction) const { return (axes.transpose() * direction).cwiseAbs().dot(half); }
};

/// Whether a point is inside of a closed mesh: from behind which side of triangles it looks at in three directions.
bool is_inside(const TriangleTree& tree, const Vector3d& p, QueryScratch& scratch, QueryCounts* counts) {
  // Directions along which models rarely have edges or faces.
  static const std::array<Vector3d, 3> kDirections = {
      Vector3d(0.4172, 0.6913, 0.5901), Vector3d(-0.7391, 0.3379, -0.5827), Vector3d(0.1729, -0.8863, 0.4297)};
  int votes = 0;
  for (int i = 0; i < 3; ++i) {
    Ray ray;
    ray.origin = p;
    ray.direction = kDirections[static_cast<std::size_t>(i)];
    const std::optional<RayHit> hit = nearest_hit(tree, ray, scratch, counts);
    if (!hit && i == 0) return false;
    votes += hit && !hit->front ? 1 : -1;
    if (std::abs(votes) == 2) break;
  }
  return votes > 0;
}

class PenetrationSearch {
 public:
  PenetrationSearch(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                    const PenetrationOptions& options, PenetrationScratch* scratch, QueryCounts* counts)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        tolerance_(std::clamp(options.tolerance >= 0.0 ? options.tolerance : 0.0, 1e-6, 1.0)),
        scratch_(*scratch),
        counts_(counts),
        box_a_(a.nodes()[0]),
        box_b_(BodyBox(b.nodes()[0]).placed(X_AB)) {
    const double extent =
        static_cast<double>(a.radius()) + static_cast<double>(b.radius()) + translation_vector(X_AB).lpNorm<1>();
    // Bodies that are points have no extent; they too come apart.
    rounding_ = 0x1p-20 * extent + static_cast<double>(std::numeric_limits<float>::min());
  }

  std::optional<Penetration> run() {
    if (apart(Vector3d::Zero())) return std::nullopt;
    find_contact();
    try_candidates();
    project();
    turn();
    Penetration result;
    result.X_AB_apart = moved(X_AB_, length_ * direction_);
    // What was really done, after rounding.
    const Vector3d translation = translation_vector(result.X_AB_apart) - translation_vector(X_AB_);
    result.depth = translation.norm();
    if (result.depth > 0.0) result.direction = translation / result.depth;
    const Distance touching = distance_at(result.X_AB_apart);
    result.p_A = touching.p_A;
    result.p_B = touching.p_B - translation;
    result.least = std::min(largest_common_depth(result), result.depth);
    return result;
  }

 private:
  Distance distance_at(const Transform& X_AB) {
    const std::optional<Distance> found = distance(a_, b_, X_AB, {}, scratch_.queries(), counts_);
    PRESCENE_CHECK(found.has_value());
    return *found;
  }

  /// Whether a piece of one body is inside of the other. Only where the bodies do not collide: then a piece is where
  /// any of its corners is.
  bool one_in_other(const Transform& X_AB) {
    const Matrix3d R_AB = rotation_matrix(X_AB);
    const Vector3d p_AB = translation_vector(X_AB);
    const auto inside = [this](const TriangleTree& body, const BodyBox& box, const Vector3d& p) {
      return box.contains(p) && is_inside(body, p, scratch_.queries(), counts_);
    };
    const BodyBox box_a(a_.nodes()[0]), box_b(b_.nodes()[0]);
    const std::vector<Vector3f>& of_a = a_.mesh().corners_of_parts();
    const std::vector<Vector3f>& of_b = b_.mesh().corners_of_parts();
    return std::any_of(of_b.begin(), of_b.end(),
                       [&](const Vector3f& p) { return inside(a_, box_a, (X_AB * p).cast<double>()); }) ||
           std::any_of(of_a.begin(), of_a.end(), [&](const Vector3f& p) {
             return inside(b_, box_b, R_AB.transpose() * (p.cast<double>() - p_AB));
           });
  }

  /// How far B must go for its box to have left that of A, at most.
  double certain_length(const Vector3d& direction) const {
    return box_a_.reach(direction) + box_b_.reach(direction) - direction.dot(box_b_.centre - box_a_.centre);
  }

  /// Whether the bodies are apart once B has been moved.
  bool apart(const Vector3d& by) {
    const Transform X_AB = moved(X_AB_, by);
    return !collide(a_, b_, X_AB, scratch_.queries(), counts_) && !one_in_other(X_AB);
  }

  /// Follows a direction to where the bodies come apart, if that is nearer than what is known.
  void try_direction(const Vector3d& direction) {
    if (!(direction.norm() > 0.5)) return;
    const Vector3d u = direction.normalized();
    double low = 0.0;
    double high = 0.0;
    if (std::isfinite(length_)) {
      if (length_ <= rounding_) return;  // Shorter ones mean nothing.
      high = (1.0 - tolerance_) * length_;
      if (!apart(high * u)) return;
    } else {
      const double most = certain_length(u);
      for (high = most / 64.0; high < most; high *= 2.0) {
        if (apart(high * u)) break;
        low = high;
      }
      // Apart by their boxes, but for rounding.
      if (high >= most) {
        high = most + rounding_;
        while (collide(a_, b_, moved(X_AB_, high * u), scratch_.queries(), counts_)) high *= 2.0;
      }
    }
    while (high - low > std::max(tolerance_ * high, rounding_)) {
      const double middle = 0.5 * (low + high);
      (apart(middle * u) ? high : low) = middle;
    }
    length_ = high;
    direction_ = u;
  }

  /// Where the surfaces meet: a point in the middle, the normal of the plane that is nearest to the curve along which
  /// they do, and the mean normals of the triangles there.
  void find_contact() {
    constexpr std::size_t kMost = 256;
    std::vector<TrianglePair>& pairs = scratch_.pairs();
    pairs.clear();
    all_pairs(a_, b_, X_AB_, kMost, &pairs, scratch_.queries(), counts_);
    middle_ = 0.5 * (box_a_.centre + box_b_.centre);
    if (pairs.empty()) return;
    Vector3d sum = Vector3d::Zero();
    Matrix3d squares = Matrix3d::Zero();
    const auto middle_of = [](const std::array<Vector3f, 3>& t) {
      return ((t[0] + t[1] + t[2]) / 3.0F).cast<double>().eval();
    };
    const auto normal_of = [](const std::array<Vector3f, 3>& t) {
      return (t[1] - t[0]).cast<double>().cross((t[2] - t[0]).cast<double>()).eval();
    };
    const Matrix3d R_AB = rotation_matrix(X_AB_);
    const Vector3d origin = middle_of(a_.mesh().corners(pairs[0].a));
    for (const TrianglePair& pair : pairs) {
      const std::array<Vector3f, 3> triangle_a = a_.mesh().corners(pair.a);
      const std::array<Vector3f, 3> triangle_b = b_.mesh().corners(pair.b);
      // About where they meet: weighted towards the smaller.
      const Vector3d n_a = normal_of(triangle_a);
      const Vector3d n_b = R_AB * normal_of(triangle_b);
      const double size_a = n_a.norm() + std::numeric_limits<double>::min();
      const double size_b = n_b.norm() + std::numeric_limits<double>::min();
      const Vector3d p_a = middle_of(triangle_a);
      const Vector3d p_b = R_AB * middle_of(triangle_b) + translation_vector(X_AB_);
      const Vector3d p = (p_a * size_b + p_b * size_a) / (size_a + size_b) - origin;
      normal_a_ += n_a / size_a;
      normal_b_ += n_b / size_b;
      sum += p;
      squares += p * p.transpose();
    }
    const auto count = static_cast<double>(pairs.size());
    middle_ = origin + sum / count;
    Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
    solver.computeDirect(squares - sum * sum.transpose() / count);
    if (solver.eigenvectors().allFinite()) curve_normal_ = solver.eigenvectors().col(0);
  }

  void try_candidates() {
    const auto unit = [](const Vector3d& v) { return v.norm() > 0.0 ? Vector3d(v.normalized()) : v; };
    for (const Vector3d& u : {unit(normal_a_), unit(-normal_b_), unit(box_b_.centre - box_a_.centre), curve_normal_,
                              Vector3d(-curve_normal_)})
      try_direction(u);
    for (int k = 0; k < 3; ++k) {
      for (const Vector3d& axis : {Vector3d(box_a_.axes.col(k)), Vector3d(box_b_.axes.col(k))}) {
        try_direction(axis);
        try_direction(-axis);
      }
    }
  }

  /// Where B comes apart, the nearest points tell the plane along which the bodies touch, and so the shortest way
  /// there.
  void project() {
    constexpr int kMost = 16;
    for (int i = 0; i < kMost; ++i) {
      const double before = length_;
      const Distance touching = distance_at(moved(X_AB_, length_ * direction_));
      if (touching.distance <= 0.0) return;
      const Vector3d normal = (touching.p_B - touching.p_A) / touching.distance;
      if (normal.dot(direction_) <= 0.0) return;
      try_direction(normal);
      if (length_ == before) return;
    }
  }

  void turn() {
    constexpr double kLargest = 0.25;   // rad
    constexpr double kSmallest = 0.01;  // rad
    for (double angle = kLargest; angle > kSmallest;) {
      const double before = length_;
      const Vector3d u = direction_.unitOrthogonal();
      const Vector3d v = direction_.cross(u);
      for (const Vector3d& side : {u, Vector3d(-u), v, Vector3d(-v)}) try_direction(direction_ + angle * side);
      if (length_ == before) angle *= 0.4;
    }
  }

  /// Radii of balls about a point inside of both bodies, and the direction in which their sum grows; nothing outside.
  struct CommonDepth {
    double sum = 0.0;
    Vector3d uphill = Vector3d::Zero();
  };

  CommonDepth common_depth(const Vector3d& p) {
    const Matrix3d R_AB = rotation_matrix(X_AB_);
    const Vector3d p_B = R_AB.transpose() * (p - translation_vector(X_AB_));
    if (!is_inside(a_, p, scratch_.queries(), counts_) || !is_inside(b_, p_B, scratch_.queries(), counts_)) return {};
    CommonDepth depth;
    const auto add = [&](const TriangleTree& body, const Vector3d& q, const Matrix3d& R) {
      const std::optional<Distance> found =
          distance(body, scratch_.point(), moved(Transform(), q), {}, scratch_.queries(), counts_);
      if (!found || found->distance <= 0.0) return;
      depth.sum += std::max(0.0, found->distance - rounding_);
      depth.uphill += R * (found->p_B - found->p_A) / found->distance;
    };
    add(a_, p, Matrix3d::Identity());
    add(b_, p_B, R_AB);
    return depth;
  }

  double largest_common_depth(const Penetration& found) {
    Vector3d best_point = middle_;
    CommonDepth best = common_depth(middle_);
    const auto keep = [&](const Vector3d& p) {
      const CommonDepth depth = common_depth(p);
      if (depth.sum <= best.sum) return false;
      best = depth;
      best_point = p;
      return true;
    };
    for (const double share : {0.5, 0.0, 1.0}) keep(found.p_A + share * (found.p_B - found.p_A));
    for (const Vector3d& centre : {box_a_.centre, box_b_.centre}) keep(centre);
    // Uphill, with shorter and shorter steps.
    constexpr int kSteps = 12;
    double step = 0.5 * (found.depth - best.sum);
    for (int i = 0; i < kSteps && best.sum > 0.0 && best.sum < (1.0 - tolerance_) * found.depth; ++i) {
      const double norm = best.uphill.norm();
      if (norm < 1e-3) break;
      if (!keep(best_point + best.uphill * (step / norm))) step *= 0.5;
    }
    return best.sum;
  }

  const TriangleTree& a_;
  const TriangleTree& b_;
  const Transform& X_AB_;
  double tolerance_;
  PenetrationScratch& scratch_;
  QueryCounts* counts_;
  BodyBox box_a_;
  BodyBox box_b_;  ///< In A's frame.
  double rounding_ = 0.0;
  Vector3d middle_ = Vector3d::Zero();
  Vector3d curve_normal_ = Vector3d::Zero();
  Vector3d normal_a_ = Vector3d::Zero();
  Vector3d normal_b_ = Vector3d::Zero();
  double length_ = std::numeric_limits<double>::infinity();
  Vector3d direction_ = Vector3d::UnitX();
};

}  // namespace

PenetrationScratch::PenetrationScratch() : point_(tree_of_origin()) {}

std::optional<Penetration> penetration(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                       const PenetrationOptions& options, PenetrationScratch& scratch,
                                       QueryCounts* counts) {
  return PenetrationSearch(a, b, X_AB, options, &scratch, counts).run();
}

}  // namespace prescene::collision
