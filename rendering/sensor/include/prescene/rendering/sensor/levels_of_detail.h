// SPDX-License-Identifier: Apache-2.0
// Coarser versions of a mesh, for likelihoods of things that are far away: a few hundred triangles weigh a pose as well
// as ten thousand where their surface is off by a fraction of a pixel.
//
//   PRESCENE_TRY(const LevelsOfDetail levels, LevelsOfDetail::make(triangle_mesh, {}));   // once a mesh
//   const DetailLevel& level = levels.at_pose(terms, X_CO);                               // once a frame and object
//   hypotheses.push_back({level.mesh.get(), X_CO, &material});
//
// Scores of different levels are of different surfaces: compare poses of one object under one level.
#pragma once

#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

struct DetailLevel {
  MeshHandle mesh;     ///< In the frame of the original. Without a look, but for the finest's.
  double error = 0.0;  ///< m: no point of this surface is further from the original one, nor the other way round.
};

/// How far a surface may be off for poses to be weighed as by the original: what that costs is in
/// docs/reference/rendering.md.
struct DetailLimits {
  double pixels = 0.1;   ///< Of the reduced image: how far outlines may be off.
  double sigmas = 0.15;  ///< Of a hit's standard deviation at that depth (SensorModel::hit_sigma).
};

struct LevelsOfDetailOptions {
  double ratio = 0.4;         ///< Triangles of a level to those of the one before, in [0.1, 0.9].
  int fewest_triangles = 64;  ///< No level has fewer, >= 4.
};

/// Immutable; any number of threads may ask.
class LevelsOfDetail {
 public:
  /// Finest first: the mesh itself, repaired, error 0; then coarser ones, each with fewer triangles and a larger error.
  /// Edges are collapsed (geometry::simplified), then corners are moved so that the surface is as often outside of the
  /// original as inside. Where the original is closed all levels are: others are left out. Takes about a second for
  /// 16,000 triangles, most of it for the bounds. The same mesh gives the same levels. Fails with kInvalidInput when
  /// the mesh has no triangle that could be seen, or an option is out of range.
  static core::Result<LevelsOfDetail> make(const geometry::TriangleMesh& mesh, const LevelsOfDetailOptions& options);

  std::span<const DetailLevel> levels() const { return levels_; }

  /// The coarsest level whose surface is within the limits at `depth` (m) and further; the finest when there is none,
  /// or when the depth is not positive.
  const DetailLevel& at_depth(const FrameTerms& frame, double depth, const DetailLimits& limits = {}) const;
  /// The same for the nearest point of the mesh's bounding sphere.
  const DetailLevel& at_pose(const FrameTerms& frame, const geometry::Pose& X_CO,
                             const DetailLimits& limits = {}) const;

 private:
  std::vector<DetailLevel> levels_;
};

}  // namespace prescene::rendering
