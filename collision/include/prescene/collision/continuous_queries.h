// SPDX-License-Identifier: Apache-2.0
// When a moving body touches another first. B moves in A's frame; where both move, their relative motion counts.
//
//   PRESCENE_TRY(const ScrewMotion screw, ScrewMotion::make(X_AB_start, X_AB_end));
//   const FirstContact contact = first_contact(cup, table, screw, {}, scratch);
//   if (contact.outcome == MotionOutcome::kContact) ... contact.time, contact.p_A, contact.normal
//
// No contact is missed, however thin the bodies and fast the motion. Conservative advancement [Mirtich 2000],
// [Zhang et al. 2006], not of the bodies but of each pair of their parts by itself: every pair of nodes or triangles
// has a time before which it cannot touch, from the gaps between the two along some axes, how fast one moves along
// these, and how much that can change. The pair with the earliest time is taken up there and then: nodes are split,
// triangles advance.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/rigid_motion.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

struct FirstContactOptions {
  /// How far the bodies may still be apart at the time reported, m, so that the search ends. It is no safety margin:
  /// bodies that pass each other closer than this are not reported. Not positive, or not a number: a ten-thousandth of
  /// the smaller body's size. What single precision does to coordinates is the least that is possible, and is taken
  /// where less is asked for: about 4e-6 of the two radii, the distance of B's origin and its way, all added up.
  double tolerance = 0.0;
  /// Pairs of nodes or triangles that are looked at before giving up: a bound for the time that a query takes.
  std::uint64_t step_limit = 10'000'000;
};

enum class MotionOutcome {
  kContact,    ///< The bodies touch at `time`, within the tolerance, and not before.
  kNoContact,  ///< They don't touch in [0, 1].
  kStepLimit,  ///< They don't touch before `time`; what comes then is not known.
};

struct FirstContact {
  MotionOutcome outcome = MotionOutcome::kNoContact;
  /// In [0, 1]. `collide` is false at all times before (for poses rounded as to_transform does). 0 where the bodies
  /// touch at the start, 1 without contact.
  double time = 1.0;
  // At a contact:
  double distance = 0.0;  ///< Of the bodies at `time`: 0 to the tolerance or the least possible, m.
  Eigen::Vector3d p_A = Eigen::Vector3d::Zero();     ///< The point of A, m.
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();     ///< The point of B, in A, m.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< From A to B, unit length; zero where the triangles intersect.
  TrianglePair triangles;
  std::uint64_t steps = 0;  ///< Pairs that were looked at.
};

/// Does not allocate once the scratch has grown. Its times agree within the tolerance, not in their last bits, between
/// instruction sets.
FirstContact first_contact(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion,
                           const FirstContactOptions& options, QueryScratch& scratch, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
