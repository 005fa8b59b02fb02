// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/uncertain_sphere_queries.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "contact_bounds.h"
#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "uncertain_lanes.h"

namespace prescene::collision {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Vector6d;

// Any: the points are the same in every query, so that answers vary smoothly with their input.
constexpr std::uint64_t kLineSeed = 1;
// Pairs further apart carry 4e-4 of a deviation's force at most.
constexpr float kWrenchReach = 3.0F;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// A tensor that is symmetric in all of its three indices, from its entries i <= j <= k.
template <int N>
std::array<Eigen::Matrix<double, N, N>, std::size_t{N}> symmetric_tensor(const double* entries) {
  std::array<Eigen::Matrix<double, N, N>, std::size_t{N}> t;
  const auto at = [&](int i, int j, int k) -> double& { return t[static_cast<std::size_t>(i)](j, k); };
  for (int i = 0; i < N; ++i) {
    for (int j = i; j < N; ++j) {
      for (int k = j; k < N; ++k)
        at(i, j, k) = at(i, k, j) = at(j, i, k) = at(j, k, i) = at(k, i, j) = at(k, j, i) = *entries++;
    }
  }
  return t;
}

using LinePoints = std::array<Vector6d, ErrorLines::kCount>;

LinePoints line_points() {
  LinePoints points;
  const core::SobolNet net(6, kLineSeed);
  std::array<double, 6> uniform{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    net.point(i, uniform);
    for (std::size_t k = 0; k < 6; ++k) points[i][static_cast<Eigen::Index>(k)] = core::inverse_normal_cdf(uniform[k]);
  }
  return points;
}

}  // namespace

struct UncertainScratch::Memory {
  DescentStack stack;
  CriticalPairs critical;
  ErrorLines lines;
  TouchingIntervals intervals;
  LinePoints points = line_points();
};

void add_bending(const LocalSums& local, SymmetricTensor* bending) {
  const double* sums = local.sums.data();
  const double weight = sums[LocalSums::kWeight];
  if (weight <= 0.0) return;
  std::array<Matrix3d, 3> H = symmetric_tensor<3>(sums + LocalSums::kCubic);
  for (Matrix3d& of_i : H) of_i *= -3.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double b = sums[LocalSums::kBent + static_cast<std::size_t>(i)];
    H[static_cast<std::size_t>(i)] += b * Matrix3d::Identity();
    for (Eigen::Index j = 0; j < 3; ++j) {
      H[static_cast<std::size_t>(j)](i, j) += b;
      H[static_cast<std::size_t>(j)](j, i) += b;
    }
  }
  // m = lever * n at the mean place.
  Eigen::Matrix<double, 6, 3> lever;
  lever << cross_matrix(Eigen::Map<const Vector3d>(sums + LocalSums::kPlace) / weight), Matrix3d::Identity();
  for (std::size_t j = 0; j < 3; ++j) {
    const Matrix6d spread = lever * H[j] * lever.transpose();
    for (std::size_t i = 0; i < 6; ++i)
      (*bending)[i] += lever(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * spread;
  }
}

UncertainScratch::UncertainScratch() : memory_(std::make_unique<Memory>()) {}
UncertainScratch::~UncertainScratch() = default;
UncertainScratch::UncertainScratch(UncertainScratch&&) noexcept = default;
UncertainScratch& UncertainScratch::operator=(UncertainScratch&&) noexcept = default;

namespace {

/// Lines along the error that brings the most critical pair together, in the direction that closes its gap.
void set_lines(const CriticalPair& leader, const RelativeUncertainty& between, const LinePoints& points,
               ErrorLines* lines) {
  Vector6d direction = -between.displacement_at(leader.b).transpose() * leader.normal();
  const double length = direction.norm();
  direction = length > 0.0 ? Vector6d(direction / length) : Vector6d(Vector6d::Unit(0));
  for (std::size_t k = 0; k < 6; ++k) lines->direction[k] = static_cast<float>(direction[static_cast<Eigen::Index>(k)]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector6d across = points[i] - points[i].dot(direction) * direction;
    for (std::size_t k = 0; k < 6; ++k) lines->start[i][k] = static_cast<float>(across[static_cast<Eigen::Index>(k)]);
  }
}

void estimate(const TouchingIntervals& intervals, UncertainOverlap* overlap) {
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
    double p = 0.0;
    for (std::size_t i = 0; i < intervals.count[line]; ++i) {
      p += core::normal_cdf(static_cast<double>(intervals.high[line][i])) -
           core::normal_cdf(static_cast<double>(intervals.low[line][i]));
    }
    sum += p;
    squares += p * p;
  }
  constexpr double kCount = ErrorLines::kCount;
  const double mean = sum / kCount;
  overlap->probability = std::clamp(mean, overlap->lower, overlap->upper);
  overlap->probability_error = 2.0 * std::sqrt(std::max(0.0, squares / kCount - mean * mean) / (kCount - 1.0));
}

/// A symmetric matrix from its upper triangle.
Matrix6d symmetric(const double* upper) {
  Matrix6d m;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) m(i, j) = m(j, i) = *upper++;
  }
  return m;
}
/// Expected derivative of the wrench (force, torque) on B by the error (phi, tau), for unit stiffness.
Matrix6d wrench_gradient(const WrenchSums& sums) {
  const Matrix6d normal = symmetric(sums.sums.data() + WrenchSums::kNormal);
  Matrix6d gradient;  // Rows of (c, n) swap: the wrench is (n, c).
  gradient.topRows<3>() = -normal.bottomRows<3>();
  gradient.bottomRows<3>() = -normal.topRows<3>();
  const double* s = sums.sums.data() + WrenchSums::kSideways;
  const Matrix3d of_p = cross_matrix(Vector3d(s[1], s[2], s[3]));
  const Matrix3d of_a = cross_matrix(Vector3d(s[4], s[5], s[6]));
  Matrix3d outer;  // sum of w a p^T
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) outer(i, j) = s[7 + 3 * i + j];
  }
  // [a]x [p]x = p a^T - (a . p) I
  gradient.topLeftCorner<3, 3>() -= of_p;
  gradient.topRightCorner<3, 3>() += s[0] * Matrix3d::Identity();
  gradient.bottomLeftCorner<3, 3>() -= outer.transpose() - outer.trace() * Matrix3d::Identity();
  gradient.bottomRightCorner<3, 3>() += of_a;
  return gradient;
}

}  // namespace

UncertainOverlap uncertain_overlap(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                   UncertainScratch& scratch) {
  UncertainScratch::Memory& memory = scratch.memory();
  const Swelling swelling(between, b);
  memory.critical.pairs.size = 0;
  memory.critical.certain = false;
  find_critical_pairs(a, b, swelling, &memory.stack, &memory.critical);

  UncertainOverlap overlap;
  const ContactBounds bounds(a, b, between, memory.critical);
  overlap.lower = bounds.lower();
  overlap.upper = bounds.upper();
  overlap.critical_pairs = static_cast<std::uint32_t>(memory.critical.pairs.size);
  overlap.complete = memory.critical.complete;
  if (memory.critical.pairs.size == 0) return overlap;
  overlap.state = memory.critical.certain ? OverlapState::kCertain : OverlapState::kPossible;
  set_lines(bounds.leader(), between, memory.points, &memory.lines);
  intersect_lines(memory.critical, swelling, memory.lines, !memory.critical.complete, &memory.intervals);
  estimate(memory.intervals, &overlap);
  return overlap;
}

UncertainWrench uncertain_wrench(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                 double stiffness, UncertainScratch& scratch) {
  WrenchSums sums;
  sum_wrenches(a, b, Swelling(between, b), kWrenchReach, &scratch.memory().stack, &sums);

  UncertainWrench wrench;
  const Eigen::Map<const Vector6d> mean(sums.sums.data() + WrenchSums::kMean);
  wrench.force = -stiffness * mean.head<3>();  // n points to B
  wrench.torque = -stiffness * mean.tail<3>();
  wrench.expected_pairs = sums.pairs;
  const Matrix6d first = wrench_gradient(sums) * between.factor();
  const Matrix6d swapped = symmetric(sums.sums.data() + WrenchSums::kRest) * between.factor();
  Matrix6d rest;  // rows of (n, c) instead of (c, n)
  rest << swapped.bottomRows<3>(), swapped.topRows<3>();
  Matrix6d covariance = first * first.transpose() + rest * rest.transpose();
  // Second order: half the inner products of the second derivatives, each a matrix over the normal numbers.
  SymmetricTensor bend = symmetric_tensor<6>(sums.sums.data() + WrenchSums::kKink);
  for (std::size_t i = 0; i < 6; ++i)
    bend[i] = between.factor().transpose() * (bend[i] + sums.bending[i]) * between.factor();
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) +=
          0.5 * bend[(i + 3) % 6].cwiseProduct(bend[(j + 3) % 6]).sum();
    }
  }
  wrench.covariance = stiffness * stiffness * covariance;
  return wrench;
}

}  // namespace prescene::collision
