// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/lens_warp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "prescene/core/random.h"

namespace prescene::interfaces::lens_warp_test {
namespace {

using geometry::ColorImage;
using geometry::DepthImage;
using geometry::LabelImage;
using geometry::LensDistortion;
using geometry::PinholeCamera;
using geometry::Rgb;

const PinholeCamera kCamera{64, 48, 60.0, 62.0, 31.2, 23.7};

LensDistortion barrel() { return *LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0}); }

ColorImage noise() {
  core::RandomStream stream(1, core::Purpose::kTest);
  ColorImage image(kCamera.width, kCamera.height);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (auto& channel : image(x, y)) channel = static_cast<std::uint8_t>(stream.uniform_below(256));
    }
  }
  return image;
}

/// Where pixel (x, y) of the straightened image is in the distorted one, in steps of 1/32 pixel.
Eigen::Vector2d source_of(const LensDistortion& lens, int x, int y) {
  const Eigen::Vector2d q = *lens.distort({(x - kCamera.cx) / kCamera.fx, (y - kCamera.cy) / kCamera.fy});
  return {std::round(32.0 * (kCamera.fx * q.x() + kCamera.cx)) / 32.0,
          std::round(32.0 * (kCamera.fy * q.y() + kCamera.cy)) / 32.0};
}

TEST(LensWarp, WithoutALensChangesNothing) {
  const LensWarp warp = LensWarp::undistorting(kCamera, {});
  const ColorImage color = noise();
  EXPECT_EQ(*warp.color(color), color);
  EXPECT_EQ(warp.visible_share(), 1.0);
  DepthImage depth(64, 48, 0.5F);
  depth(0, 0) = 2.0F;
  depth(63, 47) = 0.0F;
  EXPECT_EQ(*warp.depth(depth), depth);
}

// Of cv::initUndistortRectifyMap and cv::fisheye::initUndistortRectifyMap of OpenCV 4.6, as floats.
TEST(LensWarp, SamplesWhereOpencvsMapsPoint) {
  struct Row {
    int x, y;
    double u, v;
  };
  const auto check = [](const LensDistortion& lens, const std::vector<Row>& rows) {
    for (const Row& row : rows) {
      const Eigen::Vector2d source = source_of(lens, row.x, row.y);
      EXPECT_NEAR(source.x(), row.u, 0.5 / 32.0 + 1e-5);
      EXPECT_NEAR(source.y(), row.v, 0.5 / 32.0 + 1e-5);
    }
  };
  check(barrel(), {{0, 0, 3.15359545, 2.45931149},
                   {63, 0, 59.4869194, 2.60652518},
                   {5, 40, 6.75147676, 38.9070511},
                   {31, 24, 30.9999943, 24.0000057}});
  check(*LensDistortion::equidistant({-0.03, 0.01, -0.004, 0.0007}), {{0, 0, 3.74015594, 2.84107995},
                                                                      {63, 0, 59.1113777, 2.89812398},
                                                                      {5, 40, 7.12047243, 38.6807747},
                                                                      {31, 24, 31.0000019, 23.9999962}});
}

TEST(LensWarp, InterpolatesColourBilinearly) {
  const LensDistortion lens = barrel();
  const ColorImage image = noise();
  const ColorImage straight = *LensWarp::undistorting(kCamera, lens).color(image);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Eigen::Vector2d at = source_of(lens, x, y);
      const int u = static_cast<int>(at.x());
      const int v = static_cast<int>(at.y());
      const double a = at.x() - u;
      const double b = at.y() - v;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = (1.0 - b) * ((1.0 - a) * image(u, v)[c] + a * image(u + 1, v)[c]) +
                             b * ((1.0 - a) * image(u, v + 1)[c] + a * image(u + 1, v + 1)[c]);
        EXPECT_NEAR(straight(x, y)[c], value, 0.5 + 1e-9) << x << ' ' << y;
      }
    }
  }
}

TEST(LensWarp, TakesDepthAndLabelsOfTheNearestPixel) {
  const LensDistortion lens = barrel();
  DepthImage depth(64, 48);
  LabelImage labels(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      labels(x, y) = static_cast<std::uint16_t>(1 + 64 * y + x);
      depth(x, y) = 0.5F + 0.001F * static_cast<float>(labels(x, y));
    }
  }
  const LensWarp warp = LensWarp::undistorting(kCamera, lens);
  const DepthImage straight = *warp.depth(depth);
  const LabelImage straight_labels = *warp.labels(labels);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Eigen::Vector2d at = source_of(lens, x, y);
      const int from = straight_labels(x, y) - 1;
      ASSERT_GE(from, 0);
      EXPECT_LE(std::abs(at.x() - from % 64), 0.5);
      EXPECT_LE(std::abs(at.y() - from / 64), 0.5);
      EXPECT_EQ(straight(x, y), depth(from % 64, from / 64)) << "never between two depths";
    }
  }
}

TEST(LensWarp, LeavesEmptyWhatTheLensDoesNotShow) {
  // A pincushion moves what is near the corners out of the frame.
  const LensWarp pincushion =
      LensWarp::undistorting(kCamera, *LensDistortion::brown({0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}));
  const DepthImage depth(64, 48, 1.0F);
  const ColorImage white(64, 48, {255, 255, 255});
  const DepthImage straight = *pincushion.depth(depth);
  const ColorImage straight_color = *pincushion.color(white);
  EXPECT_EQ(straight(0, 0), 0.0F);
  EXPECT_EQ(straight(32, 24), 1.0F);
  int visible = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      visible += straight(x, y) > 0.0F ? 1 : 0;
      EXPECT_EQ(straight_color(x, y), (straight(x, y) > 0.0F ? Rgb{255, 255, 255} : Rgb{0, 0, 0}))
          << "colour and depth end at the same pixel, and neither fades";
    }
  }
  EXPECT_DOUBLE_EQ(pincushion.visible_share(), visible / (64.0 * 48.0));
  EXPECT_LT(pincushion.visible_share(), 0.95);
  // Folded to nothing: the corners are beyond the fold and stay empty.
  const LensWarp folds =
      LensWarp::undistorting(kCamera, *LensDistortion::brown({-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ((*folds.depth(depth))(0, 0), 0.0F);
  EXPECT_EQ((*folds.depth(depth))(32, 24), 1.0F);
}

TEST(LensWarp, StraightensWhatTheLensBent) {
  // A smooth picture comes back but for what interpolating twice costs.
  ColorImage image(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto wave = static_cast<std::uint8_t>(128.0 + 100.0 * std::sin(0.2 * x) * std::cos(0.15 * y));
      image(x, y) = {wave, static_cast<std::uint8_t>(255 - wave), static_cast<std::uint8_t>(4 * x)};
    }
  }
  for (const LensDistortion& lens : {barrel(), *LensDistortion::equidistant({-0.03, 0.01, -0.004, 0.0007})}) {
    const LensWarp bend = LensWarp::distorting(kCamera, lens);
    const LensWarp straighten = LensWarp::undistorting(kCamera, lens);
    EXPECT_LT(bend.visible_share(), 1.0);
    const ColorImage back = *straighten.color(*bend.color(image));
    for (int y = 4; y < 44; ++y) {
      for (int x = 5; x < 59; ++x) {
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(back(x, y)[c], image(x, y)[c], 5.0) << x << ' ' << y;
      }
    }
  }
}

TEST(LensWarp, RefusesImagesOfAnotherSize) {
  const LensWarp warp = LensWarp::undistorting(kCamera, barrel());
  const core::Status status = warp.depth(DepthImage(64, 47)).status();
  EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(status.message().find("64 x 47 pixels, but the lens was calibrated for 64 x 48"), std::string::npos);
  EXPECT_FALSE(warp.color({}).ok());
  EXPECT_FALSE(warp.labels(LabelImage(48, 64)).ok());
}

}  // namespace
}  // namespace prescene::interfaces::lens_warp_test
