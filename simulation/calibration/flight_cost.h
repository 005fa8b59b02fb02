// SPDX-License-Identifier: Apache-2.0
// What Ceres makes small to find the motion of flights, and what they share.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>

#include "observed_flight.h"

namespace prescene::simulation {

/// Weighted errors of a flight's poses, six a frame, under centre of mass (3), gravity (3), the logarithms of the
/// inertia's stretch (2) and the flight's own motion. Keeps a reference to the flight. What is not finite fails the
/// evaluation, which the solver takes as a step too far, and says nothing.
std::unique_ptr<ceres::CostFunction> flight_cost(const ObservedFlight& flight, const geometry::Matrix3d& unit_inertia);

/// Independent Gaussians. (Ceres has such a cost, but it frees in our code what its own has allocated.)
std::unique_ptr<ceres::CostFunction> gaussian_cost(Eigen::VectorXd mean, Eigen::VectorXd deviations);

}  // namespace prescene::simulation
