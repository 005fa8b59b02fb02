// SPDX-License-Identifier: Apache-2.0
#include "flight_cost.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/rotation.h>

#include <Eigen/LU>
#include <cstdint>
#include <utility>

#include "torque_free_motion.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;

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
  FlightErrors(const ObservedFlight& flight, const Matrix3d& unit_inertia)
      : flight_(&flight), unit_inertia_(unit_inertia) {}

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
      const FlightFrame& frame = flight_->frames[i];
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
      const FlightFrame& frame = flight_->frames[i];
      state = rotated(state, inertia, frame.time - flight_->frames[i - 1].time, frame.steps);
      put(i, state);
    }
    state = start;
    for (std::size_t i = flight_->middle; i-- > 0;) {
      const FlightFrame& frame = flight_->frames[i];
      state = rotated(state, inertia, frame.time - flight_->frames[i + 1].time, frame.steps);
      put(i, state);
    }
    return true;
  }

 private:
  const ObservedFlight* flight_;
  Matrix3d unit_inertia_;
};

class FlightCost final : public ceres::CostFunction {
 public:
  FlightCost(const ObservedFlight& flight, const Matrix3d& unit_inertia)
      : differentiated_(new FlightErrors(flight, unit_inertia), static_cast<int>(6 * flight.frames.size())) {
    set_num_residuals(differentiated_.num_residuals());
    for (const std::int32_t size : differentiated_.parameter_block_sizes())
      mutable_parameter_block_sizes()->push_back(size);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    if (!differentiated_.Evaluate(parameters, residuals, jacobians)) return false;
    const auto finite = [&](const double* numbers, Eigen::Index columns) {
      return Eigen::Map<const Eigen::VectorXd>(numbers, num_residuals() * columns).allFinite();
    };
    if (!finite(residuals, 1)) return false;
    if (!jacobians) return true;
    for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i)
      if (jacobians[i] && !finite(jacobians[i], parameter_block_sizes()[i])) return false;
    return true;
  }

 private:
  ceres::AutoDiffCostFunction<FlightErrors, ceres::DYNAMIC, 3, 3, 2, kFlightMotion> differentiated_;
};

class GaussianCost final : public ceres::CostFunction {
 public:
  GaussianCost(Eigen::VectorXd mean, Eigen::VectorXd deviations)
      : mean_(std::move(mean)), deviations_(std::move(deviations)) {
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

}  // namespace

std::unique_ptr<ceres::CostFunction> flight_cost(const ObservedFlight& flight, const Matrix3d& unit_inertia) {
  return std::make_unique<FlightCost>(flight, unit_inertia);
}

std::unique_ptr<ceres::CostFunction> gaussian_cost(Eigen::VectorXd mean, Eigen::VectorXd deviations) {
  return std::make_unique<GaussianCost>(std::move(mean), std::move(deviations));
}

}  // namespace prescene::simulation
