// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/overlay.h"

#include <gtest/gtest.h>

#include <cmath>

namespace prescene::interfaces {
namespace {

using geometry::ColorImage;
using geometry::LabelImage;
using geometry::Pose;
using geometry::Rgb;
using geometry::Vector3d;

constexpr Rgb kGrey{100, 100, 100};
constexpr Rgb kRed{255, 0, 0};

/// A 3 x 3 block of label 1 in the middle of 7 x 7.
LabelImage block() {
  LabelImage labels(7, 7, 0);
  for (int y = 2; y <= 4; ++y)
    for (int x = 2; x <= 4; ++x) labels(x, y) = 1;
  return labels;
}

int count(const ColorImage& picture, const Rgb& color) {
  int sum = 0;
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) sum += picture(x, y) == color ? 1 : 0;
  return sum;
}

TEST(Overlay, OutlinesAreTheRimOfASilhouette) {
  ColorImage picture(7, 7, kGrey);
  const std::vector<std::optional<Rgb>> colors{kRed};
  draw_outlines(block(), colors, 1, picture);
  EXPECT_EQ(count(picture, kRed), 8);
  EXPECT_EQ(picture(3, 3), kGrey);
  EXPECT_EQ(picture(2, 2), kRed);
  EXPECT_EQ(picture(1, 2), kGrey);
}

TEST(Overlay, InstancesWithoutAColourStayAsTheyAre) {
  ColorImage picture(7, 7, kGrey);
  LabelImage labels = block();
  labels(0, 0) = 9;  // beyond the colours
  const std::vector<std::optional<Rgb>> colors{std::nullopt};
  draw_outlines(labels, colors, 1, picture);
  tint(labels, colors, 1.0, picture);
  EXPECT_EQ(count(picture, kGrey), 49);
}

TEST(Overlay, LabelsOfAnotherSizeAreScaled) {
  ColorImage picture(14, 14, kGrey);
  const std::vector<std::optional<Rgb>> colors{kRed};
  draw_outlines(block(), colors, 1, picture);
  EXPECT_EQ(count(picture, kRed), 20);  // the rim of 6 x 6
  EXPECT_EQ(picture(4, 4), kRed);
  EXPECT_EQ(picture(9, 9), kRed);
  EXPECT_EQ(picture(10, 9), kGrey);
}

TEST(Overlay, NeighboursKeepOutlinesOfTheirOwn) {
  LabelImage labels(4, 1, 1);
  labels(2, 0) = labels(3, 0) = 2;
  ColorImage picture(4, 1, kGrey);
  const std::vector<std::optional<Rgb>> colors{kRed, Rgb{0, 0, 255}};
  draw_outlines(labels, colors, 1, picture);
  EXPECT_EQ(picture(1, 0), kRed);
  EXPECT_EQ(picture(2, 0), (Rgb{0, 0, 255}));
}

TEST(Overlay, TintMixes) {
  ColorImage picture(7, 7, kGrey);
  const std::vector<std::optional<Rgb>> colors{Rgb{200, 0, 100}};
  tint(block(), colors, 0.5, picture);
  EXPECT_EQ(picture(3, 3), (Rgb{150, 50, 100}));
  EXPECT_EQ(picture(0, 0), kGrey);
}

/// L* of CIELAB.
double lightness(const Rgb& color) {
  const double weights[3] = {0.2126, 0.7152, 0.0722};
  double luminance = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = color[c] / 255.0;
    luminance += weights[c] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return luminance > 0.008856 ? 116.0 * std::cbrt(luminance) - 16.0 : 903.3 * luminance;
}

TEST(DivergenceColor, IsAsLightOnBothSidesAndDarkerAwayFromZero) {
  for (int i = 0; i <= 100; ++i) {
    const double below = lightness(divergence_color(-i / 100.0)), above = lightness(divergence_color(i / 100.0));
    EXPECT_NEAR(below, above, 2.0) << i;
    if (i > 0) {
      EXPECT_LE(above, lightness(divergence_color((i - 1) / 100.0)));
    }
  }
  EXPECT_GT(divergence_color(1.0)[0], divergence_color(1.0)[2]);
  EXPECT_LT(divergence_color(-1.0)[0], divergence_color(-1.0)[2]);
  EXPECT_EQ(divergence_color(-3.0), divergence_color(-1.0));
  EXPECT_EQ(divergence_color(7.0), divergence_color(1.0));
}

TEST(HeatColor, GetsLighterAllTheWay) {
  for (int i = 1; i <= 100; ++i) EXPECT_GE(lightness(heat_color(i / 100.0)), lightness(heat_color((i - 1) / 100.0)));
  EXPECT_EQ(heat_color(-3.0), heat_color(0.0));
  EXPECT_EQ(heat_color(7.0), heat_color(1.0));
  EXPECT_EQ(heat_color(std::nan("")), heat_color(0.0));
}

/// 4 x 3 cells of 10 cm from (0.2, -0.1); all mass in cell (3, 0).
belief::HeatMap one_hot() {
  belief::HeatMap map;
  map.cell = 0.1;
  map.x0 = 0.2;
  map.y0 = -0.1;
  map.nx = 4;
  map.ny = 3;
  map.mass.assign(12, 0.0);
  map.mass[3] = 1.0;
  return map;
}

TEST(HeatMapPicture, HasYUpwards) {
  const ColorImage picture = heat_map_picture(one_hot());
  ASSERT_EQ(picture.width(), 4);
  ASSERT_EQ(picture.height(), 3);
  EXPECT_EQ(picture(3, 2), heat_color(1.0));
  EXPECT_EQ(picture(3, 0), heat_color(0.0));
}

/// Straight down from 2 m above (0.5, 0): image right is x, image down is -y.
HeatMapProjection from_above() {
  HeatMapProjection projection;
  projection.camera = {100, 80, 100.0, 100.0, 50.0, 40.0};
  projection.X_WC = {geometry::Quaterniond(0.0, 1.0, 0.0, 0.0), Vector3d(0.5, 0.0, 2.0)};
  return projection;
}

TEST(DrawHeatMap, PaintsTheGroundBelowItsCells) {
  ColorImage picture(100, 80, kGrey);
  HeatMapProjection projection = from_above();
  projection.opacity = 1.0;
  draw_heat_map(one_hot(), projection, picture);
  // The cell spans x 0.5 to 0.6, y -0.1 to 0: at 2 m one pixel is 2 cm, so u 50 to 55, v 40 to 45.
  EXPECT_EQ(picture(52, 42), heat_color(1.0));
  EXPECT_EQ(picture(47, 42), kGrey);
  EXPECT_EQ(picture(52, 37), kGrey);
  EXPECT_NEAR(count(picture, heat_color(1.0)), 25, 11);

  // Nearer to the camera the same cell is larger.
  ColorImage lifted(100, 80, kGrey);
  projection.height = 1.0;
  draw_heat_map(one_hot(), projection, lifted);
  EXPECT_NEAR(count(lifted, heat_color(1.0)), 100, 21);
}

TEST(DrawHeatMap, LiesOnTheSurfaceThatTheCameraSees) {
  HeatMapProjection projection = from_above();
  projection.opacity = 1.0;
  ColorImage on_plane(100, 80, kGrey), on_surface(100, 80, kGrey);
  projection.height = 0.7;
  draw_heat_map(one_hot(), projection, on_plane);
  projection.height = 0.0;
  projection.surface = geometry::DepthImage(100, 80, 1.3f);
  projection.surface(54, 44) = 0.0f;  // nothing seen there
  draw_heat_map(one_hot(), projection, on_surface);
  EXPECT_EQ(on_surface(54, 44), kGrey);
  on_surface(54, 44) = on_plane(54, 44);
  EXPECT_EQ(on_surface, on_plane);
}

TEST(DrawHeatMap, BehindTheCameraThereIsNothing) {
  HeatMapProjection projection = from_above();
  projection.X_WC.rotation = geometry::Quaterniond::Identity();  // looks up
  ColorImage picture(100, 80, kGrey);
  draw_heat_map(one_hot(), projection, picture);
  EXPECT_EQ(count(picture, kGrey), 8000);
}

TEST(DrawHeatMap, PresenceIsPaintedByItsProbability) {
  geometry::Image<float> presence(2, 1, 0.0f);
  presence(1, 0) = 1.0f;
  ColorImage picture(2, 1, kGrey);
  tint(presence, 1.0, picture);
  EXPECT_EQ(picture(0, 0), kGrey);
  EXPECT_EQ(picture(1, 0), heat_color(1.0));
}

TEST(DepthPicture, NearIsLight) {
  geometry::DepthImage depth(3, 1, 0.0f);
  depth(1, 0) = 1.0f;
  depth(2, 0) = 2.0f;
  const ColorImage picture = depth_picture(depth, 1.0, 2.0);
  EXPECT_GT(picture(1, 0)[0], picture(2, 0)[0]);
  EXPECT_NE(picture(0, 0)[0], picture(0, 0)[2]);
}

}  // namespace
}  // namespace prescene::interfaces
