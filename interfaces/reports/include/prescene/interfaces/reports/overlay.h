// SPDX-License-Identifier: Apache-2.0
// Drawing onto pictures: outlines of what is believed, and where things may end. Pure functions of images and values.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces {

/// Colour of a value in [0, 1] (clamped) on a scale from dark blue over green to yellow whose lightness grows evenly,
/// so that it reads alike in grey and for the colour-blind.
geometry::Rgb heat_color(double value);
/// Colour of a value in [-1, 1] (clamped): blue below 0, orange above, the nearer to 0 the lighter; at equal distance
/// from 0 both are equally light.
geometry::Rgb divergence_color(double value);
/// The i-th of a series of colours that are easily told apart (repeats after eight).
geometry::Rgb series_color(std::size_t i);

/// Draws the silhouette of each labelled instance: pixels of it that have a pixel of another label beside them.
/// labels: 1 + index of the instance, 0 = nothing; colors[index], instances beyond are left out. The label image may be
/// of another size than the picture (same view): it is then sampled at the nearest pixel. `thickness` in picture
/// pixels, >= 1.
void draw_outlines(const geometry::LabelImage& labels, std::span<const std::optional<geometry::Rgb>> colors,
                   int thickness, geometry::ColorImage& picture);

/// Mixes the instances' colours into the picture: opacity in [0, 1].
void tint(const geometry::LabelImage& labels, std::span<const std::optional<geometry::Rgb>> colors, double opacity,
          geometry::ColorImage& picture);

/// Mixes the heat colour of its square root into the picture where the probability (in [0, 1]) is not 0, the more the
/// higher it is.
void tint(const geometry::Image<float>& probability, double opacity, geometry::ColorImage& picture);

/// A heat map as a picture, one pixel a cell, y upwards; the largest mass is the brightest, and colours follow its
/// square root, so that rare places are seen too.
geometry::ColorImage heat_map_picture(const belief::HeatMap& map);

/// Where the heat map is put in a camera's view.
struct HeatMapProjection {
  geometry::PinholeCamera camera;  ///< Of the picture.
  geometry::Pose X_WC;
  /// z in C (m, 0 = nothing there) of the surfaces that it lies on, as seen by the camera, of the picture's size.
  /// Empty: it lies on the horizontal plane z = height.
  geometry::DepthImage surface;
  double height = 0.0;    ///< m, W.
  double opacity = 0.75;  ///< Where the mass is largest.
};
/// Paints each surface point in the colour of the map's cell above or below it. The picture has the camera's size
/// (checked).
void draw_heat_map(const belief::HeatMap& map, const HeatMapProjection& projection, geometry::ColorImage& picture);

/// Depth as grey, near = light, within [near, far] (m); no measurement is dark blue.
geometry::ColorImage depth_picture(const geometry::DepthImage& depth, double near_depth, double far_depth);

}  // namespace prescene::interfaces
