// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/resting_poses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "mesh_edges.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::geometry {
namespace {

constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();
/// For each triangle those beyond its edges: of edge k from corner k to the next.
using Neighbours = std::vector<std::array<std::uint32_t, 3>>;

/// A face of the hull: coplanar triangles together.
struct RestingFace {
  Vector3d normal = Vector3d::Zero();  // outward, area-weighted while it is summed up
  std::vector<std::size_t> triangles;
  double solid_angle = 0.0;
  double tip_angle = 0.0;  // negative: it does not carry the centre of mass
  double height = 0.0;
  int rolls_to = -1;  // the face beyond the edge over which it falls
};

/// Solid angle of a triangle from the origin [Van Oosterom & Strackee 1983].
double solid_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double numerator = a.dot(b.cross(c));
  const double denominator =
      a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm();
  return 2.0 * std::atan2(numerator, denominator);
}

Vector3d area_normal(const TriangleMesh& hull, std::size_t triangle) {
  const auto& [a, b, c] = hull.triangles[triangle];
  return (hull.vertices[b] - hull.vertices[a]).cross(hull.vertices[c] - hull.vertices[a]);
}

/// The face number of each triangle.
std::vector<int> merge_coplanar(const TriangleMesh& hull, const Neighbours& neighbours, double flatness) {
  std::vector<int> face_of(hull.triangles.size(), -1);
  int faces = 0;
  for (std::size_t seed = 0; seed < hull.triangles.size(); ++seed) {
    if (face_of[seed] >= 0) continue;
    // Compared with the seed, not the neighbour: a finely cut sphere must not become one face.
    const Vector3d normal = area_normal(hull, seed).normalized();
    std::vector<std::size_t> open{seed};
    face_of[seed] = faces;
    while (!open.empty()) {
      const std::array<std::uint32_t, 3>& around = neighbours[open.back()];
      open.pop_back();
      for (const std::uint32_t beyond : around) {
        if (beyond == kNoTriangle || face_of[beyond] >= 0) continue;
        if (area_normal(hull, beyond).normalized().dot(normal) < std::cos(flatness)) continue;
        face_of[beyond] = faces;
        open.push_back(beyond);
      }
    }
    ++faces;
  }
  return face_of;
}

Neighbours neighbours_of(const TriangleMesh& hull) {
  Neighbours neighbours(hull.triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  for_each_edge(edge_uses(hull.triangles), [&](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    neighbours[uses[0].triangle][uses[0].corner] = uses[1].triangle;
    neighbours[uses[1].triangle][uses[1].corner] = uses[0].triangle;
  });
  return neighbours;
}

/// How a body whose centre of mass is the origin stands on each face, and where it rolls from those that don't carry
/// it.
std::vector<RestingFace> measure_faces(const TriangleMesh& hull, const Neighbours& neighbours,
                                       const std::vector<int>& face_of) {
  std::vector<RestingFace> faces(static_cast<std::size_t>(*std::ranges::max_element(face_of)) + 1);
  for (std::size_t t = 0; t < hull.triangles.size(); ++t) {
    RestingFace& face = faces[static_cast<std::size_t>(face_of[t])];
    const auto& [a, b, c] = hull.triangles[t];
    face.triangles.push_back(t);
    face.normal += area_normal(hull, t);
    face.solid_angle += solid_angle(hull.vertices[a], hull.vertices[b], hull.vertices[c]);
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    RestingFace& face = faces[f];
    face.normal.normalize();
    face.height = std::numeric_limits<double>::lowest();
    for (const std::size_t t : face.triangles) {
      for (const std::uint32_t v : hull.triangles[t])
        face.height = std::max(face.height, face.normal.dot(hull.vertices[v]));
    }
    double least = std::numeric_limits<double>::max();
    for (const std::size_t t : face.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = hull.triangles[t][k];
        const std::uint32_t to = hull.triangles[t][(k + 1) % 3];
        const std::uint32_t beyond = neighbours[t][k];
        if (beyond == kNoTriangle || face_of[beyond] == static_cast<int>(f)) continue;
        // How far inside of this edge the centre of mass stands.
        const Vector3d outward = (hull.vertices[to] - hull.vertices[from]).cross(face.normal).normalized();
        const double inside = outward.dot(hull.vertices[from]);
        if (inside < least) {
          least = inside;
          face.rolls_to = face_of[beyond];
        }
      }
    }
    face.tip_angle = std::atan2(least, face.height);
  }
  return faces;
}

/// Rolling lowers the centre of mass, so it ends; but not among faces that were made of nearly coplanar triangles: of
/// two such each may send the body to the other. Those carry it together. True if any were joined.
bool join_faces_that_roll_in_circles(const std::vector<RestingFace>& faces, std::vector<int>& face_of) {
  constexpr int kOpen = -1, kDone = -2;
  std::vector<int> reached_from(faces.size(), kOpen);  // the start of the walk that came here
  std::vector<int> joined(faces.size());
  std::iota(joined.begin(), joined.end(), 0);
  bool any = false;
  for (std::size_t start = 0; start < faces.size(); ++start) {
    std::vector<std::size_t> walk;
    std::size_t at = start;
    while (reached_from[at] == kOpen && faces[at].tip_angle < 0.0) {
      reached_from[at] = static_cast<int>(start);
      walk.push_back(at);
      at = static_cast<std::size_t>(faces[at].rolls_to);
    }
    if (faces[at].tip_angle < 0.0 && reached_from[at] == static_cast<int>(start)) {
      for (auto member = std::ranges::find(walk, at); member != walk.end(); ++member)
        joined[*member] = static_cast<int>(at);
      any = true;
    }
    for (const std::size_t passed : walk) reached_from[passed] = kDone;
  }
  if (!any) return false;
  std::map<int, int> renumbered;
  for (int& face : face_of)
    face =
        renumbered.emplace(joined[static_cast<std::size_t>(face)], static_cast<int>(renumbered.size())).first->second;
  return true;
}

}  // namespace

core::Result<std::vector<RestingPose>> resting_poses(const TriangleMesh& mesh, const Vector3d& p_BoBcm,
                                                     double flatness) {
  PRESCENE_TRY(TriangleMesh hull, convex_hull(mesh.vertices));
  return resting_poses_of_hull(std::move(hull), p_BoBcm, flatness);
}

core::Result<std::vector<RestingPose>> resting_poses_of_hull(TriangleMesh hull, const Vector3d& p_BoBcm,
                                                             double flatness) {
  for (Vector3d& vertex : hull.vertices) vertex -= p_BoBcm;  // from here on about the centre of mass
  const Neighbours neighbours = neighbours_of(hull);
  std::vector<int> face_of = merge_coplanar(hull, neighbours, flatness);
  std::vector<RestingFace> faces = measure_faces(hull, neighbours, face_of);
  while (join_faces_that_roll_in_circles(faces, face_of)) faces = measure_faces(hull, neighbours, face_of);
  if (std::ranges::any_of(faces, [](const RestingFace& face) { return face.height <= 0.0; }))
    return core::invalid_input("the centre of mass is not inside of the convex hull: correct one of them");

  std::vector<double> share(faces.size(), 0.0);
  for (const RestingFace& face : faces) {
    const RestingFace* at = &face;
    while (at->tip_angle < 0.0) at = &faces[static_cast<std::size_t>(at->rolls_to)];
    share[static_cast<std::size_t>(at - faces.data())] += face.solid_angle / (4.0 * std::numbers::pi);
  }
  std::vector<RestingPose> poses;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].tip_angle < 0.0) continue;
    poses.push_back(
        {rotation_between(faces[f].normal, -Vector3d::UnitZ()), faces[f].height, faces[f].tip_angle, share[f]});
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const RestingPose& a, const RestingPose& b) { return a.probability > b.probability; });
  return poses;
}

int face_up(const Quaterniond& R_WB) {
  const Vector3d up_B = R_WB.conjugate() * Vector3d::UnitZ();
  Eigen::Index axis = 0;
  up_B.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(2 * axis) + (up_B[axis] < 0.0 ? 1 : 0);
}

}  // namespace prescene::geometry
