// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/distance_probability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::collision {

namespace {

using std::numbers::pi;

// Fitted for the least largest error with few points: spacing of the points and how soon the hyperbola turns into its
// asymptote, both in units of the saddle's width. Points 6: 3e-4; 8: 5e-5; 16: 8e-6 (each with its own best spacing).
constexpr int kPoints = 6;
constexpr double kSpacing = 1.1;
constexpr double kBend = 3.0;
// Deviations below this share of the radius are raised to it: the probability changes by less than 1e-6 unless the
// mean's distance is that close to the radius, and the saddle point stays finite.
constexpr double kLeastSpread = 1e-7;

/// |x|^2 / radius^2 = sum of (m_i + s_i z_i)^2: the squares of both.
struct Quadratic {
  std::array<double, 3> variance;
  std::array<double, 3> mean;
};

/// Derivatives of g(s) = s + log E[exp(-s |x|^2)] - log s on the positive half line.
struct Slopes {
  double first;
  double second;
  double third;
};

Slopes slopes(const Quadratic& q, double s) {
  Slopes d = {1.0 - 1.0 / s, 1.0 / (s * s), -2.0 / (s * s * s)};
  for (std::size_t i = 0; i < 3; ++i) {
    const double shrink = 1.0 / (1.0 + 2.0 * q.variance[i] * s);
    const double v = q.variance[i] * shrink;
    const double m = q.mean[i] * shrink * shrink;
    d.first -= v + m;
    d.second += (2.0 * v + 4.0 * m) * v;
    d.third -= (8.0 * v + 24.0 * m) * v * v;
  }
  return d;
}

/// A point near the minimum of g. Where exactly the contour passes matters little: a tenth is enough.
double saddle_point(const Quadratic& q) {
  double excess = -1.0;  // E|x|^2 - 1
  double spread = 0.0;   // Var|x|^2
  for (std::size_t i = 0; i < 3; ++i) {
    excess += q.mean[i] + q.variance[i];
    spread += q.variance[i] * (2.0 * q.variance[i] + 4.0 * q.mean[i]);
  }
  const double root = std::sqrt(excess * excess + 4.0 * spread);
  double s = std::max(1.0, excess < 0.0 ? 2.0 / (root - excess) : (root + excess) / (2.0 * spread));
  for (int i = 0; i < 30; ++i) {
    const Slopes d = slopes(q, s);
    const double curvature = -0.5 * d.first * d.third / (d.second * d.second);
    double next = s - d.first / (d.second * (1.0 + std::clamp(curvature, -0.5, 0.5)));
    if (next < 1.0) next = 0.5 * (1.0 + s);  // g' is negative at 1
    if (std::abs(next - s) < 0.1 * s) return next;
    s = next;
  }
  return s;
}

struct Complex {
  double re;
  double im;
};
Complex operator*(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
Complex divided(Complex a, Complex b) {
  const double inverse = 1.0 / (b.re * b.re + b.im * b.im);
  return {(a.re * b.re + a.im * b.im) * inverse, (a.im * b.re - a.re * b.im) * inverse};
}

/// Square root of w = w12 * w3 whose argument is half the sum of the factors' own: each factor lies in the upper half
/// plane, so that the sum can pass pi, where the principal root would jump.
Complex continued_root(Complex w, Complex w12) {
  const double size = std::sqrt(w.re * w.re + w.im * w.im);
  const double large = std::sqrt(0.5 * (size + std::abs(w.re)));
  const double small = large > 0.0 ? 0.5 * std::abs(w.im) / large : 0.0;
  Complex root = w.re >= 0.0 ? Complex{large, small} : Complex{small, large};
  if (w.im < 0.0) root.im = -root.im;
  const bool turned = w12.im >= 0.0 ? root.im < 0.0 : root.re > 0.0;
  return turned ? Complex{-root.re, -root.im} : root;
}

double contour_integral(const Quadratic& q) {
  const double s = saddle_point(q);
  const Slopes d = slopes(q, s);
  const double width = 1.0 / std::sqrt(d.second);
  const double step = kSpacing * width;
  const double bend = kBend * width;
  const double inverse_bend = 1.0 / bend;
  const double reach = -d.third / (3.0 * d.second) * bend * bend;  // curvature of the steepest path at the saddle
  double sum = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double u = (i + 0.5) * step;
    const double root = std::sqrt(1.0 + u * u * inverse_bend * inverse_bend);
    const Complex z = {s - reach * (root - 1.0), u};
    std::array<Complex, 3> w;
    for (std::size_t k = 0; k < 3; ++k) w[k] = {1.0 + 2.0 * q.variance[k] * z.re, 2.0 * q.variance[k] * z.im};
    const Complex w12 = w[0] * w[1];
    const Complex w13 = w[0] * w[2];
    const Complex w23 = w[1] * w[2];
    const Complex product = w12 * w[2];
    const Complex numerator = {q.mean[0] * w23.re + q.mean[1] * w13.re + q.mean[2] * w12.re,
                               q.mean[0] * w23.im + q.mean[1] * w13.im + q.mean[2] * w12.im};
    const Complex decay = z * divided(numerator, product);
    const Complex direction = {1.0, reach * u * inverse_bend * inverse_bend / root};
    const Complex factor = divided(direction, z * continued_root(product, w12));
    const double phase = z.im - decay.im;
    sum += std::exp(z.re - decay.re) * (std::cos(phase) * factor.re - std::sin(phase) * factor.im);
  }
  return std::clamp(sum * step / pi, 0.0, 1.0);
}

/// P(|X| <= half) for X ~ N(mean, deviation^2).
double interval_probability(double mean, double deviation, double half) {
  const double m = std::abs(mean);
  if (half < 0.0) return 0.0;
  if (deviation <= 0.0) return m <= half ? 1.0 : 0.0;
  return core::normal_cdf((half - m) / deviation) - core::normal_cdf((-half - m) / deviation);
}

}  // namespace

double isotropic_distance_probability(double distance, double deviation, double radius) {
  if (radius < 0.0) return 0.0;
  const double d = std::abs(distance);
  if (deviation <= 0.0) return d <= radius ? 1.0 : 0.0;
  const double r = radius / deviation;
  const double m = d / deviation;
  const double density = std::sqrt(0.5 / pi);
  if (m < 1e-4) {  // The limit of the formula below; the next term is of order m^2.
    const double central = 2.0 * core::normal_cdf(r) - 1.0 - 2.0 * r * density * std::exp(-0.5 * r * r);
    const double next = density * std::exp(-0.5 * r * r) * r * r * r / 3.0;
    return std::clamp(central - next * m * m, 0.0, 1.0);
  }
  const double wings = density / m * (std::exp(-0.5 * (r - m) * (r - m)) - std::exp(-0.5 * (r + m) * (r + m)));
  return std::clamp(core::normal_cdf(r - m) - core::normal_cdf(-r - m) - wings, 0.0, 1.0);
}

double distance_probability(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance, double radius) {
  if (radius <= 0.0) return radius == 0.0 && mean.isZero(0.0) && covariance.trace() <= 0.0 ? 1.0 : 0.0;
  const auto [values, vectors] = geometry::symmetric_eigen_3(covariance);
  const Eigen::Vector3d variance = values.cwiseMax(0.0);
  const double largest = std::sqrt(variance[2]);
  const double distance = mean.norm();
  const double slack = radius - distance;
  // All but 4e-7 of the noise is within 5.7 of its largest deviations.
  if (std::abs(slack) >= 5.7 * largest) return slack >= 0.0 ? 1.0 : 0.0;
  if (variance[0] > 0.9999 * variance[2])
    return isotropic_distance_probability(distance, std::sqrt(variance[1]), radius);
  const Eigen::Vector3d along = vectors.transpose() * mean;
  const double scale = 1.0 / (radius * radius);
  Quadratic q{};
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    q.variance[k] = std::max(variance[i] * scale, kLeastSpread * kLeastSpread);
    q.mean[k] = along[i] * along[i] * scale;
  }
  return contour_integral(q);
}

ProbabilityBounds distance_probability_bounds(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance,
                                              double radius) {
  ProbabilityBounds bounds = {0.0, 0.0};
  if (radius < 0.0) return bounds;
  const double distance = mean.norm();
  const Eigen::Vector3d n = distance > 0.0 ? Eigen::Vector3d(mean / distance) : Eigen::Vector3d::UnitX();
  const double along_variance = std::max(0.0, n.dot(covariance * n));
  const double along = std::sqrt(along_variance);
  bounds.upper = interval_probability(distance, along, radius);
  // The part across the mean is centred. With both its deviations raised to the larger one it would be long more often
  // [Anderson 1955], and then P(length > q) = exp(-q^2 / (2 largest)).
  const double half_across = 0.5 * std::max(0.0, covariance.trace() - along_variance);
  const double squares =
      covariance.squaredNorm() - 2.0 * (covariance * n).squaredNorm() + along_variance * along_variance;
  const double largest = half_across + std::sqrt(std::max(0.0, 0.5 * squares - half_across * half_across));
  for (const double tail : {3e-4, 1e-2, 0.1}) {
    const double half_squared = radius * radius + 2.0 * std::log(tail) * largest;
    if (half_squared < 0.0) continue;
    const double missed = largest > 0.0 ? tail : 0.0;
    bounds.lower = std::max(bounds.lower, interval_probability(distance, along, std::sqrt(half_squared)) - missed);
  }
  // Each coordinate alone must be within the radius.
  for (int i = 0; i < 3; ++i) {
    const double deviation = std::sqrt(std::max(0.0, covariance(i, i)));
    bounds.upper = std::min(bounds.upper, interval_probability(mean[i], deviation, radius));
  }
  bounds.lower = std::clamp(bounds.lower, 0.0, bounds.upper);
  return bounds;
}

double joint_upper_tail(double h, double k, double correlation) {
  const double rho = std::clamp(correlation, -1.0, 1.0);
  const double independent = core::normal_cdf(-h) * core::normal_cdf(-k);
  if (rho == 0.0) return independent;
  // d/d rho of the probability is the density at (h, k), with rho = sin t. It changes quickest where cos t is small, so
  // the panels shrink towards the far end. Gauss-Legendre with five points each.
  constexpr std::array<double, 5> kNodes = {-0.906179845938664, -0.5384693101056831, 0.0, 0.5384693101056831,
                                            0.906179845938664};
  constexpr std::array<double, 5> kWeights = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                              0.4786286704993665, 0.2369268850561891};
  const double end = std::asin(rho);
  double sum = 0.0;
  double remaining = 1.0;
  for (int panel = 0; panel < 12; ++panel) {
    const double width = panel < 11 ? 0.5 * remaining : remaining;
    for (std::size_t i = 0; i < kNodes.size(); ++i) {
      const double t = end * (1.0 - remaining + 0.5 * width * (1.0 + kNodes[i]));
      const double sine = std::sin(t);
      const double cosine_squared = 1.0 - sine * sine;
      const double exponent = (h * h + k * k - 2.0 * h * k * sine) / (2.0 * cosine_squared);
      if (exponent < 700.0) sum += kWeights[i] * width * std::exp(-exponent);
    }
    remaining -= width;
  }
  return std::clamp(independent + sum * 0.5 * end / (2.0 * pi), 0.0, 1.0);
}

namespace {

struct Tail {
  double probability;
  double density;
};
Tail tail_of_six(double radius) {
  const double half = 0.5 * radius * radius;
  const double decay = std::exp(-half);
  return {decay * (1.0 + half + 0.5 * half * half), decay * half * half * radius * 0.5};
}
Tail tail_of_three(double radius) {
  const double density = std::sqrt(2.0 / pi) * std::exp(-0.5 * radius * radius);
  return {2.0 * core::normal_cdf(-radius) + density * radius, density * radius * radius};
}

/// Newton's iteration on the logarithm of the tail, which is concave: from the far side it comes down monotonically.
template <class TailAt>
double radius_of(double probability, double start, TailAt tail_at) {
  if (probability >= 1.0) return 0.0;
  double radius = start;
  for (int i = 0; i < 50; ++i) {
    const Tail tail = tail_at(radius);
    const double step = std::log(tail.probability / probability) * tail.probability / tail.density;
    radius = std::max(radius + step, 0.5 * radius);
    if (std::abs(step) < 1e-12 * radius) break;
  }
  return radius;
}

}  // namespace

double six_dimensional_tail(double radius) { return radius <= 0.0 ? 1.0 : tail_of_six(radius).probability; }

double six_dimensional_radius(double probability) {
  return radius_of(probability, std::sqrt(6.0 - 2.0 * std::log(probability)), tail_of_six);
}

double three_dimensional_radius(double probability) {
  return radius_of(probability, std::sqrt(3.0 - 2.0 * std::log(probability)), tail_of_three);
}

}  // namespace prescene::collision
