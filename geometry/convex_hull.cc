// SPDX-License-Identifier: Apache-2.0
// Quickhull [Barber et al. 1996] on points that are snapped to a grid of 2^40 steps, where orientation is decided in
// exact integers. So there is no tolerance to tune and no degenerate input that confuses it, and the result depends on
// the set of points only: not on their order, and hull(hull(points)) == hull(points).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/geometry/cancellable.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {
namespace {

// Differences of coordinates have 41 bits, components of a normal 83, a determinant 126: one bit less than there are.
constexpr int kGridBits = 40;
__extension__ using Wide = __int128;
using GridPoint = std::array<std::int64_t, 3>;
using WideVector = std::array<Wide, 3>;

// What is left out, and four times as much: what has to be above a plane for points not to count as flat, in grid
// steps.
constexpr double kTolerance = 0x1p-30 * (std::int64_t{1} << kGridBits);
constexpr double kThin = 4.0 * kTolerance;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

GridPoint difference(const GridPoint& a, const GridPoint& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

WideVector cross(const GridPoint& a, const GridPoint& b) {
  const auto term = [&](std::size_t i, std::size_t j) {
    return static_cast<Wide>(a[i]) * b[j] - static_cast<Wide>(a[j]) * b[i];
  };
  return {term(1, 2), term(2, 0), term(0, 1)};
}

Wide squared_length(const GridPoint& d) {
  return static_cast<Wide>(d[0]) * d[0] + static_cast<Wide>(d[1]) * d[1] + static_cast<Wide>(d[2]) * d[2];
}

double norm(const WideVector& v) {
  return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

// Counter-clockwise seen from outside; neighbours[k] lies across the edge from corners[k] to the next corner.
struct Face {
  std::array<std::uint32_t, 3> corners;
  std::array<std::uint32_t, 3> neighbours{kNone, kNone, kNone};
  WideVector normal{};
  Wide tolerance = 0;                  // Height of a point that is just worth adding.
  std::vector<std::uint32_t> outside;  // Points above it that no earlier face took.
  bool visible = false;
  std::uint32_t skipped = kNone;  // First of the skipped points that are above it, see Quickhull::next_skipped_.
};

// The hull of distinct points in lexicographic order, which do not lie in a plane.
class Quickhull {
 public:
  explicit Quickhull(const std::vector<GridPoint>& points)
      : points_(points), next_skipped_(points.size(), kNone), face_from_(points.size(), kNone) {}

  // False when all points lie in (almost) one plane, and where it was stopped.
  bool build(const core::Cancellation* cancellation) {
    if (!make_simplex()) return false;
    for (std::uint32_t f = 0; f < slots_.size();) {
      for (; f < slots_.size(); ++f) {
        while (is_alive(f) && !face(f).outside.empty()) {
          if (cancellation && cancellation->requested()) return false;
          add_point(f, farthest(f));
        }
      }
      // A point may be just above a face that is gone but clearly above one of those that stayed.
      f = reconsider_skipped();
    }
    return true;
  }

  // Points in which at least three edges meet that are true edges; the others lie inside a side or an edge of the hull.
  std::vector<std::uint32_t> corners() const {
    std::vector<int> edges(points_.size(), 0);
    for (std::uint32_t f = 0; f < slots_.size(); ++f) {
      if (!is_alive(f)) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (height(face(f), opposite(face(f), k)) != 0) ++edges[face(f).corners[k]];
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
    for (std::uint32_t f = 0; f < slots_.size(); ++f) {
      if (is_alive(f)) result.push_back(face(f).corners);
    }
    return result;
  }

 private:
  bool is_alive(std::uint32_t f) const { return slots_[f] != kNone; }
  Face& face(std::uint32_t f) { return faces_[slots_[f]]; }
  const Face& face(std::uint32_t f) const { return faces_[slots_[f]]; }

  // Six times the signed volume of the tetrahedron of a face and a point; positive above the face.
  Wide height(const Face& face, std::uint32_t point) const {
    const GridPoint d = difference(points_[point], points_[face.corners[0]]);
    return face.normal[0] * d[0] + face.normal[1] * d[1] + face.normal[2] * d[2];
  }

  // The corner of the neighbour across edge k that the face does not share.
  std::uint32_t opposite(const Face& of, std::size_t k) const {
    for (const std::uint32_t corner : face(of.neighbours[k]).corners) {
      if (corner != of.corners[k] && corner != of.corners[(k + 1) % 3]) return corner;
    }
    core::check_failed(__FILE__, __LINE__, "two faces of a hull share all corners", {});
  }

  // Of some points one with (almost) the largest value, the one most distant from `reference`. The value alone is the
  // same along sides and edges but for rounding, so it could pick a point inside of one; distance is largest at their
  // corners.
  template <class Value>
  std::uint32_t pick(const std::vector<std::uint32_t>& candidates, std::uint32_t reference, double tolerance,
                     const Value& value) const {
    double largest = 0.0;
    for (const std::uint32_t i : candidates) largest = std::max(largest, value(i));
    std::uint32_t best = candidates.front();
    Wide best_distance = -1;
    for (const std::uint32_t i : candidates) {
      if (value(i) < largest - tolerance) continue;
      const Wide distance = squared_length(difference(points_[i], points_[reference]));
      if (distance > best_distance) {
        best = i;
        best_distance = distance;
      }
    }
    return best;
  }

  std::uint32_t farthest(std::uint32_t f) const {
    const Face& from = face(f);
    return pick(from.outside, from.corners[0], static_cast<double>(from.tolerance),
                [&](std::uint32_t i) { return static_cast<double>(height(from, i)); });
  }

  std::uint32_t add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(faces_.size()));
      faces_.emplace_back();
    }
    slots_.push_back(free_.back());
    free_.pop_back();
    const auto made = static_cast<std::uint32_t>(slots_.size() - 1);
    Face& face_made = face(made) = Face{};
    face_made.corners = {a, b, c};
    face_made.normal = cross(difference(points_[b], points_[a]), difference(points_[c], points_[a]));
    face_made.tolerance = static_cast<Wide>(kTolerance * norm(face_made.normal));
    return made;
  }

  // Gives each point to the first of the faces from `begin` that it lies clearly above; the others are inside, or
  // skipped.
  void assign(const std::vector<std::uint32_t>& candidates, std::uint32_t begin) {
    for (const std::uint32_t point : candidates) {
      std::uint32_t first_below = kNone;
      bool taken = false;
      for (std::uint32_t f = begin; f < slots_.size() && !taken; ++f) {
        const Wide h = height(face(f), point);
        if (h > 0 && first_below == kNone) first_below = f;
        taken = h > face(f).tolerance;
        if (taken) face(f).outside.push_back(point);
      }
      if (first_below == kNone || taken) continue;
      skipped_.push_back(point);
      keep_above(first_below, point);
    }
  }

  // Remembers for a skipped point one face that it is above.
  void keep_above(std::uint32_t f, std::uint32_t point) {
    next_skipped_[point] = std::exchange(face(f).skipped, point);
  }

  // The skipped points of a face that is gone are kept at one of the new faces from `begin`: a point above both a gone
  // face and one that stayed is above the new face at some edge of the outline, because what it sees is connected.
  // Who is above none of them has become a point inside.
  void keep_above_new(std::uint32_t gone, std::uint32_t begin) {
    for (std::uint32_t point = std::exchange(face(gone).skipped, kNone); point != kNone;) {
      const std::uint32_t next = next_skipped_[point];
      for (std::uint32_t f = begin; f < slots_.size(); ++f) {
        if (height(face(f), point) <= 0) continue;
        keep_above(f, point);
        break;
      }
      point = next;
    }
  }

  // Of the faces that a point sees, `seen` one of them, the first that it is more than twice the tolerance above.
  std::uint32_t first_far_below(std::uint32_t seen, std::uint32_t point) {
    std::uint32_t first = kNone;
    std::vector<std::uint32_t> visible = {seen};
    face(seen).visible = true;
    for (std::size_t i = 0; i < visible.size(); ++i) {
      const Face& seen_too = face(visible[i]);
      if (height(seen_too, point) > 2 * seen_too.tolerance) first = std::min(first, visible[i]);
      for (const std::uint32_t n : seen_too.neighbours) {
        if (face(n).visible || height(face(n), point) <= 0) continue;
        face(n).visible = true;
        visible.push_back(n);
      }
    }
    for (const std::uint32_t f : visible) face(f).visible = false;
    return first;
  }

  // Gives skipped points to faces that they are more than twice the tolerance above; returns the first such face, or
  // the number of faces when there is none.
  std::uint32_t reconsider_skipped() {
    std::vector<std::uint32_t> witness(points_.size(), kNone);
    for (std::uint32_t f = 0; f < slots_.size(); ++f) {
      if (!is_alive(f)) continue;
      for (std::uint32_t point = face(f).skipped; point != kNone; point = next_skipped_[point]) witness[point] = f;
      face(f).skipped = kNone;
    }
    auto first = static_cast<std::uint32_t>(slots_.size());
    std::erase_if(skipped_, [&](std::uint32_t point) {
      if (witness[point] == kNone) return true;  // Inside by now.
      const std::uint32_t f = first_far_below(witness[point], point);
      if (f == kNone) {
        keep_above(witness[point], point);
        return false;
      }
      face(f).outside.push_back(point);
      first = std::min(first, f);
      return true;
    });
    return first;
  }

  bool make_simplex() {
    if (points_.size() < 4) return false;
    std::vector<std::uint32_t> all(points_.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    const auto anywhere = [](std::uint32_t) { return 0.0; };
    const std::uint32_t first = pick(all, 0, 0.0, anywhere);
    const std::uint32_t second = pick(all, first, 0.0, anywhere);
    const GridPoint base = difference(points_[second], points_[first]);
    const double base_length = std::sqrt(static_cast<double>(squared_length(base)));
    const auto from_base = [&](std::uint32_t i) {
      return norm(cross(base, difference(points_[i], points_[first]))) / base_length;
    };
    const std::uint32_t third = pick(all, first, kTolerance, from_base);
    if (from_base(third) < kThin) return false;

    const Face base_face = face(add_face(first, second, third));
    const auto from_base_face = [&](std::uint32_t i) { return std::abs(static_cast<double>(height(base_face, i))); };
    const std::uint32_t fourth = pick(all, first, static_cast<double>(base_face.tolerance), from_base_face);
    if (from_base_face(fourth) < kThin * norm(base_face.normal)) return false;

    slots_.clear();
    faces_.clear();
    std::array<std::uint32_t, 3> floor = {first, second, third};
    if (height(base_face, fourth) > 0) std::swap(floor[1], floor[2]);  // The floor faces away from the fourth point.
    add_face(floor[0], floor[1], floor[2]);
    for (std::size_t e = 0; e < 3; ++e) add_face(floor[(e + 1) % 3], floor[e], fourth);
    for (std::uint32_t e = 0; e < 3; ++e) {
      face(0).neighbours[e] = 1 + e;
      face(1 + e).neighbours = {0, 1 + (e + 2) % 3, 1 + (e + 1) % 3};
    }
    assign(all, 0);
    return true;
  }

  // Replaces the faces that a point sees by the cone from the point to their outline.
  void add_point(std::uint32_t seen_face, std::uint32_t eye) {
    std::vector<std::uint32_t> visible = {seen_face};
    face(seen_face).visible = true;
    for (std::size_t i = 0; i < visible.size(); ++i) {
      for (const std::uint32_t n : face(visible[i]).neighbours) {
        if (face(n).visible || height(face(n), eye) <= 0) continue;
        face(n).visible = true;
        visible.push_back(n);
      }
    }

    const auto first_new = static_cast<std::uint32_t>(slots_.size());
    for (const std::uint32_t f : visible) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t beyond = face(f).neighbours[k];
        if (face(beyond).visible) continue;
        const std::uint32_t from = face(f).corners[k];
        const std::uint32_t to = face(f).corners[(k + 1) % 3];
        const std::uint32_t made = add_face(from, to, eye);
        face(made).neighbours[0] = beyond;
        for (std::size_t m = 0; m < 3; ++m) {
          if (face(beyond).corners[m] == to) face(beyond).neighbours[m] = made;
        }
        PRESCENE_CHECK_MSG(face_from_[from] == kNone, "the outline of the visible faces is one loop");
        face_from_[from] = made;
      }
    }
    for (std::uint32_t f = first_new; f < slots_.size(); ++f) {
      const std::uint32_t next = face_from_[face(f).corners[1]];
      PRESCENE_CHECK(next != kNone);
      face(f).neighbours[1] = next;
      face(next).neighbours[2] = f;
    }
    for (std::uint32_t f = first_new; f < slots_.size(); ++f) face_from_[face(f).corners[0]] = kNone;

    for (const std::uint32_t f : visible) {
      const std::vector<std::uint32_t> orphans = std::exchange(face(f).outside, {});
      assign(orphans, first_new);
      keep_above_new(f, first_new);
      free_.push_back(std::exchange(slots_[f], kNone));
    }
  }

  const std::vector<GridPoint>& points_;
  // Faces have numbers in the order in which they were made. Only those that are part of the hull are kept: of the
  // others there are several times as many.
  std::vector<std::uint32_t> slots_;  // For each face its place in faces_; kNone once it is gone.
  std::deque<Face> faces_;
  std::vector<std::uint32_t> free_;     // Places in faces_.
  std::vector<std::uint32_t> skipped_;  // Points above a face by less than the tolerance, in the order of skipping.
  std::vector<std::uint32_t> next_skipped_;  // For a skipped point the next one of the same face, see Face::skipped.
  std::vector<std::uint32_t> face_from_;     // While a cone is made: its face whose outline edge starts at the vertex.
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

core::Result<TriangleMesh> convex_hull(const std::vector<Vector3d>& points) { return convex_hull(points, nullptr); }

core::Result<TriangleMesh> convex_hull(const std::vector<Vector3d>& points, const core::Cancellation* cancellation) {
  for (const Vector3d& p : points) {
    if (!p.allFinite()) return core::invalid_input("a point for a convex hull is not finite: repair the mesh first");
  }
  std::vector<GridEntry> entries = snapped(points);
  // Again with the corners only until none is left out: vertices inside of sides and edges are gone then.
  while (true) {
    const std::vector<GridPoint> places = places_of(entries);
    Quickhull hull(places);
    if (!hull.build(cancellation)) {
      if (cancellation && cancellation->requested()) return core::cancelled("the making of a convex hull was stopped");
      return core::invalid_input("a convex hull needs points that do not lie in one plane; these " +
                                 std::to_string(points.size()) + " do: give the body a thickness");
    }
    const std::vector<std::uint32_t> kept = hull.corners();
    std::vector<GridEntry> corners;
    corners.reserve(kept.size());
    for (const std::uint32_t i : kept) corners.push_back(entries[i]);
    if (corners.size() == entries.size()) {
      TriangleMesh mesh;
      mesh.triangles = hull.triangles();
      for (const GridEntry& corner : corners) mesh.vertices.push_back(corner.position);
      return mesh;
    }
    entries = std::move(corners);
  }
}

}  // namespace prescene::geometry
