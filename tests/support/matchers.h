// SPDX-License-Identifier: Apache-2.0
// GoogleMock matchers of geometry that say how far off a value is, and where.
//
//   EXPECT_THAT(X_WB, tests::is_near(expected, 1e-9, 1e-9));
//   EXPECT_THAT(depth, tests::is_near(expected_depth, 1e-4F));
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"

namespace prescene::tests {

namespace detail {

struct PixelDifference {
  int x;
  int y;
  double difference;
};

/// "12 of 4800 pixels differ, most at (3, 4): 0.2, ..."; empty when the share is allowed.
std::string pixel_report(std::vector<PixelDifference> differences, std::size_t pixels, double allowed_share);

}  // namespace detail

/// A pose whose rotation is within `angle` (radians) and whose origin is within `distance` (m) of the expected one.
testing::Matcher<const geometry::Pose&> is_near(const geometry::Pose& expected, double angle, double distance);

/// A vector or matrix each of whose elements is within `tolerance` of the expected one.
template <class Derived>
auto is_near(const Eigen::MatrixBase<Derived>& expected, double tolerance) {
  using Plain = typename Derived::PlainObject;
  class Near : public testing::MatcherInterface<const Plain&> {
   public:
    Near(Plain value, double limit) : value_(std::move(value)), limit_(limit) {}
    bool MatchAndExplain(const Plain& actual, testing::MatchResultListener* listener) const override {
      if (actual.rows() != value_.rows() || actual.cols() != value_.cols()) {
        *listener << "whose size is " << actual.rows() << " x " << actual.cols();
        return false;
      }
      Eigen::Index row = 0;
      Eigen::Index col = 0;
      const double worst = (actual - value_).cwiseAbs().maxCoeff(&row, &col);
      *listener << "whose element (" << row << ", " << col << ") is off by " << worst;
      return (actual - value_).allFinite() && worst <= limit_;
    }
    void DescribeTo(std::ostream* out) const override { *out << "is within " << limit_ << " of\n" << value_; }

   private:
    Plain value_;
    double limit_;
  };
  return testing::Matcher<const Plain&>(new Near(expected.derived(), tolerance));
}

/// An image of the same size of which all but a share of the pixels are within `tolerance` of the expected ones.
template <class Pixel>
testing::Matcher<const geometry::Image<Pixel>&> is_near(const geometry::Image<Pixel>& expected, Pixel tolerance,
                                                        double allowed_share = 0.0) {
  class Near : public testing::MatcherInterface<const geometry::Image<Pixel>&> {
   public:
    Near(geometry::Image<Pixel> image, double limit, double share)
        : image_(std::move(image)), limit_(limit), share_(share) {}
    bool MatchAndExplain(const geometry::Image<Pixel>& actual, testing::MatchResultListener* listener) const override {
      if (actual.width() != image_.width() || actual.height() != image_.height()) {
        *listener << "whose size is " << actual.width() << " x " << actual.height();
        return false;
      }
      std::vector<detail::PixelDifference> differences;
      for (int y = 0; y < actual.height(); ++y) {
        for (int x = 0; x < actual.width(); ++x) {
          const double difference = std::abs(static_cast<double>(actual(x, y)) - static_cast<double>(image_(x, y)));
          if (!(difference <= limit_)) differences.push_back({x, y, difference});
        }
      }
      const std::string report = detail::pixel_report(std::move(differences), actual.size(), share_);
      *listener << report;
      return report.empty();
    }
    void DescribeTo(std::ostream* out) const override {
      *out << "is within " << limit_ << " of the expected image on all but " << 100.0 * share_ << " % of the pixels";
    }

   private:
    geometry::Image<Pixel> image_;
    double limit_;
    double share_;
  };
  return testing::Matcher<const geometry::Image<Pixel>&>(
      new Near(expected, static_cast<double>(tolerance), allowed_share));
}

}  // namespace prescene::tests

// Found by GoogleTest when it prints a value.
namespace prescene::geometry {

void PrintTo(const Pose& X, std::ostream* out);  // NOLINT(readability-identifier-naming)

}  // namespace prescene::geometry
