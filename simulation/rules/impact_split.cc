// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/impact_split.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

constexpr int kMostSplits = 16;
constexpr int kMostSplitObjects = 64;  ///< Objects times splits, of a step.

}  // namespace

double split_time(const Approach& approach, const MechanicsOptions& options) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double speed = approach.speed, gap = approach.gap;
  if (speed >= -options.restitution_speed) return kNever;
  if (-speed * options.step < kSplitTravel * approach.reach) return kNever;
  if (gap < -options.touching_distance) return kNever;
  if (gap <= 0.0) return 0.0;
  // gap + speed t + acceleration t^2 / 2 = 0
  const double discriminant = speed * speed - 2.0 * approach.acceleration * gap;
  return discriminant > 0.0 ? 2.0 * gap / (std::sqrt(discriminant) - speed) : kNever;
}

bool leans(const LeaningRim& rim) {
  const double upright = std::abs(rim.axis.dot(rim.normal));
  const double lying = std::sqrt(std::max(0.0, 1.0 - upright * upright));
  return lying > kFlatCap && upright > lying;
}

geometry::Vector3d lowest_of(const LeaningRim& rim) {
  return (rim.axis.dot(rim.normal) * rim.axis - rim.normal).normalized();
}

double roll_time(const LeaningRim& rim) {
  // What is above in the rim's plane, and how that turns about the axis.
  const geometry::Vector3d above = rim.normal - rim.axis.dot(rim.normal) * rim.axis;
  const double rate = std::abs(rim.axis.dot(above.cross(rim.spin.cross(rim.normal)))) / above.squaredNorm();
  return rate > 0.0 ? kSplitRoll / rate : std::numeric_limits<double>::infinity();
}

geometry::Vector3d lowest_of(const LeaningRim& rim, const RimPair& rims) {
  const double z = rim.axis.dot(rim.normal) > 0.0 ? rims.lower : rims.upper;
  return rims.middle + z * rim.axis + rims.radius * lowest_of(rim) - rims.rounding * rim.normal;
}

double roll_time(const LeaningRim& rim, const RimPair& rims, const geometry::Vector3d& point, double tolerance) {
  if (!leans(rim) || (point - lowest_of(rim, rims)).norm() > tolerance) return std::numeric_limits<double>::infinity();
  return roll_time(rim);
}

int parts_until(double time, double step, int left) {
  const double part = step / kStepParts;
  if (time >= part * left) return left;
  return std::clamp(static_cast<int>(time / part), 1, left);
}

int most_splits(int objects) { return std::min(kMostSplits, kMostSplitObjects / std::max(1, objects)); }

}  // namespace prescene::simulation
