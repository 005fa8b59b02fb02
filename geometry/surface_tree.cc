// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/surface_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>

#include "box_tree.h"
#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

std::vector<BoxTree::ItemBox> boxes_of(const TriangleMesh& mesh) {
  PRESCENE_CHECK(!mesh.triangles.empty());
  std::vector<BoxTree::ItemBox> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }
  return boxes;
}

}  // namespace

struct SurfaceTree::Tree {
  BoxTree boxes;
};

SurfaceTree::SurfaceTree(const TriangleMesh& mesh)
    : mesh_(&mesh), tree_(std::make_unique<const Tree>(Tree{BoxTree(boxes_of(mesh), 4)})) {}
SurfaceTree::~SurfaceTree() = default;
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;

PlaceInTriangle SurfaceTree::place_in(std::uint32_t triangle, const Vector3d& p) const {
  const auto& t = mesh_->triangles[triangle];
  return nearest_in_triangle(p, mesh_->vertices[t[0]], mesh_->vertices[t[1]], mesh_->vertices[t[2]]);
}

SurfaceTree::Nearest SurfaceTree::nearest(const Vector3d& p, std::uint32_t hint) const {
  Nearest best{hint, place_in(hint, p)};
  // A box may be off by rounding where a triangle is as near as the best; the search must not leave it out.
  const auto bound_of = [](double squared) { return squared * (1.0 + 1e-12); };
  double bound = bound_of(best.place.squared_distance);
  tree_->boxes.search(p, bound, [&](std::size_t leaf, std::uint32_t begin) {
    for (std::uint32_t i = begin; i < tree_->boxes.leaf_begins()[leaf + 1]; ++i) {
      const std::uint32_t triangle = tree_->boxes.order()[i];
      const PlaceInTriangle place = place_in(triangle, p);
      const double squared = place.squared_distance;
      const bool nearer = squared < best.place.squared_distance;
      if (!nearer && !(squared == best.place.squared_distance && triangle < best.triangle)) continue;
      best = {triangle, place};
      bound = bound_of(squared);
    }
  });
  return best;
}

bool SurfaceTree::is_within(const Vector3d& p, double distance) const {
  double bound = distance * distance;
  bool found = false;
  tree_->boxes.search(p, bound, [&](std::size_t leaf, std::uint32_t begin) {
    for (std::uint32_t i = begin; i < tree_->boxes.leaf_begins()[leaf + 1] && !found; ++i)
      found = place_in(tree_->boxes.order()[i], p).squared_distance <= bound;
    if (found) bound = -1.0;
  });
  return found;
}

namespace {

/// A corner of a piece, and what of the other surface is nearest to it.
struct Corner {
  Vector3d p;
  double distance;
  std::uint32_t triangle;
};

/// The least squared distance between two segments [Ericson 2005, section 5.1.9].
double squared_distance_of_segments(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a, v = d - c, r = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), ur = u.dot(r), vr = v.dot(r);
  const double determinant = uu * vv - uv * uv;
  const double s = determinant > 0.0 ? std::clamp((uv * vr - vv * ur) / determinant, 0.0, 1.0) : 0.0;
  const double t = vv > 0.0 ? std::clamp((uv * s + vr) / vv, 0.0, 1.0) : 0.0;
  const double again = uu > 0.0 ? std::clamp((uv * t - ur) / uu, 0.0, 1.0) : 0.0;
  return (r + again * u - t * v).squaredNorm();
}

/// A part of a triangle, none of whose points is further than `bound` from the other surface.
struct Piece {
  std::array<Corner, 3> corners;
  double bound;

  friend bool operator<(const Piece& x, const Piece& y) { return x.bound < y.bound; }
};

class DistanceSearch {
 public:
  explicit DistanceSearch(const SurfaceTree& to) : to_(to) {}

  Corner corner(const Vector3d& p, std::uint32_t hint) {
    const SurfaceTree::Nearest nearest = to_.nearest(p, hint);
    ++questions_;
    Corner found{p, std::sqrt(nearest.place.squared_distance), nearest.triangle};
    largest_ = std::max(largest_, found.distance);
    return found;
  }

  Piece piece(const std::array<Corner, 3>& corners) const {
    double bound = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      // The distance to one triangle, which is convex, is largest at a corner ...
      double to_triangle = 0.0;
      for (const Corner& corner : corners)
        to_triangle = std::max(to_triangle, to_.place_in(corners[k].triangle, corner.p).squared_distance);
      // ... and no point is further from the surface than a corner is, by more than it is from that corner.
      const double across =
          std::max((corners[(k + 1) % 3].p - corners[k].p).norm(), (corners[(k + 2) % 3].p - corners[k].p).norm());
      bound = std::min({bound, std::sqrt(to_triangle), corners[k].distance + across});
      bound = std::min(bound, over_an_edge(corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]));
    }
    return {corners, bound};
  }

  /// Where what is nearest to `lone` is in one triangle and what is nearest to the others in its neighbour: the piece
  /// is laid onto both, linearly on either side of a cut through the two sides at `lone`, which is laid onto the edge
  /// that the triangles share. No point is then moved further than a corner or an end of the cut is.
  double over_an_edge(const Corner& lone, const Corner& a, const Corner& b) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (a.triangle != b.triangle || lone.triangle == a.triangle) return kNever;
    const auto& t = to_.mesh().triangles[lone.triangle];
    const auto& other = to_.mesh().triangles[a.triangle];
    std::array<Vector3d, 2> edge;
    std::size_t shared = 0;
    for (const std::uint32_t v : t)
      if (shared < 2 && std::find(other.begin(), other.end(), v) != other.end())
        edge[shared++] = to_.mesh().vertices[v];
    if (shared < 2) return kNever;
    const double ends = std::max(squared_distance_of_segments(lone.p, a.p, edge[0], edge[1]),
                                 squared_distance_of_segments(lone.p, b.p, edge[0], edge[1]));
    return std::max({lone.distance, a.distance, b.distance, std::sqrt(ends)});
  }

  double largest() const { return largest_; }
  std::size_t questions() const { return questions_; }

 private:
  const SurfaceTree& to_;
  double largest_ = 0.0;
  std::size_t questions_ = 0;
};

}  // namespace

double largest_distance(const TriangleMesh& from, const SurfaceTree& to, double tolerance) {
  PRESCENE_CHECK(tolerance > 0.0);
  constexpr double kNegligible = 1e-4;  // of the size
  constexpr std::size_t kFewestLimit = 1'000'000;
  constexpr std::size_t kLimitPerTriangle = 20;
  if (from.triangles.empty()) return 0.0;
  const std::size_t limit =
      std::max(kFewestLimit, kLimitPerTriangle * (from.triangles.size() + to.mesh().triangles.size()));
  const double negligible = kNegligible * bounding_box(from).sizes().norm();
  DistanceSearch search(to);
  std::vector<std::optional<Corner>> corners(from.vertices.size());
  std::uint32_t hint = 0;
  for (const auto& t : from.triangles) {
    for (const std::uint32_t v : t) {
      if (corners[v]) continue;
      corners[v] = search.corner(from.vertices[v], hint);
      hint = corners[v]->triangle;
    }
  }
  std::priority_queue<Piece> pieces;
  for (const auto& t : from.triangles) pieces.push(search.piece({*corners[t[0]], *corners[t[1]], *corners[t[2]]}));
  while (pieces.top().bound > (1.0 + tolerance) * search.largest() + negligible && search.questions() < limit) {
    const std::array<Corner, 3> whole = pieces.top().corners;
    pieces.pop();
    std::array<Corner, 3> middles;
    for (std::size_t k = 0; k < 3; ++k)
      middles[k] = search.corner(0.5 * (whole[k].p + whole[(k + 1) % 3].p), whole[k].triangle);
    for (std::size_t k = 0; k < 3; ++k) pieces.push(search.piece({whole[k], middles[k], middles[(k + 2) % 3]}));
    pieces.push(search.piece(middles));
  }
  return pieces.top().bound;
}

double surface_distance(const SurfaceTree& a, const SurfaceTree& b, double tolerance) {
  return std::max(largest_distance(a.mesh(), b, tolerance), largest_distance(b.mesh(), a, tolerance));
}

}  // namespace prescene::geometry
