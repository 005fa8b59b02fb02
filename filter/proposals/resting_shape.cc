// SPDX-License-Identifier: Apache-2.0
// How models lie, and whether a frame shows them at a pose.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "prescene/filter/proposals/resting_starts.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/polygon.h"
#include "prescene/geometry/resting_poses.h"

namespace prescene::filter {
namespace {

using Eigen::Vector2d;
using geometry::Quaterniond;

constexpr int kSurfacePoints = 96;
constexpr double kAlike = 0.003;          // m: ways to lie that agree so well in their heights look alike
constexpr std::size_t kMostRests = 8;     // different ones
constexpr double kLeastTip = 0.05;        // rad; what falls over sooner does not stand
constexpr double kFlatCorner = 1e-6;      // m from the line through its neighbours
constexpr double kLeastSideShare = 0.07;  // of what it covers is a side; those of a round thing's polygon are shorter
constexpr double kBaseDepth = 0.0005;     // m; what is so near to the lowest point stands on the ground
constexpr std::array<double, 2> kSlides = {0.012, 0.006};  // m, in turn
constexpr double kHit = 0.012;  // m, growing with depth: a measurement so near shows the surface

/// Rounding makes several corners of one, whose sides point anywhere, and corners on straight sides.
std::vector<Vector2d> without_flat_corners(const std::vector<Vector2d>& corners) {
  std::vector<Vector2d> apart, kept;
  for (const Vector2d& corner : corners)
    if (std::none_of(apart.begin(), apart.end(), [&](const Vector2d& p) { return (p - corner).norm() < kFlatCorner; }))
      apart.push_back(corner);
  for (std::size_t i = 0; i < apart.size(); ++i) {
    const Vector2d& before = apart[(i + apart.size() - 1) % apart.size()];
    const Vector2d way = apart[(i + 1) % apart.size()] - before, out = apart[i] - before;
    if (std::abs(way.x() * out.y() - way.y() * out.x()) > kFlatCorner * way.norm()) kept.push_back(apart[i]);
  }
  return kept;
}

/// Middle and second moments of the border of what stands on the ground.
void add_base(const std::vector<Vector2d>& corners, Rest& rest) {
  double around = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d middle = 0.5 * (corners[i] + corners[(i + 1) % corners.size()]);
    const Vector2d along = corners[(i + 1) % corners.size()] - corners[i];
    const double length = along.norm();
    around += length;
    rest.base_middle += length * middle;
    rest.base_moments += length * (middle * middle.transpose() + along * along.transpose() / 12.0);
  }
  if (!(around > 0.0)) {
    if (!corners.empty()) rest.base_middle = corners.front();
    return;
  }
  rest.base_middle /= around;
  rest.base_moments = (rest.base_moments / around - rest.base_middle * rest.base_middle.transpose()).eval();
}

Rest rest_of(const rendering::RenderMesh& mesh, const Quaterniond& R_UO) {
  Rest rest;
  rest.R_UO = R_UO;
  rest.bottom = std::numeric_limits<double>::infinity();
  rest.top = -rest.bottom;
  std::vector<Vector2d> covered;
  for (const auto& vertex : mesh.vertices) {
    const Vector3d p = R_UO * vertex.cast<double>();
    rest.bottom = std::min(rest.bottom, p.z());
    rest.top = std::max(rest.top, p.z());
    covered.emplace_back(p.head<2>());
  }
  const std::vector<Vector2d> corners = without_flat_corners(geometry::convex_polygon(std::move(covered)));
  double around = 0.0;
  geometry::Box box;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    around += (corners[(i + 1) % corners.size()] - corners[i]).norm();
    box.extend(Vector3d(corners[i].x(), corners[i].y(), 0.0));
  }
  if (!corners.empty()) rest.middle = box.center().head<2>();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& from = corners[i];
    const Vector2d& to = corners[(i + 1) % corners.size()];
    if ((to - from).norm() >= kLeastSideShare * around) rest.sides.push_back({from, to});
  }
  std::vector<Vector2d> standing;
  for (const auto& vertex : mesh.vertices) {
    const Vector3d p = R_UO * vertex.cast<double>();
    if (p.z() < rest.bottom + kBaseDepth) standing.emplace_back(p.head<2>());
  }
  add_base(geometry::convex_polygon(std::move(standing)), rest);
  rest.reach = std::max(0.0, geometry::distance_inside(corners, rest.middle));
  return rest;
}

}  // namespace

int points_shown(const RestingShape& shape, const rendering::FrameTerms& fine, const Pose& X_CO) {
  const geometry::Matrix3d R = X_CO.rotation.toRotationMatrix();
  int score = 0;
  for (const geometry::SurfacePoint& point : shape.points) {
    const Vector3d p = R * point.position + X_CO.translation;
    if (!((R * point.normal).dot(p) < 0.0) || !(p.z() > 0.0)) continue;
    const Vector2d pixel = fine.camera.project(p);
    const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
    if (u < 0 || v < 0 || u >= fine.camera.width || v >= fine.camera.height) continue;
    const double z = static_cast<double>(fine.depth(u, v));
    if (!(z > 0.0)) continue;
    const double tolerance = kHit * tolerance_growth(p.z());
    if (z > p.z() + tolerance)
      --score;
    else if (z > p.z() - tolerance)
      ++score;
  }
  return score;
}

Pose slid_about(const RestingShape& shape, const rendering::FrameTerms& fine, const Vector3d& up_C, const Pose& X_CO) {
  Pose best = X_CO;
  int most = points_shown(shape, fine, best);
  const geometry::Matrix3d R = X_CO.rotation.toRotationMatrix();
  Eigen::Index upright = 0;
  (R.transpose() * up_C).cwiseAbs().maxCoeff(&upright);
  for (const double distance : kSlides)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (axis == upright) continue;
      const Vector3d way = (R.col(axis) - up_C * up_C.dot(R.col(axis))).normalized();
      for (const double side : {-1.0, 1.0})
        for (bool is_better = true; is_better;) {
          Pose moved = best;
          moved.translation += side * distance * way;
          const int score = points_shown(shape, fine, moved);
          is_better = score > most;
          if (is_better) best = moved, most = score;
        }
    }
  return best;
}

RestingShape resting_shape_of(const rendering::RenderMesh& mesh) {
  RestingShape shape;
  geometry::TriangleMesh triangles;
  for (const auto& vertex : mesh.vertices) triangles.vertices.push_back(vertex.cast<double>());
  triangles.triangles = mesh.triangles;
  if (triangles.empty()) return shape;
  shape.points = geometry::sample_surface(triangles, kSurfacePoints, 1);
  auto hull = geometry::convex_hull(triangles.vertices);
  if (!hull.ok()) return shape;
  const auto mass = geometry::mass_properties(*hull, 1.0);
  if (!mass.ok()) return shape;
  const Vector3d p_OQ = mass->p_BoBcm;
  const auto poses = geometry::resting_poses_of_hull(*std::move(hull), p_OQ);
  if (!poses.ok()) return shape;
  std::vector<std::array<double, 2>> heights;
  for (const geometry::RestingPose& pose : *poses) {
    if (pose.tip_angle < kLeastTip && !shape.rests.empty()) {
      shape.rolling.push_back(pose.R_WB.conjugate() * Vector3d::UnitZ());
      shape.rolling_probability += pose.probability;
      continue;
    }
    Rest rest = rest_of(mesh, pose.R_WB);
    rest.probability = pose.probability;
    const std::array<double, 2> mine = {pose.height, rest.top - rest.bottom};
    std::size_t group = 0;
    while (group < heights.size() &&
           (std::abs(heights[group][0] - mine[0]) > kAlike || std::abs(heights[group][1] - mine[1]) > kAlike))
      ++group;
    if (group == kMostRests) continue;
    if (group == heights.size()) heights.push_back(mine), shape.rests.emplace_back();
    shape.rests[group].push_back(std::move(rest));
  }
  return shape;
}

}  // namespace prescene::filter
