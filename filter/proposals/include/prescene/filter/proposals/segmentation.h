// SPDX-License-Identifier: Apache-2.0
// What stands on what in a depth image: the support plane, and the clusters of points above it.
//
//   SampledDepth sampled = sample_depth(frame.depth, frame.camera, options);
//   auto support = find_support_plane(sampled, options, stream);
//   for (const Cluster& cluster : find_clusters(sampled, support->region, {}, options)) ...
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

using geometry::Pose;
using geometry::Vector3d;

struct SegmentationOptions {
  /// pixels. The image is sampled to about this width. Range 40 to 640. Chosen.
  int target_width = 160;
  /// m. Nearer measurements are not looked at, ... Range 0 to 10. Chosen.
  double min_depth = 0.2;
  /// m. ... and neither are further ones. Range 0 to 10. Chosen.
  double max_depth = 2.5;
  /// m. Points so near to a plane are on it. Range 0.001 to 0.05. Tuned: docs/studies/tracking.md.
  double plane_inlier = 0.008;
  /// rad. Of a support, from up, where up is known. Range 0 to 1.6. Chosen.
  double max_plane_tilt = 0.6;
  /// m. Above the plane: nearer points are the plane's. Range 0.001 to 0.1. Tuned: docs/studies/tracking.md.
  double min_height = 0.008;
  /// m. Above the plane: further points are not on it. Range 0.01 to 2. Tuned: docs/studies/tracking.md.
  double max_height = 0.4;
  /// m. Between neighbouring pixels of one cluster, at most. Range 0.001 to 0.2. Tuned: docs/studies/tracking.md.
  double depth_step = 0.02;
  /// pixels. Of a cluster, at the sampled width. Range 1 to 1000. Chosen.
  int min_cluster_pixels = 25;
};

/// A depth image sampled to a smaller camera, with its points.
struct SampledDepth {
  geometry::PinholeCamera camera;
  geometry::DepthImage depth;      ///< 0 = missing or out of range.
  std::vector<Vector3d> points_C;  ///< One a pixel, row-major, of the measurement nearest to it; zero where missing.
};
SampledDepth sample_depth(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                          const SegmentationOptions& options);

/// The plane of least squares through points in C (at least three), its normal turned towards the camera.
geometry::Plane fit_plane(std::span<const Vector3d> points_C);

/// The plane that the most measured points lie on (RANSAC [Fischler & Bolles 1981], then least squares), its normal
/// turned towards the camera, with the convex hull of the largest connected patch of its points. With `up_C` (unit),
/// only planes within max_plane_tilt of facing up count.
struct SupportPlane {
  rendering::SupportRegion region;
  int inliers = 0;   ///< Sampled pixels on it.
  double rms = 0.0;  ///< m, of the inliers.
};
std::optional<SupportPlane> find_support_plane(const SampledDepth& sampled, const SegmentationOptions& options,
                                               const core::RandomStream& stream,
                                               const std::optional<Vector3d>& up_C = std::nullopt);

/// Connected measured pixels that stand on a support and are explained by nothing else.
struct Cluster {
  std::vector<int> pixels;         ///< y * width + x of the sampled camera, ascending.
  std::vector<Vector3d> points_C;  ///< Of these pixels.
};
/// Pixels min_height to max_height above the support and inside its outline, largest cluster first. Pixels where
/// `explained` (sampled camera's size; empty = nothing) is not zero are left out.
std::vector<Cluster> find_clusters(const SampledDepth& sampled, const rendering::SupportRegion& support,
                                   const geometry::Image<std::uint8_t>& explained, const SegmentationOptions& options);

/// Whether the point's foot on the region's plane lies inside its outline; always, where there is none.
bool stands_on(const rendering::SupportRegion& support, const Vector3d& p_CQ);

/// The convex hull of points of a plane, in order around it, in the plane's own frame of points.
std::vector<Vector3d> convex_outline(const geometry::Plane& plane, std::span<const Vector3d> points, double margin);

}  // namespace prescene::filter
