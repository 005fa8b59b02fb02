// SPDX-License-Identifier: Apache-2.0
// Ray queries against Embree in its robust mode, on recorded and made meshes. Embree computes in single precision, from
// the ray's own origin: where only one of the two hits, or they hit different places, the ray must pass an edge or a
// corner as near as that precision is good for, or graze the surface there.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "prescene/collision/ray_queries.h"
#include "prescene/core/random.h"
#include "tests/peers/ray_caster.h"
#include "tests/support/collision_meshes.h"

namespace prescene::collision::ray_queries_reference_test {
namespace {

using Eigen::Vector3d;

constexpr int kRays = 12000;  // each mesh
// Single precision of the distances that Embree computes with, times a little.
constexpr double kRelativeTolerance = 1e-6;

std::vector<std::shared_ptr<const Mesh>> meshes() {
  std::vector<std::shared_ptr<const Mesh>> all;
  const auto add = [&](const std::vector<tests::MeshPair>& pairs) {
    for (const tests::MeshPair& pair : pairs) {
      for (const auto& mesh : {pair.a, pair.b}) {
        const bool known =
            std::any_of(all.begin(), all.end(), [&](const auto& m) { return m->name() == mesh->name(); });
        if (!known) all.push_back(mesh);
      }
    }
  };
  add(tests::made_mesh_pairs());
  add(tests::recorded_mesh_pairs());
  return all;
}

geometry::TriangleMesh widened(const Mesh& mesh) {
  geometry::TriangleMesh wide;
  for (const Vector3f& p : mesh.vertices()) wide.vertices.push_back(p.cast<double>());
  wide.triangles = mesh.triangles();
  return wide;
}

Vector3d unit_vector(core::RandomStream& random) {
  Vector3d v;
  do {
    v = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
  } while (v.norm() > 1.0 || v.norm() < 0.1);
  return v.normalized();
}

Vector3d rounded(const Vector3d& v) { return v.cast<float>().cast<double>(); }

/// From outside towards the box's inside, and from the inside.
std::vector<Ray> make_rays(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vector3f& p : mesh.vertices()) box.extend(p.cast<double>());
  const double radius = 0.5 * box.diagonal().norm();
  core::RandomStream random(1, {});
  std::vector<Ray> rays(kRays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double z = random.uniform(-1, 1), y = random.uniform(-1, 1), x = random.uniform(-1, 1);
    const Vector3d inside = box.center() + 0.5 * box.sizes().cwiseProduct(Vector3d(x, y, z));
    const Vector3d outside = box.center() + 2.0 * radius * unit_vector(random);
    rays[i].origin = rounded(i % 3 == 0 ? inside : outside);
    rays[i].direction = rounded(i % 3 == 0 ? Vector3d(2.0 * radius * unit_vector(random)) : Vector3d(inside - outside));
  }
  return rays;
}

/// Distance from a line to a segment.
double distance_to_line(const Ray& ray, const Vector3d& p, const Vector3d& q) {
  const Vector3d d = ray.direction.normalized();
  const auto across = [&](const Vector3d& v) { return Vector3d(v - d * d.dot(v)); };
  const Vector3d a = across(p - ray.origin);
  const Vector3d b = across(q - ray.origin);
  const Vector3d ab = b - a;
  const double share = ab.squaredNorm() > 0.0 ? std::clamp(-a.dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
  return (a + share * ab).norm();
}

/// Whether the ray passes the rim of a triangle within the tolerance, or the origin is as near to it.
bool is_doubtful(const Ray& ray, const Mesh& mesh, std::uint32_t triangle, double tolerance) {
  const auto corners = mesh.corners(triangle);
  for (std::size_t i = 0; i < 3; ++i) {
    if (distance_to_line(ray, corners[i].cast<double>(), corners[(i + 1) % 3].cast<double>()) < tolerance) return true;
  }
  return false;
}

/// Of all triangles: so slow that it is only for the few rays on which the two differ.
bool any_is_doubtful(const Ray& ray, const Mesh& mesh, double tolerance) {
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    if (is_doubtful(ray, mesh, i, tolerance)) return true;
  }
  return false;
}

struct Compared {
  int hits = 0;
  int doubtful = 0;
  int wrong = 0;
  double worst = 0.0;  ///< Difference of the places of hits, as a share of the size.
};

Compared compare(const std::shared_ptr<const Mesh>& mesh) {
  core::ThreadPool pool(1);
  const TriangleTree tree = TriangleTree::build(mesh, {}, pool);
  tests::RayCaster embree;
  embree.add(widened(*mesh));
  QueryScratch scratch;
  Compared compared;
  const std::vector<Ray> rays = make_rays(*mesh);
  std::vector<std::optional<RayHit>> hits(rays.size());
  nearest_hits(tree, rays, hits, scratch);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const std::optional<RayHit>& ours = hits[i];
    const auto theirs = embree.cast(ray.origin, ray.direction, 0.0, ray.t_max);
    compared.hits += ours.has_value() ? 1 : 0;
    if (!ours && !theirs) continue;
    const double tolerance = kRelativeTolerance * (static_cast<double>(mesh->size()) + ray.origin.norm());
    if (ours && theirs) {
      // A place on the triangle that is off by the tolerance across the ray is off by more along it.
      const auto corners = mesh->corners(ours->triangle);
      const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).cast<double>().normalized();
      const double cosine = std::max(1e-3, std::abs(normal.dot(ray.direction.normalized())));
      const double apart = std::abs(ours->t - theirs->t) * ray.direction.norm();
      if (apart <= tolerance / cosine) {
        compared.worst = std::max(compared.worst, apart / static_cast<double>(mesh->size()));
        continue;
      }
    }
    if (any_is_doubtful(ray, *mesh, tolerance)) {
      ++compared.doubtful;
    } else {
      ++compared.wrong;
    }
  }
  return compared;
}

TEST(RayQueriesAgainstEmbree, HitTheSamePlaces) {
  Compared sum;
  int count = 0;
  for (const auto& mesh : meshes()) {
    const Compared compared = compare(mesh);
    EXPECT_EQ(compared.wrong, 0) << mesh->name();
    EXPECT_LE(compared.doubtful, kRays / 1000) << mesh->name();
    EXPECT_GT(compared.hits, kRays / 10) << mesh->name();
    sum.hits += compared.hits;
    sum.doubtful += compared.doubtful;
    sum.worst = std::max(sum.worst, compared.worst);
    ++count;
  }
  std::printf(
      "%d meshes, %d rays each: %d hits; %d rays differ at an edge; elsewhere hits are within %.1e of the size\n",
      count, kRays, sum.hits, sum.doubtful, sum.worst);
}

}  // namespace
}  // namespace prescene::collision::ray_queries_reference_test
