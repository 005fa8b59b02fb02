// SPDX-License-Identifier: Apache-2.0
// Where things may end, as a density over the ground and as the probability within a square around a place.
//
//   GroundDensity density(poses.components, low, high, poses.heat_map.cell);
//   density.at(x, y);           // 1/m^2
//   density.mass_around(x, y);  // probability of the square of 2 x 2 cm around x, y
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "prescene/belief/prediction.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::service {

/// A density of positions over the ground, kept on a fine grid.
class GroundDensity {
 public:
  /// Of the positions of `components`, over x, y in [low, high] (m); `window`: side of the square of mass_around(), m.
  GroundDensity(std::span<const belief::PoseComponent> components, const Eigen::Vector2d& low,
                const Eigen::Vector2d& high, double window);
  double at(double x, double y) const { return interpolated(values_, x, y); }           ///< 1/m^2; 0 outside.
  double mass_around(double x, double y) const { return interpolated(masses_, x, y); }  ///< In [0, 1]; 0 outside.
  double largest_mass() const { return largest_mass_; }
  /// Density above which the given share of the whole mass lies; 0 where less lies within the grid.
  double level_of(double share) const;
  /// The smallest upright rectangle around the densest places that hold the share; nothing for an empty grid.
  struct Rectangle {
    Eigen::Vector2d low, high;
  };
  std::optional<Rectangle> rectangle_of(double share) const;

 private:
  double interpolated(const std::vector<double>& grid, double x, double y) const;
  void add(const belief::PoseComponent& component);
  void sum_windows(double window);
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cell_ = 0.01;
  int nx_ = 0, ny_ = 0;
  std::vector<double> values_, masses_;
  double largest_mass_ = 0.0;
};

/// The part of a density that rests at about one height.
struct DensityLevel {
  double height = 0.0;  ///< z in W of what it rests on, m.
  GroundDensity density;
};
/// Final positions by the height of the object's lowest point, heights nearer than 3 cm together.
std::vector<DensityLevel> levels_of(const belief::FinalPoses& poses, const geometry::TriangleMesh& mesh,
                                    const Eigen::Vector2d& low, const Eigen::Vector2d& high);

}  // namespace prescene::service
