// SPDX-License-Identifier: Apache-2.0
#include "surface_features.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// rad: faces that meet at more than this have a sharp edge between them.
constexpr double kSharp = 0.5;
// Facets stand for a surface that bends: its spheres may rise over them by this times their angle times their width (a
// quarter is how far the round surface does where it bends both ways).
constexpr double kRise = 0.35;

/// For each vertex the lowest index of one at the same position.
std::vector<std::uint32_t> welded_vertices(const Mesh& mesh) {
  std::map<std::tuple<float, float, float>, std::uint32_t> first;
  std::vector<std::uint32_t> welded;
  for (std::uint32_t i = 0; i < mesh.vertices().size(); ++i) {
    const Vector3f& v = mesh.vertices()[i];
    welded.push_back(first.emplace(std::tuple(v.x(), v.y(), v.z()), i).first->second);
  }
  return welded;
}

/// Of an edge, one triangle that has it.
struct EdgeUse {
  std::uint32_t low, high;  // vertices; at equal positions they are one
  std::uint32_t triangle;
  std::uint32_t opposite;  // its third vertex
};

/// Sorted by the edge.
std::vector<EdgeUse> edge_uses(const Mesh& mesh, const std::vector<std::uint32_t>& welded) {
  std::vector<EdgeUse> uses;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = welded[mesh.triangles()[t][k]];
      const std::uint32_t b = welded[mesh.triangles()[t][(k + 1) % 3]];
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), t, welded[mesh.triangles()[t][(k + 2) % 3]]});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& x, const EdgeUse& y) {
    return std::tuple(x.low, x.high, x.triangle) < std::tuple(y.low, y.high, y.triangle);
  });
  return uses;
}

class FeatureFinder {
 public:
  explicit FeatureFinder(const Mesh& mesh)
      : mesh_(mesh), size_(static_cast<double>(mesh.size())), welded_(welded_vertices(mesh)) {}

  SurfaceFeatures find() {
    measure_triangles();
    find_edges();
    smooth_normals();
    return std::move(features_);
  }

 private:
  /// What meets at a vertex.
  struct Corner {
    std::vector<Vector3d> normals, neighbours;
  };
  Vector3d vertex(std::uint32_t index) const { return mesh_.vertices()[index].cast<double>(); }
  Vector3d corner(std::uint32_t triangle, std::size_t k) const { return vertex(mesh_.triangles()[triangle][k]); }

  void measure_triangles() {
    const std::uint32_t count = mesh_.triangle_count();
    features_.normals.resize(count);
    features_.areas.resize(count);
    for (std::uint32_t t = 0; t < count; ++t) {
      const Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      const Vector3d cross = (b - a).cross(c - a);
      const double norm = cross.norm();
      features_.areas[t] = 0.5 * norm;
      features_.normals[t] = norm > 0.0 ? Vector3d(cross / norm) : Vector3d::UnitZ();
      features_.volume += a.dot(b.cross(c)) / 6.0;
    }
  }

  void find_edges() {
    features_.bends.assign(mesh_.triangle_count(), 0.0);
    features_.rises.assign(mesh_.triangle_count(), 0.0);
    std::map<std::uint32_t, Corner> corners;
    const std::vector<EdgeUse> uses = edge_uses(mesh_, welded_);
    for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
      while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
      if (end - begin == 2) look_at_edge(uses[begin], uses[begin + 1], &corners);
    }
    find_corners(corners);
  }

  void look_at_edge(const EdgeUse& x, const EdgeUse& y, std::map<std::uint32_t, Corner>* corners) {
    if (features_.areas[x.triangle] == 0.0 || features_.areas[y.triangle] == 0.0) return;
    const Vector3d from = vertex(x.low), to = vertex(x.high);
    const Vector3d& normal_x = features_.normals[x.triangle];
    const Vector3d& normal_y = features_.normals[y.triangle];
    const double angle = std::atan2(normal_x.cross(normal_y).norm(), normal_x.dot(normal_y));
    const bool convex = normal_x.dot(vertex(y.opposite) - from) < 0.0;
    if (angle < kSharp) {
      const double width = (features_.areas[x.triangle] + features_.areas[y.triangle]) / (to - from).norm();
      for (const std::uint32_t t : {x.triangle, y.triangle}) {
        features_.bends[t] = std::max(features_.bends[t], angle / width);
        features_.rises[t] = std::max(features_.rises[t], kRise * angle * width);
      }
    } else if (convex) {
      features_.edges.push_back({from, to, normal_x, normal_y});
    }
    for (const auto& [here, there] : {std::pair(x.low, x.high), std::pair(x.high, x.low)}) {
      Corner& c = (*corners)[here];
      c.neighbours.push_back(vertex(there));
      for (const Vector3d& normal : {normal_x, normal_y}) {
        const bool known =
            std::any_of(c.normals.begin(), c.normals.end(), [&](const Vector3d& n) { return n.dot(normal) > 0.95; });
        if (!known) c.normals.push_back(normal);
      }
    }
  }

  void find_corners(const std::map<std::uint32_t, Corner>& corners) {
    // Corners: all edges fall away from the mean normal, and the faces are far from flat.
    for (const auto& [index, c] : corners) {
      Vector3d mean = Vector3d::Zero();
      for (const Vector3d& n : c.normals) mean += n;
      if (mean.norm() < 1e-6) continue;
      mean.normalize();
      const Vector3d p = vertex(index);
      const bool convex = std::all_of(c.neighbours.begin(), c.neighbours.end(),
                                      [&](const Vector3d& q) { return mean.dot(q - p) < 1e-9 * size_; });
      const bool sharp =
          std::any_of(c.normals.begin(), c.normals.end(), [&](const Vector3d& n) { return n.dot(mean) < 0.9; });
      if (convex && sharp) features_.corners.push_back({p, mean});
    }
  }

  void smooth_normals() {
    std::vector<std::vector<std::uint32_t>> around(mesh_.vertices().size());
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t)
      for (const std::uint32_t v : mesh_.triangles()[t]) around[welded_[v]].push_back(t);
    features_.corner_normals.resize(mesh_.triangle_count());
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        Vector3d sum = Vector3d::Zero();
        if (features_.bends[t] > 0.0) {
          for (const std::uint32_t other : around[welded_[mesh_.triangles()[t][k]]])
            if (features_.normals[other].dot(features_.normals[t]) > std::cos(kSharp))
              sum += features_.areas[other] * features_.normals[other];
        }
        features_.corner_normals[t][k] = sum.norm() > 0.0 ? Vector3d(sum.normalized()) : features_.normals[t];
      }
    }
  }

  const Mesh& mesh_;
  double size_;
  std::vector<std::uint32_t> welded_;
  SurfaceFeatures features_;
};

}  // namespace

SurfaceFeatures surface_features(const Mesh& mesh) { return FeatureFinder(mesh).find(); }

}  // namespace prescene::collision
