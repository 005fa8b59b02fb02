// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/support_surfaces.h"

#include <algorithm>
#include <cmath>

namespace prescene::filter {
namespace {

using geometry::Vector3d;

constexpr std::size_t kMostSegments = 64;

/// Where the segment p + t (q - p), t in [0, 1], meets the triangle [Moeller & Trumbore 1997].
bool meets(const Vector3d& a, const Vector3d& ab, const Vector3d& ac, const Vector3d& p, const Vector3d& pq) {
  const Vector3d h = pq.cross(ac);
  const double determinant = ab.dot(h);
  if (std::abs(determinant) < 1e-15) return false;
  const Vector3d ap = p - a;
  const double u = ap.dot(h) / determinant;
  if (u < 0.0 || u > 1.0) return false;
  const Vector3d k = ap.cross(ab);
  const double v = pq.dot(k) / determinant;
  if (v < 0.0 || u + v > 1.0) return false;
  const double t = ac.dot(k) / determinant;
  return t >= 0.0 && t <= 1.0;
}

bool boxes_meet(const geometry::Box& box, const Vector3d& p, const Vector3d& q) {
  return (p.cwiseMin(q).array() <= box.max().array()).all() && (p.cwiseMax(q).array() >= box.min().array()).all();
}

}  // namespace

SupportSurfaces::SupportSurfaces(const belief::Scene& scene, MeshCache& meshes) {
  for (const belief::Support& support : scene.supports)
    add(*meshes.get(support.visual, support.collision, MeshDetail::kLikelihood), support.X_WS);
}

void SupportSurfaces::add(const rendering::RenderMesh& mesh, const geometry::Pose& X_WM) {
  Part part;
  for (const auto& corners : mesh.triangles) {
    Vector3d p[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = X_WM * mesh.vertices[corners[static_cast<std::size_t>(i)]].cast<double>();
      part.box.extend(p[i]);
    }
    part.triangles.push_back({p[0], p[1] - p[0], p[2] - p[0]});
  }
  if (!part.triangles.empty()) parts_.push_back({std::make_shared<const Part>(std::move(part)), {}});
}

void SupportSurfaces::add(const rendering::SupportRegion& region, const geometry::Pose& X_WC) {
  Part part;
  std::vector<Vector3d> corners;
  for (const Vector3d& p_C : region.outline_C) {
    corners.push_back(X_WC * p_C);
    part.box.extend(corners.back());
  }
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    part.triangles.push_back({corners[0], corners[i] - corners[0], corners[i + 1] - corners[0]});
  // Of no thickness: nothing is inside.
  part.closed = false;
  if (!part.triangles.empty()) parts_.push_back({std::make_shared<const Part>(std::move(part)), {}});
}

void SupportSurfaces::place(const SupportSurfaces& body, const geometry::Pose& X_WB) {
  const geometry::Pose X_BW = X_WB.inverse();
  for (const Placed& placed : body.parts_) parts_.push_back({placed.part, placed.X_PW ? *placed.X_PW * X_BW : X_BW});
}

int SupportSurfaces::crossings(const Part& part, const Vector3d& p, const Vector3d& q) {
  if (!boxes_meet(part.box, p, q)) return 0;
  const Vector3d pq = q - p;
  return static_cast<int>(std::count_if(part.triangles.begin(), part.triangles.end(),
                                        [&](const Triangle& t) { return meets(t.a, t.ab, t.ac, p, pq); }));
}

std::optional<SupportSurfaces::Hit> SupportSurfaces::first_along(const Vector3d& p_W, const Vector3d& direction_W,
                                                                 double reach) const {
  std::optional<Hit> first;
  for (const Placed& placed : parts_) {
    const Vector3d p = placed.in_part(p_W), q = placed.in_part(p_W + reach * direction_W);
    if (!boxes_meet(placed.part->box, p, q)) continue;
    const Vector3d pq = q - p;
    for (const Triangle& triangle : placed.part->triangles) {
      if (!meets(triangle.a, triangle.ab, triangle.ac, p, pq)) continue;
      Vector3d normal = triangle.ab.cross(triangle.ac).normalized();
      if (placed.part->closed && !(normal.dot(pq) < 0.0)) continue;  // from within
      const double distance = reach * normal.dot(triangle.a - p) / normal.dot(pq);
      if (first && first->distance <= distance) continue;
      if (placed.X_PW) normal = placed.X_PW->rotation.conjugate() * normal;
      first = Hit{distance, normal.dot(direction_W) < 0.0 ? normal : Vector3d(-normal)};
    }
  }
  return first;
}

bool SupportSurfaces::crosses(const Vector3d& p_W, const Vector3d& q_W) const {
  return std::any_of(parts_.begin(), parts_.end(), [&](const Placed& placed) {
    return crossings(*placed.part, placed.in_part(p_W), placed.in_part(q_W)) > 0;
  });
}

bool SupportSurfaces::inside(const Vector3d& p_W) const {
  return std::any_of(parts_.begin(), parts_.end(), [&](const Placed& placed) {
    const Part& part = *placed.part;
    const Vector3d p = placed.in_part(p_W);
    if (!part.closed || !part.box.contains(p)) return false;
    // A direction that runs along no edge of things built at right angles, nor from the middle of one through a
    // diagonal of its faces.
    const Vector3d away = p + 2.0 * part.box.diagonal().norm() * Vector3d(0.27131, 0.53883, 0.79752);
    return crossings(part, p, away) % 2 == 1;
  });
}

double SupportSurfaces::overlap(const rendering::RenderMesh& mesh, const geometry::Pose& X_WO, double tolerance) const {
  if (parts_.empty() || mesh.vertices.empty()) return 0.0;
  geometry::Box box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex.cast<double>());
  const Vector3d middle = box.center();
  const Vector3d p_WQ = X_WO * middle;
  if (inside(p_WQ)) return 1.0;
  const Vector3d half = 0.5 * box.sizes();
  const Vector3d shrink = (1.0 - tolerance / half.array().max(tolerance + 1e-9)).matrix();
  const std::size_t stride = 1 + (mesh.vertices.size() - 1) / kMostSegments;
  int cut = 0, all = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += stride) {
    const Vector3d arm = (mesh.vertices[i].cast<double>() - middle).cwiseProduct(shrink);
    ++all;
    cut += crosses(p_WQ, X_WO * (middle + arm)) ? 1 : 0;
  }
  return static_cast<double>(cut) / all;
}

}  // namespace prescene::filter
