// SPDX-License-Identifier: Apache-2.0
#include "tests/support/matchers.h"

#include <ostream>
#include <sstream>

namespace prescene::tests {

std::string detail::pixel_report(std::vector<PixelDifference> differences, std::size_t pixels, double allowed_share) {
  if (static_cast<double>(differences.size()) <= allowed_share * static_cast<double>(pixels)) return {};
  // NaN counts as the largest difference.
  const auto key = [](const PixelDifference& d) { return std::isnan(d.difference) ? HUGE_VAL : d.difference; };
  std::stable_sort(differences.begin(), differences.end(),
                   [&](const PixelDifference& a, const PixelDifference& b) { return key(a) > key(b); });
  std::ostringstream text;
  text << differences.size() << " of " << pixels << " pixels differ, most at";
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, differences.size()); ++i) {
    text << " (" << differences[i].x << ", " << differences[i].y << "): " << differences[i].difference;
  }
  return text.str();
}

namespace {

class PoseNear : public testing::MatcherInterface<const geometry::Pose&> {
 public:
  PoseNear(const geometry::Pose& expected, double angle, double distance)
      : expected_(expected), angle_(angle), distance_(distance) {}

  bool MatchAndExplain(const geometry::Pose& actual, testing::MatchResultListener* listener) const override {
    const double angle = geometry::angle_between(actual.rotation, expected_.rotation);
    const double distance = (actual.translation - expected_.translation).norm();
    const double norm = actual.rotation.norm();
    *listener << "which is off by " << angle << " rad and " << distance << " m, quaternion norm " << norm;
    constexpr double kNormTolerance = 1e-9;
    return angle <= angle_ && distance <= distance_ && std::abs(norm - 1.0) <= kNormTolerance;
  }
  void DescribeTo(std::ostream* out) const override {
    *out << "is within " << angle_ << " rad and " << distance_ << " m of " << to_string(expected_);
  }

 private:
  geometry::Pose expected_;
  double angle_;
  double distance_;
};

}  // namespace

testing::Matcher<const geometry::Pose&> is_near(const geometry::Pose& expected, double angle, double distance) {
  return testing::Matcher<const geometry::Pose&>(new PoseNear(expected, angle, distance));
}

}  // namespace prescene::tests

namespace prescene::geometry {

void PrintTo(const Pose& X, std::ostream* out) { *out << to_string(X); }

}  // namespace prescene::geometry
