// SPDX-License-Identifier: Apache-2.0
#include "contact_finder.h"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/parallel.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

// Contact points of a surface nearer to each other than this (m) are one: triangles share their edges.
constexpr double kSamePoint = 1e-4;
// Barycentric coordinate below which a nearest point lies on the triangle's edge.
constexpr double kOnEdge = 1e-6;
// The same of points on triangles that were rounded to single precision.
constexpr double kOnEdgeSingle = 1e-4;

Feature& to_world(const Frame& X, Feature& feature) {
  for (int i = 0; i < feature.count; ++i) feature[i] = X * feature[i];
  feature.normal = X.R * feature.normal;
  return feature;
}

}  // namespace

SurfaceShape::SurfaceShape(std::shared_ptr<const StaticMesh> mesh, bool for_spheres) : mesh_(std::move(mesh)) {
  const geometry::TriangleMesh& m = mesh_->mesh;
  vertices_.reserve(3 * m.vertices.size());
  for (const Vector3d& v : m.vertices) vertices_.insert(vertices_.end(), {v.x(), v.y(), v.z()});
  indices_.reserve(3 * m.triangles.size());
  for (const auto& t : m.triangles) {
    for (const std::uint32_t i : t) indices_.push_back(static_cast<int>(i));
  }
  array_ = std::make_unique<btTriangleIndexVertexArray>(
      static_cast<int>(m.triangles.size()), indices_.data(), static_cast<int>(3 * sizeof(int)),
      static_cast<int>(m.vertices.size()), vertices_.data(), static_cast<int>(3 * sizeof(btScalar)));
  tree_ = std::make_unique<btBvhTriangleMeshShape>(array_.get(), true);
  if (!for_spheres) return;
  core::ThreadPool pool(1);
  if (auto single = collision::Mesh::make(m, "surface"))
    nearest_ = collision::TriangleTree::build(*std::move(single), {}, pool);
}

SurfaceShape::Place SurfaceShape::place_of(std::uint32_t triangle, const Vector3d& point) const {
  const geometry::TriangleMesh& m = mesh_->mesh;
  std::array<Vector3d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = m.vertices[m.triangles[triangle][k]];
  const Vector3d area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  Place place{area.normalized(), false};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d& from = corners[k];
    const double share = (corners[(k + 1) % 3] - from).cross(point - from).dot(area) / area.squaredNorm();
    if (share <= kOnEdgeSingle && (mesh_->ridges[triangle] >> k & 1u)) place.on_ridge = true;
  }
  return place;
}

void SurfaceShape::overlapping(const Vector3d& low, const Vector3d& high, std::vector<int>& triangles) const {
  struct Collect : btTriangleCallback {
    explicit Collect(std::vector<int>& out) : indices(out) {}
    void processTriangle(btVector3*, int, int index) override { indices.push_back(index); }
    std::vector<int>& indices;
  };
  triangles.clear();
  Collect collect(triangles);
  tree_->processAllTriangles(&collect, to_bullet(low), to_bullet(high));
}

ContactFinder::ContactFinder() : triangle_(ConvexCore::triangle()) {}

bool ContactFinder::nearest(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB,
                            double range, Nearest& result) const {
  const btTransform ta = to_bullet(X_WA.R, X_WA.p);
  const btTransform tb = to_bullet(X_WB.R, X_WB.p);
  const double radii = a.radius() + b.radius();
  const Vector3d apart = X_WA * a.center() - X_WB * b.center();
  const btVector3 guess = to_bullet(X_WA.R.transpose() * apart);
  btGjkEpaSolver2::sResults found;
  if (btGjkEpaSolver2::Distance(&a, ta, &b, tb, guess, found)) {
    const Vector3d on_a = from_bullet(found.witnesses[0]);
    const Vector3d on_b = from_bullet(found.witnesses[1]);
    const double distance = (on_a - on_b).norm();
    if (distance > 1e-10) {
      result = {on_a, on_b, (on_a - on_b) / distance, distance - radii};
      return result.gap <= range;
    }
  }
  // The cores overlap: only at a start with objects inside each other.
  if (btGjkEpaSolver2::Penetration(&a, ta, &b, tb, guess, found, false)) {
    const Vector3d normal = X_WA.R * from_bullet(found.normal);
    if (normal.squaredNorm() > 0.5) {
      result = {from_bullet(found.witnesses[0]), from_bullet(found.witnesses[1]), normal.normalized(),
                -std::abs(found.distance) - radii};
      return true;
    }
  }
  if (found.status == btGjkEpaSolver2::sResults::Separated) return false;
  // Touching cores that neither algorithm can order (two points or edges in one place): push the centres apart.
  const double distance = apart.norm();
  const Vector3d normal = distance > 0.0 ? Vector3d(apart / distance) : Vector3d::UnitZ();
  const Vector3d middle = 0.5 * (X_WA * a.center() + X_WB * b.center());
  result = {middle, middle, normal, -radii};
  return true;
}

const Feature& ContactFinder::clip_to_polygon(const Vector3d& axis, const Feature& polygon, const Feature& feature) {
  const Feature* from = &feature;
  for (int e = 0; e < polygon.count && from->count > 0; ++e) {
    const Vector3d& corner = polygon[e];
    const Vector3d inward = axis.cross(polygon[(e + 1) % polygon.count] - corner);
    const double offset = inward.dot(corner);
    Feature& to = buffers_[static_cast<std::size_t>(e & 1)];
    to.clear();
    const int count = from->count;
    double height = inward.dot((*from)[0]) - offset;
    if (count == 1) {
      if (height >= 0.0) to.add((*from)[0]);
    } else {
      // A segment is an open chain, a polygon a closed one.
      const int edges = count == 2 ? 1 : count;
      for (int i = 0; i < edges; ++i) {
        const Vector3d& p = (*from)[i];
        const Vector3d& q = (*from)[(i + 1) % count];
        const double next = inward.dot(q) - offset;
        if (height >= 0.0) to.add(p);
        if ((height > 0.0 && next < 0.0) || (height < 0.0 && next > 0.0)) {
          to.add(p + (q - p) * (height / (height - next)));
        }
        height = next;
      }
      if (count == 2 && height >= 0.0) to.add((*from)[1]);
    }
    from = &to;
  }
  return *from;
}

void ContactFinder::clip_features(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB,
                                  const Vector3d& normal, double range, std::vector<ContactPoint>& contacts) {
  a.facing(X_WA.R.transpose() * -normal, feature_a_);
  b.facing(X_WB.R.transpose() * normal, feature_b_);
  if (feature_a_.count < 2 || feature_b_.count < 2) return;
  to_world(X_WA, feature_a_);
  to_world(X_WB, feature_b_);
  const double radii = a.radius() + b.radius();
  const auto add = [&](const Vector3d& core_a, const Vector3d& core_b) {
    const double gap = normal.dot(core_a - core_b) - radii;
    if (gap > range) return;
    contacts.push_back({0.5 * ((core_a - normal * a.radius()) + (core_b + normal * b.radius())), normal, gap});
  };

  if (feature_a_.count == 2 && feature_b_.count == 2) {
    const Vector3d u = feature_a_[1] - feature_a_[0];
    const Vector3d v = feature_b_[1] - feature_b_[0];
    const double length = u.squaredNorm();
    if (length == 0.0 || v.squaredNorm() == 0.0 || u.cross(v).norm() > kParallelEdges * u.norm() * v.norm()) return;
    // Parallel segments touch along their common part.
    const double s0 = u.dot(feature_b_[0] - feature_a_[0]) / length;
    const double s1 = u.dot(feature_b_[1] - feature_a_[0]) / length;
    const double low = std::max(0.0, std::min(s0, s1));
    const double high = std::min(1.0, std::max(s0, s1));
    if (!(high > low)) return;
    for (const double s : {low, high}) {
      const double t = (s - s0) / (s1 - s0);
      add(feature_a_[0] + s * u, feature_b_[0] + t * v);
    }
    return;
  }

  const double align_a = feature_a_.count > 2 ? std::abs(feature_a_.normal.dot(normal)) : 0.0;
  const double align_b = feature_b_.count > 2 ? std::abs(feature_b_.normal.dot(normal)) : 0.0;
  // Ties (two parallel faces) go to B, the support, whatever the last bit says.
  const bool reference_is_a = align_a > align_b + 1e-6;
  const Feature& reference = reference_is_a ? feature_a_ : feature_b_;
  const double steep = reference.normal.dot(normal);
  if (std::abs(steep) < kSteepestFeature) return;
  const Feature& clipped =
      clip_to_polygon(steep > 0.0 ? normal : Vector3d(-normal), reference, reference_is_a ? feature_b_ : feature_a_);
  for (int i = 0; i < clipped.count; ++i) {
    const double t = reference.normal.dot(reference[0] - clipped[i]) / steep;
    const Vector3d opposite = clipped[i] + t * normal;
    if (reference_is_a) {
      add(opposite, clipped[i]);
    } else {
      add(clipped[i], opposite);
    }
  }
}

void ContactFinder::append_spread(std::size_t limit, std::vector<ContactPoint>& contacts) {
  if (found_.size() <= limit) {
    contacts.insert(contacts.end(), found_.begin(), found_.end());
    return;
  }
  // The deepest (the first of equals), then again and again the one farthest from all that were taken.
  std::size_t next = 0;
  for (std::size_t i = 1; i < found_.size(); ++i) {
    if (found_[i].gap < found_[next].gap - kSameGap) next = i;
  }
  spread_.assign(found_.size(), std::numeric_limits<double>::infinity());
  for (std::size_t taken = 0; taken < limit; ++taken) {
    contacts.push_back(found_[next]);
    const ContactPoint& last = found_[next];
    spread_[next] = -1.0;
    std::size_t farthest = found_.size();
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (spread_[i] < 0.0) continue;
      // Differing normals are far apart: a corner in a groove needs both walls.
      const double bend = (found_[i].normal - last.normal).squaredNorm();
      spread_[i] = std::min(spread_[i], (found_[i].position - last.position).squaredNorm() + 0.01 * bend);
      if (farthest == found_.size() || spread_[i] > spread_[farthest] * (1.0 + 1e-6)) farthest = i;
    }
    if (farthest == found_.size()) break;
    next = farthest;
  }
}

void ContactFinder::convex_convex(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB,
                                  double range, std::vector<ContactPoint>& contacts) {
  Nearest closest;
  if (!nearest(a, X_WA, b, X_WB, range, closest)) return;
  found_.clear();
  clip_features(a, X_WA, b, X_WB, closest.normal, range, found_);
  const bool covered =
      std::any_of(found_.begin(), found_.end(), [&](const ContactPoint& p) { return p.gap <= closest.gap + kSameGap; });
  if (!covered) {
    const Vector3d on_a = closest.on_a - closest.normal * a.radius();
    const Vector3d on_b = closest.on_b + closest.normal * b.radius();
    found_.push_back({0.5 * (on_a + on_b), closest.normal, closest.gap});
  }
  append_spread(kMaxPoints, contacts);
}

void ContactFinder::convex_surface(const ConvexCore& a, const Frame& X_WA, const SurfaceShape& b, const Frame& X_WB,
                                   double range, std::vector<ContactPoint>& contacts) {
  const Matrix3d R_BA = X_WB.R.transpose() * X_WA.R;
  const Vector3d center = X_WB.inverse_times(X_WA * a.box_center());
  const Vector3d half = R_BA.cwiseAbs() * a.box_half_size() + Vector3d::Constant(range);
  b.overlapping(center - half, center + half, triangles_);
  const geometry::TriangleMesh& mesh = b.mesh().mesh;
  std::vector<ContactPoint> points;
  points.swap(surface_points_);
  points.clear();
  for (const int index : triangles_) {
    const auto i = static_cast<std::size_t>(index);
    const std::array<Vector3d, 3> corners = {mesh.vertices[mesh.triangles[i][0]], mesh.vertices[mesh.triangles[i][1]],
                                             mesh.vertices[mesh.triangles[i][2]]};
    triangle_->set_triangle(corners[0], corners[1], corners[2]);
    Nearest closest;
    if (!nearest(a, X_WA, *triangle_, X_WB, range, closest)) continue;

    // On which of the triangle's edges does the nearest point lie, and may that edge be felt?
    const Vector3d area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const Vector3d q = X_WB.inverse_times(closest.on_b);
    bool on_seam = false;
    bool on_ridge = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& from = corners[k];
      const double share = (corners[(k + 1) % 3] - from).cross(q - from).dot(area) / area.squaredNorm();
      if (share > kOnEdge) continue;
      (b.mesh().ridges[i] >> k & 1u ? on_ridge : on_seam) = true;
    }
    found_.clear();
    if (on_seam && !on_ridge) {
      const Vector3d up = X_WB.R * area.normalized();
      const Vector3d normal = up.dot(closest.normal) >= 0.0 ? up : Vector3d(-up);
      clip_features(a, X_WA, *triangle_, X_WB, normal, range, found_);
    } else {
      clip_features(a, X_WA, *triangle_, X_WB, closest.normal, range, found_);
      const bool covered = std::any_of(found_.begin(), found_.end(),
                                       [&](const ContactPoint& p) { return p.gap <= closest.gap + kSameGap; });
      if (!covered) {
        const Vector3d on_a = closest.on_a - closest.normal * a.radius();
        found_.push_back({0.5 * (on_a + closest.on_b), closest.normal, closest.gap});
      }
    }
    for (const ContactPoint& p : found_) {
      const bool known = std::any_of(points.begin(), points.end(), [&](const ContactPoint& other) {
        return (p.position - other.position).squaredNorm() < kSamePoint * kSamePoint &&
               p.normal.dot(other.normal) > 0.99;
      });
      if (!known) points.push_back(p);
    }
  }
  found_.swap(points);
  append_spread(kMaxSurfacePoints, contacts);
  surface_points_.swap(points);
}

}  // namespace prescene::simulation
