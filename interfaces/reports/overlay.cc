// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/interfaces/reports/lettering.h"

namespace prescene::interfaces {
namespace {

using geometry::ColorImage;
using geometry::Rgb;

/// Samples an image of the same view and any size at the picture's pixels.
template <class Pixel>
class Sampler {
 public:
  Sampler(const geometry::Image<Pixel>& image, const ColorImage& picture)
      : image_(image), picture_width_(picture.width()), picture_height_(picture.height()) {}
  Pixel operator()(int x, int y) const {
    if (image_.width() == picture_width_ && image_.height() == picture_height_) return image_(x, y);
    const auto scaled = [](int i, int from, int to) {
      return std::min(to - 1, static_cast<int>((static_cast<std::int64_t>(2 * i + 1) * to) / (2 * from)));
    };
    return image_(scaled(x, picture_width_, image_.width()), scaled(y, picture_height_, image_.height()));
  }

 private:
  const geometry::Image<Pixel>& image_;
  int picture_width_, picture_height_;
};

const Rgb* color_of(std::uint16_t label, std::span<const std::optional<Rgb>> colors) {
  if (label == 0 || label > colors.size() || !colors[label - 1u]) return nullptr;
  return &*colors[label - 1u];
}

double largest_mass(const belief::HeatMap& map) {
  return map.mass.empty() ? 0.0 : *std::max_element(map.mass.begin(), map.mass.end());
}

/// A colour by lightness and the two chromatic axes of OKLab [Ottosson 2020], cut to what a screen shows.
Rgb from_oklab(double L, double a, double b) {
  const auto cubed = [](double v) { return v * v * v; };
  const double l = cubed(L + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cubed(L - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cubed(L - 0.0894841775 * a - 1.2914855480 * b);
  const double linear[3] = {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                            -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                            -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
  Rgb color;
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = std::clamp(linear[c], 0.0, 1.0);
    const double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
    color[c] = static_cast<std::uint8_t>(std::lround(255.0 * encoded));
  }
  return color;
}

}  // namespace

Rgb divergence_color(double value) {
  const double far = std::min(std::abs(value), 1.0);
  // Lightness falls evenly from nearly white while colour grows with it, equally on both sides.
  const double L = 0.96 - 0.44 * far;
  const double chroma = 0.135 * std::min(1.0, 1.4 * far);
  const double hue = value < 0.0 ? 4.45 : 0.85;  // rad; blue, orange
  return from_oklab(L, chroma * std::cos(hue), chroma * std::sin(hue));
}

Rgb heat_color(double value) {
  // Eleven stops whose lightness L* grows from 12 to 91 in steps of 7 to 10, linear between.
  static constexpr std::array<std::array<double, 3>, 11> kStops{{{38, 20, 72},
                                                                 {53, 42, 112},
                                                                 {48, 68, 134},
                                                                 {36, 93, 142},
                                                                 {24, 116, 142},
                                                                 {19, 139, 138},
                                                                 {37, 162, 125},
                                                                 {85, 184, 103},
                                                                 {140, 203, 76},
                                                                 {199, 219, 51},
                                                                 {252, 232, 54}}};
  if (!(value > 0.0)) value = 0.0;
  const double place = std::min(value, 1.0) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  const double t = place - static_cast<double>(i);
  Rgb color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = static_cast<std::uint8_t>(std::lround((1.0 - t) * kStops[i][c] + t * kStops[i + 1][c]));
  return color;
}

Rgb series_color(std::size_t i) {
  static constexpr std::array<Rgb, 8> kColors{{{230, 120, 30},
                                               {45, 125, 200},
                                               {40, 160, 90},
                                               {200, 60, 110},
                                               {140, 95, 200},
                                               {190, 160, 20},
                                               {30, 170, 180},
                                               {120, 85, 65}}};
  return kColors[i % kColors.size()];
}

void draw_outlines(const geometry::LabelImage& labels, std::span<const std::optional<Rgb>> colors, int thickness,
                   ColorImage& picture) {
  PRESCENE_CHECK(thickness >= 1);
  if (labels.empty() || picture.empty()) return;
  const Sampler label_at(labels, picture);
  // Painted inwards from the silhouette, so that neighbours keep lines of their own.
  const int reach = thickness;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const std::uint16_t label = label_at(x, y);
      const Rgb* color = color_of(label, colors);
      if (color == nullptr) continue;
      bool at_edge = false;
      for (int d = 1; d <= reach && !at_edge; ++d) {
        const auto differs = [&](int u, int v) {
          return u >= 0 && u < picture.width() && v >= 0 && v < picture.height() && label_at(u, v) != label;
        };
        at_edge = differs(x - d, y) || differs(x + d, y) || differs(x, y - d) || differs(x, y + d);
      }
      if (at_edge) picture(x, y) = *color;
    }
  }
}

void tint(const geometry::LabelImage& labels, std::span<const std::optional<Rgb>> colors, double opacity,
          ColorImage& picture) {
  if (labels.empty() || picture.empty()) return;
  const Sampler label_at(labels, picture);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      if (const Rgb* color = color_of(label_at(x, y), colors))
        mix(picture(x, y), *color, std::clamp(opacity, 0.0, 1.0));
}

void tint(const geometry::Image<float>& probability, double opacity, ColorImage& picture) {
  if (probability.empty() || picture.empty()) return;
  const Sampler probability_at(probability, picture);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const double p = std::clamp(static_cast<double>(probability_at(x, y)), 0.0, 1.0);
      if (p > 0.0)
        mix(picture(x, y), heat_color(std::sqrt(p)), std::clamp(opacity, 0.0, 1.0) * (0.3 + 0.7 * std::sqrt(p)));
    }
  }
}

ColorImage heat_map_picture(const belief::HeatMap& map) {
  ColorImage picture(map.nx, map.ny, heat_color(0.0));
  const double largest = largest_mass(map);
  if (!(largest > 0.0)) return picture;
  for (int iy = 0; iy < map.ny; ++iy) {
    for (int ix = 0; ix < map.nx; ++ix) {
      const double mass =
          map.mass[static_cast<std::size_t>(iy) * static_cast<std::size_t>(map.nx) + static_cast<std::size_t>(ix)];
      picture(ix, map.ny - 1 - iy) = heat_color(std::sqrt(mass / largest));
    }
  }
  return picture;
}

void draw_heat_map(const belief::HeatMap& map, const HeatMapProjection& projection, ColorImage& picture) {
  const geometry::PinholeCamera& camera = projection.camera;
  PRESCENE_CHECK(picture.width() == camera.width && picture.height() == camera.height);
  const bool on_surface = !projection.surface.empty();
  PRESCENE_CHECK(!on_surface ||
                 (projection.surface.width() == camera.width && projection.surface.height() == camera.height));
  const double largest = largest_mass(map);
  if (!(largest > 0.0)) return;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      geometry::Vector3d p_WQ;
      if (on_surface) {
        const double depth = projection.surface(u, v);
        if (!(depth > 0.0)) continue;
        p_WQ = projection.X_WC * camera.unproject(u, v, depth);
      } else {
        const geometry::Vector3d ray_W = projection.X_WC.rotation * camera.unproject(u, v, 1.0);
        const double t = (projection.height - projection.X_WC.translation.z()) / ray_W.z();
        if (!(t > 0.0) || !std::isfinite(t)) continue;
        p_WQ = projection.X_WC.translation + t * ray_W;
      }
      const double ix = std::floor((p_WQ.x() - map.x0) / map.cell), iy = std::floor((p_WQ.y() - map.y0) / map.cell);
      if (!(ix >= 0.0 && ix < map.nx && iy >= 0.0 && iy < map.ny)) continue;
      const double mass =
          map.mass[static_cast<std::size_t>(iy) * static_cast<std::size_t>(map.nx) + static_cast<std::size_t>(ix)];
      const double level = std::sqrt(mass / largest);
      // Below a hundredth of the peak nothing is painted, so that the picture stays a picture.
      if (level > 0.1) mix(picture(u, v), heat_color(level), projection.opacity * std::min(1.0, 0.35 + level));
    }
  }
}

ColorImage depth_picture(const geometry::DepthImage& depth, double near_depth, double far_depth) {
  ColorImage picture(depth.width(), depth.height(), Rgb{24, 28, 60});
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double z = depth(x, y);
      if (!(z > 0.0) || !std::isfinite(z)) continue;
      const double t = std::clamp((z - near_depth) / std::max(1e-9, far_depth - near_depth), 0.0, 1.0);
      const auto grey = static_cast<std::uint8_t>(std::lround(245.0 - 200.0 * t));
      picture(x, y) = {grey, grey, grey};
    }
  }
  return picture;
}

}  // namespace prescene::interfaces
