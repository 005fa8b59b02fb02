// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "prescene/core/check.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/surface_tree.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::geometry {
namespace {

// Asks whether rotations about a point map a mesh onto itself.
class SymmetryTest {
 public:
  SymmetryTest(const TriangleMesh& mesh, const Vector3d& centre, double tolerance)
      : surface_(mesh), centre_(centre), tolerance_(tolerance) {
    // Area decides what is seen: a feature of 1 % of the area is missed by 500 points with probability 0.7 %.
    constexpr int kPoints = 500;
    points_ = sample_surface(mesh, kPoints, 0);
    // Thin handles and fins reach far out but have little area, so the farthest vertices are points too.
    std::vector<Vector3d> far = mesh.vertices;
    const std::size_t count = std::min<std::size_t>(far.size(), 64);
    std::partial_sort(far.begin(), far.begin() + static_cast<std::ptrdiff_t>(count), far.end(),
                      [&](const Vector3d& a, const Vector3d& b) {
                        const double da = (a - centre).squaredNorm();
                        const double db = (b - centre).squaredNorm();
                        return da != db ? da > db
                                        : std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
                      });
    for (std::size_t i = 0; i < count; ++i) points_.push_back({far[i], Vector3d::Zero()});
  }

  bool holds(const Quaterniond& rotation) const {
    const Matrix3d R = rotation.toRotationMatrix();
    return std::all_of(points_.begin(), points_.end(), [&](const SurfacePoint& point) {
      return surface_.is_within(centre_ + R * (point.position - centre_), tolerance_);
    });
  }

  // The most steps n of 360/n degrees that hold about an axis: 0 for any turn, 1 for none.
  int steps_about(const Vector3d& axis) const {
    constexpr double kGoldenAngle = 2.399963229728653;
    bool any_turn = true;
    for (int k = 1; k <= 8 && any_turn; ++k) any_turn = holds(exp_rotation(k * kGoldenAngle * axis));
    if (any_turn) return 0;
    for (int n = 8; n >= 2; --n) {
      bool all = true;
      for (int k = 1; 2 * k <= n && all; ++k) all = holds(exp_rotation(2.0 * std::numbers::pi * k / n * axis));
      if (all) return n;
    }
    return 1;
  }

 private:
  SurfaceTree surface_;
  Vector3d centre_;
  double tolerance_;
  std::vector<SurfacePoint> points_;
};

// Mass properties of the solid, or of the surface's points when the mesh is open.
MassProperties inertia_of(const TriangleMesh& mesh) {
  if (auto solid = mass_properties(mesh, 1.0); solid.ok()) return *solid;
  MassProperties shell;
  const std::vector<SurfacePoint> points = sample_surface(mesh, 4000, 0);
  shell.mass = static_cast<double>(points.size());
  for (const SurfacePoint& p : points) shell.p_BoBcm += p.position / shell.mass;
  for (const SurfacePoint& p : points) {
    const Vector3d d = p.position - shell.p_BoBcm;
    shell.I_BBcm_B += d.squaredNorm() * Matrix3d::Identity() - d * d.transpose();
  }
  return shell;
}

// The frame's axes first: where a principal axis is (almost) the same, the round numbers win.
std::vector<Vector3d> candidate_axes(const MassProperties& body) {
  const PrincipalInertia principal = principal_inertia(body);
  std::vector<Vector3d> axes;
  const auto add = [&](const Vector3d& axis) {
    constexpr double kCosineOfHalfDegree = 0.99996192;
    const bool known = std::any_of(axes.begin(), axes.end(),
                                   [&](const Vector3d& a) { return std::abs(a.dot(axis)) > kCosineOfHalfDegree; });
    if (!known) axes.push_back(axis);
  };
  for (int i = 0; i < 3; ++i) add(Vector3d::Unit(i));
  for (int i = 0; i < 3; ++i) add(principal.R_BP.col(i));
  if (principal.moments[2] < 1.01 * principal.moments[0]) {
    for (const auto& [x, y, z] : {std::array<double, 3>{1, 1, 1},
                                  {-1, 1, 1},
                                  {1, -1, 1},
                                  {1, 1, -1},
                                  {1, 1, 0},
                                  {1, -1, 0},
                                  {1, 0, 1},
                                  {1, 0, -1},
                                  {0, 1, 1},
                                  {0, 1, -1}}) {
      add(Vector3d(x, y, z).normalized());
    }
  }
  return axes;
}

// Directions across an axis in which a prism of n sides may have axes of half turns: towards the vertex farthest from
// the axis, and half a side from it.
std::vector<Vector3d> candidates_across(const TriangleMesh& mesh, const Vector3d& centre, const Vector3d& axis, int n) {
  Vector3d farthest = Vector3d::Zero();
  for (const Vector3d& p : mesh.vertices) {
    const Vector3d across = (p - centre) - (p - centre).dot(axis) * axis;
    if (across.squaredNorm() > farthest.squaredNorm()) farthest = across;
  }
  if (farthest.isZero()) return {};
  const Vector3d direction = farthest.normalized();
  return {direction, exp_rotation(std::numbers::pi / (2.0 * n) * axis) * direction,
          exp_rotation(std::numbers::pi / n * axis) * direction};
}

// All products of the generators; empty when they do not close into a small group.
std::optional<std::vector<Quaterniond>> closure(const std::vector<Quaterniond>& generators) {
  // Different rotations of a group with at most 8 steps about an axis are at least 45 degrees apart; axes found by two
  // different ways may disagree by some degrees.
  constexpr double kSame = 0.2;
  constexpr std::size_t kLargest = 60;  // The icosahedron's.
  std::vector<Quaterniond> group = {Quaterniond::Identity()};
  for (std::size_t i = 0; i < group.size(); ++i) {
    for (const Quaterniond& generator : generators) {
      const Quaterniond product = (group[i] * generator).normalized();
      const bool known = std::any_of(group.begin(), group.end(),
                                     [&](const Quaterniond& g) { return angle_between(g, product) < kSame; });
      if (!known) group.push_back(product);
      if (group.size() > kLargest) return std::nullopt;
    }
  }
  group.erase(group.begin());
  return group;
}

}  // namespace

SymmetryGroup suggest_symmetry(const TriangleMesh& mesh, double tolerance) {
  PRESCENE_CHECK(tolerance > 0.0);
  if (mesh.empty()) return SymmetryGroup::none();
  const MassProperties body = inertia_of(mesh);
  const Vector3d centre = body.p_BoBcm;
  const SymmetryTest test(mesh, centre, tolerance);

  std::vector<Vector3d> continuous;
  std::vector<std::pair<Vector3d, int>> stepped;
  for (const Vector3d& axis : candidate_axes(body)) {
    const int steps = test.steps_about(axis);
    if (steps == 0) continuous.push_back(axis);
    if (steps > 1) stepped.emplace_back(axis, steps);
  }
  if (continuous.size() > 1) return SymmetryGroup::every_rotation(centre);
  if (continuous.size() == 1) {
    const Vector3d& axis = continuous.front();
    const bool flip = test.holds(exp_rotation(std::numbers::pi * axis.unitOrthogonal()));
    return SymmetryGroup::continuous(axis, flip, centre);
  }
  if (stepped.empty()) return SymmetryGroup::none();

  const auto [best_axis, best_steps] = *std::max_element(
      stepped.begin(), stepped.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (best_steps > 2) {
    for (const Vector3d& across : candidates_across(mesh, centre, best_axis, best_steps)) {
      if (test.holds(exp_rotation(std::numbers::pi * across))) stepped.emplace_back(across, 2);
    }
  }
  std::vector<Quaterniond> generators;
  for (const auto& [axis, steps] : stepped) generators.push_back(exp_rotation(2.0 * std::numbers::pi / steps * axis));
  SymmetryGroup group;
  if (auto rotations = closure(generators)) {
    group.rotations = std::move(*rotations);
    group.p_BoC = centre;
    return group;
  }
  return SymmetryGroup::cyclic(best_axis, best_steps, centre);
}

}  // namespace prescene::geometry
