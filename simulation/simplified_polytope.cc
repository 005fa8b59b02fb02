// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/simplified_polytope.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

using Face = ConvexPolytope::Face;

// What a body rests on decides more than how round it is: corners of resting faces count as this many times as far
// outside as they are, and the largest face begins with some of its corners.
constexpr double kWeightOfResting = 2.0;
constexpr std::size_t kCornersAtFirst = 6;
// To move the faces of a hull inwards takes time with the square of their number, and makes more vertices: hulls are
// first simplified to this many times the vertices asked for.
constexpr std::size_t kBeforeInset = 2;

double area_of(const ConvexPolytope& polytope, const Face& face) {
  Vector3d twice = Vector3d::Zero();
  const Vector3d& first = polytope.vertices[face.loop[0]];
  for (std::size_t k = 1; k + 1 < face.loop.size(); ++k)
    twice += (polytope.vertices[face.loop[k]] - first).cross(polytope.vertices[face.loop[k + 1]] - first);
  return 0.5 * twice.dot(face.normal);
}

/// Of the volume.
Vector3d centroid_of(const ConvexPolytope& polytope) {
  const Vector3d inside = polytope.vertex_mean();
  Vector3d sum = Vector3d::Zero();
  double volume = 0.0;
  for (const Face& face : polytope.faces) {
    const Vector3d a = polytope.vertices[face.loop[0]] - inside;
    for (std::size_t k = 1; k + 1 < face.loop.size(); ++k) {
      const Vector3d b = polytope.vertices[face.loop[k]] - inside, c = polytope.vertices[face.loop[k + 1]] - inside;
      const double six = a.dot(b.cross(c));
      volume += six;
      sum += six * (a + b + c) / 4.0;
    }
  }
  return volume > 0.0 ? Vector3d(inside + sum / volume) : inside;
}

bool rests_on(const ConvexPolytope& polytope, const Face& face, const Vector3d& centroid) {
  for (std::size_t k = 0; k < face.loop.size(); ++k) {
    const Vector3d& from = polytope.vertices[face.loop[k]];
    const Vector3d& to = polytope.vertices[face.loop[(k + 1) % face.loop.size()]];
    if (face.normal.cross(to - from).dot(centroid - from) < 0.0) return false;
  }
  return true;
}

/// At most `count` of the loop, each as far from those before it as can be.
std::vector<std::uint32_t> spread(const ConvexPolytope& polytope, const std::vector<std::uint32_t>& loop,
                                  std::size_t count) {
  if (loop.size() <= count) return loop;
  std::vector<double> distance(loop.size(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> chosen;
  std::size_t next = 0;
  while (chosen.size() < count) {
    chosen.push_back(loop[next]);
    for (std::size_t i = 0; i < loop.size(); ++i)
      distance[i] = std::min(distance[i], (polytope.vertices[loop[i]] - polytope.vertices[chosen.back()]).norm());
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return chosen;
}

/// Which vertices are kept, in the order of keeping.
class Choice {
 public:
  explicit Choice(const ConvexPolytope& polytope) : polytope_(polytope), taken_(polytope.vertices.size(), false) {}

  std::size_t size() const { return points_.size(); }
  const std::vector<Vector3d>& points() const { return points_; }
  void take(std::uint32_t vertex) {
    if (taken_[vertex]) return;
    taken_[vertex] = true;
    points_.push_back(polytope_.vertices[vertex]);
  }
  bool taken(std::size_t vertex) const { return taken_[vertex]; }

  /// Six extreme vertices, so that there is a hull to begin with.
  void take_extremes() {
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, most] =
          std::minmax_element(polytope_.vertices.begin(), polytope_.vertices.end(),
                              [axis](const Vector3d& a, const Vector3d& b) { return a[axis] < b[axis]; });
      take(static_cast<std::uint32_t>(least - polytope_.vertices.begin()));
      take(static_cast<std::uint32_t>(most - polytope_.vertices.begin()));
    }
  }

 private:
  const ConvexPolytope& polytope_;
  std::vector<bool> taken_;
  std::vector<Vector3d> points_;
};

/// The faces on which a body of uniform density would rest, largest first.
std::vector<const Face*> resting_faces(const ConvexPolytope& polytope) {
  const Vector3d centroid = centroid_of(polytope);
  std::vector<std::pair<double, const Face*>> faces;
  for (const Face& face : polytope.faces)
    if (rests_on(polytope, face, centroid)) faces.emplace_back(area_of(polytope, face), &face);
  std::stable_sort(faces.begin(), faces.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<const Face*> result;
  result.reserve(faces.size());
  for (const auto& [area, face] : faces) result.push_back(face);
  return result;
}

double height_above(const ConvexPolytope& polytope, const Vector3d& p) {
  double height = -std::numeric_limits<double>::infinity();
  for (const Face& face : polytope.faces) height = std::max(height, face.normal.dot(p) - face.offset);
  return height;
}

double largest_height(const ConvexPolytope& polytope, const std::vector<Vector3d>& points) {
  double largest = 0.0;
  for (const Vector3d& p : points) largest = std::max(largest, height_above(polytope, p));
  return largest;
}

/// Faces with too many corners lose those that are nearest to others.
core::Result<ConvexPolytope> with_few_corners(ConvexPolytope polytope, std::size_t corners) {
  while (true) {
    const auto face = std::find_if(polytope.faces.begin(), polytope.faces.end(),
                                   [&](const Face& f) { return f.loop.size() > corners; });
    if (face == polytope.faces.end()) return polytope;
    const std::vector<std::uint32_t> kept = spread(polytope, face->loop, corners);
    std::vector<Vector3d> points;
    for (std::uint32_t i = 0; i < polytope.vertices.size(); ++i) {
      const bool of_face = std::find(face->loop.begin(), face->loop.end(), i) != face->loop.end();
      if (!of_face || std::find(kept.begin(), kept.end(), i) != kept.end()) points.push_back(polytope.vertices[i]);
    }
    PRESCENE_TRY(polytope, make_polytope(points));
  }
}

}  // namespace

bool within(const ConvexPolytope& polytope, const PolytopeLimits& limits) {
  return polytope.vertices.size() <= limits.vertices &&
         std::all_of(polytope.faces.begin(), polytope.faces.end(),
                     [&](const Face& face) { return face.loop.size() <= limits.corners; });
}

core::Result<SimplifiedPolytope> simplified(const ConvexPolytope& polytope, const PolytopeLimits& limits) {
  PRESCENE_CHECK(limits.vertices >= 16 && limits.corners >= 4);
  if (within(polytope, limits)) return SimplifiedPolytope{polytope, 0.0};
  Choice choice(polytope);
  choice.take_extremes();
  const std::vector<const Face*> faces = resting_faces(polytope);
  std::vector<double> weights(polytope.vertices.size(), 1.0);
  for (const Face* face : faces)
    for (const std::uint32_t vertex : face->loop) weights[vertex] = kWeightOfResting;
  if (!faces.empty())
    for (const std::uint32_t vertex : spread(polytope, faces[0]->loop, kCornersAtFirst)) choice.take(vertex);
  PRESCENE_TRY(ConvexPolytope hull, make_polytope(choice.points()));
  while (choice.size() < limits.vertices) {
    double farthest = 0.0;
    std::optional<std::uint32_t> next;
    for (std::uint32_t i = 0; i < polytope.vertices.size(); ++i) {
      if (choice.taken(i)) continue;
      const double height = weights[i] * height_above(hull, polytope.vertices[i]);
      if (height > farthest) {
        farthest = height;
        next = i;
      }
    }
    if (!next) break;
    choice.take(*next);
    PRESCENE_TRY(hull, make_polytope(choice.points()));
  }
  SimplifiedPolytope result;
  PRESCENE_TRY(result.polytope, with_few_corners(std::move(hull), limits.corners));
  result.error = largest_height(result.polytope, polytope.vertices);
  return result;
}

core::Result<RoundedPolytope> rounded(const ConvexPolytope& polytope, double radius, const PolytopeLimits& limits) {
  const PolytopeLimits more{kBeforeInset * limits.vertices, std::numeric_limits<std::size_t>::max()};
  PRESCENE_TRY(const SimplifiedPolytope hull, simplified(polytope, more));
  RoundedPolytope result{hull.polytope, 0.0, 0.0};
  if (std::optional<ConvexPolytope> smaller = inset(hull.polytope, radius)) {
    result.core = std::move(*smaller);
    result.radius = radius;
  }
  PRESCENE_TRY(SimplifiedPolytope core, simplified(result.core, limits));
  result.core = std::move(core.polytope);
  if (hull.error > 0.0 || core.error > 0.0)
    result.error = std::max(0.0, largest_height(result.core, polytope.vertices) - result.radius);
  result.error += polytope.left_out;
  return result;
}

}  // namespace prescene::simulation
