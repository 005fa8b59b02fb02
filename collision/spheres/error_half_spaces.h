// SPDX-License-Identifier: Apache-2.0
// Half-spaces in the space of the six normal numbers behind the error of a pose.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "prescene/collision/spheres/distance_probability.h"
#include "prescene/core/random.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// P(one of four half-spaces of errors is entered): u_i . z >= h_i. At most the sum less the overlaps along a path.
class ErrorHalfSpaces {
 public:
  void add(const geometry::Vector6d& gradient, double gap) {
    const double deviation = gradient.norm();
    const std::size_t i = count_++;
    unit_[i] =
        deviation > 0.0 ? geometry::Vector6d(gradient / deviation) : geometry::Vector6d(geometry::Vector6d::Zero());
    threshold_[i] = deviation > 0.0 ? gap / deviation : (gap > 0.0 ? 40.0 : -40.0);
  }
  double probability() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i) sum += core::normal_cdf(-threshold_[i]);
    for (std::size_t i = 1; i < count_; ++i) {
      // What is less than a thousandth of the sum is not worth the integral.
      const double least = core::normal_cdf(-std::max(threshold_[i - 1], threshold_[i]));
      if (least < 1e-3 * sum || sum < 1e-4) continue;
      constexpr double kError = 1e-6;  // of joint_upper_tail
      sum -= std::max(0.0, joint_upper_tail(threshold_[i - 1], threshold_[i], unit_[i - 1].dot(unit_[i])) - kError);
    }
    return std::min(1.0, sum);
  }

 private:
  std::array<geometry::Vector6d, 4> unit_;
  std::array<double, 4> threshold_{};
  std::size_t count_ = 0;
};

}  // namespace prescene::collision
