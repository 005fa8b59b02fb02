// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/levels_of_detail.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "prescene/geometry/surface_tree.h"

namespace prescene::rendering {
namespace {

using geometry::SurfacePoint;
using geometry::SurfaceTree;
using geometry::TriangleMesh;
using geometry::Vector3d;

constexpr double kErrorTolerance = 0.15;  // of the error: how much larger the bound may be

/// Moves the corners of `coarse` so that points of the original surface are on either side of it alike. Collapsing
/// edges leaves round things too small, which a likelihood takes for a distance.
TriangleMesh centred(TriangleMesh coarse, const std::vector<SurfacePoint>& original) {
  constexpr int kRounds = 4;
  std::vector<std::uint32_t> nearest(original.size(), 0);
  for (int round = 0; round < kRounds; ++round) {
    const SurfaceTree tree(coarse);
    std::vector<Vector3d> off(coarse.vertices.size(), Vector3d::Zero());
    std::vector<double> weight(coarse.vertices.size(), 0.0);
    for (std::size_t i = 0; i < original.size(); ++i) {
      const Vector3d& p = original[i].position;
      const SurfaceTree::Nearest found = tree.nearest(p, nearest[i]);
      nearest[i] = found.triangle;
      const auto& t = coarse.triangles[found.triangle];
      const Vector3d &a = coarse.vertices[t[0]], &b = coarse.vertices[t[1]], &c = coarse.vertices[t[2]];
      // The other side of a thin wall.
      if ((b - a).cross(c - a).dot(original[i].normal) <= 0.0) continue;
      const Vector3d& share = found.place.weights;
      const Vector3d residual = p - (share[0] * a + share[1] * b + share[2] * c);
      for (std::size_t k = 0; k < 3; ++k) {
        off[t[k]] += share[static_cast<Eigen::Index>(k)] * residual;
        weight[t[k]] += share[static_cast<Eigen::Index>(k)];
      }
    }
    for (std::size_t v = 0; v < off.size(); ++v)
      if (weight[v] > 0.0) coarse.vertices[v] += off[v] / weight[v];
  }
  return coarse;
}

}  // namespace

core::Result<LevelsOfDetail> LevelsOfDetail::make(const TriangleMesh& mesh, const LevelsOfDetailOptions& options) {
  if (!(options.ratio >= 0.1 && options.ratio <= 0.9))
    return core::invalid_input("levels of detail: ratio is " + std::to_string(options.ratio) +
                               ", give one from 0.1 to 0.9");
  if (options.fewest_triangles < 4)
    return core::invalid_input("levels of detail: fewest_triangles is " + std::to_string(options.fewest_triangles) +
                               ", give at least 4");
  PRESCENE_TRY(const TriangleMesh original, repair_mesh(mesh, nullptr));
  LevelsOfDetail result;
  result.levels_.push_back({make_render_mesh(original), 0.0});
  const bool closed = result.levels_.front().mesh->closed;

  constexpr int kPoints = 20'000;
  std::vector<SurfacePoint> points;
  const SurfaceTree surface(original);
  TriangleMesh coarse = original;
  for (;;) {
    const auto wanted = static_cast<int>(options.ratio * static_cast<double>(coarse.triangles.size()));
    if (wanted < options.fewest_triangles) break;
    if (points.empty()) points = sample_surface(original, kPoints, 0);
    coarse = simplified(coarse, wanted);
    if (coarse.triangles.empty()) break;
    const TriangleMesh level = centred(coarse, points);
    const MeshHandle handle = make_render_mesh(level);
    if (closed && !handle->closed) continue;
    const double error = surface_distance(surface, SurfaceTree(level), kErrorTolerance);
    // Of those that are no worse the coarsest is enough.
    while (result.levels_.size() > 1 && result.levels_.back().error >= error) result.levels_.pop_back();
    result.levels_.push_back({handle, error});
  }
  return result;
}

const DetailLevel& LevelsOfDetail::at_depth(const FrameTerms& frame, double depth, const DetailLimits& limits) const {
  if (!(depth > 0.0)) return levels_.front();
  const double pixel = depth / std::max(frame.camera.fx, frame.camera.fy);
  const double allowed = std::min(limits.pixels * pixel, limits.sigmas * frame.model.hit_sigma(depth, 1.0));
  for (std::size_t i = levels_.size(); i-- > 1;)
    if (levels_[i].error <= allowed) return levels_[i];
  return levels_.front();
}

const DetailLevel& LevelsOfDetail::at_pose(const FrameTerms& frame, const geometry::Pose& X_CO,
                                           const DetailLimits& limits) const {
  const RenderMesh& mesh = *levels_.front().mesh;
  const double centre = (X_CO * mesh.centre.cast<double>().eval()).z();
  return at_depth(frame, centre - static_cast<double>(mesh.radius), limits);
}

}  // namespace prescene::rendering
