// SPDX-License-Identifier: Apache-2.0
// What a planner moves: shapes whose places follow from a configuration, and how a motion between two configurations
// goes. A rigid body in space is here, an arm in arm.h.
//
//   PRESCENE_TRY(const PlanningShape cup, PlanningShape::of_mesh(mesh, "cup", pool));
//   const auto mover = std::make_shared<const RigidBody>("cup", cup);       // 7 numbers: position and quaternion
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/collision/rigid_motion.h"
#include "prescene/geometry/pose.h"
#include "prescene/interfaces/planning/planning_shape.h"

namespace prescene::interfaces {

struct MovingShape {
  std::string name;
  PlanningShape shape;
};

/// Immutable after it was made, so that any number of threads may ask it.
class Mover {
 public:
  Mover() = default;
  Mover(const Mover&) = delete;
  Mover& operator=(const Mover&) = delete;
  virtual ~Mover() = default;

  const std::vector<MovingShape>& shapes() const { return shapes_; }
  /// How many numbers a configuration has. Of those that functions are given, this many are there (not checked).
  virtual std::size_t dimension() const = 0;
  /// Whether these numbers say where the shapes are: all are finite. The other functions take none that do not.
  virtual bool is_configuration(std::span<const double> q) const;
  /// Poses in the world of all shapes. `work` is memory that is kept from call to call.
  virtual void place(std::span<const double> q, std::span<geometry::Pose> X_WS,
                     std::vector<geometry::Pose>* work) const = 0;
  /// The configuration at t of the motion from q0, t = 0, to q1, t = 1.
  virtual void between(std::span<const double> q0, std::span<const double> q1, double t, std::span<double> q) const = 0;
  /// Upper bound of the length (m) of the path of any point of a shape in this motion, seen from what carries both the
  /// shape and `other`; from the world where that is nothing. From t to u it is at most (u - t) times this.
  virtual double way(std::size_t shape, std::optional<std::size_t> other, std::span<const double> q0,
                     std::span<const double> q1) const = 0;
  /// Whether a shape moves at all.
  virtual bool moves(std::size_t /*shape*/) const { return true; }
  /// The motion of the first shape in the world, where it is the only one and moves so.
  virtual std::optional<geometry::Twist> steady_twist(std::span<const double> /*q0*/,
                                                      std::span<const double> /*q1*/) const {
    return std::nullopt;
  }
  /// Pairs of shapes that must not meet each other.
  virtual std::vector<std::pair<std::size_t, std::size_t>> own_pairs() const { return {}; }

 protected:
  std::vector<MovingShape> shapes_;
};

/// A rigid body that is free in space. A configuration is the position of its frame's origin in the world, m, and the
/// quaternion (x, y, z, w) of its orientation; a motion is a straight line of the origin, and the shorter turn at a
/// steady rate, as OMPL's SE3StateSpace interpolates.
class RigidBody final : public Mover {
 public:
  RigidBody(std::string name, PlanningShape shape);

  std::size_t dimension() const override { return 7; }
  /// The quaternion may have any length but zero.
  bool is_configuration(std::span<const double> q) const override;
  void place(std::span<const double> q, std::span<geometry::Pose> X_WS,
             std::vector<geometry::Pose>* work) const override;
  void between(std::span<const double> q0, std::span<const double> q1, double t, std::span<double> q) const override;
  double way(std::size_t shape, std::optional<std::size_t> other, std::span<const double> q0,
             std::span<const double> q1) const override;
  std::optional<geometry::Twist> steady_twist(std::span<const double> q0, std::span<const double> q1) const override;

  static geometry::Pose pose(std::span<const double> q);
  static std::array<double, 7> configuration(const geometry::Pose& X_WB);
};

}  // namespace prescene::interfaces
