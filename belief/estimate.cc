// SPDX-License-Identifier: Apache-2.0
// What is read off the particles of an object: where it is, how surely, and where else it may be.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "prescene/belief/alternative_poses.h"
#include "prescene/belief/belief.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

using geometry::Matrix3d;

// What "is where the mean says" means in ObjectEstimate::confidence.
constexpr double kHereDistance = 0.02;                   // m
constexpr double kHereAngle = 15.0 * geometry::kDegree;  // rad
constexpr double kOneTurn = 30.0 * geometry::kDegree;    // rad; poses turned by no more ...
constexpr double kOnePlace = 0.05;                       // m; ... and no further apart are averaged
constexpr double kLeastProbability = 0.01;               // of an alternative that is told of

// Inverse of the right Jacobian of the rotation exponential: log(exp(phi) exp(e)) = phi + J e for small e.
Matrix3d inverse_right_jacobian(const Vector3d& phi) {
  const double angle = phi.norm();
  const Matrix3d cross = geometry::cross_matrix(phi);
  // The second is (1 + cos t) / (2 t sin t), written so that half a turn is no quotient of zeros; 1/12 for small t.
  const double c = angle < 1e-4 ? 1.0 / 12.0 : 1.0 / (angle * angle) - 1.0 / (2.0 * angle * std::tan(0.5 * angle));
  return Matrix3d::Identity() + 0.5 * cross + c * cross * cross;
}

Pose weighted_mean(const std::vector<Particle>& particles, const Pose& X_start) {
  Pose X_mean = X_start;
  // The rotation's mean is a fixed point; a few rounds settle it to rounding for spreads below a radian.
  for (int round = 0; round < 8; ++round) {
    Vector6d sum = Vector6d::Zero();
    for (const Particle& particle : particles)
      sum += std::exp(particle.log_weight) * geometry::box_minus(particle.X_WO, X_mean);
    X_mean = geometry::normalized(geometry::box_plus(X_mean, sum));
    if (sum.norm() < 1e-12) break;
  }
  return X_mean;
}

Matrix6d mixture_covariance(const std::vector<Particle>& particles, const Pose& X_mean) {
  Matrix6d sum = Matrix6d::Zero();
  for (const Particle& particle : particles) {
    const Vector6d d = geometry::box_minus(particle.X_WO, X_mean);
    Matrix6d to_mean = Matrix6d::Identity();
    to_mean.topLeftCorner<3, 3>() = inverse_right_jacobian(d.head<3>());
    const Matrix6d own = to_mean * particle.covariance.topLeftCorner<6, 6>() * to_mean.transpose();
    sum += std::exp(particle.log_weight) * (own + d * d.transpose());
  }
  return 0.5 * (sum + sum.transpose());
}

// Probability that a point with the normal distribution N(m, S) lies within `radius` of the origin, from the first
// three cumulants of its squared distance (Wilson-Hilferty for a shifted chi-square; error below 0.03).
double probability_within(const Vector3d& m, const Matrix3d& S, double radius) {
  const Matrix3d S2 = S * S;
  const double c1 = S.trace() + m.squaredNorm();
  const double c2 = 2.0 * S2.trace() + 4.0 * m.dot(S * m);
  const double c3 = 8.0 * (S2 * S).trace() + 24.0 * m.dot(S2 * m);
  if (!(c2 > 1e-24)) return m.norm() <= radius ? 1.0 : 0.0;
  const double h = 8.0 * c2 * c2 * c2 / (c3 * c3);
  const double y = (radius * radius - c1) * std::sqrt(2.0 * h / c2) + h;
  if (y <= 0.0) return 0.0;
  return core::normal_cdf((std::cbrt(y / h) - 1.0 + 2.0 / (9.0 * h)) / std::sqrt(2.0 / (9.0 * h)));
}

// The particles as the equivalents that are nearest to X_WR, with their covariances.
std::vector<Particle> aligned(const std::vector<Particle>& particles, const geometry::SymmetryGroup& symmetry,
                              const Pose& X_WR) {
  if (symmetry.trivial()) return particles;
  std::vector<Particle> result = particles;
  for (Particle& particle : result) {
    const Pose X_equal = geometry::closest_equivalent(particle.X_WO, X_WR, symmetry);
    const geometry::Quaterniond S = particle.X_WO.rotation.conjugate() * X_equal.rotation;
    // An error e of the body's rotation is S^T e of the equivalent's, and moves its origin if C is not the origin.
    const Vector3d p_BoC_moved = symmetry.p_BoC - S * symmetry.p_BoC;
    Matrix6d to_equal = Matrix6d::Identity();
    to_equal.topLeftCorner<3, 3>() = S.toRotationMatrix().transpose();
    to_equal.bottomLeftCorner<3, 3>() =
        -(particle.X_WO.rotation.toRotationMatrix() * geometry::cross_matrix(p_BoC_moved));
    particle.covariance.topLeftCorner<6, 6>() =
        to_equal * Matrix6d(particle.covariance.topLeftCorner<6, 6>()) * to_equal.transpose();
    particle.X_WO = X_equal;
  }
  return result;
}

// Probability that a particle's rotation is that of the mean within kHereAngle, up to turns that symmetry allows.
double probability_of_rotation(const Particle& particle, const Pose& X_mean, const geometry::SymmetryGroup& symmetry) {
  if (symmetry.ball) return 1.0;
  Matrix3d across = Matrix3d::Identity();
  if (symmetry.axis) across -= *symmetry.axis * symmetry.axis->transpose();
  const Vector3d error = across * geometry::box_minus(particle.X_WO, X_mean).head<3>();
  const Matrix3d spread = across * particle.covariance.topLeftCorner<3, 3>() * across;
  return std::min(1.0, probability_within(error, spread, kHereAngle));
}

// Whether two poses may be averaged, up to turns that symmetry allows.
bool is_alike(const Pose& X, const Pose& X_leader, const geometry::SymmetryGroup& symmetry) {
  const Pose X_equal = geometry::closest_equivalent(X, X_leader, symmetry);
  return (X_equal.translation - X_leader.translation).norm() <= kOnePlace &&
         geometry::log_rotation(X_leader.rotation.conjugate() * X_equal.rotation).norm() <= kOneTurn;
}

// The pose of the heaviest particle that has more than half of the weight about it, or else most of it.
Pose likeliest_leader(const std::vector<Particle>& particles, const geometry::SymmetryGroup& symmetry) {
  std::vector<const Particle*> sorted;
  for (const Particle& particle : particles) sorted.push_back(&particle);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Particle* a, const Particle* b) { return a->log_weight > b->log_weight; });
  double most = 0.0;
  const Particle* leader = sorted.front();
  for (const Particle* particle : sorted) {
    double mass = 0.0;
    for (const Particle& other : particles)
      if (is_alike(other.X_WO, particle->X_WO, symmetry)) mass += std::exp(other.log_weight);
    if (mass > most) most = mass, leader = particle;
    if (most > 0.5) break;
  }
  return leader->X_WO;
}

MotionMode likeliest_motion(const std::vector<Particle>& particles) {
  std::array<double, 3> mass{};
  for (const Particle& particle : particles)
    mass[static_cast<std::size_t>(particle.mode)] += std::exp(particle.log_weight);
  return static_cast<MotionMode>(std::max_element(mass.begin(), mass.end()) - mass.begin());
}

}  // namespace

ObjectEstimate estimate(const ObjectBelief& object, const geometry::SymmetryGroup& symmetry) {
  ObjectEstimate estimate;
  PRESCENE_CHECK(!object.particles.empty());
  const Pose X_leader = likeliest_leader(object.particles, symmetry);
  const std::vector<Particle> particles = aligned(object.particles, symmetry, X_leader);
  estimate.mode = heaviest(particles).X_WO;
  // A mean of poses that differ by more would be none of them.
  std::vector<Particle> alike;
  std::copy_if(particles.begin(), particles.end(), std::back_inserter(alike),
               [&](const Particle& particle) { return is_alike(particle.X_WO, X_leader, symmetry); });
  if (alike.size() < particles.size()) normalize(alike);
  estimate.mean = weighted_mean(alike, X_leader);
  estimate.covariance = mixture_covariance(particles, estimate.mean);
  estimate.motion = likeliest_motion(particles);
  estimate.effective_sample_size = effective_sample_size(particles);
  double here = 0.0;
  for (const Particle& particle : particles) {
    const double weight = std::exp(particle.log_weight);
    estimate.twist.angular += weight * particle.V_WO.angular;
    estimate.twist.linear += weight * particle.V_WO.linear;
    here += weight * probability_of_rotation(particle, estimate.mean, symmetry) *
            probability_within(particle.X_WO.translation - estimate.mean.translation,
                               particle.covariance.block<3, 3>(3, 3), kHereDistance);
  }
  estimate.confidence = object.state == TrackState::kLost ? 0.0 : object.existence * std::min(here, 1.0);
  return estimate;
}

ObjectEstimate estimate(const Belief& belief, const ObjectBelief& object) {
  return estimate(object, model_of(belief, object).symmetry);
}

std::vector<AlternativePose> alternative_poses(const ObjectBelief& object, const geometry::SymmetryGroup& symmetry) {
  std::vector<AlternativePose> alternatives;
  if (object.state == TrackState::kLost) return alternatives;
  PRESCENE_CHECK(!object.particles.empty());
  std::vector<Particle> left = object.particles;
  Pose X_leader = likeliest_leader(left, symmetry);
  for (bool is_estimate = true; !left.empty(); is_estimate = false) {
    if (!is_estimate) X_leader = heaviest(left).X_WO;
    const auto others = std::stable_partition(left.begin(), left.end(), [&](const Particle& particle) {
      return is_alike(particle.X_WO, X_leader, symmetry);
    });
    std::vector<Particle> alike(left.begin(), others);
    left.erase(left.begin(), others);
    if (is_estimate) continue;
    double mass = 0.0;
    for (const Particle& particle : alike) mass += std::exp(particle.log_weight);
    normalize(alike);
    alternatives.push_back({weighted_mean(aligned(alike, symmetry, X_leader), X_leader), object.existence * mass});
  }
  std::erase_if(alternatives, [](const AlternativePose& pose) { return pose.probability < kLeastProbability; });
  std::stable_sort(alternatives.begin(), alternatives.end(),
                   [](const AlternativePose& a, const AlternativePose& b) { return a.probability > b.probability; });
  if (alternatives.size() > kMostAlternatives) alternatives.resize(kMostAlternatives);
  return alternatives;
}

std::vector<AlternativePose> alternative_poses(const Belief& belief, const ObjectBelief& object) {
  return alternative_poses(object, model_of(belief, object).symmetry);
}

}  // namespace prescene::belief
