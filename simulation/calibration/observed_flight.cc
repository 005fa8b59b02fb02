// SPDX-License-Identifier: Apache-2.0
#include "observed_flight.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace prescene::simulation {
namespace {

// Of the rotation that is integrated at once, rad.
constexpr double kLongestInterval = 0.15;

}  // namespace

using geometry::Vector3d;

core::Result<ObservedFlight> observed_flight(std::span<const TimedPose> poses, std::size_t number) {
  const std::string place = "flight " + std::to_string(number);
  ObservedFlight flight;
  flight.middle = poses.size() / 2;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!std::isfinite(poses[i].time) || !poses[i].X_WO.is_finite())
      return core::invalid_input(place + ": pose " + std::to_string(i) + " is not finite");
    FlightFrame frame;
    frame.time = poses[i].time - poses[flight.middle].time;
    frame.X_WO = geometry::normalized(poses[i].X_WO);
    if (i > 0) {
      if (!(poses[i].time > poses[i - 1].time))
        return core::invalid_input(place + ": the times do not ascend at pose " + std::to_string(i));
      const double turn = geometry::angle_between(flight.frames.back().X_WO.rotation, frame.X_WO.rotation);
      if (turn > 0.5 * std::numbers::pi) {
        return core::invalid_input(place + ": more than a quarter turn before pose " + std::to_string(i) +
                                   "; give frames closer together");
      }
      const int steps = 1 + static_cast<int>(turn / kLongestInterval);
      frame.steps = steps;
      // What lies before the middle is reached from the frame after it.
      if (i <= flight.middle) flight.frames.back().steps = steps;
    }
    flight.frames.push_back(std::move(frame));
  }
  return flight;
}

void guess_motion(const Vector3d& center_of_mass, ObservedFlight* flight) {
  const FlightFrame& before = flight->frames[flight->middle - 1];
  const FlightFrame& at = flight->frames[flight->middle];
  const FlightFrame& after = flight->frames[flight->middle + 1];
  const double span = after.time - before.time;
  const Vector3d p = at.X_WO * center_of_mass;
  const Vector3d v = (after.X_WO * center_of_mass - before.X_WO * center_of_mass) / span;
  const Vector3d spin = geometry::log_rotation(before.X_WO.rotation.conjugate() * after.X_WO.rotation) / span;
  Eigen::Map<Vector3d>(flight->motion.data()) = p;
  Eigen::Map<Vector3d>(flight->motion.data() + 3) = v;
  Eigen::Map<Vector3d>(flight->motion.data() + 6).setZero();
  Eigen::Map<Vector3d>(flight->motion.data() + 9) = spin;
}

}  // namespace prescene::simulation
