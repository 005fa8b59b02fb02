// SPDX-License-Identifier: Apache-2.0
// Quickhull [Barber et al. 1996] on points that are snapped to a grid of 2^40 steps, where orientation is decided in
// exact integers. So there is no tolerance to tune and no degenerate input that confuses it, and the result depends on
// the set of points only: not on their order, and hull(hull(points)) == hull(points).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {
namespace {

// Differences of coordinates have 41 bits, components of a normal 83, a determinant 126: one bit less than there are.
constexpr int kGridBits = 40;
__extension__ using Wide = __int128;
using GridPoint = std::array<std::int64_t, 3>;
using WideVector = std::array<Wide, 3>;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

GridPoint difference(const GridPoint& a, const GridPoint& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

WideVector cross(const GridPoint& a, const GridPoint& b) {
  const auto term = [&](std::size_t i, std::size_t j) {
    return static_cast<Wide>(a[i]) * b[j] - static_cast<Wide>(a[j]) * b[i];
  };
  return {term(1, 2), term(2, 0), term(0, 1)};
}

double norm(const WideVector& v) {
  return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

// Counter-clockwise seen from outside; neighbours[k] lies across the edge from corners[k] to the next corner.
struct Face {
  std::array<std::uint32_t, 3> corners;
  std::array<std::uint32_t, 3> neighbours{kNone, kNone, kNone};
  WideVector normal{};
  std::vector<std::uint32_t> outside;  // Points above it that no earlier face took.
  bool alive = true;
  bool visible = false;
};

// The hull of distinct points in lexicographic order, which do not lie in a plane.
class Quickhull {
 public:
  explicit Quickhull(const std::vector<GridPoint>& points) : points_(points), face_from_(points.size(), kNone) {}

  // False when all points lie in (almost) one plane: thinner than 2^-30 of their extent.
  bool build() {
    if (!make_simplex()) return false;
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      while (faces_[f].alive && !faces_[f].outside.empty()) add_point(f, farthest(f));
    }
    return true;
  }

  // Points in which at least three edges meet that are true edges; the others lie inside a side or an edge of the hull.
  std::vector<std::uint32_t> corners() const {
    std::vector<int> edges(points_.size(), 0);
    for (const Face& face : faces_) {
      if (!face.alive) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (height(face, opposite(face, k)) != 0) ++edges[face.corners[k]];
      }
    }
    std::vector<std::uint32_t> result;
    for (std::uint32_t i = 0; i < edges.size(); ++i) {
      if (edges[i] >= 3) result.push_back(i);
    }
    return result;
  }

  std::vector<std::array<std::uint32_t, 3>> triangles() const {
    std::vector<std::array<std::uint32_t, 3>> result;
    for (const Face& face : faces_) {
      if (face.alive) result.push_back(face.corners);
    }
    return result;
  }

 private:
  // Six times the signed volume of the tetrahedron of a face and a point; positive above the face.
  Wide height(const Face& face, std::uint32_t point) const {
    const GridPoint d = difference(points_[point], points_[face.corners[0]]);
    return face.normal[0] * d[0] + face.normal[1] * d[1] + face.normal[2] * d[2];
  }

  // The corner of the neighbour across edge k that the face does not share.
  std::uint32_t opposite(const Face& face, std::size_t k) const {
    const Face& neighbour = faces_[face.neighbours[k]];
    for (const std::uint32_t corner : neighbour.corners) {
      if (corner != face.corners[k] && corner != face.corners[(k + 1) % 3]) return corner;
    }
    core::check_failed(__FILE__, __LINE__, "two faces of a hull share all corners", {});
  }

  // The farthest point above a face; of several the last, which is a corner of what they span.
  std::uint32_t farthest(std::uint32_t f) const {
    const Face& face = faces_[f];
    std::uint32_t best = face.outside.front();
    Wide best_height = height(face, best);
    for (const std::uint32_t point : face.outside) {
      const Wide h = height(face, point);
      if (h > best_height || (h == best_height && point > best)) {
        best = point;
        best_height = h;
      }
    }
    return best;
  }

  std::uint32_t add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    Face face;
    face.corners = {a, b, c};
    face.normal = cross(difference(points_[b], points_[a]), difference(points_[c], points_[a]));
    faces_.push_back(std::move(face));
    return static_cast<std::uint32_t>(faces_.size() - 1);
  }

  // Gives each point to the first of the faces from `begin` that it lies above; the others are inside.
  template <class Points>
  void assign(const Points& candidates, std::uint32_t begin) {
    for (const std::uint32_t point : candidates) {
      for (std::uint32_t f = begin; f < faces_.size(); ++f) {
        if (height(faces_[f], point) > 0) {
          faces_[f].outside.push_back(point);
          break;
        }
      }
    }
  }

  bool make_simplex() {
    if (points_.size() < 4) return false;
    constexpr double kThin = 0x1p-30 * (std::int64_t{1} << kGridBits);
    const auto last = static_cast<std::uint32_t>(points_.size() - 1);
    const GridPoint base = difference(points_[last], points_[0]);

    std::array<std::uint32_t, 3> far_point{};
    WideVector far_value{};
    for (std::uint32_t i = 0; i <= last; ++i) {
      const WideVector c = cross(base, difference(points_[i], points_[0]));
      for (std::size_t k = 0; k < 3; ++k) {
        const Wide value = c[k] < 0 ? -c[k] : c[k];
        if (value >= far_value[k]) {
          far_value[k] = value;
          far_point[k] = i;
        }
      }
    }
    const auto k = static_cast<std::size_t>(std::max_element(far_value.begin(), far_value.end()) - far_value.begin());
    const std::uint32_t third = far_point[k];
    const double base_length =
        std::hypot(static_cast<double>(base[0]), static_cast<double>(base[1]), static_cast<double>(base[2]));
    if (norm(cross(base, difference(points_[third], points_[0]))) < kThin * base_length) return false;

    const std::uint32_t first_face = add_face(0, last, third);
    std::uint32_t fourth = 0;
    Wide fourth_height = 0;
    for (std::uint32_t i = 0; i <= last; ++i) {
      const Wide h = height(faces_[first_face], i);
      if ((h < 0 ? -h : h) >= (fourth_height < 0 ? -fourth_height : fourth_height)) {
        fourth = i;
        fourth_height = h;
      }
    }
    if (std::abs(static_cast<double>(fourth_height)) < kThin * norm(faces_[first_face].normal)) return false;

    faces_.clear();
    std::array<std::uint32_t, 3> floor = {0, last, third};
    if (fourth_height > 0) std::swap(floor[1], floor[2]);  // The floor faces away from the fourth point.
    add_face(floor[0], floor[1], floor[2]);
    for (std::size_t e = 0; e < 3; ++e) add_face(floor[(e + 1) % 3], floor[e], fourth);
    for (std::uint32_t e = 0; e < 3; ++e) {
      faces_[0].neighbours[e] = 1 + e;
      faces_[1 + e].neighbours = {0, 1 + (e + 2) % 3, 1 + (e + 1) % 3};
    }
    std::vector<std::uint32_t> all(points_.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    assign(all, 0);
    return true;
  }

  // Replaces the faces that a point sees by the cone from the point to their outline.
  void add_point(std::uint32_t seen_face, std::uint32_t eye) {
    std::vector<std::uint32_t> visible = {seen_face};
    faces_[seen_face].visible = true;
    for (std::size_t i = 0; i < visible.size(); ++i) {
      for (const std::uint32_t n : faces_[visible[i]].neighbours) {
        if (faces_[n].visible || height(faces_[n], eye) <= 0) continue;
        faces_[n].visible = true;
        visible.push_back(n);
      }
    }

    const auto first_new = static_cast<std::uint32_t>(faces_.size());
    for (const std::uint32_t f : visible) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t beyond = faces_[f].neighbours[k];
        if (faces_[beyond].visible) continue;
        const std::uint32_t from = faces_[f].corners[k];
        const std::uint32_t to = faces_[f].corners[(k + 1) % 3];
        const std::uint32_t made = add_face(from, to, eye);
        faces_[made].neighbours[0] = beyond;
        for (std::size_t m = 0; m < 3; ++m) {
          if (faces_[beyond].corners[m] == to) faces_[beyond].neighbours[m] = made;
        }
        PRESCENE_CHECK_MSG(face_from_[from] == kNone, "the outline of the visible faces is one loop");
        face_from_[from] = made;
      }
    }
    for (std::uint32_t f = first_new; f < faces_.size(); ++f) {
      const std::uint32_t next = face_from_[faces_[f].corners[1]];
      PRESCENE_CHECK(next != kNone);
      faces_[f].neighbours[1] = next;
      faces_[next].neighbours[2] = f;
    }
    for (std::uint32_t f = first_new; f < faces_.size(); ++f) face_from_[faces_[f].corners[0]] = kNone;

    for (const std::uint32_t f : visible) {
      faces_[f].alive = faces_[f].visible = false;
      const std::vector<std::uint32_t> orphans = std::exchange(faces_[f].outside, {});
      assign(orphans, first_new);
    }
  }

  const std::vector<GridPoint>& points_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> face_from_;  // While a cone is made: its face whose outline edge starts at the vertex.
};

struct GridEntry {
  GridPoint place;
  Vector3d position;
};

// The points on the grid, lexicographic, each place once.
std::vector<GridEntry> snapped(const std::vector<Vector3d>& points) {
  Box box;
  for (const Vector3d& p : points) box.extend(p);
  int exponent = 0;
  std::frexp(box.sizes().maxCoeff(), &exponent);  // extent < 2^exponent
  std::vector<GridEntry> entries;
  entries.reserve(points.size());
  for (const Vector3d& p : points) {
    GridPoint place;
    for (int i = 0; i < 3; ++i) {
      place[static_cast<std::size_t>(i)] = std::llround(std::ldexp(p[i] - box.min()[i], kGridBits - exponent));
    }
    entries.push_back({place, p});
  }
  std::sort(entries.begin(), entries.end(), [](const GridEntry& a, const GridEntry& b) {
    if (a.place != b.place) return a.place < b.place;
    return std::lexicographical_compare(a.position.begin(), a.position.end(), b.position.begin(), b.position.end());
  });
  const auto same_place = [](const GridEntry& a, const GridEntry& b) { return a.place == b.place; };
  entries.erase(std::unique(entries.begin(), entries.end(), same_place), entries.end());
  return entries;
}

std::vector<GridPoint> places_of(const std::vector<GridEntry>& entries) {
  std::vector<GridPoint> places;
  places.reserve(entries.size());
  for (const GridEntry& entry : entries) places.push_back(entry.place);
  return places;
}

}  // namespace

core::Result<TriangleMesh> convex_hull(const std::vector<Vector3d>& points) {
  for (const Vector3d& p : points) {
    if (!p.allFinite()) return core::invalid_input("a point for a convex hull is not finite: repair the mesh first");
  }
  std::vector<GridEntry> entries = snapped(points);
  {
    const std::vector<GridPoint> places = places_of(entries);
    Quickhull hull(places);
    if (!hull.build()) {
      return core::invalid_input("a convex hull needs points that do not lie in one plane; these " +
                                 std::to_string(points.size()) + " do: give the body a thickness");
    }
    std::vector<GridEntry> corners;
    for (const std::uint32_t i : hull.corners()) corners.push_back(entries[i]);
    entries = std::move(corners);
  }
  // Again with the corners only: points inside of sides and edges that were vertices on the way are gone.
  const std::vector<GridPoint> places = places_of(entries);
  Quickhull hull(places);
  PRESCENE_CHECK(hull.build());
  TriangleMesh mesh;
  mesh.triangles = hull.triangles();
  mesh.vertices.reserve(entries.size());
  for (const GridEntry& entry : entries) mesh.vertices.push_back(entry.position);
  return mesh;
}

}  // namespace prescene::geometry
