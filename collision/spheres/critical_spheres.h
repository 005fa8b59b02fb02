// SPDX-License-Identifier: Apache-2.0
// The spheres of a packed body that touch a static shape first when the pose between them is uncertain, and what they
// say about the probability that the body touches the shape.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "shape_placement.h"
#include "sphere_pairs.h"
#include "uncertain_memory.h"

namespace prescene::collision {

/// An error without variance has no standard deviations: they are taken to be that long, m.
inline constexpr double kLeastDeviation = 1e-30;

/// A packed body and a static shape, and the error between them.
class UncertainShape {
 public:
  UncertainShape(const SphereTree& a, const StaticShape& b, const RelativeUncertainty& between)
      : a_(a),
        b_(b),
        between_(between),
        placement_(a, between.X_AB()),
        convex_(b.is_convex()),
        along_(between.reversed_along(Eigen::Vector3d::UnitZ())) {}

  void find_critical(std::vector<UncertainScratch::Memory::OpenNode>* stack, CriticalSpheres* critical) const;
  /// Calls found(sphere) for each sphere whose gap is at most `reach` standard deviations along the normal.
  template <class Found>
  void for_near(double reach, std::vector<UncertainScratch::Memory::OpenNode>* stack, const Found& found) const;

  /// Bounds of the probability that the bodies touch.
  double lower(const CriticalSpheres& critical) const;
  double upper(const CriticalSpheres& critical) const;

 private:
  /// What is known of spheres below a node, or of one: see OpenNode.
  struct Bounds {
    double rank;
    double margin;
  };

  double to_pivot(const Eigen::Vector3d& c) const { return (c - between_.pivot()).norm(); }
  const RelativeUncertainty::Along& along(const Eigen::Vector3d& n) const;
  Bounds bounds_of(const PackedSphere& bounding, const StaticShape::Nearest& nearest) const;
  CriticalSphere look_at(const PackedSphere& sphere, const StaticShape::Nearest& nearest) const;
  double margin_of(const CriticalSphere& sphere) const;
  bool is_certain(const CriticalSphere& sphere) const;
  double surely_touching(const CriticalSphere& sphere) const;
  double touches_ball(const CriticalSphere& sphere, double ball, double apart) const;
  double touches_face(const CriticalSphere& sphere) const;
  std::optional<double> face_depth(const CriticalSphere& sphere, double radius, double slack) const;
  bool contains_prism(const CriticalSphere& sphere, double radius, double from, double to) const;
  double touching_bound(const CriticalSphere& sphere) const;
  double crossing_bound(const CriticalSphere& leader) const;

  const SphereTree& a_;
  const StaticShape& b_;
  const RelativeUncertainty& between_;
  ShapePlacement placement_;
  bool convex_;
  mutable RelativeUncertainty::Along along_;  // Of the last normal: neighbours often have the same.
};

template <class Found>
void UncertainShape::for_near(double reach, std::vector<UncertainScratch::Memory::OpenNode>* stack,
                              const Found& found) const {
  stack->clear();
  stack->push_back({0, 0.0, 0.0});
  while (!stack->empty()) {
    const std::uint32_t index = stack->back().node;
    stack->pop_back();
    const SphereTree::Node& node = a_.nodes()[index];
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const PackedSphere child = lane(a_, index, k);
      const auto radius = static_cast<double>(child.radius);
      const double far = to_pivot(child.centre.cast<double>()) + (node.is_bottom() ? 0.0 : radius);
      const double within = radius + placement_.slack + reach * between_.deviation_bound(far);
      const Eigen::Vector3d centre = placement_.to_shape(child.centre);
      if (!node.is_bottom()) {
        if (b_.is_within(centre, within)) stack->push_back({node.first + k, 0.0, 0.0});
      } else if (const auto nearest = b_.nearest(centre, within)) {
        found(look_at(child, *nearest));
      }
    }
  }
}

}  // namespace prescene::collision
