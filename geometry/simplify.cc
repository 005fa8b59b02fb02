// SPDX-License-Identifier: Apache-2.0
// Edge collapse by quadric error [Garland & Heckbert 1997].
#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>

#include <Eigen/LU>

#include "mesh_edges.h"
#include "prescene/core/check.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {
namespace {

// Sum of weighted squared distances to planes, as a function of the point: x'Ax + 2b'x + c.
struct Quadric {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double c = 0.0;

  void add_plane(const Vector3d& normal, const Vector3d& point, double weight) {
    const double d = -normal.dot(point);
    A += weight * normal * normal.transpose();
    b += weight * d * normal;
    c += weight * d * d;
  }
  void add_point(const Vector3d& point, double weight) {
    A += weight * Matrix3d::Identity();
    b -= weight * point;
    c += weight * point.squaredNorm();
  }
  void add(const Quadric& other) {
    A += other.A;
    b += other.b;
    c += other.c;
  }
  double at(const Vector3d& x) const { return std::max(0.0, x.dot(A * x) + 2.0 * b.dot(x) + c); }
};

struct Collapse {
  double cost;
  std::uint32_t keep;
  std::uint32_t drop;
  std::uint32_t version;  // Sum of both vertices' versions when it was made: an older one is out of date.
  Vector3d position;
  bool changes_topology = false;

  // The cheapest first; vertices break ties, so that the order is total.
  friend bool operator<(const Collapse& x, const Collapse& y) {
    return std::tie(y.cost, y.keep, y.drop) < std::tie(x.cost, x.keep, x.drop);
  }
};

class Simplifier {
 public:
  explicit Simplifier(const TriangleMesh& mesh) : positions_(mesh.vertices), triangles_(mesh.triangles) {
    // Far from the origin the quadrics' constants would cancel, so they are about the middle.
    middle_ = bounding_box(mesh).center();
    for (Vector3d& p : positions_) p -= middle_;
    const std::size_t count = positions_.size();
    quadrics_.resize(count);
    versions_.assign(count, 0);
    triangles_of_.resize(count);
    alive_.assign(triangles_.size(), true);
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      for (const std::uint32_t v : triangles_[i]) triangles_of_[v].push_back(i);
    }
    left_ = triangles_.size();
    make_quadrics();
  }

  // Collapses the cheapest edges first. With `keep_shape` none that turns a triangle over or squeezes it to a sliver,
  // so that more triangles may be left than wanted.
  void run(std::size_t max_triangles, bool keep_shape) {
    if (left_ <= max_triangles) return;
    std::priority_queue<Collapse> queue;
    for_each_edge(edge_uses(alive_triangles()),
                  [&](std::span<const EdgeUse> edge) { queue.push(make_collapse(edge[0].low, edge[0].high)); });
    while (left_ > max_triangles && !queue.empty()) {
      Collapse collapse = queue.top();
      queue.pop();
      if (collapse.version != versions_[collapse.keep] + versions_[collapse.drop]) continue;
      if (triangles_of_[collapse.drop].empty() || triangles_of_[collapse.keep].empty()) continue;
      if (!collapse.changes_topology && !keeps_topology(collapse)) {
        // Tunnels and necks stay as long as there is something nearly as cheap to do. Forbidding it would be worse:
        // scans have such tunnels in their noise by the hundred, and all triangles would end up there.
        constexpr double kTopologyFactor = 10.0;
        collapse.changes_topology = true;
        collapse.cost *= kTopologyFactor;
        queue.push(collapse);
        continue;
      }
      if (keep_shape && !keeps_shape(collapse)) continue;
      apply(collapse);
      if (collapse.changes_topology) remove_cancelling(collapse.keep);
      for (const std::uint32_t v : neighbours(collapse.keep)) {
        queue.push(make_collapse(std::min(v, collapse.keep), std::max(v, collapse.keep)));
      }
    }
  }

  TriangleMesh mesh() const {
    std::vector<Vector3d> positions = positions_;
    for (Vector3d& p : positions) p += middle_;
    return with_used_vertices(positions, alive_triangles());
  }

  std::size_t triangles_left() const { return left_; }

 private:
  std::vector<Triangle> alive_triangles() const {
    std::vector<Triangle> result;
    result.reserve(left_);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (alive_[i]) result.push_back(triangles_[i]);
    }
    return result;
  }

  void make_quadrics() {
    double total = 0.0;
    for (const Triangle& t : triangles_) {
      const Vector3d doubled = area_vector(t);
      const double doubled_area = doubled.norm();
      total += doubled_area;
      if (doubled_area == 0.0) continue;
      for (const std::uint32_t v : t) {
        quadrics_[v].add_plane(doubled / doubled_area, positions_[t[0]], doubled_area);
        // A little pull towards where the surface was: on flat parts, where planes leave the place open, it keeps the
        // best position unique and the vertices spread out.
        constexpr double kPull = 1e-3;
        quadrics_[v].add_point(positions_[v], kPull * doubled_area);
      }
    }
    // Open edges are held by planes through them, across their triangles.
    for_each_edge(edge_uses(triangles_), [&](std::span<const EdgeUse> edge) {
      if (edge.size() != 1) return;
      const Vector3d along = positions_[edge[0].high] - positions_[edge[0].low];
      const Vector3d across = along.cross(area_vector(triangles_[edge[0].triangle]));
      if (across.isZero()) return;
      constexpr double kBorderWeight = 10.0;
      const double weight = kBorderWeight * along.squaredNorm();
      for (const std::uint32_t v : {edge[0].low, edge[0].high}) {
        quadrics_[v].add_plane(across.normalized(), positions_[edge[0].low], weight);
      }
    });
  }

  Vector3d area_vector(const Triangle& t) const {
    const Vector3d& a = positions_[t[0]];
    return (positions_[t[1]] - a).cross(positions_[t[2]] - a);
  }

  Collapse make_collapse(std::uint32_t low, std::uint32_t high) const {
    Quadric sum = quadrics_[low];
    sum.add(quadrics_[high]);
    const Vector3d& a = positions_[low];
    const Vector3d& b = positions_[high];
    Vector3d best = 0.5 * (a + b);
    double cost = sum.at(best);
    const auto consider = [&](const Vector3d& x) {
      const double c = sum.at(x);
      if (c < cost) {
        cost = c;
        best = x;
      }
    };
    consider(a);
    consider(b);
    Matrix3d inverse;
    bool invertible = false;
    const double scale = sum.A.trace();
    sum.A.computeInverseWithCheck(inverse, invertible, 1e-9 * scale * scale * scale);
    if (invertible) {
      const Vector3d x = -(inverse * sum.b);
      // The minimum of nearly parallel planes may be far away; the surface there is not what the planes say.
      if ((x - 0.5 * (a + b)).squaredNorm() <= (a - b).squaredNorm()) consider(x);
    }
    return {cost, low, high, versions_[low] + versions_[high], best};
  }

  std::vector<std::uint32_t> neighbours(std::uint32_t v) const {
    std::vector<std::uint32_t> result;
    for (const std::uint32_t i : triangles_of_[v]) {
      for (const std::uint32_t w : triangles_[i]) {
        if (w != v) result.push_back(w);
      }
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  bool has(std::uint32_t triangle, std::uint32_t v) const {
    const Triangle& t = triangles_[triangle];
    return t[0] == v || t[1] == v || t[2] == v;
  }

  // The vertices that both ends share are the third corners of the triangles at the edge, no others: otherwise the
  // collapse would fold the surface onto itself [Dey et al. 1999].
  bool keeps_topology(const Collapse& collapse) const {
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t i : triangles_of_[collapse.drop]) {
      if (!has(i, collapse.keep)) continue;
      for (const std::uint32_t w : triangles_[i]) {
        if (w != collapse.keep && w != collapse.drop) corners.push_back(w);
      }
    }
    std::sort(corners.begin(), corners.end());
    if (corners.size() > 2 || std::adjacent_find(corners.begin(), corners.end()) != corners.end()) return false;
    const std::vector<std::uint32_t> of_keep = neighbours(collapse.keep);
    const std::vector<std::uint32_t> of_drop = neighbours(collapse.drop);
    std::vector<std::uint32_t> shared;
    std::set_intersection(of_keep.begin(), of_keep.end(), of_drop.begin(), of_drop.end(), std::back_inserter(shared));
    if (shared != corners) return false;
    // A tetrahedron passes the test but would become two triangles back to back.
    if (of_keep.size() <= 3 && of_drop.size() <= 3) return false;
    // An edge across the surface between two open edges must not pinch it.
    return corners.size() == 1 || !(on_border(collapse.keep) && on_border(collapse.drop));
  }

  bool on_border(std::uint32_t v) const {
    for (const std::uint32_t w : neighbours(v)) {
      const auto uses =
          std::count_if(triangles_of_[v].begin(), triangles_of_[v].end(), [&](std::uint32_t i) { return has(i, w); });
      if (uses == 1) return true;
    }
    return false;
  }

  bool keeps_shape(const Collapse& collapse) const {
    for (const std::uint32_t end : {collapse.keep, collapse.drop}) {
      for (const std::uint32_t i : triangles_of_[end]) {
        if (has(i, collapse.keep) && has(i, collapse.drop)) continue;
        const Triangle& t = triangles_[i];
        std::array<Vector3d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) p[k] = t[k] == end ? collapse.position : positions_[t[k]];
        const Vector3d before = area_vector(t);
        const Vector3d after = (p[1] - p[0]).cross(p[2] - p[0]);
        // Turned by more than 75 degrees, or squeezed to a sliver.
        constexpr double kCosine = 0.25;
        constexpr double kThinSliver = 1e-3;
        const double longest =
            std::max({(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()});
        if (after.norm() < kThinSliver * longest) return false;
        if (before.dot(after) < kCosine * before.norm() * after.norm()) return false;
      }
    }
    return true;
  }

  void apply(const Collapse& collapse) {
    positions_[collapse.keep] = collapse.position;
    quadrics_[collapse.keep].add(quadrics_[collapse.drop]);
    const std::vector<std::uint32_t> moving = triangles_of_[collapse.drop];
    for (const std::uint32_t i : moving) {
      if (has(i, collapse.keep)) {
        remove(i);
        continue;
      }
      std::replace(triangles_[i].begin(), triangles_[i].end(), collapse.drop, collapse.keep);
      triangles_of_[collapse.keep].push_back(i);
    }
    triangles_of_[collapse.drop].clear();
    ++versions_[collapse.keep];
    ++versions_[collapse.drop];
  }

  void remove(std::uint32_t triangle) {
    alive_[triangle] = false;
    --left_;
    for (const std::uint32_t w : triangles_[triangle]) std::erase(triangles_of_[w], triangle);
  }

  // Removes pairs of triangles back to back at a vertex: they enclose nothing.
  void remove_cancelling(std::uint32_t v) {
    const auto opposite_sides = [&](std::uint32_t i, std::uint32_t j) {
      const Triangle& t = triangles_[i];
      const Triangle& u = triangles_[j];
      for (std::size_t k = 0; k < 3; ++k) {
        if (u[k] == t[0] && u[(k + 1) % 3] == t[2] && u[(k + 2) % 3] == t[1]) return true;
      }
      return false;
    };
    const std::vector<std::uint32_t> around = triangles_of_[v];
    for (std::size_t i = 0; i < around.size(); ++i) {
      for (std::size_t j = i + 1; j < around.size() && alive_[around[i]]; ++j) {
        if (!alive_[around[j]] || !opposite_sides(around[i], around[j])) continue;
        remove(around[i]);
        remove(around[j]);
      }
    }
  }

  Vector3d middle_;
  std::vector<Vector3d> positions_;
  std::vector<Triangle> triangles_;
  std::vector<bool> alive_;
  std::size_t left_ = 0;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> versions_;
  std::vector<std::vector<std::uint32_t>> triangles_of_;
};

}  // namespace

TriangleMesh simplified(const TriangleMesh& mesh, int max_triangles) {
  PRESCENE_CHECK(max_triangles >= 4);
  const auto wanted = static_cast<std::size_t>(max_triangles);
  if (mesh.triangles.size() <= wanted) return mesh;
  TriangleMesh clean = mesh;
  if (auto repaired = repair_mesh(mesh, nullptr); repaired.ok()) clean = *std::move(repaired);
  Simplifier simplifier(clean);
  for (const bool keep_shape : {true, false}) {
    // What was not allowed at its turn may be later.
    std::size_t before = 0;
    do {
      before = simplifier.triangles_left();
      simplifier.run(wanted, keep_shape);
    } while (simplifier.triangles_left() < before);
  }
  return simplifier.mesh();
}

}  // namespace prescene::geometry
