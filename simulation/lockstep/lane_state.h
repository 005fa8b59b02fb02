// SPDX-License-Identifier: Apache-2.0
// What the stages of a lockstep step share: the scene's shapes as bare numbers, the states of the live instances by
// coordinate, and their contacts. Frame P has the object's principal axes and its origin in the centre of mass.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <vector>

namespace prescene::simulation {

/// What states, impulses and contacts are computed in. Nearest points are found in double precision: contact normals
/// are differences of points that are a rounding radius apart.
using Real = float;

inline constexpr int kLaneMultiple = 16;  ///< Slots come in multiples of the widest vector.
inline constexpr int kMaxContacts = 32;   ///< Of an instance in a step.
inline constexpr int kMaxLoop = 16;       ///< Corners of a side of a hull.
/// Points that stand for the rim of a cylinder, the first one where it is lowest: at 0, 30, 90, 150, 180, ... degrees.
/// The two beside the lowest are as far from it as those of Bullet's stepper, since they take the energy out of a
/// wobble.
inline constexpr int kRimPoints = 8;
inline constexpr double kRimCosine[kRimPoints] = {1,  0.86602540378443865,  0, -0.86602540378443865,
                                                  -1, -0.86602540378443865, 0, 0.86602540378443865};
inline constexpr double kRimSine[kRimPoints] = {0, 0.5, 1, 0.5, 0, -0.5, -1, -0.5};

enum class CoreKind { kPoint, kSegment, kBox, kCylinder, kHull };

/// A convex core and the radius about it, as in Bullet's stepper: faces keep their true place, edges are rounded.
struct ConvexPart {
  CoreKind kind = CoreKind::kBox;
  double radius = 0.0;
  std::array<double, 3> half{};  ///< Box: half edges; segment: (-, -, z); cylinder: (rim radius, -, z).
  /// Of parts of the object: frame S of the shape in P's directions. Hulls are already turned (identity).
  std::array<double, 9> R_PS{1, 0, 0, 0, 1, 0, 0, 0, 1};
  /// Middle of the bounding box: about it are core coordinates, boxes and balls. Of parts of the object from O in P's
  /// directions, of supports in W.
  std::array<double, 3> center{};
  std::array<double, 3> box_half{};  ///< Of the whole part in the directions of `center`'s frame.
  double ball = 0.0;                 ///< Radius about the centre that holds the whole part.
  // Hulls: about the centre.
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<double, 3>> normals;
  std::vector<int> corner_counts;                   ///< By face.
  std::vector<std::array<double, 3>> face_corners;  ///< kMaxLoop by face, the last one repeated.
  int longest_loop = 0;
};

struct FixedPart {
  ConvexPart shape;              ///< kBox or kHull.
  std::array<double, 9> R_WB{};  ///< Of boxes; hulls are already turned.
  std::array<double, 3> full_half{};
  int body = 0;  ///< As belief::ContactInterval counts them.
  Real friction = 0, impact_friction = 0, restitution = 0, rolling_arm = 0;
};

/// A face of a box as a half-space: inside is normal.p <= offset, in W from the local origin.
struct FixedPlane {
  std::array<Real, 3> normal;
  Real offset;
  int part;
};

struct StepSettings {
  double dt = 0.0;
  std::array<double, 3> gravity{};
  int iterations = 0;
  double accuracy = 0.0;
  double overlap_recovery = 0.0;
  double restitution_speed = 0.0;
  double impact_speed = 0.0;
};

struct LockstepScene {
  StepSettings settings;
  std::array<double, 3> origin{};  ///< Positions of lanes are from here, W.
  std::vector<ConvexPart> parts;   ///< Of the object.
  std::vector<FixedPart> fixed;
  std::vector<FixedPlane> planes;               ///< Six a fixed part; of boxes only.
  std::array<double, 3> unit_moments{1, 1, 1};  ///< m^2
  double radius = 0.0;                          ///< Farthest point of the object from O.
  double rolling_arm = 0.0;                     ///< Of the object.
  bool rolls = false;                           ///< Some pair has a rolling arm.
};

/// One contact of a step, and what is kept of it for the next.
struct LaneContact {
  Real position[3];  ///< Midway between the surfaces, from the centre of mass, P.
  Real normal[3];    ///< From the fixed part to the object, P.
  Real gap;
  std::int32_t part;  ///< Fixed.
  Real impulse;       ///< m/s: N s for each kilogram
  std::int32_t hit;   ///< 1: the gap closed in this step.
};
struct WarmContact {
  Real position[3];  ///< From the local origin, W.
  Real impulse;
  Real friction[3];  ///< W
  std::int32_t part;
};

template <std::size_t N>
using Rows = std::array<Real*, N>;

/// The live instances: a slot each, a row a coordinate.
class LaneState {
 public:
  /// `slots` is rounded up to a multiple of kLaneMultiple.
  explicit LaneState(int slots);

  int slots() const { return slots_; }

  Rows<3> p, v, w;  ///< Centre of mass (from the local origin), its velocity, spin; W.
  Rows<4> q;        ///< R_WP: w, x, y, z.
  Rows<3> com;      ///< From O to the centre of mass, in P's directions.
  Real *friction, *impact_friction, *restitution;
  // Where free flight ends.
  Rows<3> flown_p, flown_v, flown_w;
  Rows<4> flown_q;
  Rows<9> R;  ///< R_WP at the start of the step.
  Real* travel;
  Real *energy, *distance2, *speed2;  ///< After the step: per mass, from W's origin, the larger of both speeds.

  // By slot.
  std::vector<int> contact_count, warm_count;
  LaneContact* contacts(int slot) { return contacts_.data() + static_cast<std::size_t>(slot) * kMaxContacts; }
  WarmContact* warm(int slot) { return warm_.data() + static_cast<std::size_t>(slot) * kMaxContacts; }

 private:
  struct Free {
    void operator()(Real* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  int slots_;
  std::unique_ptr<Real[], Free> memory_;
  std::vector<LaneContact> contacts_;
  std::vector<WarmContact> warm_;
};

/// Contacts of the pairs of one vector. A slot may have several of its lanes: it gets their contacts one lane after the
/// other, as it would from vectors of its own.
class ContactStage {
 public:
  void add(int lane, const LaneContact& contact) {
    int& count = counts_[static_cast<std::size_t>(lane)];
    if (count < kMaxContacts) contacts_[static_cast<std::size_t>(lane)][static_cast<std::size_t>(count++)] = contact;
  }
  /// Appends what was added to the contacts of the lanes' slots, as far as there is room.
  void flush(const std::int32_t* slots, LaneState& state);

 private:
  std::array<int, kLaneMultiple> counts_{};
  std::array<std::array<LaneContact, kMaxContacts>, kLaneMultiple> contacts_;
};

/// Pairs that may touch in this step, by what they need.
struct LanePairs {
  struct Plane {
    std::int32_t slot, plane;
  };
  struct Near {
    std::int32_t slot, fixed;
  };
  std::vector<Plane> planes;             ///< The object is over the inner part of a face.
  std::vector<Near> boxes;               ///< About edges of boxes.
  std::vector<std::vector<Near>> hulls;  ///< By fixed part.
};

/// m: contacts are made this much before they are needed, so that resting bodies keep theirs when they breathe.
inline constexpr double kLaneMargin = 5e-4;

/// Free flight of slots [0, count): where it ends, and how far a point of the object can get. `count` is rounded up to
/// whole vectors.
void fly(const LockstepScene& scene, int count, LaneState& state);
/// Pairs of part `part` of the object, of the slots whose `wanted` is not 0.
void find_pairs(const LockstepScene& scene, int part, std::span<const std::uint8_t> wanted, LaneState& state,
                LanePairs& pairs);
/// Appends the contacts of the pairs to their slots'.
void touch_planes(const LockstepScene& scene, int part, std::span<const LanePairs::Plane> pairs, LaneState& state);
void touch_boxes(const LockstepScene& scene, int part, std::span<const LanePairs::Near> pairs, LaneState& state);
void touch_hull(const LockstepScene& scene, int part, std::span<const LanePairs::Near> pairs, LaneState& state);

/// Scratch of `solve`: rows of the contacts of one vector, and what slots keep from one round of iterations to the
/// next.
class SolverScratch {
 public:
  explicit SolverScratch(int slots);
  Real* memory() { return memory_.get(); }
  Real* kept(int slot) { return kept_.data() + static_cast<std::size_t>(slot) * kKept; }
  std::vector<std::int32_t>& unsettled(int round) { return unsettled_[static_cast<std::size_t>(round)]; }
  static constexpr int kFields = 42;

 private:
  struct Free {
    void operator()(Real* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  static constexpr std::size_t kKept = 6 + 6 * kMaxContacts;
  std::unique_ptr<Real[], Free> memory_;
  std::vector<Real> kept_;
  std::array<std::vector<std::int32_t>, 2> unsettled_;
};
/// Steps the slots listed (all with contacts): impulses, then velocities and poses. Leaves impulses in their contacts
/// and their warm contacts for the next step. Slots next to each other should have about as many contacts.
void solve(const LockstepScene& scene, std::span<const std::int32_t> slots, LaneState& state, SolverScratch& scratch);
/// Ends the step of the slots listed by free flight.
void land(std::span<const std::int32_t> slots, LaneState& state);
/// Energies, distances and speeds of slots [0, count).
void measure(const LockstepScene& scene, int count, LaneState& state);

}  // namespace prescene::simulation
