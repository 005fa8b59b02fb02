// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/flight_calibration.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "torque_free_motion.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;
using geometry::Vector3d;
using Parameters = Eigen::Matrix<double, kFlightParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kFlightParameters, kFlightParameters>;

// Of a flight at its middle frame: centre of mass and its velocity, turn from the tracked orientation, spin (body
// axes).
constexpr int kMotion = 12;
constexpr double kLongestStep = 0.15;  // rad
constexpr int kMostRounds = 8;
constexpr double kSettled = 0.01;  // Relative change of the noise that ends the rounds.
// Standardised errors of three coordinates beyond which a frame counts less: 3 % of good ones are.
constexpr double kHuber = 3.0;
// Of exact poses.
constexpr double kLeastNoise = 1e-9;

struct Frame {
  double time = 0.0;  // Since the middle frame, s.
  geometry::Pose X_WO;
  int steps = 1;  // From the frame before, or after for those before the middle.
  double position_weight = 0.0;
  double rotation_weight = 0.0;
};

struct Flight {
  std::vector<Frame> frames;
  std::size_t middle = 0;
  std::array<double, kMotion> motion{};
};

template <class T>
RelativeInertia<T> stretched(const Matrix3d& unit_inertia, const T* log_stretch) {
  using std::exp;
  const Eigen::Matrix<T, 3, 1> root(exp(T(0.5) * log_stretch[0]), exp(T(0.5) * log_stretch[1]),
                                    exp(T(-0.5) * (log_stretch[0] + log_stretch[1])));
  RelativeInertia<T> inertia;
  inertia.matrix = root.asDiagonal() * unit_inertia.cast<T>() * root.asDiagonal();
  const Eigen::Matrix<T, 3, 1> inverse_root = root.cwiseInverse();
  inertia.inverse = inverse_root.asDiagonal() * unit_inertia.inverse().cast<T>() * inverse_root.asDiagonal();
  return inertia;
}

/// Weighted errors of a flight's poses: three of the position and three of the orientation for each frame.
class FlightErrors {
 public:
  FlightErrors(const Flight& flight, const Matrix3d& unit_inertia) : flight_(&flight), unit_inertia_(unit_inertia) {}

  template <class T>
  bool operator()(const T* center_of_mass, const T* gravity, const T* log_stretch, const T* motion, T* errors) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const RelativeInertia<T> inertia = stretched(unit_inertia_, log_stretch);
    const Eigen::Map<const Vector3> c(center_of_mass), g(gravity), p(motion), v(motion + 3), spin(motion + 9);
    const Eigen::Quaterniond& tracked = flight_->frames[flight_->middle].X_WO.rotation;
    const T from[4] = {T(tracked.w()), T(tracked.x()), T(tracked.y()), T(tracked.z())};
    T turn[4];
    ceres::AngleAxisToQuaternion(motion + 6, turn);
    Rotating<T> start;
    ceres::QuaternionProduct(from, turn, start.rotation.data());
    start.spin = spin;

    const auto put = [&](std::size_t i, const Rotating<T>& state) {
      const Frame& frame = flight_->frames[i];
      const T t(frame.time);
      Vector3 arm;
      ceres::UnitQuaternionRotatePoint(state.rotation.data(), c.data(), arm.data());
      const Vector3 origin = p + t * v + T(0.5) * t * t * g - arm;
      Eigen::Map<Vector3> of_position(errors + 6 * i), of_rotation(errors + 6 * i + 3);
      of_position = T(frame.position_weight) * (origin - frame.X_WO.translation.cast<T>());
      const Eigen::Quaterniond& seen = frame.X_WO.rotation;
      const T inverse[4] = {T(seen.w()), T(-seen.x()), T(-seen.y()), T(-seen.z())};
      T between[4];
      ceres::QuaternionProduct(inverse, state.rotation.data(), between);
      const T sign(between[0] < T(0.0) ? -2.0 : 2.0);
      for (int k = 0; k < 3; ++k) of_rotation[k] = T(frame.rotation_weight) * sign * between[k + 1];
    };
    put(flight_->middle, start);
    Rotating<T> state = start;
    for (std::size_t i = flight_->middle + 1; i < flight_->frames.size(); ++i) {
      const Frame& frame = flight_->frames[i];
      state = rotated(state, inertia, frame.time - flight_->frames[i - 1].time, frame.steps);
      put(i, state);
    }
    state = start;
    for (std::size_t i = flight_->middle; i-- > 0;) {
      const Frame& frame = flight_->frames[i];
      state = rotated(state, inertia, frame.time - flight_->frames[i + 1].time, frame.steps);
      put(i, state);
    }
    return true;
  }

 private:
  const Flight* flight_;
  Matrix3d unit_inertia_;
};

using FlightCost = ceres::AutoDiffCostFunction<FlightErrors, ceres::DYNAMIC, 3, 3, 2, kMotion>;

/// Independent Gaussians. (Ceres has such a cost, but it frees in our code what its own has allocated.)
class Prior final : public ceres::CostFunction {
 public:
  Prior(Eigen::VectorXd mean, Eigen::VectorXd deviations) : mean_(std::move(mean)), deviations_(std::move(deviations)) {
    set_num_residuals(static_cast<int>(mean_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<std::int32_t>(mean_.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index size = mean_.size();
    const Eigen::Map<const Eigen::VectorXd> values(parameters[0], size);
    Eigen::Map<Eigen::VectorXd>(residuals, size) = (values - mean_).cwiseQuotient(deviations_);
    if (jacobians && jacobians[0]) {
      using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<Jacobian>(jacobians[0], size, size) = deviations_.cwiseInverse().asDiagonal();
    }
    return true;
  }

 private:
  Eigen::VectorXd mean_, deviations_;
};

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
  if ((J - J.transpose()).cwiseAbs().maxCoeff() > 1e-9 * J.cwiseAbs().maxCoeff() || J.llt().info() != Eigen::Success)
    return core::invalid_input("the prior's inertia is not symmetric and positive definite");
  return core::ok_status();
}

core::Result<Flight> make_flight(std::span<const TimedPose> poses, std::size_t number) {
  const std::string place = "flight " + std::to_string(number);
  Flight flight;
  flight.middle = poses.size() / 2;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!std::isfinite(poses[i].time) || !poses[i].X_WO.is_finite())
      return core::invalid_input(place + ": pose " + std::to_string(i) + " is not finite");
    Frame frame;
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
      const int steps = 1 + static_cast<int>(turn / kLongestStep);
      frame.steps = steps;
      // What lies before the middle is reached from the frame after it.
      if (i <= flight.middle) flight.frames.back().steps = steps;
    }
    flight.frames.push_back(std::move(frame));
  }
  return flight;
}

/// Where the motion starts: straight lines between the frames about the middle.
void guess_motion(const FlightPrior& prior, Flight* flight) {
  const Frame& before = flight->frames[flight->middle - 1];
  const Frame& at = flight->frames[flight->middle];
  const Frame& after = flight->frames[flight->middle + 1];
  const double span = after.time - before.time;
  const Vector3d p = at.X_WO * prior.center_of_mass;
  const Vector3d v = (after.X_WO * prior.center_of_mass - before.X_WO * prior.center_of_mass) / span;
  const Vector3d spin = geometry::log_rotation(before.X_WO.rotation.conjugate() * after.X_WO.rotation) / span;
  Eigen::Map<Vector3d>(flight->motion.data()) = p;
  Eigen::Map<Vector3d>(flight->motion.data() + 3) = v;
  Eigen::Map<Vector3d>(flight->motion.data() + 6).setZero();
  Eigen::Map<Vector3d>(flight->motion.data() + 9) = spin;
}

double median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

/// The estimation under way.
class FlightFit {
 public:
  FlightFit(std::vector<Flight> flights, const FlightPrior& prior) : prior_(prior), flights_(std::move(flights)) {
    Eigen::Map<Vector3d>(values_.data()) = prior.center_of_mass;
    Eigen::Map<Vector3d>(values_.data() + 3) = prior.gravity_W;
    deviations_ << Vector3d::Constant(prior.center_of_mass_deviation), Vector3d::Constant(prior.gravity_deviation),
        prior.inertia_deviation, prior.inertia_deviation;
    for (Flight& flight : flights_) {
      guess_motion(prior, &flight);
      costs_.push_back(std::make_unique<FlightCost>(new FlightErrors(flight, prior.unit_inertia),
                                                    static_cast<int>(6 * flight.frames.size())));
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
    FlightCalibration found;
    found.center_of_mass = Eigen::Map<const Vector3d>(values_.data());
    found.gravity_W = Eigen::Map<const Vector3d>(values_.data() + 3);
    found.inertia_stretch = {std::exp(values_[6]), std::exp(values_[7]), std::exp(-values_[6] - values_[7])};
    found.covariance = covariance();
    found.left_of_prior = found.covariance.diagonal().cwiseSqrt().cwiseQuotient(deviations_);
    found.position_noise = position_noise_;
    found.rotation_noise = rotation_noise_;
    found.flights = static_cast<int>(flights_.size());
    for (const Flight& flight : flights_) found.frames += static_cast<int>(flight.frames.size());
    return found;
  }

 private:
  std::array<double*, 4> blocks(Flight& flight) {
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
    std::vector<std::unique_ptr<Prior>> priors;
    const auto hold = [&](int first, int size, const Eigen::VectorXd& mean) {
      priors.push_back(std::make_unique<Prior>(mean, deviations_.segment(first, size)));
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
    solver.function_tolerance = 1e-10;
    solver.parameter_tolerance = 1e-10;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary.IsSolutionUsable();
  }

  void weigh_all_alike() {
    // Turns count like shifts a tenth of a metre away.
    position_noise_ = 1e-3;
    rotation_noise_ = 1e-2;
    for (Flight& flight : flights_) {
      for (Frame& frame : flight.frames) {
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
        const Frame& frame = flights_[i].frames[k];
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
    const double freed = std::sqrt(all / (all - 0.5 * kMotion * static_cast<double>(flights_.size())));
    position_noise_ = std::max(kLeastNoise, 1.4826 * freed * median(&of_positions));
    rotation_noise_ = std::max(kLeastNoise, 1.4826 * freed * median(&of_rotations));
    const auto weight = [](const double* error, double noise) {
      const double size = Eigen::Map<const Vector3d>(error).norm() / noise;
      return std::sqrt(size > kHuber ? kHuber / size : 1.0) / noise;
    };
    for (std::size_t i = 0; i < flights_.size(); ++i) {
      for (std::size_t k = 0; k < flights_[i].frames.size(); ++k) {
        Frame& frame = flights_[i].frames[k];
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
    const Flight& flight = flights_[i];
    const auto rows = static_cast<Eigen::Index>(6 * flight.frames.size());
    Eigen::VectorXd errors(rows);
    using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::array<Jacobian, 4> parts;
    std::array<double*, 4> pointers{};
    const std::array<Eigen::Index, 4> columns = {3, 3, 2, kMotion};
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
    const Eigen::MatrixXd own_information = own.transpose() * own;
    const Eigen::MatrixXd coupling = shared.transpose() * own;
    const Eigen::LDLT<Eigen::MatrixXd> solver(own_information);
    Say say;
    say.information = shared.transpose() * shared - coupling * solver.solve(coupling.transpose());
    say.score = shared.transpose() * errors - coupling * solver.solve(own.transpose() * errors);
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
    const ParameterMatrix inverse = information.inverse();
    // As if each flight were left out in turn [MacKinnon & White 1985]: few flights are not overconfident then.
    ParameterMatrix spread = prior;
    for (const Say& say : says) {
      const ParameterMatrix others = ParameterMatrix::Identity() - say.information * inverse;
      const Parameters score = others.partialPivLu().solve(say.score);
      spread += score * score.transpose();
    }
    return inverse * spread * inverse;
  }

  const FlightPrior& prior_;
  std::vector<Flight> flights_;
  std::vector<std::unique_ptr<FlightCost>> costs_;
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
  std::vector<Flight> used;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    if (flights[i].size() < kLeastFlightFrames) continue;
    PRESCENE_TRY(Flight flight, make_flight(flights[i], i));
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
