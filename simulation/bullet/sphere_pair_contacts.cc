// SPDX-License-Identifier: Apache-2.0
// SphereContactFinder: two bodies of spheres.
#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/collision/transform.h"
#include "sphere_contacts.h"
#include "sphere_patch.h"

namespace prescene::simulation {
namespace {

using collision::SpherePair;
using collision::SurfaceSpheres;

constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// A patch and what was found for it.
struct Candidate {
  PlacedPatch patch;
  double nearest = std::numeric_limits<double>::infinity();  // m^2, to the other's point
  std::uint32_t nearest_pair = kNone;
  std::uint32_t contact = kNone;  // with the least gap
};

struct PairContact {
  ContactPoint point;
  std::uint32_t a = 0;  // candidates
  std::uint32_t b = 0;
};

}  // namespace

/// The patches of two bodies that are near each other, all in A's frame, each placed once however many pairs it is in.
struct SphereContactFinder::Pairs {
  std::vector<SpherePair> spheres;
  std::vector<std::uint32_t> where_a, where_b;  // among the candidates, by sphere
  std::vector<Candidate> a, b;
  std::vector<SpherePair> edges;  // of candidates: both are edges
  std::vector<PairContact> contacts;

  // Of a query.
  const MovingFrame* moving_a = nullptr;
  const MovingFrame* moving_b = nullptr;
  Vector3d spin, velocity;  // of A against B in A's frame: a place p of A moves by velocity + spin x p
  double range = 0.0, dt = 0.0, travel = 0.0;

  static std::uint32_t candidate(std::uint32_t sphere, const SurfaceSpheres& of, const Frame& X,
                                 std::vector<std::uint32_t>& where, std::vector<Candidate>& all) {
    if (where[sphere] == kNone) {
      where[sphere] = static_cast<std::uint32_t>(all.size());
      all.push_back({PlacedPatch(of.patches[sphere], X)});
    }
    return where[sphere];
  }

  /// Where the lowest point of a sphere will be when it gets to the patch, if only the part of its way along the patch
  /// counts. `sign` is 1 where the sphere is A's, else -1.
  Vector3d shift_of(const Vector3d& p, const PlacedPatch& patch, double up, double sign) const {
    if (up <= 0.0) return Vector3d::Zero();
    const Vector3d moves = sign * (velocity + spin.cross(p));
    const double closing = -patch.normal.dot(moves);
    if (closing <= 0.0) return Vector3d::Zero();
    return std::min(dt, up / closing) * (moves + closing * patch.normal);
  }

  /// How far (m^2) the sphere's lowest point is from the patch's point; nothing where it is not over the patch.
  std::optional<double> far_from(const PlacedPatch& sphere, const PlacedPatch& patch, double sign) const {
    if ((sphere.centre - patch.centre).dot(patch.normal) <= 0.0) return std::nullopt;
    Vector3d p = sphere.lowest(patch.normal);
    Vector3d to = p - patch.point;
    const double up = patch.normal.dot(to);
    if (up > range + patch.reach) return std::nullopt;
    const double room = patch.reach + travel;
    if (to.squaredNorm() - up * up > room * room) return std::nullopt;
    if (travel > 0.1 * patch.reach) to += shift_of(p, patch, up, sign);
    const double away = to.squaredNorm();
    if (away - up * up > patch.reach * patch.reach) return std::nullopt;
    if (patch.ends_before(patch.X->R.transpose() * to, std::max(0.0, -up))) return std::nullopt;
    return away;
  }

  void note(SpherePair pair, double away, std::uint32_t index) {
    for (Candidate* c : {&a[pair.a], &b[pair.b]}) {
      if (away >= c->nearest) continue;
      c->nearest = away;
      c->nearest_pair = index;
    }
  }

  std::optional<ContactPoint> contact(const PlacedPatch& sphere, const PlacedPatch& patch, double sign) const {
    Vector3d p = sphere.lowest(patch.normal);
    const Vector3d shift = shift_of(p, patch, patch.normal.dot(p - patch.point), sign);
    auto height = patch.height_of(p + shift);
    if (!height) return std::nullopt;
    p = sphere.lowest(height->normal);
    if (!sphere.stands_for(p)) return std::nullopt;
    height = patch.height_of(p + shift);
    if (!height || height->gap > range) return std::nullopt;
    ContactPoint contact{p - 0.5 * height->gap * height->normal, sign * height->normal, height->gap};
    const BodyMotion& motion = (sign > 0.0 ? moving_a : moving_b)->motion;
    const Frame& X_WA = moving_a->X;
    turn(contact, (X_WA.R * height->normal).dot(motion.towards_center(X_WA * sphere.centre)), dt);
    return contact;
  }

  void offer(const ContactPoint& point, std::uint32_t index_a, std::uint32_t index_b) {
    if (point.gap > range) return;
    const auto index = static_cast<std::uint32_t>(contacts.size());
    contacts.push_back({point, index_a, index_b});
    for (Candidate* c : {&a[index_a], &b[index_b]})
      if (c->contact == kNone || point.gap < contacts[c->contact].point.gap - kSameSphereGap) c->contact = index;
  }
};

SphereContactFinder::SphereContactFinder() : pairs_(std::make_unique<Pairs>()) {}
SphereContactFinder::~SphereContactFinder() = default;

void SphereContactFinder::spheres_spheres(const SurfaceSpheres& a, const MovingFrame& A, const SurfaceSpheres& b,
                                          const MovingFrame& B, double range, double dt,
                                          std::vector<ContactPoint>& contacts) {
  found_.clear();
  Pairs& pairs = *pairs_;
  pairs.spheres.clear();
  const Frame X_AB(A.X.R.transpose() * B.X.R, A.X.inverse_times(B.X.p));
  const double within = range + static_cast<double>(a.longest_reach) + static_cast<double>(b.longest_reach);
  collision::near_pairs(*a.tree, *b.tree, collision::rounded_transform(X_AB.R, X_AB.p), within, &pairs.spheres,
                        scratch_);
  if (pairs.spheres.empty()) return;
  const Frame identity;
  pairs.where_a.assign(a.patches.size(), kNone);
  pairs.where_b.assign(b.patches.size(), kNone);
  pairs.a.clear();
  pairs.b.clear();
  pairs.edges.clear();
  pairs.contacts.clear();
  pairs.moving_a = &A;
  pairs.moving_b = &B;
  pairs.range = range;
  pairs.dt = dt;
  pairs.spin = A.X.R.transpose() * (A.motion.spin - B.motion.spin);
  pairs.velocity = A.X.R.transpose() * (A.motion.at(A.X.p) - B.motion.at(A.X.p));
  pairs.travel = dt * (pairs.velocity.norm() +
                       pairs.spin.norm() * static_cast<double>(a.tree->root().centre.norm() + a.tree->root().radius));
  // Of two faces, the spheres of the body that has more of them to the area are enough.
  const bool a_is_finer = a.spacing <= b.spacing;
  const auto is_spheres_of_a = [&](const PlacedPatch& of_a, const PlacedPatch& of_b) {
    return of_a.is_edge() || (a_is_finer && !of_b.is_edge());
  };
  // Many patches reach under a sphere: the one whose point is nearest knows best.
  for (const SpherePair& spheres : pairs.spheres) {
    const SpherePair pair{Pairs::candidate(spheres.a, a, identity, pairs.where_a, pairs.a),
                          Pairs::candidate(spheres.b, b, X_AB, pairs.where_b, pairs.b)};
    const PlacedPatch& of_a = pairs.a[pair.a].patch;
    const PlacedPatch& of_b = pairs.b[pair.b].patch;
    if (of_a.is_edge() && of_b.is_edge()) {
      pairs.edges.push_back(pair);
      continue;
    }
    if (!of_a.is_edge() && !of_b.is_edge() && of_a.normal.dot(of_b.normal) > kSameSide) continue;
    const std::optional<double> away =
        is_spheres_of_a(of_a, of_b) ? pairs.far_from(of_a, of_b, 1.0) : pairs.far_from(of_b, of_a, -1.0);
    if (away) pairs.note(pair, *away, static_cast<std::uint32_t>(&spheres - pairs.spheres.data()));
  }
  const auto look_at = [&](std::uint32_t index) {
    const SpherePair pair{pairs.where_a[pairs.spheres[index].a], pairs.where_b[pairs.spheres[index].b]};
    const PlacedPatch& of_a = pairs.a[pair.a].patch;
    const PlacedPatch& of_b = pairs.b[pair.b].patch;
    const std::optional<ContactPoint> contact =
        is_spheres_of_a(of_a, of_b) ? pairs.contact(of_a, of_b, 1.0) : pairs.contact(of_b, of_a, -1.0);
    if (contact) pairs.offer(*contact, pair.a, pair.b);
  };
  for (const Candidate& c : pairs.a)
    if (c.nearest_pair != kNone) look_at(c.nearest_pair);
  for (const Candidate& c : pairs.b) {
    if (c.nearest_pair == kNone) continue;
    const std::uint32_t of_a = pairs.where_a[pairs.spheres[c.nearest_pair].a];
    if (pairs.a[of_a].nearest_pair != c.nearest_pair) look_at(c.nearest_pair);
  }
  for (const SpherePair& pair : pairs.edges) {
    const PlacedPatch& of_a = pairs.a[pair.a].patch;
    const PlacedPatch& of_b = pairs.b[pair.b].patch;
    const Vector3d between = of_a.centre - of_b.centre;
    const double distance = between.norm();
    if (!(distance > 0.0)) continue;
    const Vector3d normal = between / distance;
    const double gap = distance - of_a.radius - of_b.radius;
    pairs.offer({of_a.lowest(normal) - 0.5 * gap * normal, normal, gap}, pair.a, pair.b);
  }
  for (std::uint32_t i = 0; i < pairs.contacts.size(); ++i) {
    const PairContact& found = pairs.contacts[i];
    if (pairs.a[found.a].contact != i && pairs.b[found.b].contact != i) continue;
    ContactPoint contact = found.point;
    contact.position = A.X * contact.position;
    contact.normal = A.X.R * contact.normal;
    add(contact, A, B, dt);
  }
  reduce(A.X, contacts);
}

}  // namespace prescene::simulation
