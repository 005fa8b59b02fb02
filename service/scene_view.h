// SPDX-License-Identifier: Apache-2.0
// One camera's picture of a scene's surroundings that things are painted onto: a density, silhouettes of objects,
// lines in space.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "prescene/belief/scene.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/service/backends.h"

namespace prescene::service {

/// A density of positions over the ground, kept on a fine grid.
class GroundDensity {
 public:
  /// Of the positions of `components`, over x, y in [low, high] (m).
  GroundDensity(std::span<const belief::PoseComponent> components, const Eigen::Vector2d& low,
                const Eigen::Vector2d& high);
  double at(double x, double y) const;  ///< 1/m^2; 0 outside.
  double largest() const { return largest_; }
  /// Density above which the given share of the whole mass lies.
  double level_of(double share) const;

 private:
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cell_ = 0.01;
  int nx_ = 0, ny_ = 0;
  std::vector<double> values_;
  double largest_ = 0.0;
};

/// The part of a density that rests at about one height.
struct DensityLevel {
  double height = 0.0;  ///< z in W of what it rests on, m.
  GroundDensity density;
};
/// Final positions by the height of the object's lowest point, heights nearer than 3 cm together.
std::vector<DensityLevel> levels_of(const belief::FinalPoses& poses, const geometry::TriangleMesh& mesh,
                                    const Eigen::Vector2d& low, const Eigen::Vector2d& high);

/// Looks straight down from far above, so that the picture is a map: one metre is `scale` pixels.
struct MapView {
  geometry::PinholeCamera camera;
  geometry::Pose X_WC;
};
MapView map_view(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int width, int height);
/// Looks at points from a direction (from them to the camera), near enough for them to fill the picture.
MapView perspective_view(std::span<const geometry::Vector3d> points, const geometry::Vector3d& away, int width,
                         int height);

class SceneView {
 public:
  /// Renders supports and, as they are in `state` (if any), the objects but one, at twice the size, pale; not the
  /// robot.
  static core::Result<SceneView> make(const belief::Scene& scene, const belief::WorldState* state, std::size_t left_out,
                                      const MapView& view, Backends& backends);

  /// Colours the planes at the levels' heights where nothing hides them, as shares of the largest of `whole`; with
  /// lines around the areas of its highest density that hold these shares.
  void paint(const std::vector<DensityLevel>& levels, const GroundDensity& whole,
             std::span<const double> outlined_shares);
  /// The object's silhouette at a pose, tinted where it is seen, outlined everywhere.
  core::Status outline(const belief::Scene& scene, std::size_t object, const geometry::Pose& X_WO,
                       const geometry::Rgb& color, double tint, bool dashed, Backends& backends);
  /// A line through points in W; fainter where something stands in front.
  void line(std::span<const geometry::Vector3d> points, double width, const geometry::Rgb& color, double opacity,
            bool arrow);

  /// Pixel (of picture()) of a point in W; nothing behind the camera.
  std::optional<Eigen::Vector2d> pixel(const geometry::Vector3d& p_WQ) const;
  /// At its final size.
  geometry::ColorImage picture() const;

 private:
  SceneView(const MapView& view) : view_(view) {}
  MapView view_;  // its camera is of twice the size
  geometry::DepthImage depth_;
  geometry::ColorImage image_;
};

/// Colour of a share of the largest density, in [0, 1]: from pale yellow over orange to dark red, evenly darker.
geometry::Rgb warm_color(double value);
/// How strongly it is laid over the scene.
double warm_opacity(double value);

}  // namespace prescene::service
