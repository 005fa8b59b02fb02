// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "prescene/rendering/sensor/likelihood_batch.h"
#include "scenes.h"

namespace prescene::rendering {
namespace {

using geometry::Vector3d;

/// A 640 x 480 frame of a frontal plane 1 m away, with one odd pixel.
class FrameTermsTest : public testing::Test {
 protected:
  FrameTermsTest() : depth_(640, 480, 1.0f), color_(640, 480, geometry::Rgb{100, 100, 100}) {
    input_.camera = tests::camera_of_width(640);
    input_.depth = depth_.view();
    support_.plane_C = {Vector3d(0, 0, -1), 1.0};
  }

  FrameTerms make() const {
    FrameTerms terms;
    const core::Status status = make_frame_terms(input_, {}, SensorModel{}, &terms);
    EXPECT_TRUE(status.ok()) << status.message();
    return terms;
  }

  geometry::DepthImage depth_;
  geometry::ColorImage color_;
  SupportRegion support_;
  FrameTermsInput input_;
};

TEST_F(FrameTermsTest, SamplesTheMiddleOfEachBlockAndItsRay) {
  depth_(8 * 10 + 4, 8 * 7 + 4) = 0.625f;
  depth_(8 * 10 + 3, 8 * 7 + 4) = 0.5f;  // never looked at
  const FrameTerms terms = make();
  EXPECT_EQ(terms.step, 8);
  EXPECT_EQ(terms.depth.width(), 80);
  EXPECT_EQ(terms.depth.height(), 60);
  EXPECT_EQ(terms.depth(10, 7), 0.625f);
  EXPECT_EQ(terms.depth(9, 7), 1.0f);
  EXPECT_TRUE(terms.camera.unproject(10, 7, 1.0).isApprox(input_.camera.unproject(84, 60, 1.0), 1e-12));
}

TEST_F(FrameTermsTest, CountsNanAndNegativeDepthAsMissingAndCutsTheRest) {
  depth_(4, 4) = std::numeric_limits<float>::quiet_NaN();
  depth_(12, 4) = -1.0f;
  depth_(20, 4) = std::numeric_limits<float>::infinity();
  depth_(28, 4) = 7.0f;
  depth_(36, 4) = 0.1f;
  const FrameTerms terms = make();
  for (int x = 0; x < 3; ++x) {
    EXPECT_EQ(terms.depth(x, 0), 0.0f);
    EXPECT_EQ(terms.inverse_absent(x, 0), 0.0f);
  }
  EXPECT_EQ(terms.depth(3, 0), 2.5f);
  EXPECT_EQ(terms.depth(4, 0), 0.3f);
  // Uniform over 2.2 m without knowledge of the background.
  EXPECT_NEAR(terms.inverse_absent(3, 0), 2.2, 1e-5);
  EXPECT_NEAR(terms.inverse_absent(10, 10), 2.2, 1e-5);
  EXPECT_LT(terms.absent_missing(10, 10), 0.0f);
}

TEST_F(FrameTermsTest, KnowsTheSupportPlaneWithinItsOutline) {
  support_.outline_C = {{-0.1, -0.1, 1.0}, {0.1, -0.1, 1.0}, {0.1, 0.1, 1.0}, {-0.1, 0.1, 1.0}};
  input_.supports = std::span(&support_, 1);
  const FrameTerms terms = make();
  const double on_plane = 0.6 / (0.004 * std::sqrt(2.0 * M_PI)) + 0.4 / 2.2;
  int inside = 0;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const Vector3d p = terms.camera.unproject(x, y, 1.0);
      const bool on_support = std::abs(p.x()) < 0.1 && std::abs(p.y()) < 0.1;
      inside += on_support ? 1 : 0;
      EXPECT_NEAR(1.0 / terms.inverse_absent(x, y), on_support ? on_plane : 1.0 / 2.2, 1e-4);
    }
  }
  EXPECT_GT(inside, 200);
  // The other way around the outline is the same region.
  std::reverse(support_.outline_C.begin(), support_.outline_C.end());
  EXPECT_TRUE(make().inverse_absent == terms.inverse_absent);
}

TEST_F(FrameTermsTest, TakesTheNearestOfSeveralSupports) {
  SupportRegion supports[] = {
      {{Vector3d(0, 0, -1), 1.5}, {}}, {{Vector3d(0, 0, 1), -1.0}, {}}, {{Vector3d(0, 0, 1), 0.4}, {}}};
  input_.supports = supports;
  EXPECT_EQ(make().absent_peak(40, 30), 1.0f);
}

TEST_F(FrameTermsTest, PrefersAnEmptyScenesDepthToAPlane) {
  geometry::DepthImage background(640, 480, 1.4f);
  background(4, 4) = 0.0f;
  input_.background = background.view();
  input_.supports = std::span(&support_, 1);
  const FrameTerms terms = make();
  EXPECT_EQ(terms.absent_peak(40, 30), 1.4f);
  EXPECT_NEAR(terms.absent_missing(40, 30), 0.03, 1e-6);
  EXPECT_EQ(terms.absent_peak(0, 0), 0.0f);
  EXPECT_NEAR(terms.absent_missing(0, 0), 0.7, 1e-6);
  EXPECT_NEAR(terms.inverse_absent(0, 0), 2.2, 1e-5);
  EXPECT_NEAR(terms.inverse_returns(0, 0), 1.0 / 0.3, 1e-5);
}

TEST_F(FrameTermsTest, KnownSurfacesReplaceTheBackgroundWhereTheyAre) {
  input_.supports = std::span(&support_, 1);
  const FrameTerms frame = make();
  geometry::DepthImage known(80, 60, 0.0f);
  known(20, 20) = 1.0f;
  known(21, 20) = 0.7f;
  FrameTerms terms;
  with_known_surfaces(frame, known, &terms);
  EXPECT_EQ(terms.known(20, 20), 1.0f);
  EXPECT_LT(terms.inverse_absent(20, 20), 0.1f);
  EXPECT_NEAR(terms.inverse_absent(21, 20), 2.2 / 0.2, 1e-3) << "the known surface was not measured where it is";
  EXPECT_EQ(terms.inverse_absent(22, 20), frame.inverse_absent(22, 20));
  // A second layer keeps the nearer of both.
  geometry::DepthImage more(80, 60, 0.8f);
  with_known_surfaces(terms, more, &terms);
  EXPECT_EQ(terms.known(20, 20), 0.8f);
  EXPECT_EQ(terms.known(21, 20), 0.7f);
}

TEST_F(FrameTermsTest, KnownSurfacesBeyondTheRangeAreNotExpected) {
  const FrameTerms frame = make();
  FrameTerms terms;
  with_known_surfaces(frame, geometry::DepthImage(80, 60, 3.0f), &terms);
  EXPECT_EQ(terms.inverse_absent(20, 20), frame.inverse_absent(20, 20));
  EXPECT_EQ(terms.absent_peak(20, 20), 0.0f);
}

TEST_F(FrameTermsTest, RaisesColourRatiosToTheExponent) {
  std::vector<ColorModel> models(2);
  models[1].log_ratio[ColorHistogram::bin({100, 100, 100})] = 0.75f;
  input_.color_models = models;
  EXPECT_TRUE(make().color_ratio.empty()) << "no colour image";
  input_.color = color_.view();
  SensorModelOptions options;
  options.color_exponent = 0.5;
  FrameTerms terms;
  ASSERT_TRUE(make_frame_terms(input_, {}, SensorModel{options}, &terms).ok());
  ASSERT_EQ(terms.color_ratio.size(), 2u);
  EXPECT_EQ(terms.color_ratio[0](3, 3), 1.0f);
  EXPECT_NEAR(terms.color_ratio[1](3, 3), std::exp(0.375), 1e-6);
}

TEST_F(FrameTermsTest, RefusesImagesOfOtherSizes) {
  const auto refused = [&](const FrameTermsInput& input) {
    FrameTerms terms;
    return make_frame_terms(input, {}, SensorModel{}, &terms);
  };
  FrameTermsInput wrong = input_;
  wrong.camera.width = 320;
  EXPECT_EQ(refused(wrong).code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(refused(wrong).message().find("640 x 480"), std::string::npos);
  geometry::ColorImage small(320, 240);
  wrong = input_;
  wrong.color = small.view();
  EXPECT_EQ(refused(wrong).code(), core::StatusCode::kInvalidInput);
  geometry::DepthImage other(639, 480);
  wrong = input_;
  wrong.background = other.view();
  EXPECT_EQ(refused(wrong).code(), core::StatusCode::kInvalidInput);
  wrong = input_;
  wrong.camera.fx = -1.0;
  EXPECT_EQ(refused(wrong).code(), core::StatusCode::kInvalidInput);
}

TEST_F(FrameTermsTest, WorksOnImagesSmallerThanTheTarget) {
  geometry::DepthImage tiny(5, 3, 1.0f);
  input_.camera = {5, 3, 5.0, 5.0, 2.0, 1.0};
  input_.depth = tiny.view();
  const FrameTerms terms = make();
  EXPECT_EQ(terms.step, 1);
  EXPECT_EQ(terms.depth.width(), 5);
}

}  // namespace
}  // namespace prescene::rendering
