// SPDX-License-Identifier: Apache-2.0
#include "lane_spheres.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

using collision::SphereTree;
using Eigen::Vector3d;
using Matrix3d = Eigen::Matrix3d;

constexpr Real kUnlimited = Real(1e30);

void put(const Vector3d& value, std::size_t lane, std::array<SphereLanes::Row, 3>& rows) {
  for (std::size_t k = 0; k < 3; ++k) rows[k][lane] = static_cast<Real>(value[static_cast<Eigen::Index>(k)]);
}

void put(const collision::SurfacePatch& patch, std::size_t lane, const Vector3d& middle, SphereLanes::PatchRows& rows) {
  put(patch.centre.cast<double>() - middle, lane, rows.centre);
  put(patch.point.cast<double>() - middle, lane, rows.point);
  put(patch.normal.cast<double>(), lane, rows.normal);
  put(patch.tangent.cast<double>(), lane, rows.tangent);
  put(patch.bitangent.cast<double>(), lane, rows.bitangent);
  for (std::size_t k = 0; k < 3; ++k) rows.bend[k][lane] = patch.bend[k];
  rows.radius[lane] = patch.radius;
  rows.reach[lane] = patch.reach;
  rows.bent = rows.bent || patch.bend != std::array<float, 3>{};
  for (std::size_t k = 0; k < 2; ++k) {
    const collision::SurfacePatch::Limit& limit = patch.limits[k];
    const bool used = limit.out.squaredNorm() > 0.0F;
    put(limit.out.cast<double>(), lane, rows.out[k]);
    rows.distance[k][lane] = used ? limit.distance : kUnlimited;
    rows.limited = rows.limited || used;
  }
}

void hold_centres(std::size_t count, SphereLanes::PatchRows& rows) {
  const auto centre = [&](std::size_t k) {
    return Vector3d(static_cast<double>(rows.centre[0][k]), static_cast<double>(rows.centre[1][k]),
                    static_cast<double>(rows.centre[2][k]));
  };
  Vector3d low = centre(0), high = low;
  for (std::size_t k = 1; k < count; ++k) {
    low = low.cwiseMin(centre(k));
    high = high.cwiseMax(centre(k));
  }
  const Vector3d middle = 0.5 * (low + high);
  double ball = 0.0;
  for (std::size_t k = 0; k < count; ++k) ball = std::max(ball, (centre(k) - middle).norm());
  for (std::size_t i = 0; i < 3; ++i) rows.middle[i] = static_cast<Real>(middle[static_cast<Eigen::Index>(i)]);
  rows.ball = static_cast<Real>(ball);
}

Vector3d vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
Matrix3d matrix_of(const std::array<double, 9>& m) {
  return (Matrix3d() << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]).finished();
}
Vector3d vector_of(const Rows<3>& rows, std::int32_t at) {
  return {static_cast<double>(rows[0][at]), static_cast<double>(rows[1][at]), static_cast<double>(rows[2][at])};
}
std::array<Real, 3> reals(const Vector3d& v) {
  return {static_cast<Real>(v.x()), static_cast<Real>(v.y()), static_cast<Real>(v.z())};
}

/// A part of a body in a slot: its frame S, and how the body moves before its contacts act; W.
struct PlacedPart {
  const ConvexPart* part = nullptr;
  Matrix3d R_WBody = Matrix3d::Identity(), R_WS = Matrix3d::Identity();
  Vector3d p_WS = Vector3d::Zero();    ///< The part's middle.
  Vector3d center = Vector3d::Zero();  ///< What the velocity is of.
  Vector3d velocity = Vector3d::Zero(), spin = Vector3d::Zero();

  Vector3d velocity_at(const Vector3d& p) const { return velocity + spin.cross(p - center); }
};

PlacedPart placed(const LockstepScene& scene, const ConvexPart& part, int body, std::int32_t at,
                  const LaneState& state) {
  PlacedPart result;
  result.part = &part;
  const Matrix3d R_PS = matrix_of(part.R_PS);
  const Vector3d middle = vector_of(part.center);
  if (body < 0) {
    result.R_WS = R_PS;
    result.p_WS = middle;
    return result;
  }
  for (int i = 0; i < 9; ++i)
    result.R_WBody(i / 3, i % 3) = static_cast<double>(state.R[static_cast<std::size_t>(i)][at]);
  const bool object = body < scene.objects;
  result.center = vector_of(state.p, at);
  result.R_WS = result.R_WBody * R_PS;
  result.p_WS = result.center + result.R_WBody * (middle - vector_of(state.com, at));
  result.velocity = object ? vector_of(state.flown_v, at) : vector_of(state.v, at);
  if (object && state.inverse_mass[at] > 0) {
    const double falls = 0.5 * scene.settings.dt * static_cast<double>(state.share[at]);
    result.velocity -= falls * vector_of(scene.settings.gravity);
  }
  result.spin = vector_of(state.w, at);
  return result;
}

/// The box of a core about the part's middle.
void core_box(const ConvexPart& part, Vector3d& low, Vector3d& high) {
  Vector3d half = Vector3d::Zero();
  switch (part.kind) {
    case CoreKind::kPoint:
    case CoreKind::kSpheres:
      break;
    case CoreKind::kSegment:
      half.z() = part.half[2];
      break;
    case CoreKind::kBox:
      half = vector_of(part.half);
      break;
    case CoreKind::kCylinder:
      half = {part.half[0], part.half[0], part.half[2]};
      break;
    case CoreKind::kCone:
      low = {-part.half[0], -part.half[0], part.half[2]};
      high = {part.half[0], part.half[0], part.half[1]};
      return;
    case CoreKind::kHull:
      half = vector_of(part.box_half);
      break;
  }
  low = -half;
  high = half;
}

/// A's spheres at B; both in the same slot.
SphereQuery query_of(const PlacedPart& A, const PlacedPart& B, double range, double dt) {
  SphereQuery query{};
  query.spheres = A.part->spheres.get();
  query.core = B.part;
  query.others = B.part->spheres.get();
  const Matrix3d R_BS = B.R_WS.transpose() * A.R_WS;
  for (int i = 0; i < 9; ++i) query.R_BS[static_cast<std::size_t>(i)] = static_cast<Real>(R_BS(i / 3, i % 3));
  const Vector3d p_BS = B.R_WS.transpose() * (A.p_WS - B.p_WS);
  query.p_BS = reals(p_BS);
  query.velocity = reals(A.R_WS.transpose() * (A.velocity_at(A.p_WS) - B.velocity_at(A.p_WS)));
  query.spin = reals(A.R_WS.transpose() * (A.spin - B.spin));
  query.own_spin = reals(A.R_WS.transpose() * A.spin);
  query.center = reals(A.R_WS.transpose() * (A.center - A.p_WS));
  query.other_spin = reals(A.R_WS.transpose() * B.spin);
  query.other_center = reals(A.R_WS.transpose() * (B.center - A.p_WS));
  query.range = static_cast<Real>(range);
  query.dt = static_cast<Real>(dt);
  Vector3d low, high;
  core_box(*B.part, low, high);
  query.low = reals(low - p_BS);
  query.high = reals(high - p_BS);
  return query;
}

}  // namespace

std::shared_ptr<const SphereLanes> lanes_of(const collision::SurfaceSpheres& spheres,
                                            const std::array<double, 3>& middle) {
  const SphereTree& tree = *spheres.tree;
  PRESCENE_CHECK(tree.branching() == kNodeWidth);
  auto lanes = std::make_shared<SphereLanes>();
  lanes->middle = middle;
  lanes->reach = static_cast<double>(spheres.longest_reach);
  lanes->spacing = spheres.spacing;
  const collision::PackedSphere& root = tree.root();
  lanes->ball =
      (root.centre.cast<double>() - vector_of(middle)).norm() + static_cast<double>(root.radius) + lanes->reach;
  lanes->count = static_cast<int>(spheres.patches.size());
  const Vector3d origin = vector_of(middle);
  // How far a sphere's patch reaches beyond it, and of a node the farthest below it. Children come after their nodes.
  const auto beyond = [&](std::uint32_t sphere) {
    const double radius = static_cast<double>(tree.packing().spheres()[sphere].radius);
    return std::hypot(radius, static_cast<double>(spheres.patches[sphere].reach)) - radius;
  };
  std::vector<double> reaches(tree.nodes().size(), 0.0);
  const auto child_reach = [&](const SphereTree::Node& node, std::size_t k) {
    return node.is_bottom() ? beyond(tree.order()[node.first + k]) : reaches[node.first + k];
  };
  for (std::size_t index = tree.nodes().size(); index-- > 0;)
    for (std::size_t k = 0; k < tree.nodes()[index].count; ++k)
      reaches[index] = std::max(reaches[index], child_reach(tree.nodes()[index], k));
  for (std::size_t index = 0; index < tree.nodes().size(); ++index) {
    const SphereTree::Node& given = tree.nodes()[index];
    SphereLanes::Node node;
    for (SphereLanes::Row* row : {&node.x, &node.y, &node.z}) row->fill(SphereTree::kUnusedCentre);
    node.radius.fill(Real(0));
    node.count = given.count;
    node.bottom = given.is_bottom();
    node.first =
        node.bottom ? static_cast<std::int32_t>(lanes->patches.size()) : static_cast<std::int32_t>(given.first);
    const float* row = tree.lanes(static_cast<std::uint32_t>(index));
    for (std::size_t k = 0; k < given.count; ++k) {
      node.x[k] = static_cast<Real>(static_cast<double>(row[k]) - origin.x());
      node.y[k] = static_cast<Real>(static_cast<double>(row[kNodeWidth + k]) - origin.y());
      node.z[k] = static_cast<Real>(static_cast<double>(row[2 * kNodeWidth + k]) - origin.z());
      node.radius[k] = static_cast<Real>(static_cast<double>(row[3 * kNodeWidth + k]) + child_reach(given, k));
    }
    if (node.bottom) {
      SphereLanes::PatchRows rows{};
      for (std::size_t k = 0; k < given.count; ++k)
        put(spheres.patches[tree.order()[given.first + k]], k, origin, rows);
      hold_centres(given.count, rows);
      lanes->patches.push_back(rows);
    }
    lanes->nodes.push_back(node);
  }
  return lanes;
}

void FoundContacts::reserve(int more) {
  // A vector is stored behind the last one, whatever of it is wanted.
  const std::size_t needed = static_cast<std::size_t>(size_ + more + 2 * kNodeWidth) / kNodeWidth * kNodeWidth;
  if (needed <= capacity_) return;
  const std::size_t capacity = std::max(needed, 2 * capacity_);
  std::unique_ptr<Real[], Free> memory(
      static_cast<Real*>(::operator new[](kRows* capacity * sizeof(Real), std::align_val_t{64})));
  std::fill_n(memory.get(), kRows * capacity, Real(0));
  for (std::size_t r = 0; r < kRows; ++r)
    std::copy_n(memory_.get() + r * capacity_, size_, memory.get() + r * capacity);
  memory_ = std::move(memory);
  capacity_ = capacity;
}

void SpherePairs::begin(const SphereLanes& a, const SphereLanes& b) {
  for (auto* all : {&best_a, &best_b}) {
    auto& touched = all == &best_a ? touched_a : touched_b;
    for (const std::int32_t rows : touched) (*all)[static_cast<std::size_t>(rows)].touched = false;
    touched.clear();
  }
  best_a.resize(std::max(best_a.size(), a.patches.size()));
  best_b.resize(std::max(best_b.size(), b.patches.size()));
  placed.resize(std::max(placed.size(), b.patches.size()));
  is_placed.assign(placed.size(), 0);
  edges.clear();
  contacts.clear();
}

void touch_spheres(const LockstepScene& scene, const ConvexPart& part, int other,
                   std::span<const LanePairs::Near> pairs, LaneState& state, SphereScratch& scratch) {
  const PartId& id = scene.parts[static_cast<std::size_t>(other)];
  const ConvexPart& second = scene.part_of(id);
  ChosenContacts chosen;
  for (const LanePairs::Near& pair : pairs) {
    const std::int32_t at = pair.object;
    const PlacedPart object = placed(scene, part, at / state.slots(), at, state);
    const PlacedPart opposite = placed(scene, second, id.body, pair.other, state);
    const bool with_object = id.body >= 0;
    const double range = static_cast<double>(state.travel[at]) + kContactMargin +
                         (with_object ? static_cast<double>(state.travel[pair.other]) : 0.0);
    const double dt = scene.settings.dt * static_cast<double>(state.share[at]);
    const bool turned = !part.spheres;
    const PlacedPart& A = turned ? opposite : object;
    const SphereQuery query = query_of(A, turned ? object : opposite, range, dt);
    if (query.others) {
      meet_spheres(query, scratch);
    } else {
      meet_core(query, scratch);
    }
    const int count = choose_contacts(scratch.found, chosen);
    const Matrix3d R_PS = object.R_WBody.transpose() * A.R_WS;
    const Vector3d p_PS = object.R_WBody.transpose() * (A.p_WS - object.center);
    for (int k = 0; k < count; ++k) {
      const FoundContacts& found = scratch.found;
      const auto value = [&](int row) {
        return static_cast<double>(
            found.row(static_cast<FoundContacts::Row>(row))[chosen[static_cast<std::size_t>(k)]]);
      };
      const Vector3d position =
          p_PS + R_PS * Vector3d(value(FoundContacts::kX), value(FoundContacts::kY), value(FoundContacts::kZ));
      const Vector3d normal =
          (turned ? -1.0 : 1.0) * (R_PS * Vector3d(value(FoundContacts::kNormalX), value(FoundContacts::kNormalY),
                                                   value(FoundContacts::kNormalZ)));
      const std::array<Real, 3> p = reals(position), n = reals(normal);
      state.add(at, {{p[0], p[1], p[2]},
                     {n[0], n[1], n[2]},
                     static_cast<Real>(value(FoundContacts::kGap)),
                     other,
                     0,
                     0,
                     static_cast<Real>(value(FoundContacts::kTurning))});
    }
  }
}

}  // namespace prescene::simulation
