// SPDX-License-Identifier: Apache-2.0
// Small packings at uncertain poses, and what drawn poses of them say.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::collision {

using core::RandomStream;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector6d;

inline constexpr double kStiffness = 1000.0;

inline std::shared_ptr<const SphereTree> tree_of(const std::vector<PackedSphere>& spheres, int branching = 4) {
  const std::vector<SurfaceAnchor> anchors(spheres.size(), {Vector3f::Zero(), Vector3f::UnitZ()});
  const auto packing = SpherePacking::make(spheres, anchors, "test");
  EXPECT_TRUE(packing.ok());
  core::ThreadPool pool(1);
  const auto tree = SphereTree::make(*packing, {branching}, pool);
  EXPECT_TRUE(tree.ok());
  return *tree;
}

/// Spheres that touch each other on a grid about `middle`.
inline std::vector<PackedSphere> grid(int nx, int ny, int nz, float radius, const Vector3f& middle = Vector3f::Zero()) {
  std::vector<PackedSphere> spheres;
  const Vector3f corner(static_cast<float>(nx - 1), static_cast<float>(ny - 1), static_cast<float>(nz - 1));
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      for (int z = 0; z < nz; ++z) {
        const Vector3f place(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        spheres.push_back({middle + 2.0F * radius * (place - 0.5F * corner), radius});
      }
    }
  }
  return spheres;
}

inline std::vector<PackedSphere> joined(std::vector<PackedSphere> a, const std::vector<PackedSphere>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline Matrix6d diagonal(const Vector3d& rotation, const Vector3d& translation) {
  Vector6d deviations;
  deviations << rotation, translation;
  return deviations.cwiseAbs2().asDiagonal();
}

/// Of a body that turns about a place in the world, far from its origin.
inline Matrix6d turning_about(const Vector3d& arm, double turn, double shift) {
  Matrix6d about = Matrix6d::Identity();
  // p = place + exp(phi) (-arm): the translation moves by -phi x arm.
  about.bottomLeftCorner<3, 3>() << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
  return about * diagonal(Vector3d::Constant(turn), Vector3d::Constant(shift)) * about.transpose();
}

struct Setting {
  std::string name;
  std::vector<PackedSphere> a;
  std::vector<PackedSphere> b;
  UncertainPose pose_a;
  UncertainPose pose_b;
  OverlapState state = OverlapState::kPossible;
  double moments_off = 0.0;  ///< Relative error of the wrench's covariance that is allowed; 0: it is not compared.
  int draws = 1'000'000;
};

struct Sampled {
  double touching = 0.0;
  double noise = 0.0;  ///< Three standard errors.
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  double pairs = 0.0;
};

inline Matrix6d factor_of(const Matrix6d& covariance) {
  const geometry::SymmetricEigen6 eigen = geometry::symmetric_eigen_6(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

inline Vector6d normals(RandomStream& stream) {
  Vector6d z;
  for (int i = 0; i < 6; ++i) z[i] = stream.normal();
  return z;
}

/// Draws poses and adds up what each pair does, in double precision.
inline Sampled sample(const Setting& setting) {
  RandomStream stream(7, core::Purpose::kTest);
  const Matrix6d L_A = factor_of(setting.pose_a.covariance);
  const Matrix6d L_B = factor_of(setting.pose_b.covariance);
  const bool moves_a = !L_A.isZero(0.0);
  const bool moves_b = !L_B.isZero(0.0);
  std::vector<Vector3d> a;
  std::vector<Vector3d> b(setting.b.size());
  for (const PackedSphere& sphere : setting.a) a.push_back(sphere.centre.cast<double>());
  Sampled sampled;
  for (int i = 0; i < setting.draws; ++i) {
    const Pose X_WA = moves_a ? box_plus(setting.pose_a.X_WB, L_A * normals(stream)) : setting.pose_a.X_WB;
    const Pose X_WB = moves_b ? box_plus(setting.pose_b.X_WB, L_B * normals(stream)) : setting.pose_b.X_WB;
    const Pose X_AB = X_WA.inverse() * X_WB;
    const Matrix3d R_AB = X_AB.rotation.toRotationMatrix();
    Vector6d wrench = Vector6d::Zero();
    int pairs = 0;
    for (std::size_t k = 0; k < setting.b.size(); ++k) {
      const Vector3d p = R_AB * setting.b[k].centre.cast<double>() + X_AB.translation;
      for (std::size_t j = 0; j < a.size(); ++j) {
        const Vector3d g = p - a[j];
        const double radii = static_cast<double>(setting.a[j].radius) + static_cast<double>(setting.b[k].radius);
        if (g.squaredNorm() > radii * radii) continue;
        ++pairs;
        const double distance = g.norm();
        const Vector3d force = -kStiffness * 0.5 * (radii - distance) * g / distance;
        wrench.head<3>() += force;
        wrench.tail<3>() += a[j].cross(force);
      }
    }
    if (pairs == 0) continue;
    sampled.touching += 1.0;
    sampled.pairs += pairs;
    sampled.mean += wrench;
    sampled.covariance += wrench * wrench.transpose();
  }
  const double n = setting.draws;
  sampled.touching /= n;
  sampled.pairs /= n;
  sampled.mean /= n;
  sampled.covariance = sampled.covariance / n - sampled.mean * sampled.mean.transpose();
  sampled.noise = 3.0 * std::sqrt(std::max(sampled.touching * (1.0 - sampled.touching), 1.0 / n) / n);
  return sampled;
}

inline std::vector<Setting> settings() {
  const std::vector<PackedSphere> slab = grid(4, 4, 1, 0.02F);
  const std::vector<PackedSphere> block = grid(2, 2, 2, 0.015F);
  const std::vector<PackedSphere> ball = {{Vector3f(0.01F, 0, 0), 0.03F}};
  const auto above = [](double gap, double half) { return Pose::from_translation({0.004, -0.003, 0.02 + half + gap}); };
  const Matrix6d none = Matrix6d::Zero();
  const Matrix6d millimetres = diagonal(Vector3d::Zero(), Vector3d::Constant(0.001));
  const Matrix6d usual = diagonal(Vector3d::Constant(0.01), Vector3d::Constant(0.001));
  const Pose tilted = {geometry::exp_rotation({0.3, -0.2, 0.5}), {0.004, 0.002, 0.052}};
  const Pose world = {geometry::exp_rotation({-0.4, 1.1, 0.3}), {1.0, -2.0, 0.5}};
  const UncertainPose fixed = {Pose::identity(), none};
  constexpr OverlapState kNone = OverlapState::kNone;
  constexpr OverlapState kPossible = OverlapState::kPossible;
  constexpr OverlapState kCertain = OverlapState::kCertain;
  std::vector<Setting> s;
  s.push_back({"far", slab, block, fixed, {above(0.2, 0.03), usual}, kNone, 0.01});
  s.push_back({"near, translation", slab, block, fixed, {above(-0.0005, 0.03), millimetres}, kPossible, 0.15});
  s.push_back({"touching, translation", slab, block, fixed, {above(-0.004, 0.03), millimetres}, kCertain, 0.02});
  s.push_back({"shallow, usual", slab, block, fixed, {above(-0.0065, 0.03), usual}, kCertain, 0.03});
  s.push_back({"deep, usual", slab, block, fixed, {above(-0.015, 0.03), usual}, kCertain, 0.03});
  s.push_back({"sideways", slab, block, fixed, {above(-0.004, 0.03), diagonal({0, 0, 0}, {0.008, 0.002, 1e-4})}});
  s.push_back({"rotation alone",
               slab,
               grid(4, 1, 1, 0.02F),
               fixed,
               {above(-0.0005, 0.02), diagonal({0.02, 0.02, 0.02}, {0, 0, 0})},
               kPossible,
               0.3});
  s.push_back({"turns about a far place",
               slab,
               block,
               fixed,
               {above(-0.006, 0.03), turning_about({0.0, 0.3, 0.1}, 0.004, 0.0003)},
               kCertain,
               0.02});
  s.push_back({"both, tilted", slab, block, {world, usual}, {world * tilted, usual}, kPossible, 0.35});
  s.push_back({"one direction",
               ball,
               ball,
               fixed,
               {Pose::from_translation({0.03, 0.045, 0}), diagonal({0, 0, 0}, {0.02, 0, 0})}});
  s.push_back({"error as large as spheres",
               ball,
               block,
               fixed,
               {Pose::from_translation({0.03, 0.05, 0}), diagonal({0, 0, 0}, {0.03, 0.02, 0.03})}});
  s.push_back({"peg between plates",
               joined(grid(3, 3, 1, 0.02F, {0, 0, -0.041F}), grid(3, 3, 1, 0.02F, {0, 0, 0.041F})),
               grid(1, 1, 1, 0.02F),
               fixed,
               {Pose::identity(), millimetres},
               kPossible,
               0.1});
  s.push_back({"large rotations of both",
               slab,
               block,
               {world, diagonal({0.2, 0.2, 0.2}, {0.002, 0.002, 0.002})},
               {world * tilted, diagonal({0.3, 0.3, 0.3}, {0.002, 0.002, 0.002})}});
  s.push_back({"more pairs than are kept",
               grid(10, 10, 2, 0.005F),
               grid(8, 8, 2, 0.005F),
               fixed,
               {{geometry::exp_rotation({0.003, -0.002, 0.4}), {0.001, 0.0005, 0.0195}}, usual},
               kPossible,
               0.25,
               50'000});
  const std::vector<PackedSphere> cube = grid(5, 5, 5, 0.1F);
  const auto beside = [](double gap) { return Pose::from_translation({1.0 + gap, 0.0, 0.0}); };
  const auto errors = [](double turn, double shift) {
    return diagonal(Vector3d::Constant(turn), Vector3d::Constant(shift));
  };
  s.push_back({"errors beyond the gap", cube, cube, fixed, {beside(0.05), errors(0.0, 0.3)}, kPossible, 0.0, 20'000});
  s.push_back(
      {"errors as large as bodies", cube, cube, fixed, {beside(2.0), errors(0.0, 1.0)}, kPossible, 0.0, 20'000});
  s.push_back({"turns of 0.05", cube, cube, fixed, {beside(0.3), errors(0.05, 0.1)}, kPossible, 0.0, 20'000});
  s.push_back({"turns of 0.3", cube, cube, fixed, {beside(0.3), errors(0.3, 0.1)}, kPossible, 0.0, 20'000});
  return s;
}

}  // namespace prescene::collision
