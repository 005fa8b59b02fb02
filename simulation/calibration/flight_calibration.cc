// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/flight_calibration.h"

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "flight_cost.h"
#include "observed_flight.h"
#include "prescene/core/order_statistics.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/simulation/calibration/keep_prior.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;
using geometry::Vector3d;
using Parameters = Eigen::Matrix<double, kFlightParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kFlightParameters, kFlightParameters>;

constexpr int kMostRounds = 8;
constexpr double kSettled = 0.01;  // Relative change of the noise that ends the rounds.
// Standardised errors of three coordinates beyond which a frame counts less: 3 % of good ones are.
constexpr double kHuber = 3.0;
// Of exact poses.
constexpr double kLeastNoise = 1e-9;

core::Status check(const FlightPrior& prior) {
  if (!prior.center_of_mass.allFinite() || !prior.gravity_W.allFinite() || !prior.unit_inertia.allFinite())
    return core::invalid_input("the prior of the flights is not finite");
  for (const auto& [deviation, name] :
       {std::pair(prior.center_of_mass_deviation, "centre of mass"), std::pair(prior.gravity_deviation, "gravity"),
        std::pair(prior.inertia_deviation, "inertia")}) {
    if (!(deviation > 0.0 && std::isfinite(deviation)))
      return core::invalid_input(std::string("the prior's deviation of the ") + name + " is not positive");
  }
  const Matrix3d& J = prior.unit_inertia;
  if ((J - J.transpose()).cwiseAbs().maxCoeff() > 1e-9 * J.cwiseAbs().maxCoeff() ||
      !(geometry::symmetric_eigen_3(J).values[0] > 0.0))
    return core::invalid_input("the prior's inertia is not symmetric and positive definite");
  return core::ok_status();
}

/// The estimation under way.
class FlightFit {
 public:
  FlightFit(std::vector<ObservedFlight> flights, const FlightPrior& prior)
      : prior_(prior), flights_(std::move(flights)) {
    Eigen::Map<Vector3d>(values_.data()) = prior.center_of_mass;
    Eigen::Map<Vector3d>(values_.data() + 3) = prior.gravity_W;
    deviations_ << Vector3d::Constant(prior.center_of_mass_deviation), Vector3d::Constant(prior.gravity_deviation),
        prior.inertia_deviation, prior.inertia_deviation;
    for (ObservedFlight& flight : flights_) {
      guess_motion(prior.center_of_mass, &flight);
      costs_.push_back(flight_cost(flight, prior.unit_inertia));
    }
  }

  /// Solves and weighs the frames anew until the noise settles.
  core::Status solve() {
    weigh_all_alike();
    for (int round = 0; round < kMostRounds; ++round) {
      if (!minimize())
        return core::invalid_input("no motion without torque fits the flights; are they free of contact?");
      const double position_before = position_noise_;
      const double rotation_before = rotation_noise_;
      weigh_by_errors();
      if (std::abs(position_noise_ - position_before) < kSettled * position_noise_ &&
          std::abs(rotation_noise_ - rotation_before) < kSettled * rotation_noise_)
        break;
    }
    return core::ok_status();
  }

  FlightCalibration result() const {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(kFlightParameters);
    mean.head<3>() = prior_.center_of_mass;
    mean.segment<3>(3) = prior_.gravity_W;
    Eigen::VectorXd values = Eigen::Map<const Parameters>(values_.data());
    Eigen::MatrixXd errors = covariance();
    keep_prior(mean, deviations_, &values, &errors);
    FlightCalibration found;
    found.center_of_mass = values.head<3>();
    found.gravity_W = values.segment<3>(3);
    found.inertia_stretch = {std::exp(values[6]), std::exp(values[7]), std::exp(-values[6] - values[7])};
    found.covariance = errors;
    found.left_of_prior = found.covariance.diagonal().cwiseSqrt().cwiseQuotient(deviations_);
    found.position_noise = position_noise_;
    found.rotation_noise = rotation_noise_;
    found.flights = static_cast<int>(flights_.size());
    for (const ObservedFlight& flight : flights_) found.frames += static_cast<int>(flight.frames.size());
    return found;
  }

 private:
  std::array<double*, 4> blocks(ObservedFlight& flight) {
    return {values_.data(), values_.data() + 3, values_.data() + 6, flight.motion.data()};
  }

  bool minimize() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < flights_.size(); ++i) {
      const std::array<double*, 4> all = blocks(flights_[i]);
      problem.AddResidualBlock(costs_[i].get(), nullptr, all[0], all[1], all[2], all[3]);
      order->AddElementToGroup(all[3], 0);
    }
    std::vector<std::unique_ptr<ceres::CostFunction>> priors;
    const auto hold = [&](int first, int size, const Eigen::VectorXd& mean) {
      priors.push_back(gaussian_cost(mean, deviations_.segment(first, size)));
      problem.AddResidualBlock(priors.back().get(), nullptr, values_.data() + first);
      order->AddElementToGroup(values_.data() + first, 1);
    };
    hold(0, 3, prior_.center_of_mass);
    hold(3, 3, prior_.gravity_W);
    hold(6, 2, Eigen::Vector2d::Zero());

    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = std::move(order);
    solver.logging_type = ceres::SILENT;
    solver.max_num_iterations = 50;
    // Ceres says on standard error, however silent it is to be, when it ends for these.
    solver.max_num_consecutive_invalid_steps = solver.max_num_iterations + 1;
    solver.function_tolerance = 1e-10;
    solver.parameter_tolerance = 1e-10;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary.IsSolutionUsable() &&
           (summary.termination_type == ceres::CONVERGENCE || summary.num_successful_steps > 0);
  }

  void weigh_all_alike() {
    // Turns count like shifts a tenth of a metre away.
    position_noise_ = 1e-3;
    rotation_noise_ = 1e-2;
    for (ObservedFlight& flight : flights_) {
      for (FlightFrame& frame : flight.frames) {
        frame.position_weight = 1.0 / position_noise_;
        frame.rotation_weight = 1.0 / rotation_noise_;
      }
    }
  }

  /// Noise from the median error, then Huber's weights.
  void weigh_by_errors() {
    std::vector<std::vector<double>> errors;
    std::vector<double> of_positions;
    std::vector<double> of_rotations;
    std::size_t frames = 0;
    for (std::size_t i = 0; i < flights_.size(); ++i) {
      const std::array<double*, 4> all = blocks(flights_[i]);
      std::vector<double>& own = errors.emplace_back(6 * flights_[i].frames.size());
      costs_[i]->Evaluate(all.data(), own.data(), nullptr);
      for (std::size_t k = 0; k < flights_[i].frames.size(); ++k) {
        const FlightFrame& frame = flights_[i].frames[k];
        for (std::size_t j = 0; j < 3; ++j) {
          own[6 * k + j] /= frame.position_weight;
          own[6 * k + 3 + j] /= frame.rotation_weight;
          of_positions.push_back(std::abs(own[6 * k + j]));
          of_rotations.push_back(std::abs(own[6 * k + 3 + j]));
        }
      }
      frames += flights_[i].frames.size();
    }
    // A normal number's median size; half of each flight's motion was fitted to either kind of error.
    const auto all = static_cast<double>(3 * frames);
    const double freed = std::sqrt(all / (all - 0.5 * kFlightMotion * static_cast<double>(flights_.size())));
    position_noise_ = std::max(kLeastNoise, 1.4826 * freed * core::upper_median(of_positions));
    rotation_noise_ = std::max(kLeastNoise, 1.4826 * freed * core::upper_median(of_rotations));
    const auto weight = [](const double* error, double noise) {
      const double size = Eigen::Map<const Vector3d>(error).norm() / noise;
      return std::sqrt(size > kHuber ? kHuber / size : 1.0) / noise;
    };
    for (std::size_t i = 0; i < flights_.size(); ++i) {
      for (std::size_t k = 0; k < flights_[i].frames.size(); ++k) {
        FlightFrame& frame = flights_[i].frames[k];
        frame.position_weight = weight(errors[i].data() + 6 * k, position_noise_);
        frame.rotation_weight = weight(errors[i].data() + 6 * k + 3, rotation_noise_);
      }
    }
  }

  /// With what a flight says of the parameters when its motion is fitted to it: information and score.
  struct Say {
    ParameterMatrix information;
    Parameters score;
  };
  Say say_of(std::size_t i) const {
    const ObservedFlight& flight = flights_[i];
    const auto rows = static_cast<Eigen::Index>(6 * flight.frames.size());
    Eigen::VectorXd errors(rows);
    using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::array<Jacobian, 4> parts;
    std::array<double*, 4> pointers{};
    const std::array<Eigen::Index, 4> columns = {3, 3, 2, kFlightMotion};
    for (std::size_t k = 0; k < parts.size(); ++k) {
      parts[k].resize(rows, columns[k]);
      pointers[k] = parts[k].data();
    }
    const std::array<const double*, 4> at = {values_.data(), values_.data() + 3, values_.data() + 6,
                                             flight.motion.data()};
    costs_[i]->Evaluate(at.data(), errors.data(), pointers.data());
    Eigen::MatrixXd shared(rows, kFlightParameters);
    shared << parts[0], parts[1], parts[2];
    const Jacobian& own = parts[3];
    const Eigen::MatrixXd own_information = geometry::product(own.transpose(), own);
    const Eigen::MatrixXd coupling = geometry::product(shared.transpose(), own);
    Say say;
    say.information = geometry::product(shared.transpose(), shared) -
                      geometry::product(coupling, geometry::solve_symmetric(own_information, coupling.transpose()));
    say.score = shared.transpose() * errors -
                geometry::product(coupling, geometry::solve_symmetric(own_information, own.transpose() * errors));
    return say;
  }

  ParameterMatrix covariance() const {
    const ParameterMatrix prior = deviations_.cwiseAbs2().cwiseInverse().asDiagonal();
    std::vector<Say> says;
    ParameterMatrix information = prior;
    for (std::size_t i = 0; i < flights_.size(); ++i) {
      says.push_back(say_of(i));
      information += says.back().information;
    }
    const ParameterMatrix inverse = geometry::inverse(information);
    // As if each flight were left out in turn [MacKinnon & White 1985]: few flights are not overconfident then.
    ParameterMatrix spread = prior;
    for (const Say& say : says) {
      const ParameterMatrix others = ParameterMatrix::Identity() - say.information * inverse;
      const Parameters score = geometry::solve(others, say.score);
      spread += score * score.transpose();
    }
    return geometry::product(geometry::product(inverse, spread), inverse);
  }

  const FlightPrior& prior_;
  std::vector<ObservedFlight> flights_;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs_;
  std::array<double, kFlightParameters> values_{};
  Parameters deviations_;
  double position_noise_ = 0.0;
  double rotation_noise_ = 0.0;
};

}  // namespace

Matrix3d FlightCalibration::unit_inertia(const FlightPrior& prior) const {
  const Vector3d root = inertia_stretch.cwiseSqrt();
  return root.asDiagonal() * prior.unit_inertia * root.asDiagonal();
}

core::Result<FlightCalibration> calibrate_flights(std::span<const std::span<const TimedPose>> flights,
                                                  const FlightPrior& prior) {
  PRESCENE_RETURN_IF_ERROR(check(prior));
  std::vector<ObservedFlight> used;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    if (flights[i].size() < kLeastFlightFrames) continue;
    PRESCENE_TRY(ObservedFlight flight, observed_flight(flights[i], i));
    used.push_back(std::move(flight));
  }
  if (used.size() < 3) {
    return core::invalid_input("only " + std::to_string(used.size()) + " flights of " +
                               std::to_string(kLeastFlightFrames) + " frames or more; record three at least");
  }
  FlightFit fit(std::move(used), prior);
  PRESCENE_RETURN_IF_ERROR(fit.solve());
  return fit.result();
}

}  // namespace prescene::simulation
