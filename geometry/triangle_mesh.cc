// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/triangle_mesh.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/hash.h"
#include "prescene/core/random.h"

namespace prescene::geometry {

Box bounding_box(const TriangleMesh& mesh) {
  Box box;
  for (const Vector3d& p : mesh.vertices) box.extend(p);
  return box;
}

double radius_about(const TriangleMesh& mesh, const Vector3d& p_MQ) {
  double squared = 0.0;
  for (const Vector3d& p : mesh.vertices) squared = std::max(squared, (p - p_MQ).squaredNorm());
  return std::sqrt(squared);
}

namespace {

// Twice the triangle's area times its normal.
Vector3d area_vector(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vector3d& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

}  // namespace

double surface_area(const TriangleMesh& mesh) {
  double doubled = 0.0;
  for (const auto& t : mesh.triangles) doubled += area_vector(mesh, t).norm();
  return 0.5 * doubled;
}

TriangleMesh transformed(const TriangleMesh& mesh, const Pose& X_NM) {
  TriangleMesh result;
  result.triangles = mesh.triangles;
  result.vertices.reserve(mesh.vertices.size());
  const Matrix3d R_NM = X_NM.rotation.toRotationMatrix();
  for (const Vector3d& p : mesh.vertices) result.vertices.emplace_back(R_NM * p + X_NM.translation);
  return result;
}

TriangleMesh scaled(const TriangleMesh& mesh, double factor) {
  TriangleMesh result = mesh;
  for (Vector3d& p : result.vertices) p *= factor;
  // A mirror image turns the triangles inside out.
  if (factor < 0.0) {
    for (auto& t : result.triangles) std::swap(t[1], t[2]);
  }
  return result;
}

TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh result = a;
  const auto shift = static_cast<std::uint32_t>(a.vertices.size());
  result.vertices.insert(result.vertices.end(), b.vertices.begin(), b.vertices.end());
  result.triangles.reserve(a.triangles.size() + b.triangles.size());
  for (const auto& t : b.triangles) result.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  return result;
}

std::vector<SurfacePoint> sample_surface(const TriangleMesh& mesh, int count, std::uint64_t seed) {
  PRESCENE_CHECK(count >= 0 && !mesh.empty());
  std::vector<double> cumulative;
  cumulative.reserve(mesh.triangles.size());
  double total = 0.0;
  for (const auto& t : mesh.triangles) cumulative.push_back(total += area_vector(mesh, t).norm());

  core::RandomStream stream(seed, core::Purpose::kSurface);
  std::vector<SurfacePoint> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), stream.uniform() * total);
    const auto index =
        std::min<std::size_t>(static_cast<std::size_t>(found - cumulative.begin()), cumulative.size() - 1);
    const auto& t = mesh.triangles[index];
    const double root = std::sqrt(stream.uniform());
    const double v = stream.uniform();
    points.push_back(
        {(1.0 - root) * mesh.vertices[t[0]] + root * (1.0 - v) * mesh.vertices[t[1]] + root * v * mesh.vertices[t[2]],
         area_vector(mesh, t).normalized()});
  }
  return points;
}

std::uint64_t content_hash(const TriangleMesh& mesh) {
  core::Hasher hasher;
  hasher.value(static_cast<std::uint64_t>(mesh.vertices.size()));
  for (const Vector3d& p : mesh.vertices) hasher.bytes(p.data(), 3 * sizeof(double));
  hasher.value(static_cast<std::uint64_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) hasher.bytes(t.data(), sizeof t);
  return hasher.digest();
}

}  // namespace prescene::geometry
