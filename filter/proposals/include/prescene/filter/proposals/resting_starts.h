// SPDX-License-Identifier: Apache-2.0
// Poses in which an object may lie where a cluster is. What rests on something lies in one of a few ways, so that its
// height is known and only its place and its turn about up are open; these follow from the straight edges of the
// cluster seen from above. A box of which a third is hidden is proposed from a face and one end of it.
//
//   const RestingShape shape = resting_shape_of(*target.mesh);                           // once a model
//   const std::vector<ClusterShape> seen = cluster_shapes(clusters, sampled, fine, surroundings, stream);
//   std::vector<Pose> starts = resting_starts(seen[0], shape, fine, surroundings, 40, stream);
#pragma once

#include <array>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/filter/proposals/frame_surfaces.h"
#include "prescene/filter/proposals/segmentation.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

/// A way to lie, in a frame U of which z is up and whose origin is the model's.
struct Rest {
  geometry::Quaterniond R_UO;
  double bottom = 0.0, top = 0.0;  ///< Heights in U, m.
  double probability = 0.0;        ///< Of what falls from any rotation to lie so (geometry::RestingPose).
  /// Long straight sides of what it covers, seen from above, counter-clockwise; none of round things.
  std::vector<std::array<Eigen::Vector2d, 2>> sides;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< Of what it covers ...
  double reach = 0.0;                                ///< ... and the least distance of that one's border from it.
  /// Of the border of what it stands on, in U: its middle, m, and its second moments about that, m^2.
  Eigen::Vector2d base_middle = Eigen::Vector2d::Zero();
  Eigen::Matrix2d base_moments = Eigen::Matrix2d::Zero();
};

/// What of a model tells how it may lie.
struct RestingShape {
  std::vector<std::vector<Rest>> rests;        ///< Ways to lie that look alike together, likeliest first.
  std::vector<geometry::SurfacePoint> points;  ///< Spread over its surface, in O.
  std::vector<Vector3d> rolling;               ///< Ups, in O, of faces from which it rolls on to the next ...
  double rolling_probability = 0.0;            ///< ... and how often it comes to lie on one of them.
};
/// From the faces of the convex hull that carry the hull's centre of mass; empty for a flat mesh.
RestingShape resting_shape_of(const rendering::RenderMesh& mesh);

/// Straight border of a cluster, seen from above: points p with outwards . p = offset.
struct SeenEdge {
  Eigen::Vector2d outwards = Eigen::Vector2d::UnitX();  ///< Unit; away from the thing.
  double offset = 0.0;                                  ///< m
  double first = 0.0, last = 0.0;                       ///< m, its ends along `outwards` turned by +90 degrees.
};

/// A cluster, in a frame U of which z is up and whose origin is W's.
struct ClusterShape {
  std::vector<Vector3d> points_U;  ///< Some of its points.
  std::vector<double> bases;       ///< Heights of what may carry the thing, m.
  std::vector<double> tops;        ///< Heights of its level faces, m, likeliest first.
  std::vector<SeenEdge> edges;     ///< Of upright faces, and of the level ones.
};
/// Of each cluster of `sampled`, as the finer image of the same view shows it.
std::vector<ClusterShape> cluster_shapes(std::span<const Cluster> clusters, const SampledDepth& sampled,
                                         const rendering::FrameTerms& fine, const Surroundings& surroundings,
                                         const core::RandomStream& stream);

/// How many of the model's points the fine image shows at this pose, less those that it sees through.
int points_shown(const RestingShape& shape, const rendering::FrameTerms& fine, const Pose& X_CO);
/// The pose, moved along its own axes on a level plane while more of these points are shown: depth alone does not tell
/// how far a box is along its faces.
Pose slid_about(const RestingShape& shape, const rendering::FrameTerms& fine, const Vector3d& up_C, const Pose& X_CO);

/// At most `most` different poses in C, best first: those in which the fine image shows the most points of the surface,
/// less those that it sees through.
std::vector<Pose> resting_starts(const ClusterShape& cluster, const RestingShape& shape,
                                 const rendering::FrameTerms& fine, const Surroundings& surroundings, int most,
                                 const core::RandomStream& stream);

}  // namespace prescene::filter
