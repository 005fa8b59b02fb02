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
#include "prescene/service/pictures/ground_density.h"

namespace prescene::service {

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
  /// robot. The objects are seen through.
  static core::Result<SceneView> make(const belief::Scene& scene, const belief::WorldState* state, std::size_t left_out,
                                      const MapView& view, Backends& backends);

  /// Colours the planes at the levels' heights where no support hides them, by the mass around each place as a share of
  /// the largest of `whole`; with lines around the areas of its highest density that hold these shares.
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
  MapView view_;                                // its camera is of twice the size
  geometry::DepthImage depth_, support_depth_;  // with the objects, and without
  geometry::ColorImage image_;
  geometry::Image<std::uint8_t> object_edges_;  // 1 where an object's edge is, drawn over what is painted
};

/// Colour of a share of the largest mass, in [0, 1]: from pale yellow over orange to dark red, evenly darker.
geometry::Rgb warm_color(double value);
/// How strongly it is laid over the scene.
double warm_opacity(double value);

}  // namespace prescene::service
