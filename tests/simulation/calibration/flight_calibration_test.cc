// SPDX-License-Identifier: Apache-2.0
// Flights of a symmetric top, whose motion has a closed form: it turns about its angular momentum at a constant rate,
// and about its own axis at another.
#include "prescene/simulation/calibration/flight_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"

namespace prescene::tests::flight_calibration_test {
namespace {

using geometry::Matrix3d;
using geometry::Quaterniond;
using geometry::Vector3d;
using simulation::calibrate_flights;
using simulation::FlightCalibration;
using simulation::FlightParameter;
using simulation::FlightPrior;
using simulation::kFlightParameters;
using simulation::TimedPose;
using ::testing::HasSubstr;

const Vector3d kCenter(0.004, -0.003, 0.0055);
const Vector3d kGravity(0.02, -0.01, -9.61);
constexpr double kAxisRatio = 0.9;  // The moment about z over that about x and y.

struct Noise {
  double position = 0.0;  ///< m
  double rotation = 0.0;  ///< rad
};

/// Where a symmetric top of moments (1, 1, kAxisRatio) is after `time` [Goldstein 2002, 5.6].
Quaterniond top(const Quaterniond& start, const Vector3d& spin, double time) {
  const Vector3d momentum_W = start * Vector3d(spin.x(), spin.y(), kAxisRatio * spin.z());
  const double own_rate = spin.z() * (1.0 - kAxisRatio);
  return geometry::exp_rotation(momentum_W * time) * start * geometry::exp_rotation({0.0, 0.0, own_rate * time});
}

std::vector<TimedPose> flight(core::RandomStream& stream, int frames, double most_spin, const Noise& noise) {
  const Vector3d v = Vector3d(1.0, 0.3, 0.5) + 0.3 * geometry::normal_vector(stream);
  const Vector3d axis = geometry::normal_vector(stream).normalized();
  const Vector3d spin = most_spin * stream.uniform(0.3, 1.0) * axis;
  const Quaterniond start = geometry::exp_rotation(2.0 * geometry::normal_vector(stream));
  std::vector<TimedPose> poses;
  for (int i = 0; i < frames; ++i) {
    const double t = i / 148.0;
    const Quaterniond R = top(start, spin, t);
    const Vector3d origin = Vector3d(0.1, 0.2, 0.3) + v * t + 0.5 * t * t * kGravity - R * kCenter;
    poses.push_back({3.0 + t,
                     {R * geometry::exp_rotation(noise.rotation * geometry::normal_vector(stream)),
                      origin + noise.position * geometry::normal_vector(stream)}});
  }
  return poses;
}

std::vector<std::vector<TimedPose>> flights(core::RandomStream& stream, int count, int frames, double most_spin,
                                            const Noise& noise) {
  std::vector<std::vector<TimedPose>> all;
  for (int i = 0; i < count; ++i) all.push_back(flight(stream, frames, most_spin, noise));
  return all;
}

core::Result<FlightCalibration> calibrated(const std::vector<std::vector<TimedPose>>& flights,
                                           const FlightPrior& prior = {}) {
  const std::vector<std::span<const TimedPose>> spans(flights.begin(), flights.end());
  return calibrate_flights(spans, prior);
}

/// Estimates less what is true, in the order of FlightParameter.
Eigen::Matrix<double, kFlightParameters, 1> errors_of(const FlightCalibration& found) {
  Eigen::Matrix<double, kFlightParameters, 1> errors;
  const double stretch = -std::log(kAxisRatio) / 3.0;  // of x and of y
  errors << found.center_of_mass - kCenter, found.gravity_W - kGravity, std::log(found.inertia_stretch.x()) - stretch,
      std::log(found.inertia_stretch.y()) - stretch;
  return errors;
}

TEST(FlightCalibration, RecoversExactFlights) {
  core::RandomStream stream(1, core::Purpose::kTest);
  FlightPrior vague;
  vague.center_of_mass_deviation = 1.0;
  vague.gravity_deviation = 100.0;
  vague.inertia_deviation = 10.0;
  const auto found = calibrated(flights(stream, 10, 15, 15.0, {}), vague);
  ASSERT_TRUE(found.ok()) << found.status().message();
  const auto errors = errors_of(*found);
  EXPECT_LT(errors.head<3>().norm(), 1e-7);
  EXPECT_LT(errors.segment<3>(3).norm(), 1e-5);
  EXPECT_LT(errors.tail<2>().norm(), 1e-4);
  EXPECT_LT(found->position_noise, 1e-7);
  EXPECT_EQ(found->flights, 10);
  EXPECT_EQ(found->frames, 150);
}

TEST(FlightCalibration, IntervalsHoldWhatTheyPromise) {
  constexpr int kSets = 80;
  constexpr int kFlights = 20;
  constexpr double kStudent90 = 1.729;  // of 19 degrees of freedom
  core::RandomStream stream(2, core::Purpose::kTest);
  int held = 0;
  for (int set = 0; set < kSets; ++set) {
    const auto found = calibrated(flights(stream, kFlights, 12, 10.0, {2e-4, 2e-3}));
    ASSERT_TRUE(found.ok()) << found.status().message();
    const auto deviations = found->covariance.diagonal().cwiseSqrt();
    const Eigen::Matrix<double, kFlightParameters, 1> standardized = errors_of(*found).cwiseQuotient(deviations);
    held += static_cast<int>((standardized.cwiseAbs().array() < kStudent90).count());
    EXPECT_NEAR(found->position_noise, 2e-4, 0.5e-4);
    EXPECT_NEAR(found->rotation_noise, 2e-3, 0.5e-3);
  }
  RecordProperty("held", held);
  EXPECT_NEAR(held / static_cast<double>(kSets * kFlightParameters), 0.9, 0.05);
}

TEST(FlightCalibration, StrayFramesHardlyCount) {
  core::RandomStream stream(3, core::Purpose::kTest);
  auto all = flights(stream, 30, 12, 10.0, {2e-4, 2e-3});
  const auto clean = calibrated(all);
  for (std::size_t i = 0; i < all.size(); i += 2) {
    all[i][3 + i % 6].X_WO.translation += 0.03 * geometry::normal_vector(stream);
    all[i][3 + i % 5].X_WO.rotation *= geometry::exp_rotation(0.2 * geometry::normal_vector(stream));
  }
  const auto found = calibrated(all);
  ASSERT_TRUE(clean.ok() && found.ok());
  EXPECT_LT((found->center_of_mass - kCenter).norm(), 4.0 * (clean->center_of_mass - kCenter).norm() + 1e-3);
  EXPECT_NEAR(found->position_noise, 2e-4, 1e-4);
}

TEST(FlightCalibration, SaysWhatFlightsWithoutSpinDoNotTell) {
  core::RandomStream stream(4, core::Purpose::kTest);
  FlightPrior prior;
  prior.center_of_mass_deviation = 0.01;
  const auto found = calibrated(flights(stream, 10, 12, 1e-3, {2e-4, 2e-3}), prior);
  ASSERT_TRUE(found.ok());
  for (const FlightParameter parameter : {FlightParameter::kCenterOfMassX, FlightParameter::kCenterOfMassY,
                                          FlightParameter::kCenterOfMassZ, FlightParameter::kInertiaX}) {
    EXPECT_EQ(found->left_of_prior[static_cast<int>(parameter)], 1.0);
  }
  EXPECT_EQ(found->center_of_mass, prior.center_of_mass);
  EXPECT_EQ(found->inertia_stretch, Vector3d::Ones());
  EXPECT_LT(found->left_of_prior[static_cast<int>(FlightParameter::kGravityZ)], 0.1);
}

TEST(FlightCalibration, PrintsNothingWhateverTheUnits) {
  for (const double unit : {1e3, 1e6, 1e160}) {
    core::RandomStream stream(4, core::Purpose::kTest);
    auto wild = flights(stream, 8, 32, 6.0, {2e-4, 2e-3});
    for (auto& poses : wild)
      for (TimedPose& pose : poses) pose.X_WO.translation *= unit;
    ::testing::internal::CaptureStderr();
    const auto found = calibrated(wild);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << unit;
    if (found.ok()) {
      EXPECT_TRUE(found->gravity_W.allFinite()) << unit;
    }
  }
}

TEST(FlightCalibration, RefusesWhatIsNoFlight) {
  core::RandomStream stream(5, core::Purpose::kTest);
  const auto good = flights(stream, 4, 12, 5.0, {1e-4, 1e-3});
  const auto message = [](const core::Result<FlightCalibration>& result) {
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : std::string(result.status().message());
  };
  EXPECT_THAT(message(calibrated({good[0], good[1]})), HasSubstr("only 2 flights"));
  auto bad = good;
  bad[2][4].time = bad[2][3].time;
  EXPECT_THAT(message(calibrated(bad)), HasSubstr("flight 2: the times do not ascend at pose 4"));
  bad = good;
  bad[1][5].X_WO.translation.x() = std::nan("");
  EXPECT_THAT(message(calibrated(bad)), HasSubstr("flight 1: pose 5 is not finite"));
  bad = good;
  bad[3][6].X_WO.rotation *= geometry::exp_rotation({2.0, 0.0, 0.0});
  EXPECT_THAT(message(calibrated(bad)), HasSubstr("quarter turn before pose 6"));
  FlightPrior prior;
  prior.inertia_deviation = 0.0;
  EXPECT_THAT(message(calibrated(good, prior)), HasSubstr("inertia"));
  prior = {};
  prior.unit_inertia = Vector3d(1.0, -1.0, 1.0).asDiagonal();
  EXPECT_THAT(message(calibrated(good, prior)), HasSubstr("positive definite"));
}

}  // namespace
}  // namespace prescene::tests::flight_calibration_test
