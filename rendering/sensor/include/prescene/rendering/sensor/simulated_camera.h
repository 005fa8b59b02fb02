// SPDX-License-Identifier: Apache-2.0
// A simulated RGB-D camera: the sensor model's sampling face over a whole image, with what only shows between pixels:
// correlated noise, flying pixels at edges, quantisation.
//
//   SimulatedCamera simulated(SensorModel(), options);
//   simulated.sample(scene, view, nullptr, camera, X_WC, stream, frame, &depth, &color);
#pragma once

#include <array>

#include "prescene/core/random.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::rendering {

struct SimulatedCameraOptions {
  /// Shares of the hit's variance: a pattern that stays from frame to frame (calibration), noise correlated over
  /// neighbours but new in each frame; the rest is white. Both in [0, 1], sum at most 1.
  double fixed_pattern_share = 0.25;
  double correlated_share = 0.5;
  double correlation_px = 12.0;  ///< Cell of the correlated noise; half of its correlation is gone there.
  double quantisation_per_depth_squared = 0.0013;  ///< Step of the returned depth, 1/m: 1.3 mm at 1 m.
  double depth_edge = 0.02;  ///< m; a jump that counts as an edge even between pixels of one object.
  /// Shares of returns that are not from the surface: by the distance to the nearest edge, in the sensor model's
  /// classes (flying pixels, between the two surfaces of the edge) ...
  std::array<double, 4> edge_outlier = {0.24, 0.18, 0.08, 0.02};
  double interior_outlier = 0.01;  ///< ... and further in (anywhere in range).
  bool missing = true;
  double color_noise = 2.0;                         ///< Standard deviation of each channel, of 255.
  geometry::Rgb background_low = {70, 74, 82};      ///< Colour of empty pixels at the bottom of the image ...
  geometry::Rgb background_high = {150, 158, 170};  ///< ... and at its top.

  friend bool operator==(const SimulatedCameraOptions&, const SimulatedCameraOptions&) = default;
};

/// Immutable; any number of threads.
class SimulatedCamera {
 public:
  SimulatedCamera(const SensorModel& model, const SimulatedCameraOptions& options) : model_(model), options_(options) {}
  const SensorModel& model() const { return model_; }
  const SimulatedCameraOptions& options() const { return options_; }

  /// What the camera returns of a view of `scene` rendered with normals, in frame number `frame`: the same numbers for
  /// the same stream and frame. Unmodelled occluders are not invented: what stands in front must be in the scene.
  /// Through a transparent surface it sees `behind`, the scene rendered without transparent things (null: nothing).
  void sample(const RenderScene& scene, const RenderedView& view, const RenderedView* behind,
              const geometry::PinholeCamera& camera, const geometry::Pose& X_WC, const core::RandomStream& stream,
              std::uint64_t frame, geometry::DepthImage* depth, geometry::ColorImage* color) const;

 private:
  SensorModel model_;
  SimulatedCameraOptions options_;
};

/// Whether a mesh has colours of its own.
bool has_look(const RenderMesh& mesh);
/// Whether any mesh of the scene has: then a view of it is to be rendered with colours (RenderOptions::color).
bool has_looks(const RenderScene& scene);

/// Diffuse shading without noise, for reports and overlays: two fixed lights, materials' colours, a grey gradient
/// behind. Meshes with a look are drawn as in the view's colour image where it has one.
void shade(const RenderScene& scene, const RenderedView& view, const geometry::Pose& X_WC,
           const SimulatedCameraOptions& options, geometry::ColorImage* color);

}  // namespace prescene::rendering
