// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/segmentation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/pixel_rays.h"
#include "prescene/geometry/polygon.h"

namespace prescene::filter {
namespace {

using Eigen::Vector2d;

constexpr int kPlaneDraws = 400;     // triples of points tried
constexpr double kDepthStep = 0.02;  // m, the most between neighbours in one cluster; tuned: docs/studies/tracking.md
constexpr double kLeastPlaneShare = 0.08;  // of the measured points; less is no support
// 1/m^2: the tolerance of a plane is so many times the squared depth where that is more than 1.
constexpr double kToleranceGrowth = 0.7;

bool measured(const Vector3d& p) { return p.z() > 0.0; }

/// Two unit vectors that span a plane.
std::array<Vector3d, 2> plane_axes(const Vector3d& normal) {
  const Vector3d helper = std::abs(normal.x()) < 0.7 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = helper.cross(normal).normalized();
  return {x, normal.cross(x)};
}

/// Pixels of the plane of whose 3 x 3 neighbourhood two thirds are on the plane and nothing is off it: thin bridges to
/// other things are cut, single holes are not.
std::vector<std::uint8_t> eroded_inliers(const SampledDepth& sampled, const geometry::Plane& plane, double inlier) {
  const int width = sampled.camera.width, height = sampled.camera.height;
  const auto point = [&](int x, int y) -> const Vector3d& {
    return sampled.points_C[static_cast<std::size_t>(y * width + x)];
  };
  const auto on_plane = [&](const Vector3d& p) { return std::abs(plane.signed_distance(p)) < inlier; };
  std::vector<std::uint8_t> eroded(static_cast<std::size_t>(width * height), 0);
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x) {
      int on = 0, off = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (measured(point(x + dx, y + dy))) (on_plane(point(x + dx, y + dy)) ? on : off)++;
      eroded[static_cast<std::size_t>(y * width + x)] = measured(point(x, y)) && on >= 6 && off == 0;
    }
  return eroded;
}

}  // namespace

double tolerance_growth(double depth) { return std::max(1.0, kToleranceGrowth * depth * depth); }

double tolerance_at(const SegmentationOptions& options, double depth) {
  return options.plane_inlier * tolerance_growth(depth);
}

std::optional<geometry::Plane> plane_through(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a);
  if (n.norm() < 1e-6) return std::nullopt;
  geometry::Plane plane;
  plane.normal = n.normalized();
  plane.offset = -plane.normal.dot(a);
  if (plane.offset < 0.0) {  // the camera, at the origin, is above it
    plane.normal = -plane.normal;
    plane.offset = -plane.offset;
  }
  return plane;
}

std::vector<std::vector<int>> connected_pixels(int width, int height, const std::function<bool(int)>& inside,
                                               const std::function<bool(int, int)>& joined) {
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(width * height), 0);
  std::vector<std::vector<int>> result;
  std::vector<int> stack;
  for (int start = 0; start < width * height; ++start) {
    if (seen[static_cast<std::size_t>(start)] || !inside(start)) continue;
    std::vector<int> component;
    stack.assign(1, start);
    seen[static_cast<std::size_t>(start)] = 1;
    while (!stack.empty()) {
      const int i = stack.back();
      stack.pop_back();
      component.push_back(i);
      const int x = i % width;
      const auto visit = [&](bool exists, int j) {
        if (!exists || seen[static_cast<std::size_t>(j)] || !inside(j) || !joined(i, j)) return;
        seen[static_cast<std::size_t>(j)] = 1;
        stack.push_back(j);
      };
      visit(x > 0, i - 1);
      visit(x + 1 < width, i + 1);
      visit(i >= width, i - width);
      visit(i + width < width * height, i + width);
    }
    std::sort(component.begin(), component.end());
    result.push_back(std::move(component));
  }
  return result;
}

geometry::Plane fit_plane(std::span<const Vector3d> points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;
  for (const Vector3d& p : points) {
    const double x = p.x() - mean.x(), y = p.y() - mean.y(), z = p.z() - mean.z();
    xx += x * x, xy += x * y, xz += x * z;
    yy += y * y, yz += y * z, zz += z * z;
  }
  geometry::Matrix3d scatter;
  scatter << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  geometry::Plane plane;
  plane.normal = geometry::symmetric_eigen_3(scatter).vectors.col(0);
  plane.offset = -plane.normal.dot(mean);
  if (plane.offset < 0.0) {
    plane.normal = -plane.normal;
    plane.offset = -plane.offset;
  }
  return plane;
}

namespace {

/// Depths that count, as the numbers of single precision that lie in the range: no depth has to be widened to be told.
struct DepthRange {
  explicit DepthRange(const SegmentationOptions& options)
      : least(static_cast<float>(options.min_depth)), most(static_cast<float>(options.max_depth)) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    if (static_cast<double>(least) < options.min_depth) least = std::nextafter(least, kFar);
    if (static_cast<double>(most) > options.max_depth) most = std::nextafter(most, -kFar);
  }
  bool has(float z) const { return z >= least && z <= most; }

  float least, most;
};

/// The measured pixel nearest to (x, y), at most `reach` away in either direction; nearest first, ties by row.
std::optional<std::array<int, 2>> measured_near(const geometry::ImageView<const float>& depth, int x, int y, int reach,
                                                const DepthRange& range) {
  if (range.has(depth(x, y))) return {{x, y}};
  std::optional<std::array<int, 2>> found;
  int nearest = 2 * reach * reach + 1;
  const int left = std::max(0, x - reach), right = std::min(depth.width() - 1, x + reach);
  for (int v = std::max(0, y - reach); v <= std::min(depth.height() - 1, y + reach); ++v) {
    const float* row = depth.row(v);
    for (int u = left; u <= right; ++u) {
      if (!range.has(row[u])) continue;
      const int distance = (u - x) * (u - x) + (v - y) * (v - y);
      if (distance >= nearest) continue;
      nearest = distance;
      found = {u, v};
    }
  }
  return found;
}

}  // namespace

SampledDepth sample_depth(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                          const SegmentationOptions& options) {
  PRESCENE_CHECK(depth.width() == camera.width && depth.height() == camera.height);
  const int step = std::max(1, static_cast<int>(std::lround(static_cast<double>(camera.width) / options.target_width)));
  const int offset = step / 2;
  SampledDepth sampled;
  sampled.camera = camera.subsampled(step, offset);
  const int width = sampled.camera.width, height = sampled.camera.height;
  sampled.depth = geometry::DepthImage(width, height);
  sampled.points_C.assign(sampled.depth.size(), Vector3d::Zero());
  const geometry::PixelRays rays(camera);
  const DepthRange range(options);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      // Depth that was registered to a colour camera is full of single holes: a neighbour stands in, at its own place.
      const auto pixel = measured_near(depth.view(), offset + step * x, offset + step * y, step / 2, range);
      if (!pixel) continue;
      const auto [u, v] = *pixel;
      const float z = depth(u, v);
      sampled.depth(x, y) = z;
      sampled.points_C[static_cast<std::size_t>(y * width + x)] = rays.unproject(u, v, z);
    }
  return sampled;
}

std::vector<Vector3d> convex_outline(const geometry::Plane& plane, std::span<const Vector3d> points, double margin) {
  const auto [x_axis, y_axis] = plane_axes(plane.normal);
  std::vector<Vector2d> flat;
  Vector2d centre = Vector2d::Zero();
  for (const Vector3d& p : points) flat.emplace_back(x_axis.dot(p), y_axis.dot(p));
  const std::vector<Vector2d> hull = geometry::convex_polygon(std::move(flat));
  for (const Vector2d& p : hull) centre += p / static_cast<double>(hull.size());
  std::vector<Vector3d> outline;
  for (const Vector2d& p : hull) {
    const Vector2d outwards = p - centre;
    const Vector2d widened = p + margin * outwards / std::max(outwards.norm(), 1e-9);
    outline.push_back(widened.x() * x_axis + widened.y() * y_axis - plane.offset * plane.normal);
  }
  return outline;
}

bool stands_on(const rendering::SupportRegion& support, const Vector3d& p_CQ) {
  const std::size_t n = support.outline_C.size();
  if (n < 3) return true;
  const Vector3d& normal = support.plane_C.normal;
  int left = 0, right = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d& a = support.outline_C[i];
    const Vector3d& b = support.outline_C[(i + 1) % n];
    (normal.dot((b - a).cross(p_CQ - a)) >= 0.0 ? left : right)++;
  }
  return left == 0 || right == 0;
}

std::optional<SupportPlane> find_support_plane(const SampledDepth& sampled, const SegmentationOptions& options,
                                               const core::RandomStream& stream, const std::optional<Vector3d>& up_C) {
  std::vector<Vector3d> points;
  for (const Vector3d& p : sampled.points_C)
    if (measured(p)) points.push_back(p);
  if (points.size() < 50) return std::nullopt;
  core::RandomStream draws = stream;
  const auto counts = [&](const geometry::Plane& plane) {
    return !up_C || plane.normal.dot(*up_C) >= std::cos(options.max_plane_tilt);
  };
  geometry::Plane best;
  std::size_t best_inliers = 0;
  for (int draw = 0; draw < kPlaneDraws; ++draw) {
    std::array<Vector3d, 3> corner;
    for (Vector3d& p : corner) p = points[draws.uniform_below(points.size())];
    const auto plane = plane_through(corner[0], corner[1], corner[2]);
    if (!plane || !counts(*plane)) continue;
    std::size_t inliers = 0;
    for (const Vector3d& p : points) inliers += std::abs(plane->signed_distance(p)) < options.plane_inlier;
    if (inliers > best_inliers) best = *plane, best_inliers = inliers;
  }
  if (static_cast<double>(best_inliers) < kLeastPlaneShare * static_cast<double>(points.size()) || best_inliers < 30)
    return std::nullopt;

  for (int round = 0; round < 3; ++round) {
    std::vector<Vector3d> inliers;
    for (const Vector3d& p : points)
      if (std::abs(best.signed_distance(p)) < options.plane_inlier) inliers.push_back(p);
    if (inliers.size() < 30) return std::nullopt;
    best = fit_plane(inliers);
  }
  SupportPlane support;
  support.region.plane_C = best;
  double squares = 0.0;
  for (const Vector3d& p : points) {
    const double distance = best.signed_distance(p);
    if (std::abs(distance) >= options.plane_inlier) continue;
    ++support.inliers;
    squares += distance * distance;
  }
  support.rms = std::sqrt(squares / std::max(1, support.inliers));

  const std::vector<std::uint8_t> on_plane = eroded_inliers(sampled, best, options.plane_inlier);
  const auto patches = connected_pixels(
      sampled.camera.width, sampled.camera.height, [&](int i) { return on_plane[static_cast<std::size_t>(i)] != 0; },
      [](int, int) { return true; });
  const auto largest = std::max_element(patches.begin(), patches.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (largest == patches.end() || largest->size() < 10) return std::nullopt;
  std::vector<Vector3d> patch;
  for (const int i : *largest) patch.push_back(sampled.points_C[static_cast<std::size_t>(i)]);
  support.region.outline_C = convex_outline(best, patch, kSupportOutlineMargin);
  return support;
}

std::vector<Cluster> find_clusters(const SampledDepth& sampled, const geometry::Image<std::uint8_t>& explained,
                                   const SegmentationOptions& options) {
  const auto inside = [&](int i) {
    return measured(sampled.points_C[static_cast<std::size_t>(i)]) && (explained.empty() || explained.data()[i] == 0);
  };
  const auto joined = [&](int i, int j) {
    return std::abs(sampled.depth.data()[i] - sampled.depth.data()[j]) < kDepthStep;
  };
  std::vector<Cluster> clusters;
  for (std::vector<int>& pixels : connected_pixels(sampled.camera.width, sampled.camera.height, inside, joined)) {
    if (static_cast<int>(pixels.size()) < options.min_cluster_pixels) continue;
    Cluster cluster;
    for (const int i : pixels) cluster.points_C.push_back(sampled.points_C[static_cast<std::size_t>(i)]);
    cluster.pixels = std::move(pixels);
    clusters.push_back(std::move(cluster));
  }
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const Cluster& a, const Cluster& b) { return a.pixels.size() > b.pixels.size(); });
  return clusters;
}

}  // namespace prescene::filter
