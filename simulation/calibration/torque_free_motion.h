// SPDX-License-Identifier: Apache-2.0
// Rotation of a rigid body without torque, by Euler's equations, for any number type.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Core>
#include <cmath>

namespace prescene::simulation {

/// Orientation as a unit quaternion (w, x, y, z) and spin in the body's axes, rad/s.
template <class T>
struct Rotating {
  Eigen::Matrix<T, 4, 1> rotation;
  Eigen::Matrix<T, 3, 1> spin;
};

/// Moments of inertia up to a common factor, about the centre of mass, with its inverse.
template <class T>
struct RelativeInertia {
  Eigen::Matrix<T, 3, 3> matrix;
  Eigen::Matrix<T, 3, 3> inverse;
};

/// The state `seconds` later (or earlier), in `steps` steps of the classical Runge-Kutta method. A step of 0.15 rad is
/// off by less than 1e-6 rad.
template <class T>
Rotating<T> rotated(const Rotating<T>& start, const RelativeInertia<T>& inertia, double seconds, int steps) {
  using Vector3 = Eigen::Matrix<T, 3, 1>;
  using Vector4 = Eigen::Matrix<T, 4, 1>;
  const auto rate = [&](const Rotating<T>& state) {
    Rotating<T> slope;
    const Vector3 momentum = inertia.matrix * state.spin;
    slope.spin = inertia.inverse * momentum.cross(state.spin);
    const T spin[4] = {T(0.0), state.spin[0], state.spin[1], state.spin[2]};
    T product[4];
    ceres::QuaternionProduct(state.rotation.data(), spin, product);
    for (int i = 0; i < 4; ++i) slope.rotation[i] = T(0.5) * product[i];
    return slope;
  };
  const auto moved = [](const Rotating<T>& from, const Rotating<T>& slope, double time) {
    return Rotating<T>{Vector4(from.rotation + T(time) * slope.rotation), Vector3(from.spin + T(time) * slope.spin)};
  };
  const double h = seconds / steps;
  Rotating<T> state = start;
  for (int i = 0; i < steps; ++i) {
    const Rotating<T> k1 = rate(state);
    const Rotating<T> k2 = rate(moved(state, k1, 0.5 * h));
    const Rotating<T> k3 = rate(moved(state, k2, 0.5 * h));
    const Rotating<T> k4 = rate(moved(state, k3, h));
    state.rotation += T(h / 6.0) * (k1.rotation + T(2.0) * (k2.rotation + k3.rotation) + k4.rotation);
    state.spin += T(h / 6.0) * (k1.spin + T(2.0) * (k2.spin + k3.spin) + k4.spin);
    state.rotation.normalize();
  }
  return state;
}

}  // namespace prescene::simulation
