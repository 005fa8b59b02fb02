// SPDX-License-Identifier: Apache-2.0
// The parts of a depth image: the plane that most points lie on, and the clusters of points that nothing explains.
//
//   SampledDepth sampled = sample_depth(frame.depth, frame.camera, options);
//   auto support = find_support_plane(sampled, options, stream);
//   for (const Cluster& cluster : find_clusters(sampled, explained, options)) ...
#pragma once

#include <functional>
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

/// m that the outline of a support which is found in a frame is widened by.
inline constexpr double kSupportOutlineMargin = 0.01;

struct SegmentationOptions {
  /// pixels. The image is sampled to about this width before it is segmented. Range 40 to 640. Chosen.
  int target_width = 160;
  /// m. Measurements nearer to the camera than this are ignored. Range 0 to 10. Chosen.
  double min_depth = 0.2;
  /// m. Measurements further from the camera than this are ignored. Range 0 to 10. Chosen.
  double max_depth = 2.5;
  /// m. A point lies on a plane if its distance from it is less than this. Range 0.001 to 0.05. Tuned:
  /// docs/studies/tracking.md.
  double plane_inlier = 0.008;
  /// rad. The normal of a support may differ from up by this angle, where up is known. Range 0 to 1.6. Chosen.
  double max_plane_tilt = 0.6;
  /// m. Points that are lower above a plane than this belong to the plane. Range 0.001 to 0.1. Tuned:
  /// docs/studies/tracking.md.
  double min_height = 0.008;
  /// m. Points that are higher above a plane than this are not on top of it. Range 0.01 to 2. Tuned:
  /// docs/studies/tracking.md.
  double max_height = 0.4;
  /// pixels. Clusters with fewer pixels, at the sampled width, are ignored. Range 1 to 1000. Chosen.
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

/// How much larger tolerances are at this depth (m) than nearby: beyond 1.2 m they grow with the squared depth, as
/// noise does.
double tolerance_growth(double depth);
/// How near to a plane a measurement at this depth (m) must be to lie on it, m.
double tolerance_at(const SegmentationOptions& options, double depth);

/// The plane through three points in C, its normal turned towards the camera; nothing where they lie on a line.
std::optional<geometry::Plane> plane_through(const Vector3d& a_C, const Vector3d& b_C, const Vector3d& c_C);
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

/// The 4-connected parts of an image of this size: pixels (y * width + x) for which `inside` holds, neighbours for
/// which `joined` holds too. Pixels of each part in ascending order, parts in the order of their first pixel.
std::vector<std::vector<int>> connected_pixels(int width, int height, const std::function<bool(int)>& inside,
                                               const std::function<bool(int, int)>& joined);

/// Connected measured pixels that nothing explains.
struct Cluster {
  std::vector<int> pixels;         ///< y * width + x of the sampled camera, ascending.
  std::vector<Vector3d> points_C;  ///< Of these pixels.
};
/// Largest cluster first. Pixels where `explained` (sampled camera's size; empty = nothing) is not zero are left out.
std::vector<Cluster> find_clusters(const SampledDepth& sampled, const geometry::Image<std::uint8_t>& explained,
                                   const SegmentationOptions& options);

/// Whether the point's foot on the region's plane lies inside its outline; always, where there is none.
bool stands_on(const rendering::SupportRegion& support, const Vector3d& p_CQ);

/// The convex hull of points of a plane, in order around it, in the plane's own frame of points.
std::vector<Vector3d> convex_outline(const geometry::Plane& plane, std::span<const Vector3d> points, double margin);

}  // namespace prescene::filter
