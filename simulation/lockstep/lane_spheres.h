// SPDX-License-Identifier: Apache-2.0
// Contacts of bodies of spheres in vectors: Bullet's stepper finds the same ones sphere by sphere
// (simulation/bullet/sphere_contacts.h). The lanes are spheres of one instance, the children of a node of its inner
// sphere tree [Weller and Zachmann 2011], since instances are near other parts of their trees. All is in the frame S of
// the body of spheres, from the middle of its part, where single precision has digits enough.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lane_state.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/simulation/rules/sphere_rules.h"

namespace prescene::simulation {

inline constexpr int kNodeWidth = 16;  ///< Children of a node of a tree of spheres.

/// A tree of spheres by rows of 16: what stands for a mesh in lanes.
struct SphereLanes {
  using Row = std::array<Real, kNodeWidth>;
  /// Children of a node: their spheres, larger by how far the patches below them reach beyond them. Unused ones are far
  /// away.
  struct alignas(64) Node {
    Row x, y, z, radius;
    std::int32_t count = 0;
    std::int32_t first = 0;  ///< Of the nodes below, or the PatchRows of its spheres if `bottom`.
    bool bottom = false;
  };
  /// What 16 spheres know of the surface (collision::SurfacePatch). Unused ones are never looked at.
  struct alignas(64) PatchRows {
    std::array<Row, 3> centre, point, normal, tangent, bitangent, bend;
    Row radius, reach;
    std::array<std::array<Row, 3>, 2> out;  ///< Limits; 0, and distances of 1e30, where there is none.
    std::array<Row, 2> distance;
    bool bent = false, limited = false;  ///< Some of them.
    std::array<Real, 3> middle{};        ///< A ball that holds their centres.
    Real ball = 0;
  };

  std::vector<Node> nodes;  ///< The root first.
  std::vector<PatchRows> patches;
  std::array<double, 3> middle{};  ///< In the mesh's frame: S begins there.
  double reach = 0.0;              ///< m: how far a patch reaches beyond its sphere at most.
  double ball = 0.0;               ///< m: about the middle, holds all patches.
  double spacing = 0.0;            ///< m, of the spheres on faces.
  int count = 0;
};
/// `middle`: where S has its origin, in the mesh's frame.
std::shared_ptr<const SphereLanes> lanes_of(const collision::SurfaceSpheres& spheres,
                                            const std::array<double, 3>& middle);

/// A body of spheres, A, at another part, B.
struct SphereQuery {
  const SphereLanes* spheres;
  std::array<Real, 9> R_BS;
  std::array<Real, 3> p_BS;  ///< A's middle from B's.
  // A place p of A moves against B by velocity + spin x p, S.
  std::array<Real, 3> velocity, spin;
  std::array<Real, 3> own_spin, center;  ///< A's spin, and its centre of mass; S.
  Real range, dt;
  // B:
  const ConvexPart* core;
  std::array<Real, 3> low, high;                 ///< Box of the core, in its frame from A's middle.
  const SphereLanes* others;                     ///< Not null: B is of spheres, too.
  std::array<Real, 3> other_spin, other_center;  ///< As A's.
};

/// Contacts in S, a row a coordinate: what was found, and what was chosen of it.
class FoundContacts {
 public:
  enum Row : int { kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kGap, kTurning, kAtEnd, kSpread, kScore, kU, kV, kRows };

  void clear() { size_ = 0; }
  int size() const { return size_; }
  /// Room for `more` and a vector's width beyond.
  void reserve(int more);
  void grow(int by) { size_ += by; }
  Real* row(Row r) { return memory_.get() + static_cast<std::size_t>(r) * capacity_; }
  const Real* row(Row r) const { return memory_.get() + static_cast<std::size_t>(r) * capacity_; }

 private:
  struct Free {
    void operator()(Real* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  std::unique_ptr<Real[], Free> memory_;
  std::size_t capacity_ = 0;
  int size_ = 0;
};

using ChosenContacts = std::array<std::int32_t, kMostSphereContacts>;

/// What two bodies of spheres are to each other, in A. A sphere, or its patch, is 16 times its PatchRows plus its lane.
struct SpherePairs {
  struct Two {
    std::int32_t a = 0, b = 0;
  };
  /// By lane: how far (m^2) the nearest of the other body is, and which it is (-1: none).
  struct alignas(64) Best {
    SphereLanes::Row away, partner;
    bool touched = false;
  };

  /// A node of each, and B's bounding sphere in A.
  struct Nodes {
    std::int32_t a, b;
    Real x, y, z, radius;
  };
  /// The spheres of two nodes.
  struct Leaves {
    std::int32_t rows_a = 0, rows_b = 0;
    const SphereLanes::PatchRows *patches_a = nullptr, *patches_b = nullptr;
    Best *best_a = nullptr, *best_b = nullptr;
  };

  std::vector<Nodes> stack;
  std::vector<SphereLanes::PatchRows> placed;  ///< B's in A, where `is_placed`.
  std::vector<std::uint8_t> is_placed;
  std::vector<Best> best_a, best_b;  ///< By PatchRows.
  std::vector<std::int32_t> touched_a, touched_b;
  std::vector<Two> edges;     ///< Both are.
  std::vector<Two> contacts;  ///< Of those found.

  void begin(const SphereLanes& a, const SphereLanes& b);
  Best& best_of(std::vector<Best>& all, std::int32_t rows) {
    Best& best = all[static_cast<std::size_t>(rows)];
    if (!best.touched) {
      best.touched = true;
      best.away.fill(Real(1e30));
      best.partner.fill(Real(-1));
      (&all == &best_a ? touched_a : touched_b).push_back(rows);
    }
    return best;
  }
};

/// Scratch memory of one thread.
struct SphereScratch {
  FoundContacts found;
  SpherePairs pairs;
  std::vector<std::int32_t> stack;
  std::vector<std::int32_t> faces;  ///< Of a hull: those that matter to the spheres of a node.
  std::vector<Real> heights;        ///< Of a node over all of them.
};

/// The contacts of spheres with a convex core, into `scratch.found`.
void meet_core(const SphereQuery& query, SphereScratch& scratch);
/// The same with another body of spheres.
void meet_spheres(const SphereQuery& query, SphereScratch& scratch);
/// Which of the contacts found are kept; returns how many.
int choose_contacts(FoundContacts& found, ChosenContacts& chosen);

/// Appends the contacts of an object's part with another part, of which one or both are of spheres, to their objects'.
void touch_spheres(const LockstepScene& scene, const ConvexPart& part, int other,
                   std::span<const LanePairs::Near> pairs, LaneState& state, SphereScratch& scratch);

}  // namespace prescene::simulation
