// SPDX-License-Identifier: Apache-2.0
// Queries on two inner sphere trees whose poses are Gaussian: do the bodies touch, how probable is it, and what force
// do they exert on each other.
//
//   PRESCENE_TRY(const RelativeUncertainty between, RelativeUncertainty::make({X_WA, C_A}, {X_WB, C_B}));
//   UncertainScratch scratch;
//   if (overlap_state(cup, table, between, scratch) == OverlapState::kNone) ...       // surely apart
//   const UncertainOverlap overlap = uncertain_overlap(cup, table, between, scratch);
//   const UncertainWrench wrench = uncertain_wrench(cup, table, between, {.stiffness = 1e4}, scratch);
//
// A sphere with an uncertain centre has a smallest and a largest radius: what it covers wherever its centre is, within
// a region of confidence, and all that it may reach. "No overlap" is said of all pairs at once: since they move with
// one error (see RelativeUncertainty), the chance that its region is left counts once and not for each pair.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

enum class OverlapState {
  kNone,      ///< No pair of spheres touches, with at least the confidence asked for.
  kPossible,  ///< In between.
  kCertain,   ///< One pair is sure to touch, with at least that confidence.
};

struct UncertainOverlap {
  OverlapState state = OverlapState::kNone;
  double probability = 0.0;  ///< Best estimate that some pair of spheres touches; within the bounds.
  /// Two standard errors of the estimate's sampling, half the bounds' gap when certain; not what an estimate of first
  /// order misses, up to 0.01 where those are taken.
  double probability_error = 0.0;
  double lower = 0.0;  ///< Bounds that hold without exception, also for rotations that are not small.
  double upper = 1.0;
  std::uint32_t critical_pairs = 0;  ///< Pairs that estimate and bounds rest on.
  /// Whether these are all pairs that touch for some error in the region. Otherwise they are those that the shortest
  /// errors bring together.
  bool complete = true;
};

/// Force on A and torque about a point P fixed to A, both in A's frame, N and N m: moments over the error of the poses.
struct UncertainWrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< Mean.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();  ///< Of (force, torque).
  double expected_pairs = 0.0;                                 ///< Mean number of pairs that touch.
};

/// Memory that uncertain queries work in. One a thread; after the first query on a pair of trees nothing is allocated.
class UncertainScratch {
 public:
  UncertainScratch();
  ~UncertainScratch();
  UncertainScratch(UncertainScratch&&) noexcept;
  UncertainScratch& operator=(UncertainScratch&&) noexcept;

  struct Memory;
  Memory& memory() { return *memory_; }

 private:
  std::unique_ptr<Memory> memory_;
};

/// Whether the bodies touch, without the probability: for the many pairs of bodies that are surely apart, and those
/// that surely touch. Ends with the first pair of spheres that is certain.
OverlapState overlap_state(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                           UncertainScratch& scratch);

/// The same and how probable it is. Where more pairs touch at the mean than are kept it may say kPossible of what
/// overlap_state() finds certain. The descent keeps the 64 pairs of spheres that the shortest errors bring together, by
/// the distance along the line of centres in standard deviations, and leaves out what has more of them; it ends at the
/// first pair that touches for certain. Lower bound: the most probable pair. Upper bound, the least of: no error
/// shorter than the critical one makes the bodies touch; the sum over all pairs; a plane between the bodies is crossed
/// at one of four points [Worsley 1982]. Estimate: 32 lines through the space of errors, along each of which it is
/// exact for the pairs kept (line sampling [Koutsourelakis et al. 2004]); where pairs were left out or bodies turn by
/// more than some 0.04 rad, 256 poses drawn (a net), each asked overlap().
UncertainOverlap uncertain_overlap(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                   UncertainScratch& scratch);

/// Mean and covariance of penalty_wrench(): each pair that touches pushes with the stiffness times half its depth along
/// the line of centres [Weller and Zachmann 2011]. Moments to second order in the error, with the kink where contact
/// begins taken in full; pairs are correlated through the error that they share. Good while the error is small against
/// the distances of centres (a tenth).
UncertainWrench uncertain_wrench(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                 const PenaltyOptions& options, UncertainScratch& scratch);

}  // namespace prescene::collision
