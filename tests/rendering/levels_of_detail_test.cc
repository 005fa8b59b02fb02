// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/levels_of_detail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fine_shapes.h"
#include "prescene/collision/point_queries.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/refine.h"

namespace prescene::rendering {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;

TriangleMesh triangles_of(const RenderMesh& mesh) {
  TriangleMesh result;
  for (const auto& vertex : mesh.vertices) result.vertices.push_back(vertex.cast<double>());
  result.triangles = mesh.triangles;
  return result;
}

/// The largest distance of a surface's corners and of many more of its points to another surface, by the trees of
/// another module.
double sampled_distance(const TriangleMesh& from, const TriangleMesh& to) {
  core::ThreadPool pool(1);
  const auto mesh = collision::Mesh::make(to, "to");
  EXPECT_TRUE(mesh.ok());
  const auto tree = collision::TriangleTree::build(*mesh, {}, pool);
  double largest = 0.0;
  const auto ask = [&](const geometry::Vector3d& p) {
    largest = std::max(largest, collision::nearest_point(tree, p)->distance);
  };
  for (const geometry::Vector3d& corner : from.vertices) ask(corner);
  for (const geometry::SurfacePoint& p : sample_surface(from, 50'000, 17)) ask(p.position);
  return largest;
}

FrameTerms frame_of_width(int width) {
  FrameTerms frame;
  frame.camera = {width, width * 3 / 4, 0.9 * width, 0.9 * width, 0.5 * width, 0.375 * width};
  return frame;
}

TEST(LevelsOfDetail, AreCoarserAndCoarserWithErrorsThatAreBounds) {
  for (const tests::FineShape& shape : tests::fine_shapes()) {
    SCOPED_TRACE(shape.name);
    ASSERT_GT(shape.mesh.triangles.size(), 9000U);
    const std::span<const DetailLevel> levels = shape.levels.levels();
    ASSERT_GE(levels.size(), 5U);
    EXPECT_EQ(levels.front().error, 0.0);
    EXPECT_EQ(levels.front().mesh->triangles.size(), shape.mesh.triangles.size());
    EXPECT_LE(levels.back().mesh->triangles.size(), 200U);
    const DetailLevel* before = nullptr;
    for (const DetailLevel& level : levels) {
      EXPECT_EQ(level.mesh->closed, levels.front().mesh->closed);
      if (before != nullptr) {
        EXPECT_LT(level.mesh->triangles.size(), before->mesh->triangles.size());
        EXPECT_GT(level.error, before->error);
        const TriangleMesh coarse = triangles_of(*level.mesh);
        const double sampled = std::max(sampled_distance(shape.mesh, coarse), sampled_distance(coarse, shape.mesh));
        constexpr double kRounding = 1e-7;  // m, of single precision
        EXPECT_GE(level.error, sampled - kRounding);
        // A fifth above what samples find, which may miss a ridge, and a ten-thousandth of the size.
        EXPECT_LE(level.error, 1.2 * sampled + 1e-4 * geometry::bounding_box(shape.mesh).sizes().norm());
      }
      before = &level;
    }
  }
}

TEST(LevelsOfDetail, AreNeitherLargerNorSmallerThanTheOriginal) {
  for (const tests::FineShape& shape : tests::fine_shapes()) {
    const double volume = geometry::signed_volume(shape.mesh);
    if (!(volume > 1e-4)) continue;  // walls: their sides' errors do not add up
    SCOPED_TRACE(shape.name);
    for (const DetailLevel& level : shape.levels.levels()) {
      const auto count = static_cast<int>(level.mesh->triangles.size());
      if (count > 700 || count < 150) continue;
      const double off = std::abs(geometry::signed_volume(triangles_of(*level.mesh)) / volume - 1.0);
      const double collapsed =
          std::abs(geometry::signed_volume(geometry::simplified(shape.mesh, count)) / volume - 1.0);
      EXPECT_LT(off, 0.002);
      EXPECT_LT(off, 0.5 * collapsed) << "what collapsing edges alone leaves";
    }
  }
}

TEST(LevelsOfDetail, AreTheSameForTheSameMesh) {
  const tests::FineShape& shape = tests::fine_shapes().back();
  const auto again = LevelsOfDetail::make(shape.mesh, {});
  ASSERT_TRUE(again.ok());
  const std::span<const DetailLevel> a = shape.levels.levels(), b = again->levels();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].error, b[i].error);
    EXPECT_EQ(a[i].mesh->vertices, b[i].mesh->vertices);
    EXPECT_EQ(a[i].mesh->triangles, b[i].mesh->triangles);
  }
}

TEST(LevelsOfDetail, TheCoarsestWithinTheLimitsIsChosen) {
  const LevelsOfDetail& levels = tests::fine_shapes().front().levels;
  for (const int width : {80, 160, 640}) {
    const FrameTerms frame = frame_of_width(width);
    std::size_t last = std::numeric_limits<std::size_t>::max();
    for (const double depth : {0.01, 0.3, 0.5, 0.8, 1.2, 2.0, 4.0}) {
      const DetailLimits limits;
      const auto allowed = [&](const DetailLevel& level) {
        return level.error * frame.camera.fx / depth <= limits.pixels &&
               level.error <= limits.sigmas * frame.model.hit_sigma(depth, 1.0);
      };
      const DetailLevel& chosen = levels.at_depth(frame, depth);
      EXPECT_TRUE(allowed(chosen));
      for (const DetailLevel& level : levels.levels()) EXPECT_TRUE(level.error <= chosen.error || !allowed(level));
      EXPECT_LE(chosen.mesh->triangles.size(), last) << "further away it is no finer";
      last = chosen.mesh->triangles.size();
    }
    for (const double depth : {0.0, -1.0, std::nan("")}) EXPECT_EQ(levels.at_depth(frame, depth).error, 0.0) << depth;
    const RenderMesh& mesh = *levels.levels().front().mesh;
    const geometry::Pose X_CO{geometry::exp_rotation({0.3, 2.0, 0.1}), {0.1, 0.0, 1.5}};
    const double nearest = (X_CO * mesh.centre.cast<double>().eval()).z() - static_cast<double>(mesh.radius);
    EXPECT_EQ(&levels.at_pose(frame, X_CO), &levels.at_depth(frame, nearest));
  }
}

TEST(LevelsOfDetail, OfFlatThingsAreNearlyExact) {
  const TriangleMesh carton = geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23);
  const auto few = LevelsOfDetail::make(carton, {});
  ASSERT_TRUE(few.ok());
  EXPECT_EQ(few->levels().size(), 1U) << "of so few triangles no coarser ones are made";
  const auto many = LevelsOfDetail::make(geometry::refined(carton, 0.012, 20'000), {});
  ASSERT_TRUE(many.ok());
  EXPECT_GT(many->levels().front().mesh->triangles.size(), 3000U);
  const geometry::Vector3d size = geometry::bounding_box(carton).sizes();
  for (const DetailLevel& level : many->levels()) {
    EXPECT_TRUE(level.mesh->closed);
    EXPECT_LT(level.error, (level.mesh->triangles.size() > 200 ? 0.002 : 0.02) * size.norm());
  }
}

TEST(LevelsOfDetail, OfAnOpenSheetAreOpen) {
  TriangleMesh half;
  const TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.1}, 48);
  half.vertices = ball.vertices;
  for (const auto& t : ball.triangles)
    if (ball.vertices[t[0]].z() + ball.vertices[t[1]].z() + ball.vertices[t[2]].z() > 0.0) half.triangles.push_back(t);
  const auto levels = LevelsOfDetail::make(half, {});
  ASSERT_TRUE(levels.ok());
  EXPECT_GE(levels->levels().size(), 3U);
  for (const DetailLevel& level : levels->levels()) EXPECT_FALSE(level.mesh->closed);
  EXPECT_LT(levels->levels().back().error, 0.02);
}

TEST(LevelsOfDetail, OfNothingAndOptionsOutOfRangeAreRefused) {
  EXPECT_EQ(LevelsOfDetail::make({}, {}).status().code(), core::StatusCode::kInvalidInput);
  TriangleMesh bad = geometry::make_mesh(geometry::Sphere{0.1});
  for (Vector3d& vertex : bad.vertices) vertex.x() = std::nan("");
  EXPECT_EQ(LevelsOfDetail::make(bad, {}).status().code(), core::StatusCode::kInvalidInput);
  const TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.1});
  for (const double ratio : {0.0, 1.0, -1.0, std::nan("")})
    EXPECT_EQ(LevelsOfDetail::make(ball, {.ratio = ratio}).status().code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(LevelsOfDetail::make(ball, {.fewest_triangles = 3}).status().code(), core::StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::rendering
