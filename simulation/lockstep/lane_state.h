// SPDX-License-Identifier: Apache-2.0
// What the stages of a lockstep step share: the scene's shapes as bare numbers, the states of the live instances by
// coordinate, and their contacts. Frame P has an object's principal axes and its origin in the centre of mass.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "prescene/simulation/rules/free_spin.h"

namespace prescene::simulation {

/// What states, impulses and contacts are computed in. Nearest points are found in double precision: contact normals
/// are differences of points that are a rounding radius apart.
using Real = float;

inline constexpr int kLaneMultiple = 16;  ///< Slots come in multiples of the widest vector.
inline constexpr int kMaxObjects = 16;
/// Contacts of an object in a step with those after it and what is not an object; with bodies of spheres kMaxContacts.
inline constexpr int kRoomForContacts = 32;
inline constexpr int kMaxContacts = 64;
inline constexpr int kMaxLoop = 16;  ///< Corners of a side of a hull.
/// Points that stand for the rim of a cylinder, the first one where it is lowest: at 0, 30, 90, 150, 180, ... degrees.
/// The two beside the lowest are as far from it as those of Bullet's stepper, since they take the energy out of a
/// wobble.
inline constexpr int kRimPoints = 8;
inline constexpr double kRimCosine[kRimPoints] = {1,  0.86602540378443865,  0, -0.86602540378443865,
                                                  -1, -0.86602540378443865, 0, 0.86602540378443865};
inline constexpr double kRimSine[kRimPoints] = {0, 0.5, 1, 0.5, 0, -0.5, -1, -0.5};

/// kSpheres is no core: the part collides as spheres (lane_spheres.h).
enum class CoreKind { kPoint, kSegment, kBox, kCylinder, kCone, kHull, kSpheres };

struct SphereLanes;

/// A convex core and the radius about it, as in Bullet's stepper: faces keep their true place, edges are rounded.
struct ConvexPart {
  CoreKind kind = CoreKind::kBox;
  double radius = 0.0;
  std::array<double, 3> half{};  ///< Box: half edges; segment: (-, -, z); cylinder: (rim radius, -, z); cone: (rim
                                 ///< radius, tip z, base z).
  /// Frame S of the shape: of objects in P's directions, of kinematic bodies in theirs, of supports in W. Hulls are
  /// already turned (identity).
  std::array<double, 9> R_PS{1, 0, 0, 0, 1, 0, 0, 0, 1};
  /// Middle of the bounding box: about it are core coordinates, boxes and balls. Of parts of objects from O in P's
  /// directions, of supports in W, of kinematic bodies in their frame.
  std::array<double, 3> center{};
  std::array<double, 3> box_half{};  ///< Of the whole part in the directions of `center`'s frame.
  double ball = 0.0;                 ///< Radius about the centre that holds the whole part.
  // Hulls: about the centre.
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<double, 3>> normals;
  std::vector<std::array<Real, 4>> planes;          ///< By face: normal and offset.
  std::array<std::vector<Real>, 4> plane_rows;      ///< The same by coordinate, up to a multiple of kLaneMultiple.
  std::vector<int> corner_counts;                   ///< By face.
  std::vector<std::array<double, 3>> face_corners;  ///< kMaxLoop by face, the last one repeated.
  int longest_loop = 0;
  std::shared_ptr<const SphereLanes> spheres;  ///< Of kSpheres.
  double hull_error = 0.0;                     ///< m, of hulls that are simplified to fit (RoundedPolytope::error).
};

struct FixedPart {
  ConvexPart shape;
  std::array<double, 3> full_half{};  ///< Of boxes.
};

/// An object, or a kinematic body with a shape: a robot body or a pusher.
struct LaneBody {
  std::vector<ConvexPart> parts;
  std::array<double, 3> unit_moments{1, 1, 1};  ///< m^2
  SpinRates spin_rates;                         ///< Of a step.
  Eigen::Vector3d uneven_axes = Eigen::Vector3d::Zero();
  double radius = 0.0;  ///< Farthest point from O.
  Real rolling_arm = 0;
  int number = 0;  ///< As belief::ContactInterval counts them.
};

/// A convex part of anything: what a contact is with.
struct PartId {
  int number = 0;                                           ///< Of its body, as belief::ContactInterval counts them.
  int body = -1;                                            ///< LaneBody, or -1: fixed.
  int part = 0;                                             ///< Of the body, or the FixedPart.
  Real friction = 0, impact_friction = 0, restitution = 0;  ///< Not of objects, which bring theirs.
  Real rolling_arm = 0;
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
  double gravity_size = 0.0;
  int iterations = 0;
  double accuracy = 0.0;
  double overlap_recovery = 0.0;
  double restitution_speed = 0.0;
  double impact_speed = 0.0;
};

struct LockstepScene {
  StepSettings settings;
  std::array<double, 3> origin{};  ///< Positions of lanes are from here, W.
  int objects = 0;
  std::vector<LaneBody> bodies;  ///< Objects first.
  std::vector<FixedPart> fixed;
  std::vector<FixedPlane> planes;  ///< Six a fixed part; of boxes only.
  std::vector<PartId> parts;       ///< The fixed ones, then those of each body.
  std::vector<int> first_part;     ///< In `parts`, by body.
  bool rolls = false;              ///< Something has a rolling arm.
  bool has_spheres = false;        ///< Something collides as spheres.

  const ConvexPart& part_of(const PartId& id) const {
    const auto index = static_cast<std::size_t>(id.part);
    return id.body < 0 ? fixed[index].shape : bodies[static_cast<std::size_t>(id.body)].parts[index];
  }
  int room() const { return has_spheres ? kMaxContacts : kRoomForContacts; }
  bool has_kinematic() const { return bodies.size() > static_cast<std::size_t>(objects); }
};

/// One contact of a step, and what is kept of it for the next.
struct LaneContact {
  Real position[3];  ///< Midway between the surfaces, from the centre of mass, P.
  Real normal[3];    ///< From the other part to the object, P.
  Real gap;
  std::int32_t part;  ///< The other one, of LockstepScene::parts.
  Real impulse;       ///< N s; of a scene with one object for each kilogram, m/s
  std::int32_t hit;   ///< 1: the gap closed in this step.
  /// m/s; by how much the turning of bodies of spheres slows the closing of the gap in the time that the contact was
  /// found for. `gap` has its share.
  Real turning;
};
struct WarmContact {
  Real position[3];  ///< In the other part's frame; of what is not an object from its origin in W's directions.
  Real impulse;
  Real friction[3];  ///< W
  Real upward;       ///< Of the normal; of several objects only.
  std::int32_t part;
};

template <std::size_t N>
using Rows = std::array<Real*, N>;

/// The live instances: a slot each, a row a coordinate. The rows of a body lie behind each other: what belongs to slot
/// s of body b is at b * slots() + s.
class LaneState {
 public:
  /// `slots` is rounded up to a multiple of kLaneMultiple.
  LaneState(int slots, const LockstepScene& scene);

  int slots() const { return slots_; }
  int room() const { return room_; }  ///< For contacts of an object.
  int at(int body, int slot) const { return body * slots_ + slot; }

  Rows<3> p, v, w;  ///< Centre of mass (from the local origin), its velocity, spin; W. Of kinematic bodies the origin.
  Rows<4> q;        ///< R_WP: w, x, y, z.
  Rows<3> com;      ///< From O to the centre of mass, in P's directions.
  Real *friction, *impact_friction, *restitution;
  Real* inverse_mass;  ///< 1/kg; 0 of what contacts do not move.
  /// Of what is borne: the velocities in the middle of the step before, from which the next step goes on, and by how
  /// much they are older than p (s). What is not has no lag. `owed`: for how long gravity has not acted in v yet (s).
  Rows<3> middle_v, middle_w;
  Real *lag, *owed;
  // Where free flight (or what moves a kinematic body) ends.
  Rows<3> flown_p, flown_v, flown_w;
  Rows<4> flown_q;
  Rows<9> R;  ///< R_WP at the start of the step.
  Real* travel;
  Real* share;  ///< Of objects: of a whole step that the step takes (LaneEngine::advance); 1 or less.
  Real *energy, *distance2, *speed2;  ///< After the step: per mass, from W's origin, the larger of both speeds.

  // Of objects: with the objects after it, then with all else.
  std::vector<int> contact_count, warm_count;
  std::vector<int> dropped_count;  ///< Contacts beyond room(), of this step.
  LaneContact* contacts(int at) { return contacts_.data() + static_cast<std::size_t>(at * room_); }
  WarmContact* warm(int at) { return warm_.data() + static_cast<std::size_t>(at * room_); }
  /// Appends a contact to an object's, or counts that there is no room.
  void add(int at, const LaneContact& contact) {
    int& count = contact_count[static_cast<std::size_t>(at)];
    if (count < room_)
      contacts(at)[count++] = contact;
    else
      ++dropped_count[static_cast<std::size_t>(at)];
  }

 private:
  struct Free {
    void operator()(Real* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  int slots_, room_;
  std::unique_ptr<Real[], Free> memory_;
  std::vector<LaneContact> contacts_;
  std::vector<WarmContact> warm_;
};

/// Contacts of the pairs of one vector. An object may have several of its lanes: it gets their contacts one lane after
/// the other, as it would from vectors of its own.
class ContactStage {
 public:
  void add(int lane, const LaneContact& contact) {
    int& count = counts_[static_cast<std::size_t>(lane)];
    if (count < kMaxContacts)
      contacts_[static_cast<std::size_t>(lane)][static_cast<std::size_t>(count++)] = contact;
    else
      ++dropped_[static_cast<std::size_t>(lane)];
  }
  /// Appends what was added to the contacts of the lanes' objects, as far as there is room; the rest is counted.
  void flush(const std::int32_t* objects, LaneState& state);

 private:
  std::array<int, kLaneMultiple> counts_{}, dropped_{};
  std::array<std::array<LaneContact, kMaxContacts>, kLaneMultiple> contacts_;
};

/// Pairs that may touch in this step, by what they need. Objects and bodies as places in the rows of LaneState.
struct LanePairs {
  struct Plane {
    std::int32_t object, plane;
  };
  struct Near {
    std::int32_t object, other;  ///< The other one is a fixed part's index, or a body's place.
  };
  std::vector<Plane> planes;              ///< The object is over the inner part of a face.
  std::vector<Near> boxes;                ///< About edges of fixed boxes.
  std::vector<std::vector<Near>> shapes;  ///< All others, by LockstepScene::parts.
};

/// A part of an object in the slots whose `wanted` is not 0.
struct PartQuery {
  int object, part;
  std::span<const std::uint8_t> wanted;
};

/// Free flight of an object in slots [0, wanted.size()) by their share of a step: where it ends, and how far a point of
/// it can get. Other slots of a vector fly with those with wanted[slot] != 0.
void fly(const LockstepScene& scene, int object, std::span<const std::uint8_t> wanted, LaneState& state);
/// Pairs with fixed parts.
void find_pairs(const LockstepScene& scene, const PartQuery& query, LaneState& state, LanePairs& pairs);
/// Pairs with parts of another body.
void find_body_pairs(const LockstepScene& scene, const PartQuery& query, int body, LaneState& state, LanePairs& pairs);
/// Appends the contacts of the pairs to their objects'.
void touch_planes(const LockstepScene& scene, const ConvexPart& part, std::span<const LanePairs::Plane> pairs,
                  LaneState& state);
void touch_boxes(const LockstepScene& scene, const ConvexPart& part, std::span<const LanePairs::Near> pairs,
                 LaneState& state);
/// All with the same part.
void touch_shape(const LockstepScene& scene, const ConvexPart& part, int other, std::span<const LanePairs::Near> pairs,
                 LaneState& state);

/// Scratch of `solve`: rows of the contacts of one vector, and what slots keep from one round of iterations to the
/// next.
class SolverScratch {
 public:
  SolverScratch(int slots, const LockstepScene& scene);
  Real* memory() { return memory_.get(); }
  /// The lanes' contacts of a row.
  LaneContact** contacts(int row) { return contacts_.data() + static_cast<std::size_t>(row) * kLaneMultiple; }
  Real* kept(int slot) { return kept_.data() + static_cast<std::size_t>(slot) * kept_each_; }
  std::vector<std::int32_t>& unsettled(int round) { return unsettled_[static_cast<std::size_t>(round)]; }
  static constexpr int kFields = 57;

 private:
  struct Free {
    void operator()(Real* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  std::size_t kept_each_;
  std::unique_ptr<Real[], Free> memory_;
  std::vector<LaneContact*> contacts_;
  std::vector<Real> kept_;
  std::array<std::vector<std::int32_t>, 2> unsettled_;
};
/// Steps all objects of the slots listed (all with contacts): impulses, then velocities and poses. Leaves impulses in
/// their contacts and their warm contacts for the next step. Slots next to each other should have about as many
/// contacts.
void solve(const LockstepScene& scene, std::span<const std::int32_t> slots, LaneState& state, SolverScratch& scratch);
/// Ends the step of the objects listed (places in rows) by free flight.
void land(std::span<const std::int32_t> objects, LaneState& state);
/// Energies, distances and speeds of an object in slots [0, count).
void measure(const LockstepScene& scene, int object, int count, LaneState& state);

}  // namespace prescene::simulation
