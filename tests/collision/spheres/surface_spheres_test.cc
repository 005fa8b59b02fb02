// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/surface_spheres.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/collision/point_queries.h"
#include "prescene/collision/spheres/scalar_sphere_queries.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/hollow_meshes.h"

namespace prescene::collision::surface_spheres_test {
namespace {

using Eigen::Vector3d;

core::ThreadPool& pool() {
  static core::ThreadPool threads(2);
  return threads;
}

struct Named {
  const char* name;
  geometry::TriangleMesh mesh;
  double deviation;  // of the patches from the surface, as a share of the spacing
};

std::vector<Named> bodies() {
  const std::vector<Eigen::Vector2d> cup = {{0.0, 0.0},   {0.04, 0.0},    {0.04, 0.1},
                                            {0.037, 0.1}, {0.037, 0.003}, {0.0, 0.003}};
  return {{"box", geometry::make_mesh(geometry::BoxShape{{0.1, 0.06, 0.04}}), 1e-4},
          {"plate", geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.001}}), 1e-4},
          {"bin", geometry::make_open_bin({0.2, 0.15, 0.1}, 0.004), 1e-4},
          {"ball", geometry::make_mesh(geometry::Sphere{0.05}, 64), 0.02},
          {"cup", geometry::make_lathe(cup, 64), 0.04},
          {"ring", tests::arc(0.03, 0.008, 0.0, 2.0 * std::numbers::pi, 64, 32), 0.1},
          {"mug", tests::mug(), 0.2}};
}

TEST(SurfaceSpheres, LieInTheBodyAndTouchItsSurface) {
  for (const Named& body : bodies()) {
    const auto mesh = tests::collision_mesh(body.mesh, body.name);
    const auto made = cover_surface(mesh, {}, pool());
    ASSERT_TRUE(made.ok()) << body.name;
    const TriangleTree tree = TriangleTree::build(mesh, {}, pool());
    const double rounding = 1e-6 * static_cast<double>(mesh->size());
    const auto rise = static_cast<double>(made->rise);
    ASSERT_EQ(made->tree->packing().size(), made->patches.size());
    for (std::size_t i = 0; i < made->patches.size(); ++i) {
      const SurfacePatch& patch = made->patches[i];
      const Vector3d centre = patch.centre.cast<double>();
      const auto radius = static_cast<double>(patch.radius);
      if (radius > rise + 20.0 * rounding) {
        EXPECT_GT(winding_number(tree, centre), 0) << body.name << " " << i;
        EXPECT_GE(nearest_point(tree, centre)->distance, (1.0 - 2e-5) * radius - rise - rounding) << body.name << i;
      }
      EXPECT_LE(nearest_point(tree, patch.point.cast<double>())->distance, rise + rounding) << body.name << " " << i;
      EXPECT_NEAR((patch.point - patch.centre).norm(), patch.radius, rounding) << body.name << " " << i;
      // The tree's sphere is inside of the patch's and touches it at the patch's point.
      const PackedSphere& sphere = made->tree->packing().spheres()[i];
      EXPECT_LE(static_cast<double>((sphere.centre - patch.centre).norm() + sphere.radius), radius + rounding);
      EXPECT_NEAR((sphere.centre - patch.point).norm(), sphere.radius, rounding);
    }
  }
}

TEST(SurfaceSpheres, StandForAllOfTheSurface) {
  for (const Named& body : bodies()) {
    const auto mesh = tests::collision_mesh(body.mesh, body.name);
    const auto made = cover_surface(mesh, {}, pool());
    ASSERT_TRUE(made.ok()) << body.name;
    const TriangleTree tree = TriangleTree::build(mesh, {}, pool());
    double worst = 0.0;
    int uncovered = 0;
    const std::vector<geometry::SurfacePoint> points = geometry::sample_surface(body.mesh, 3000, 5);
    for (const auto& point : points) {
      if (winding_number(tree, point.position + 1e-5 * point.normal) > 0) continue;  // inside of another part
      // The patch that it belongs to is the one of its side whose point is nearest.
      const SurfacePatch* best = nullptr;
      double least = std::numeric_limits<double>::infinity();
      for (const SurfacePatch& patch : made->patches) {
        const Vector3d to = point.position - patch.point.cast<double>();
        if (patch.is_edge() || to.norm() >= least || patch.normal.cast<double>().dot(point.normal) < 0.7) continue;
        const bool ended = std::any_of(patch.limits.begin(), patch.limits.end(), [&](const SurfacePatch::Limit& l) {
          return l.out.cast<double>().dot(to) > static_cast<double>(l.distance) + 1e-6;
        });
        if (ended || to.norm() > static_cast<double>(patch.reach)) continue;
        least = to.norm();
        best = &patch;
      }
      if (!best) {
        ++uncovered;
        continue;
      }
      const Vector3d to = point.position - best->point.cast<double>();
      const double u = best->tangent.cast<double>().dot(to), v = best->bitangent.cast<double>().dot(to);
      const double z = 0.5 * (static_cast<double>(best->bend[0]) * u * u + static_cast<double>(best->bend[1]) * u * v +
                              static_cast<double>(best->bend[2]) * v * v);
      worst = std::max(worst, std::abs(best->normal.cast<double>().dot(to) - z));
    }
    EXPECT_LE(uncovered, 15) << body.name;
    EXPECT_LT(worst, body.deviation * made->spacing + static_cast<double>(made->rise)) << body.name;
    RecordProperty(std::string(body.name) + "_deviation", std::to_string(worst));
  }
}

TEST(SurfaceSpheres, ReachTheCornersAsFaithfullyAsAsked) {
  for (const double fidelity : {2e-3, 1e-3, 2e-4}) {
    const Vector3d half(0.05, 0.03, 0.02);
    const auto mesh = tests::collision_mesh(geometry::make_mesh(geometry::BoxShape{2.0 * half}), "box");
    const auto made = cover_surface(mesh, {3000, fidelity}, pool());
    ASSERT_TRUE(made.ok());
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d p(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                       corner & 4 ? half.z() : -half.z());
      double least = 1.0;
      for (const SurfacePatch& patch : made->patches)
        if (patch.is_edge()) least = std::min(least, (patch.centre.cast<double>() - p).norm());
      EXPECT_LT(least, fidelity * 1.001);
    }
  }
}

TEST(SurfaceSpheres, AreTheSameForAnyNumberOfThreads) {
  const auto mesh = tests::collision_mesh(tests::make_knot(0.06, 4000), "knot");
  core::ThreadPool one(1), three(3);
  const auto a = cover_surface(mesh, {}, one);
  const auto b = cover_surface(mesh, {}, three);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->tree->packing().content_hash(), b->tree->packing().content_hash());
}

TEST(SurfaceSpheres, RefuseWhatTheyCannotStandFor) {
  using testing::HasSubstr;
  geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.1, 0.1, 0.1}});
  EXPECT_THAT(cover_surface(tests::collision_mesh(box, "box"), {10}, pool()).status().message(), HasSubstr("50"));
  EXPECT_THAT(cover_surface(tests::collision_mesh(box, "box"), {3000, 0.1}, pool()).status().message(),
              HasSubstr("edge_fidelity"));
  for (auto& t : box.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(cover_surface(tests::collision_mesh(box, "box"), {}, pool()).status().message(), HasSubstr("inside out"));
  box.triangles.pop_back();
  EXPECT_THAT(cover_surface(tests::collision_mesh(box, "box"), {}, pool()).status().message(), HasSubstr("box"));
}

TEST(NearPairs, AreThoseOfBruteForceOnEveryInstructionSet) {
  const auto mesh = tests::collision_mesh(tests::make_knot(0.06, 2000), "knot");
  const auto spheres = cover_surface(mesh, {500}, pool());
  ASSERT_TRUE(spheres.ok());
  const Array<PackedSphere>& all = spheres->tree->packing().spheres();
  core::RandomStream stream(4, core::Purpose::kTest);
  SphereScratch scratch;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix3d R = geometry::uniform_rotation(stream).toRotationMatrix();
    const double y = stream.uniform(-0.1, 0.1), x = stream.uniform(-0.1, 0.1);
    const Transform X_AB = rounded_transform(R, Vector3d(x, y, 0.02));
    const double range = i % 2 == 0 ? 0.0 : 0.01;
    std::vector<SpherePair> sure, perhaps;
    for (std::uint32_t a = 0; a < all.size(); ++a) {
      for (std::uint32_t b = 0; b < all.size(); ++b) {
        const double gap =
            static_cast<double>((X_AB * all[b].centre - all[a].centre).norm() - all[a].radius - all[b].radius);
        if (gap < range - 1e-6) sure.push_back({a, b});
        if (gap < range + 1e-6) perhaps.push_back({a, b});
      }
    }
    const auto expect_found = [&](std::vector<SpherePair> found, const char* by) {
      std::sort(found.begin(), found.end());
      EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end()) << by;
      EXPECT_TRUE(std::includes(found.begin(), found.end(), sure.begin(), sure.end())) << by;
      EXPECT_TRUE(std::includes(perhaps.begin(), perhaps.end(), found.begin(), found.end())) << by;
    };
    std::vector<SpherePair> found;
    scalar::near_pairs(*spheres->tree, *spheres->tree, X_AB, range, &found, scratch);
    expect_found(found, "scalar");
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().DeInit();
      found.clear();
      near_pairs(*spheres->tree, *spheres->tree, X_AB, range, &found, scratch);
      expect_found(found, hwy::TargetName(target));
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
}

}  // namespace
}  // namespace prescene::collision::surface_spheres_test
