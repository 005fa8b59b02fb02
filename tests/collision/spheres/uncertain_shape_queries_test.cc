// SPDX-License-Identifier: Apache-2.0
// Answers about packed bodies and static shapes with uncertain poses against drawn poses.
#include "prescene/collision/spheres/uncertain_shape_queries.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "every_shape.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"
#include "tests/support/allocations.h"

namespace prescene::collision::uncertain_shape_queries_test {
namespace {

using core::RandomStream;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector6d;

constexpr double kStiffness = 1000.0;

std::shared_ptr<const SphereTree> tree_of(const std::vector<PackedSphere>& spheres, int branching = 4) {
  const std::vector<SurfaceAnchor> anchors(spheres.size(), {Vector3f::Zero(), Vector3f::UnitZ()});
  const auto packing = SpherePacking::make(spheres, anchors, "test");
  EXPECT_TRUE(packing.ok());
  core::ThreadPool pool(1);
  const auto tree = SphereTree::make(*packing, {branching}, pool);
  EXPECT_TRUE(tree.ok());
  return *tree;
}

/// Spheres that touch each other on a grid about the origin.
std::vector<PackedSphere> grid(int nx, int ny, int nz, float radius) {
  std::vector<PackedSphere> spheres;
  const Vector3f corner(static_cast<float>(nx - 1), static_cast<float>(ny - 1), static_cast<float>(nz - 1));
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      for (int z = 0; z < nz; ++z) {
        const Vector3f place(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        spheres.push_back({2.0F * radius * (place - 0.5F * corner), radius});
      }
    }
  }
  return spheres;
}

Matrix6d diagonal(const Vector3d& rotation, const Vector3d& translation) {
  Vector6d deviations;
  deviations << rotation, translation;
  return deviations.cwiseAbs2().asDiagonal();
}

struct Setting {
  std::string name;
  std::vector<PackedSphere> spheres;
  std::shared_ptr<const StaticShape> shape;
  UncertainPose body;
  UncertainPose support;
  OverlapState state = OverlapState::kPossible;
  double gap_of_bounds = 1.0;  ///< Upper less lower bound at most.
  double moments_off = 0.0;    ///< Relative error of the wrench's covariance that is allowed; 0: it is not compared.
  int draws = 100'000;
};

struct Sampled {
  double touching = 0.0;
  double noise = 0.0;  ///< Four standard errors.
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  double touched = 0.0;
};

Matrix6d factor_of(const Matrix6d& covariance) {
  const geometry::SymmetricEigen6 eigen = geometry::symmetric_eigen_6(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

Vector6d normals(RandomStream& stream) {
  Vector6d z;
  for (int i = 0; i < 6; ++i) z[i] = stream.normal();
  return z;
}

Sampled sample(const Setting& setting) {
  RandomStream stream(31, core::Purpose::kTest);
  const Matrix6d L_A = factor_of(setting.body.covariance);
  const Matrix6d L_B = factor_of(setting.support.covariance);
  const bool moves_b = !L_B.isZero(0.0);
  Sampled sampled;
  for (int i = 0; i < setting.draws; ++i) {
    const Pose X_WA = box_plus(setting.body.X_WB, L_A * normals(stream));
    const Pose X_WB = moves_b ? box_plus(setting.support.X_WB, L_B * normals(stream)) : setting.support.X_WB;
    const Pose X_BA = X_WB.inverse() * X_WA;
    const Matrix3d R_BA = X_BA.rotation.toRotationMatrix();
    Vector6d wrench = Vector6d::Zero();
    int touched = 0;
    for (const PackedSphere& sphere : setting.spheres) {
      const auto radius = static_cast<double>(sphere.radius);
      const Vector3d centre = sphere.centre.cast<double>();
      const auto nearest =
          setting.shape->nearest(R_BA * centre + X_BA.translation, std::nextafter(radius, 2.0 * radius));
      if (!nearest) continue;
      ++touched;
      const Vector3d force = kStiffness * 0.5 * (radius - nearest->distance) * (R_BA.transpose() * nearest->normal);
      wrench.head<3>() += force;
      wrench.tail<3>() += centre.cross(force);
    }
    if (touched == 0) continue;
    sampled.touching += 1.0;
    sampled.touched += touched;
    sampled.mean += wrench;
    sampled.covariance += wrench * wrench.transpose();
  }
  const double n = setting.draws;
  sampled.touching /= n;
  sampled.touched /= n;
  sampled.mean /= n;
  sampled.covariance = sampled.covariance / n - sampled.mean * sampled.mean.transpose();
  sampled.noise = 4.0 * std::sqrt(std::max(sampled.touching * (1.0 - sampled.touching), 1.0 / n) / n);
  return sampled;
}

template <class Shape>
std::shared_ptr<const StaticShape> shared(const core::Result<Shape>& shape) {
  return std::make_shared<const Shape>(*shape);
}

std::shared_ptr<const StaticShape> sheet() {
  geometry::TriangleMesh top;
  top.vertices = {{-0.5, -0.4, 0}, {0.5, -0.4, 0}, {0.5, 0.4, 0}, {-0.5, 0.4, 0}};
  top.triangles = {{0, 1, 2}, {0, 2, 3}};
  return shared(TriangleSurface::make(*Mesh::make(top, "top"), SurfaceSide::kBoth, shape_pool()));
}

std::shared_ptr<const StaticShape> table(SurfaceSide side) {
  const auto mesh = geometry::make_mesh(geometry::BoxShape{{0.6, 0.5, 0.04}});
  return shared(TriangleSurface::make(*Mesh::make(mesh, "table"), side, shape_pool()));
}

std::shared_ptr<const StaticShape> field(float step) {
  HeightField::Grid grid{21, 21, 0.02, 0.02, {}};
  for (int i = 0; i < 441; ++i) grid.heights.push_back(step * static_cast<float>(i % 3));
  return shared(HeightField::make(std::move(grid), "field"));
}

std::vector<Setting> settings() {
  const std::vector<PackedSphere> box = grid(4, 3, 2, 0.01F);
  const std::vector<PackedSphere> ball = {{Vector3f(0.01F, 0, 0), 0.03F}};
  const Matrix6d none = Matrix6d::Zero();
  const Matrix6d millimetres = diagonal(Vector3d::Zero(), Vector3d::Constant(0.001));
  const Matrix6d usual = diagonal(Vector3d::Constant(0.01), Vector3d::Constant(0.001));
  const Matrix6d lying = diagonal(Vector3d(0.002, 0.002, 0.05), Vector3d(0.02, 0.02, 0.0005));
  const Matrix6d turned_far = diagonal(Vector3d(0.002, 0.002, 0.3), Vector3d(0.02, 0.02, 0.0005));
  const Pose world = {geometry::exp_rotation({-0.4, 1.1, 0.3}), {1.0, -2.0, 0.5}};
  const auto above = [](double gap) { return Pose::from_translation({0.004, -0.003, 0.02 + gap}); };
  const Pose tilted = {geometry::exp_rotation({0.3, -0.2, 0.5}), {0.004, 0.002, 0.034}};
  const UncertainPose fixed = {Pose::identity(), none};
  const UncertainPose on_table = {Pose::from_translation({0, 0, -0.02}), none};
  const auto floor = shared(HalfSpace::make({0, 0, 1}, 0.0));
  const auto top = shared(PrimitiveShape::make(geometry::BoxShape{{0.6, 0.5, 0.04}}));
  const auto can = shared(PrimitiveShape::make(geometry::Cylinder{0.03, 0.1}));
  constexpr OverlapState kNone = OverlapState::kNone;
  constexpr OverlapState kPossible = OverlapState::kPossible;
  constexpr OverlapState kCertain = OverlapState::kCertain;
  std::vector<Setting> s;
  s.push_back({"floor, far", box, floor, {above(0.2), usual}, fixed, kNone, 0.004, 0.01});
  s.push_back({"floor, one ball", ball, floor, {above(0.0105), usual}, fixed, kPossible, 0.02, 0.02});
  s.push_back({"floor, translation", box, floor, {above(0.0005), millimetres}, fixed, kPossible, 5e-4, 0.02});
  s.push_back({"floor, just above", box, floor, {above(0.003), millimetres}, fixed, kNone, 2e-3, 0.0});
  s.push_back({"floor, usual", box, floor, {above(0.0002), usual}, fixed, kPossible, 0.4, 0.06});
  s.push_back({"floor, deep", box, floor, {above(-0.006), usual}, fixed, kCertain, 0.01, 0.03});
  s.push_back({"floor, tilted, both", box, floor, {world * tilted, usual}, {world, usual}, kPossible, 0.3, 0.15});
  s.push_back({"floor, rotation alone",
               box,
               floor,
               {above(0.0004), diagonal({0.02, 0.02, 0.02}, {0, 0, 0})},
               fixed,
               kPossible,
               0.9,
               0.15});
  s.push_back({"floor, large rotations",
               box,
               floor,
               {world * tilted, diagonal({0.3, 0.3, 0.3}, {0.002, 0.002, 0.002})},
               {world, diagonal({0.1, 0.1, 0.1}, {0.002, 0.002, 0.002})},
               kPossible,
               1.0,
               0.0});
  s.push_back({"box, usual", box, top, {above(0.0002), usual}, on_table, kPossible, 0.4, 0.06});
  s.push_back({"box, lying on it", box, top, {above(0.0002), lying}, on_table, kPossible, 0.5, 0.06});
  s.push_back({"box, turned far", box, top, {above(0.0002), turned_far}, on_table, kPossible, 0.9, 0.06});
  s.push_back({"mesh of a box",
               box,
               table(SurfaceSide::kSolid),
               {above(0.0002), usual},
               on_table,
               kPossible,
               0.45,
               0.06,
               20'000});
  s.push_back({"mesh of a box, near",
               box,
               table(SurfaceSide::kSolid),
               {above(0.0035), usual},
               on_table,
               kPossible,
               0.02,
               0.0,
               20'000});
  s.push_back(
      {"its surface", box, table(SurfaceSide::kBoth), {above(0.0002), usual}, on_table, kPossible, 0.45, 0.06, 20'000});
  s.push_back({"sheet, lying on it", box, sheet(), {above(0.0002), lying}, fixed, kPossible, 0.3, 0.06, 50'000});
  s.push_back({"sheet, touching", box, sheet(), {above(-0.005), millimetres}, fixed, kCertain, 0.01, 0.02, 20'000});
  s.push_back({"cylinder, its side",
               box,
               can,
               {{geometry::exp_rotation({0.1, 0.2, 0.3}), {0.0725, 0.01, 0.02}}, usual},
               fixed,
               kPossible,
               0.5,
               0.0});
  s.push_back({"field, flat",
               box,
               field(0.0F),
               {above(0.0004), usual},
               {Pose::from_translation({-0.2, -0.2, 0}), none},
               kPossible,
               0.45,
               0.06,
               20'000});
  s.push_back({"field, rough",
               box,
               field(0.003F),
               {above(0.006), usual},
               {Pose::from_translation({-0.2, -0.2, 0}), usual},
               kPossible,
               1.0,
               0.0,
               20'000});
  s.push_back({"ball in a corner",
               ball,
               table(SurfaceSide::kSolid),
               {Pose::from_translation({0.3105, 0.2705, 0.022}), diagonal({0, 0, 0}, {0.002, 0.002, 0.002})},
               on_table,
               kPossible,
               1.0,
               0.0,
               50'000});
  s.push_back({"error as large as the ball",
               ball,
               top,
               {Pose::from_translation({0.3, 0.25, 0.05}), diagonal({0, 0, 0}, {0.03, 0.02, 0.03})},
               on_table,
               kPossible,
               1.0,
               0.0});
  return s;
}

TEST(UncertainShapeQueries, BoundsHoldAndMomentsAgreeWithDraws) {
  UncertainScratch scratch;
  int draws = 0;
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto between = RelativeUncertainty::make(setting.body, setting.support);
    ASSERT_TRUE(between.ok()) << between.status().message();
    const auto tree = tree_of(setting.spheres, draws % 3 == 0 ? 4 : 16);
    const UncertainOverlap overlap = uncertain_overlap(*tree, *setting.shape, *between, scratch);
    const UncertainWrench wrench =
        uncertain_wrench(*tree, *setting.shape, *between, {.stiffness = kStiffness}, scratch);
    const Sampled drawn = sample(setting);
    draws += setting.draws;
    Vector6d mean;
    mean << wrench.force, wrench.torque;
    const double deviation = std::sqrt(drawn.covariance.topLeftCorner<3, 3>().trace()) + 1e-9;
    const double mean_off = (mean - drawn.mean).head<3>().norm() / deviation;
    const double covariance_off = (wrench.covariance - drawn.covariance).norm() / (drawn.covariance.norm() + 1e-9);
    std::printf("%-26s drawn %.4f in [%.4f, %.4f], estimate %.4f +- %.4f; mean %.3f deviations off, covariance %.3f\n",
                setting.name.c_str(), drawn.touching, overlap.lower, overlap.upper, overlap.probability,
                overlap.probability_error, mean_off, covariance_off);
    EXPECT_EQ(overlap.state, setting.state);
    EXPECT_LE(overlap.lower, drawn.touching + drawn.noise);
    EXPECT_GE(overlap.upper, drawn.touching - drawn.noise);
    EXPECT_LE(overlap.lower, overlap.probability);
    EXPECT_GE(overlap.upper, overlap.probability);
    EXPECT_LE(overlap.upper - overlap.lower, setting.gap_of_bounds);
    EXPECT_NEAR(overlap.probability, drawn.touching, drawn.noise + overlap.probability_error + 2e-3);
    if (setting.moments_off == 0.0) continue;
    EXPECT_LE(mean_off, 0.03);
    EXPECT_LE(covariance_off, setting.moments_off);
    EXPECT_NEAR(wrench.expected_pairs, drawn.touched, 0.03 * drawn.touched + 4.0 * drawn.noise);
  }
  std::printf("%d poses drawn\n", draws);
}

// One sphere and a half-space: the height of its centre is Gaussian, with the lever arm of the rotation.
TEST(UncertainShapeQueries, OneSphereOnAFloorIsANormalDistribution) {
  const auto tree = tree_of({{Vector3f(0.2F, 0.1F, 0.0F), 0.03F}});
  const auto floor = *HalfSpace::make({0, 0, 1}, 0.0);
  UncertainScratch scratch;
  for (const double gap : {-0.004, -0.001, 0.0, 0.0015, 0.005}) {
    const UncertainPose body = {Pose::from_translation({0, 0, 0.03 + gap}),
                                diagonal({0.001, 0.002, 0.1}, {1, 1, 0.002})};
    const auto between = RelativeUncertainty::make(body, {Pose::identity(), Matrix6d::Zero()}, 1.0 - 1e-6);
    ASSERT_TRUE(between.ok());
    const double deviation = std::sqrt(0.002 * 0.002 + std::pow(0.1 * 0.001, 2) + std::pow(0.2 * 0.002, 2));
    const double expected = core::normal_cdf(-gap / deviation);
    const UncertainOverlap overlap = uncertain_overlap(*tree, floor, *between, scratch);
    EXPECT_NEAR(overlap.probability, expected, 1e-6);
    // A turn about the height is an error of this size, which bounds don't leave out.
    const double missed = between->reversed_remainder((Vector3d(0.2, 0.1, 0.0) - between->pivot()).norm());
    EXPECT_GE(overlap.lower, core::normal_cdf((-gap - missed) / deviation) - 2e-3);
    EXPECT_LE(overlap.lower, expected);
    EXPECT_GE(overlap.upper, expected);
  }
}

TEST(UncertainShapeQueries, KnownPosesAnswerAsTheyAre) {
  UncertainScratch scratch;
  const auto tree = tree_of(grid(3, 3, 3, 0.02F));
  for (const std::shared_ptr<const StaticShape>& shape :
       {shared(HalfSpace::make({0, 0, 1}, 0.02)), shared(PrimitiveShape::make(geometry::BoxShape{{0.6, 0.5, 0.04}})),
        table(SurfaceSide::kSolid)}) {
    for (const double gap : {0.001, -0.002}) {
      const UncertainPose at = {Pose::from_translation({0.0, 0.0, 0.08 + gap}), Matrix6d::Zero()};
      const auto between = RelativeUncertainty::make(at, {Pose::identity(), Matrix6d::Zero()});
      ASSERT_TRUE(between.ok());
      const UncertainOverlap overlap = uncertain_overlap(*tree, *shape, *between, scratch);
      const UncertainWrench wrench = uncertain_wrench(*tree, *shape, *between, {}, scratch);
      EXPECT_EQ(overlap.state, gap < 0.0 ? OverlapState::kCertain : OverlapState::kNone);
      EXPECT_NEAR(wrench.force.z(), 9.0 * 0.5 * std::max(0.0, -gap), 1e-7);
      EXPECT_LE(wrench.covariance.norm(), 1e-12);
    }
  }
}

TEST(UncertainShapeQueries, FirstOrderAndRemainderBoundTheDisplacementSeenFromTheShape) {
  RandomStream stream(33, core::Purpose::kTest);
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto between = RelativeUncertainty::make(setting.body, setting.support);
    ASSERT_TRUE(between.ok());
    const Pose X_AB = setting.body.X_WB.inverse() * setting.support.X_WB;
    const Matrix6d L_A = factor_of(setting.body.covariance);
    const Matrix6d L_B = factor_of(setting.support.covariance);
    const Matrix3d R_AW = setting.body.X_WB.rotation.toRotationMatrix().transpose();
    for (int i = 0; i < 500; ++i) {
      const Vector6d d_A = L_A * normals(stream);
      const Vector6d d_B = L_B * normals(stream);
      const double p_z = stream.uniform(-0.1, 0.1), p_y = stream.uniform(-0.1, 0.1), p_x = stream.uniform(-0.1, 0.1);
      const Vector3d p(p_x, p_y, p_z);
      const Pose X_BA = box_plus(setting.support.X_WB, d_B).inverse() * box_plus(setting.body.X_WB, d_A);
      const Vector3d moved = X_AB * (X_BA * p) - p;  // in A's axes
      const Vector3d phi_B = X_AB.rotation * Vector3d(d_B.head<3>());
      const Vector3d linear =
          R_AW * (d_B.tail<3>() - d_A.tail<3>()) + phi_B.cross(p - X_AB.translation) - Vector3d(d_A.head<3>()).cross(p);
      ASSERT_LE((moved + linear).norm(), between->reversed_remainder((p - between->pivot()).norm()));
      ASSERT_LE(moved.norm(), between->reversed_displacement(p));
      // Along a direction: also along the one about which bodies turn most.
      const double z = stream.uniform(-1, 1), y = stream.uniform(-1, 1), x = stream.uniform(-1, 1);
      const Vector3d random(x, y, z);
      const Vector3d n = i % 2 == 0 ? Vector3d(Vector3d::UnitZ()) : Vector3d(random.normalized());
      const double missed = std::abs(n.dot(moved + linear));
      ASSERT_LE(missed, between->reversed_along(n).remainder(p));
      ASSERT_LE(missed, between->reversed_along(n).remainder(p + Vector3d(0.01, 0.02, -0.02), 0.03));
    }
  }
}

TEST(UncertainShapeQueries, ShapesReachAsFarAsTheySay) {
  RandomStream stream(34, core::Purpose::kTest);
  const auto vector = [&](double reach) {
    const double z = stream.uniform(-reach, reach), y = stream.uniform(-reach, reach),
                 x = stream.uniform(-reach, reach);
    return Vector3d(x, y, z);
  };
  for (const std::unique_ptr<StaticShape>& shape : every_shape()) {
    for (int i = 0; i < 2000; ++i) {
      const Vector3d direction = vector(1.0).normalized();
      const Vector3d centre = vector(0.15);
      const double radius = stream.uniform(0.01, 0.2);
      const Vector3d from = centre + vector(radius);
      const auto nearest = shape->nearest(from, 1e9);
      const Vector3d p = from - nearest->distance * nearest->normal;
      if ((p - centre).norm() <= radius - 1e-9) {
        EXPECT_GE(shape->reach_along(direction, centre, radius), direction.dot(p) - 1e-9);
      }
      // The plane that touches a convex shape has it behind.
      if (!shape->is_convex() || nearest->distance <= 0.0) continue;
      const Vector3d q = vector(0.3);
      const auto at = shape->nearest(q, 1e9);
      EXPECT_LE(nearest->normal.dot(q - at->distance * at->normal - p), 1e-9);
    }
  }
}

TEST(UncertainShapeQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  UncertainScratch scratch;
  for (const Setting& setting : settings()) {
    const auto between = RelativeUncertainty::make(setting.body, setting.support);
    ASSERT_TRUE(between.ok());
    const auto tree = tree_of(setting.spheres, 16);
    uncertain_overlap(*tree, *setting.shape, *between, scratch);
    uncertain_wrench(*tree, *setting.shape, *between, {.stiffness = kStiffness}, scratch);
    const auto before = tests::allocation_count();
    uncertain_overlap(*tree, *setting.shape, *between, scratch);
    uncertain_wrench(*tree, *setting.shape, *between, {.stiffness = kStiffness}, scratch);
    EXPECT_EQ(tests::allocation_count(), before);
  }
}

}  // namespace
}  // namespace prescene::collision::uncertain_shape_queries_test
