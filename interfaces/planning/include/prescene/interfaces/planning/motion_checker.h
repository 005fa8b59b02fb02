// SPDX-License-Identifier: Apache-2.0
// Whether a configuration of what a planner moves, or a whole motion between two, is free of collisions. For OMPL, see
// ompl.h.
//
//   PRESCENE_TRY(auto obstacles, scene_obstacles(scene, {"cup"}, pool));
//   PRESCENE_TRY(const auto checker, MotionChecker::make(mover, std::move(obstacles), {.margin = 0.005}));
//   PlanningScratch scratch;                                                 // one a thread, kept
//   if (checker->is_free(q0, scratch) && checker->check(q0, q1, scratch).outcome == MotionCheck::kFree) ...
//
// Motions are not sampled: nothing is too thin, and no motion too fast, to be met. The answer "free" holds for all
// poses of the motion. Where a single body moves without margin among triangles, collision::first_contact decides.
// Otherwise [Schwarzer et al. 2005]: between two configurations at which two bodies are d and e apart, they don't come
// within the margin if none of their points travels further than d + e less twice the margin; else the motion is cut in
// the middle.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/interfaces/planning/mover.h"
#include "prescene/interfaces/planning/planning_shape.h"

namespace prescene::interfaces {

struct Obstacle {
  std::string name;
  PlanningShape shape;
  geometry::Pose X_WO;
};

struct MotionCheckOptions {
  /// How near things may come to each other, m: at this distance they collide. In [0, 1].
  double margin = 0.0;
  /// Motions that pass within the margin and half of this, m, may be called blocked. In [1e-6, 1].
  double tolerance = 1e-3;
  /// Pieces into which a motion is cut, at most; more are answered with kStepLimit. At least 1.
  std::uint64_t step_limit = 20'000;
};

struct MotionCheck {
  enum Outcome {
    kFree,       ///< No pose of the motion collides.
    kBlocked,    ///< One does, or comes within the tolerance of it.
    kStepLimit,  ///< Not known: to be taken as blocked.
  };
  Outcome outcome = kFree;
  /// The motion is free before this time, in [0, 1]; how much is known of that depends on how it was asked for.
  double free_until = 1.0;
  std::uint64_t steps = 0;  ///< Configurations that were looked at, or pairs whose first contact was.
};

/// Memory of checks. One a thread.
class PlanningScratch {
 public:
  ShapeScratch shapes;

 private:
  friend class MotionChecker;
  struct Bound {
    std::uint32_t pair;
    double at_begin, at_end;  // m
  };
  struct Piece {
    double begin, end;
    std::size_t first, count;  // Of the bounds.
  };
  std::vector<geometry::Pose> poses_, work_;
  std::vector<double> configuration_, ways_;
  std::vector<Bound> bounds_, left_, right_;
  std::vector<Piece> pieces_;
};

class MotionChecker {
 public:
  /// Fails with kInvalidInput when there is no mover, a pose of an obstacle is not finite, or an option is out of
  /// range. Own shapes of the mover that are within the margin at `home` are never compared (empty: all are).
  static core::Result<std::shared_ptr<const MotionChecker>> make(std::shared_ptr<const Mover> mover,
                                                                 std::vector<Obstacle> obstacles,
                                                                 const MotionCheckOptions& options,
                                                                 std::span<const double> home = {});

  /// False for numbers that are no configuration (Mover::is_configuration).
  bool is_free(std::span<const double> q, PlanningScratch& scratch) const;
  /// How far the nearest two are apart, less the margin, m: a lower bound, as shape_gap. Zero where is_free is false.
  double clearance(std::span<const double> q, PlanningScratch& scratch) const;

  enum class Order {
    kAny,       ///< Ends as soon as a collision is found; free_until may be 0.
    kEarliest,  ///< From the start on: free_until is where the first collision, or what is within the tolerance, is.
  };
  /// q0 is free: that it is inside of a solid is not noticed.
  MotionCheck check(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch,
                    Order order = Order::kAny) const;

  const Mover& mover() const { return *mover_; }
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }
  const MotionCheckOptions& options() const { return options_; }
  /// Names of the mover's shapes that touch at `home`.
  const std::vector<std::pair<std::string, std::string>>& ignored_pairs() const { return ignored_; }

 private:
  struct Pair {
    std::uint32_t shape;
    std::uint32_t other;  // An obstacle, or another shape.
    bool is_own;
  };

  MotionChecker() = default;
  void place(std::span<const double> q, PlanningScratch& scratch) const;
  const PlanningShape& other_shape(const Pair& pair) const;
  geometry::Pose other_to_shape(const Pair& pair, const PlanningScratch& scratch) const;
  double gap(const Pair& pair, double below, PlanningScratch& scratch) const;
  bool meets(const Pair& pair, PlanningScratch& scratch) const;
  MotionCheck first_contacts(std::span<const double> q0, std::span<const double> q1, const geometry::Twist& twist,
                             PlanningScratch& scratch, Order order) const;
  MotionCheck bisect(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch,
                     Order order) const;
  MotionCheck cut_pieces(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch, Order order,
                         MotionCheck result) const;
  double known_free(const PlanningScratch& scratch, const PlanningScratch::Piece& piece) const;

  std::shared_ptr<const Mover> mover_;
  std::vector<Obstacle> obstacles_;
  MotionCheckOptions options_;
  std::vector<Pair> pairs_;
  bool only_triangles_ = true;
  std::vector<std::pair<std::string, std::string>> ignored_;
};

}  // namespace prescene::interfaces
