// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/distribution.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::belief {
namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

std::size_t index_of(double uniform, std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(uniform * static_cast<double>(count)));
}

double standard_normal_density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }

// A cut normal in standard coordinates, turned so that its heavier tail lies below zero: differences of the
// distribution function lose no digits there.
struct StandardCut {
  double low, high;
  bool turned;
};

StandardCut standard_cut(const NormalScalar& normal) {
  const double low = (normal.low - normal.mean) / normal.standard_deviation;
  const double high = (normal.high - normal.mean) / normal.standard_deviation;
  return low > 0.0 ? StandardCut{-high, -low, true} : StandardCut{low, high, false};
}

double draw_normal(const NormalScalar& normal, double uniform) {
  const StandardCut cut = standard_cut(normal);
  const double from = core::normal_cdf(cut.low);
  const double to = core::normal_cdf(cut.high);
  // Beyond some 38 deviations nothing is left of the density: all that is known is the nearer end.
  const double z =
      to > from ? core::inverse_normal_cdf(from + (cut.turned ? 1.0 - uniform : uniform) * (to - from)) : cut.high;
  const double x = normal.mean + normal.standard_deviation * (cut.turned ? -z : z);
  return std::clamp(x, normal.low, normal.high);
}

// Mean and variance of a standard normal cut to [low, high].
std::pair<double, double> cut_moments(const StandardCut& cut) {
  const double mass = core::normal_cdf(cut.high) - core::normal_cdf(cut.low);
  if (!(mass > 0.0)) return {cut.high, 0.0};
  const double at_low = standard_normal_density(cut.low), at_high = standard_normal_density(cut.high);
  const double first = (at_low - at_high) / mass;
  const double low_term = std::isfinite(cut.low) ? cut.low * at_low : 0.0;
  const double high_term = std::isfinite(cut.high) ? cut.high * at_high : 0.0;
  return {first, std::max(0.0, 1.0 + (low_term - high_term) / mass - first * first)};
}

bool is_fixed(const NormalScalar& normal) { return normal.standard_deviation == 0.0 || normal.low == normal.high; }
double fixed_value(const NormalScalar& normal) { return std::clamp(normal.mean, normal.low, normal.high); }

double mean_of(const std::vector<double>& samples) {
  double sum = 0.0;
  for (const double sample : samples) sum += sample;
  return sum / static_cast<double>(samples.size());
}

// Variance of a coordinate of the rotation vector of a uniform rotation: its angle has the density (1 - cos t) / pi on
// [0, pi], so the mean of t^2 is pi^2 / 3 + 2, a third of it for each axis.
constexpr double kUniformRotationVariance = (std::numbers::pi * std::numbers::pi / 3.0 + 2.0) / 3.0;

std::span<const double> take(std::span<const double>& uniforms, int count) {
  PRESCENE_CHECK(std::ssize(uniforms) >= count);
  const auto front = uniforms.first(static_cast<std::size_t>(count));
  uniforms = uniforms.subspan(static_cast<std::size_t>(count));
  return front;
}

Vector3d mean_position(const SampledPose& sampled) {
  Vector3d sum = Vector3d::Zero();
  for (const Pose& sample : sampled.samples) sum += sample.translation;
  return sum / static_cast<double>(sampled.samples.size());
}

// Quadratic in the samples; lists written by hand or by a filter are short.
Pose middle_of(const SampledPose& sampled) {
  std::size_t best = 0;
  double best_sum = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sampled.samples.size(); ++i) {
    double sum = 0.0;
    for (const Pose& other : sampled.samples) {
      const double angle = geometry::angle_between(sampled.samples[i].rotation, other.rotation);
      sum += angle * angle;
      if (sum >= best_sum) break;
    }
    if (sum < best_sum) {
      best_sum = sum;
      best = i;
    }
  }
  return {sampled.samples[best].rotation, mean_position(sampled)};
}

}  // namespace

int dimensions(const ScalarDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedScalar&) { return 0; },
                               [](const NormalScalar& normal) { return is_fixed(normal) ? 0 : 1; },
                               [](const UniformScalar& uniform) { return uniform.low == uniform.high ? 0 : 1; },
                               [](const SampledScalar& sampled) { return sampled.samples.size() == 1 ? 0 : 1; }},
                    distribution);
}

double draw(const ScalarDistribution& distribution, std::span<const double> uniforms) {
  if (dimensions(distribution) == 0) return mean(distribution);
  PRESCENE_CHECK(uniforms.size() == 1);
  const double u = uniforms[0];
  return std::visit(
      Overloaded{[](const FixedScalar& fixed) { return fixed.value; },
                 [u](const NormalScalar& normal) { return draw_normal(normal, u); },
                 [u](const UniformScalar& uniform) { return uniform.low + u * (uniform.high - uniform.low); },
                 [u](const SampledScalar& sampled) {
                   PRESCENE_CHECK(!sampled.samples.empty());
                   return sampled.samples[index_of(u, sampled.samples.size())];
                 }},
      distribution);
}

double mean(const ScalarDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedScalar& fixed) { return fixed.value; },
                               [](const NormalScalar& normal) {
                                 if (is_fixed(normal)) return fixed_value(normal);
                                 const StandardCut cut = standard_cut(normal);
                                 const double first = cut_moments(cut).first;
                                 const double x =
                                     normal.mean + normal.standard_deviation * (cut.turned ? -first : first);
                                 return std::clamp(x, normal.low, normal.high);
                               },
                               [](const UniformScalar& uniform) { return 0.5 * (uniform.low + uniform.high); },
                               [](const SampledScalar& sampled) {
                                 PRESCENE_CHECK(!sampled.samples.empty());
                                 return mean_of(sampled.samples);
                               }},
                    distribution);
}

double variance(const ScalarDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedScalar&) { return 0.0; },
                               [](const NormalScalar& normal) {
                                 if (is_fixed(normal)) return 0.0;
                                 return normal.standard_deviation * normal.standard_deviation *
                                        cut_moments(standard_cut(normal)).second;
                               },
                               [](const UniformScalar& uniform) {
                                 return (uniform.high - uniform.low) * (uniform.high - uniform.low) / 12.0;
                               },
                               [](const SampledScalar& sampled) {
                                 PRESCENE_CHECK(!sampled.samples.empty());
                                 const double middle = mean_of(sampled.samples);
                                 double sum = 0.0;
                                 for (const double sample : sampled.samples)
                                   sum += (sample - middle) * (sample - middle);
                                 return sum / static_cast<double>(sampled.samples.size());
                               }},
                    distribution);
}

double lowest(const ScalarDistribution& distribution) {
  return std::visit(
      Overloaded{[](const FixedScalar& fixed) { return fixed.value; },
                 [](const NormalScalar& normal) { return is_fixed(normal) ? fixed_value(normal) : normal.low; },
                 [](const UniformScalar& uniform) { return uniform.low; },
                 [](const SampledScalar& sampled) {
                   PRESCENE_CHECK(!sampled.samples.empty());
                   return *std::min_element(sampled.samples.begin(), sampled.samples.end());
                 }},
      distribution);
}

double highest(const ScalarDistribution& distribution) {
  return std::visit(
      Overloaded{[](const FixedScalar& fixed) { return fixed.value; },
                 [](const NormalScalar& normal) { return is_fixed(normal) ? fixed_value(normal) : normal.high; },
                 [](const UniformScalar& uniform) { return uniform.high; },
                 [](const SampledScalar& sampled) {
                   PRESCENE_CHECK(!sampled.samples.empty());
                   return *std::max_element(sampled.samples.begin(), sampled.samples.end());
                 }},
      distribution);
}

Vector3Distribution Vector3Distribution::fixed(const Vector3d& value) {
  return {FixedScalar{value.x()}, FixedScalar{value.y()}, FixedScalar{value.z()}};
}

int dimensions(const Vector3Distribution& distribution) {
  return dimensions(distribution.x) + dimensions(distribution.y) + dimensions(distribution.z);
}

Vector3d draw(const Vector3Distribution& distribution, std::span<const double> uniforms) {
  const double x = draw(distribution.x, take(uniforms, dimensions(distribution.x)));
  const double y = draw(distribution.y, take(uniforms, dimensions(distribution.y)));
  const double z = draw(distribution.z, take(uniforms, dimensions(distribution.z)));
  return {x, y, z};
}

Vector3d mean(const Vector3Distribution& distribution) {
  return {mean(distribution.x), mean(distribution.y), mean(distribution.z)};
}

Vector3d variance(const Vector3Distribution& distribution) {
  return {variance(distribution.x), variance(distribution.y), variance(distribution.z)};
}

Eigen::MatrixXd covariance_square_root(const Eigen::MatrixXd& covariance) {
  PRESCENE_CHECK(covariance.rows() == covariance.cols());
  const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(covariance);
  const Eigen::VectorXd& values = eigen.values;  // ascending
  const double largest = values.size() > 0 ? values[values.size() - 1] : 0.0;
  // Zero eigenvalues come out as some 1e-16 of the largest.
  const double threshold = 1e-13 * largest;
  Eigen::Index rank = 0;
  while (rank < values.size() && values[values.size() - 1 - rank] > threshold) ++rank;
  Eigen::MatrixXd root(covariance.rows(), rank);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index from = values.size() - 1 - i;
    root.col(i) = std::sqrt(values[from]) * eigen.vectors.col(from);
  }
  return root;
}

int dimensions(const PoseDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedPose&) { return 0; },
                               [](const NormalPose& normal) {
                                 return static_cast<int>(covariance_square_root(normal.covariance).cols());
                               },
                               [](const BoxPose& box) { return dimensions(box.position) + (box.any_rotation ? 3 : 0); },
                               [](const SampledPose& sampled) { return sampled.samples.size() == 1 ? 0 : 1; }},
                    distribution);
}

Pose draw(const PoseDistribution& distribution, std::span<const double> uniforms) {
  return std::visit(
      Overloaded{[](const FixedPose& fixed) { return fixed.X_WO; },
                 [uniforms](const NormalPose& normal) {
                   const Eigen::MatrixXd root = covariance_square_root(normal.covariance);
                   PRESCENE_CHECK(std::ssize(uniforms) == root.cols());
                   if (root.cols() == 0) return normal.mean;
                   Vector6d d = Vector6d::Zero();
                   for (Eigen::Index i = 0; i < root.cols(); ++i)
                     d += core::inverse_normal_cdf(uniforms[static_cast<std::size_t>(i)]) * root.col(i);
                   return geometry::box_plus(normal.mean, d);
                 },
                 [rest = uniforms](const BoxPose& box) mutable {
                   Pose X_WO{box.rotation, draw(box.position, take(rest, dimensions(box.position)))};
                   if (box.any_rotation) {
                     PRESCENE_CHECK(rest.size() == 3);
                     X_WO.rotation = X_WO.rotation * geometry::uniform_rotation({rest[0], rest[1], rest[2]});
                   }
                   return X_WO;
                 },
                 [uniforms](const SampledPose& sampled) {
                   PRESCENE_CHECK(!sampled.samples.empty());
                   if (sampled.samples.size() == 1) return sampled.samples[0];
                   PRESCENE_CHECK(uniforms.size() == 1);
                   return sampled.samples[index_of(uniforms[0], sampled.samples.size())];
                 }},
      distribution);
}

Pose mean(const PoseDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedPose& fixed) { return fixed.X_WO; },
                               [](const NormalPose& normal) { return normal.mean; },
                               [](const BoxPose& box) {
                                 return Pose{box.rotation, mean(box.position)};
                               },
                               [](const SampledPose& sampled) {
                                 PRESCENE_CHECK(!sampled.samples.empty());
                                 return middle_of(sampled);
                               }},
                    distribution);
}

Matrix6d covariance(const PoseDistribution& distribution) {
  return std::visit(Overloaded{[](const FixedPose&) -> Matrix6d { return Matrix6d::Zero(); },
                               [](const NormalPose& normal) -> Matrix6d { return normal.covariance; },
                               [](const BoxPose& box) -> Matrix6d {
                                 Vector6d diagonal = Vector6d::Zero();
                                 if (box.any_rotation) diagonal.head<3>().setConstant(kUniformRotationVariance);
                                 diagonal.tail<3>() = variance(box.position);
                                 return diagonal.asDiagonal();
                               },
                               [](const SampledPose& sampled) -> Matrix6d {
                                 PRESCENE_CHECK(!sampled.samples.empty());
                                 const Pose middle = middle_of(sampled);
                                 Matrix6d sum = Matrix6d::Zero();
                                 for (const Pose& sample : sampled.samples) {
                                   const Vector6d d = geometry::box_minus(sample, middle);
                                   sum += d * d.transpose();
                                 }
                                 return sum / static_cast<double>(sampled.samples.size());
                               }},
                    distribution);
}

int dimensions(const TwistDistribution& distribution) {
  return dimensions(distribution.angular) + dimensions(distribution.linear);
}

Twist draw(const TwistDistribution& distribution, std::span<const double> uniforms) {
  const Vector3d angular = draw(distribution.angular, take(uniforms, dimensions(distribution.angular)));
  const Vector3d linear = draw(distribution.linear, take(uniforms, dimensions(distribution.linear)));
  return {angular, linear};
}

Twist mean(const TwistDistribution& distribution) { return {mean(distribution.angular), mean(distribution.linear)}; }

Matrix6d covariance(const TwistDistribution& distribution) {
  Vector6d diagonal;
  diagonal << variance(distribution.angular), variance(distribution.linear);
  return diagonal.asDiagonal();
}

}  // namespace prescene::belief
