// SPDX-License-Identifier: Apache-2.0
// Edges and heights of clusters.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "prescene/filter/proposals/resting_starts.h"
#include "resting_parts.h"

namespace prescene::filter {
namespace {

using Eigen::Vector2d;

using geometry::Quaterniond;

constexpr double kSameSurface = 0.02;   // m between a fine pixel and the sampled one that belongs to a cluster
constexpr double kBin = 0.004;          // m of height
constexpr int kHalfWindow = 2;          // bins to either side that count as the same height
constexpr double kLevelContrast = 2.0;  // times as many points as usual at a height are a level face
constexpr std::size_t kMostTops = 3;
constexpr std::size_t kFewestPoints = 15;  // of a face
constexpr std::size_t kMostScored = 300;   // points that edges are looked for in
constexpr int kEdgeDraws = 60;             // pairs of points tried for each upright face
constexpr int kMostFaces = 3;              // upright ones
constexpr double kOnFace = 0.007;          // m, growing with depth
constexpr double kLeastEdge = 0.015;       // m
constexpr double kTrimmed = 0.02;          // of the points of an edge are beyond either end
constexpr int kDirections = 30;            // of a level face's sides, over a right angle
constexpr std::size_t kMostBases = 3;
constexpr double kFurthestBase = 0.5;  // m below a point
constexpr double kUnderPoint = 0.008;  // m below a point that a base begins

/// Ends of the middle share of the values; reorders them.
std::array<double, 2> ends_of(std::vector<double>& values) {
  const auto at = [&](double share) {
    const auto place = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  const double low = at(kTrimmed);
  return {low, at(1.0 - kTrimmed)};
}

/// Points at even distances in the list, at most `most`.
std::vector<Vector3d> some_of(const std::vector<Vector3d>& points, std::size_t most) {
  std::vector<Vector3d> some;
  const std::size_t stride = (points.size() + most - 1) / most;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, stride)) some.push_back(points[i]);
  return some;
}

/// Makes the shape of one cluster from its points in U.
class ShapeFinder {
 public:
  ShapeFinder(std::vector<Vector3d> points_U, const Vector3d& p_UC, const Surroundings& surroundings,
              const Quaterniond& R_WU, core::RandomStream stream)
      : points_(std::move(points_U)), p_UC_(p_UC), surroundings_(surroundings), R_WU_(R_WU), draws_(stream) {}

  ClusterShape run() {
    if (points_.size() < kFewestPoints) return shape_;
    shape_.points_U = some_of(points_, 12);
    find_tops();
    find_bases();
    find_upright_faces();
    for (const double top : shape_.tops) find_sides_of_level_face(top);
    return std::move(shape_);
  }

 private:
  double tolerance(const Vector3d& p) const { return kOnFace * tolerance_growth((p - p_UC_).norm()); }

  void find_tops() {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vector3d& p : points_) low = std::min(low, p.z()), high = std::max(high, p.z());
    const int bins = 1 + static_cast<int>((high - low) / kBin);
    std::vector<int> counts(static_cast<std::size_t>(bins), 0), windows(counts);
    for (const Vector3d& p : points_) ++counts[static_cast<std::size_t>((p.z() - low) / kBin)];
    for (int i = 0; i < bins; ++i)
      for (int k = std::max(0, i - kHalfWindow); k <= std::min(bins - 1, i + kHalfWindow); ++k)
        windows[static_cast<std::size_t>(i)] += counts[static_cast<std::size_t>(k)];
    std::vector<int> usual = windows;
    std::nth_element(usual.begin(), usual.begin() + bins / 2, usual.end());
    const double least =
        std::max(kLevelContrast * usual[static_cast<std::size_t>(bins / 2)], static_cast<double>(kFewestPoints));
    while (shape_.tops.size() < kMostTops) {
      const auto best = std::max_element(windows.begin(), windows.end());
      if (*best < least && !(shape_.tops.empty() && bins <= 2 * kHalfWindow + 1)) break;
      const int at = static_cast<int>(best - windows.begin());
      double sum = 0.0;
      int n = 0;
      for (int k = std::max(0, at - kHalfWindow); k <= std::min(bins - 1, at + kHalfWindow); ++k) {
        sum += counts[static_cast<std::size_t>(k)] * (low + (k + 0.5) * kBin);
        n += counts[static_cast<std::size_t>(k)];
      }
      shape_.tops.push_back(sum / std::max(1, n));
      for (int k = std::max(0, at - 2 * kHalfWindow - 1); k <= std::min(bins - 1, at + 2 * kHalfWindow + 1); ++k)
        windows[static_cast<std::size_t>(k)] = 0;
    }
    std::vector<double> heights;
    for (const Vector3d& p : points_) heights.push_back(p.z());
    highest_ = ends_of(heights)[1];
  }

  void find_bases() {
    std::vector<std::pair<double, int>> seen;
    for (const Vector3d& p : some_of(points_, 24)) {
      const Vector3d up_W = R_WU_ * Vector3d::UnitZ();
      const Vector3d from = R_WU_ * p - kUnderPoint * up_W;
      const auto reaches = [&](double drop) {
        return surroundings_.solid.crosses(from, from - drop * up_W) ||
               surroundings_.steps.crosses(from, from - drop * up_W);
      };
      if (!reaches(kFurthestBase)) continue;
      double above = 0.0, below = kFurthestBase;
      while (below - above > 1e-3) {
        const double middle = 0.5 * (above + below);
        (reaches(middle) ? below : above) = middle;
      }
      const double base = p.z() - kUnderPoint - 0.5 * (above + below);
      const auto same = std::find_if(seen.begin(), seen.end(),
                                     [&](const auto& other) { return std::abs(other.first - base) < kSameHeight; });
      if (same == seen.end())
        seen.emplace_back(base, 1);
      else
        ++same->second;
    }
    // A thing may stand on another one of the same cluster.
    for (const double top : shape_.tops)
      if (top < highest_ - 2.0 * kSameHeight && std::none_of(seen.begin(), seen.end(), [&](const auto& other) {
            return std::abs(other.first - top) < kSameHeight;
          }))
        seen.emplace_back(top, 1);
    std::stable_sort(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    for (std::size_t i = 0; i < std::min(kMostBases, seen.size()); ++i) shape_.bases.push_back(seen[i].first);
  }

  void find_upright_faces() {
    std::vector<Vector3d> rest;
    for (const Vector3d& p : points_)
      if (std::none_of(shape_.tops.begin(), shape_.tops.end(),
                       [&](double top) { return std::abs(p.z() - top) < tolerance(p); }))
        rest.push_back(p);
    rest = some_of(rest, kMostScored);
    for (int face = 0; face < kMostFaces && rest.size() >= kFewestPoints; ++face) {
      Vector2d normal = Vector2d::Zero();
      double offset = 0.0;
      std::size_t most = 0;
      const auto on = [&](const Vector3d& p) { return std::abs(normal.dot(p.head<2>()) - offset) < tolerance(p); };
      Vector2d best = Vector2d::Zero();
      double best_offset = 0.0;
      for (int draw = 0; draw < kEdgeDraws; ++draw) {
        const Vector3d& p = rest[draws_.uniform_below(rest.size())];
        const Vector3d& q = rest[draws_.uniform_below(rest.size())];
        const Vector2d along = (q - p).head<2>();
        if (along.norm() < kLeastEdge) continue;
        normal = left_of(along.normalized());
        offset = normal.dot(p.head<2>());
        const auto inliers = static_cast<std::size_t>(std::count_if(rest.begin(), rest.end(), on));
        if (inliers > most) most = inliers, best = normal, best_offset = offset;
      }
      if (most < kFewestPoints) break;
      normal = best, offset = best_offset;
      for (int refinement = 0; refinement < 2; ++refinement) {
        Vector2d mean = Vector2d::Zero();
        double n = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
        for (const Vector3d& p : rest)
          if (on(p)) mean += p.head<2>(), n += 1.0;
        mean /= std::max(1.0, n);
        for (const Vector3d& p : rest)
          if (on(p)) {
            const Vector2d d = p.head<2>() - mean;
            xx += d.x() * d.x(), xy += d.x() * d.y(), yy += d.y() * d.y();
          }
        const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);  // of the direction of most spread
        normal = left_of({std::cos(angle), std::sin(angle)});
        offset = normal.dot(mean);
      }
      if (normal.dot(p_UC_.head<2>()) < offset) normal = -normal, offset = -offset;
      std::vector<double> along;
      for (const Vector3d& p : rest)
        if (on(p)) along.push_back(left_of(normal).dot(p.head<2>()));
      if (along.size() < kFewestPoints) break;
      const auto [first, last] = ends_of(along);
      if (last - first >= kLeastEdge) shape_.edges.push_back({normal, offset, first, last});
      std::erase_if(rest, on);
    }
  }

  /// The least rectangle about a level face.
  void find_sides_of_level_face(double top) {
    std::vector<Vector3d> level;
    for (const Vector3d& p : points_)
      if (std::abs(p.z() - top) < tolerance(p)) level.push_back(p);
    level = some_of(level, kMostScored);
    if (level.size() < kFewestPoints) return;
    std::vector<double> values(level.size());
    const auto ends = [&](const Vector2d& direction) {
      for (std::size_t i = 0; i < level.size(); ++i) values[i] = direction.dot(level[i].head<2>());
      return ends_of(values);
    };
    double least = std::numeric_limits<double>::infinity();
    Vector2d best = Vector2d::UnitX();
    std::array<double, 2> best_x{}, best_y{};
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 0.5 * std::numbers::pi * i / kDirections;
      const Vector2d x(std::cos(angle), std::sin(angle));
      const auto along_x = ends(x), along_y = ends(left_of(x));
      const double area = (along_x[1] - along_x[0]) * (along_y[1] - along_y[0]);
      if (area < least) least = area, best = x, best_x = along_x, best_y = along_y;
    }
    // `outwards` turned by +90 degrees: y for x, -x for y, and so on.
    shape_.edges.push_back({best, best_x[1], best_y[0], best_y[1]});
    shape_.edges.push_back({-best, -best_x[0], -best_y[1], -best_y[0]});
    shape_.edges.push_back({left_of(best), best_y[1], -best_x[1], -best_x[0]});
    shape_.edges.push_back({-left_of(best), -best_y[0], best_x[0], best_x[1]});
  }

  std::vector<Vector3d> points_;
  Vector3d p_UC_;
  const Surroundings& surroundings_;
  Quaterniond R_WU_;
  core::RandomStream draws_;
  double highest_ = 0.0;
  ClusterShape shape_;
};

}  // namespace

std::vector<ClusterShape> cluster_shapes(std::span<const Cluster> clusters, const SampledDepth& sampled,
                                         const rendering::FrameTerms& fine, const Surroundings& surroundings,
                                         const core::RandomStream& stream) {
  const Quaterniond R_UW = up_to_z(surroundings.up_W);
  const Pose X_UC{(R_UW * surroundings.X_WC.rotation).normalized(), R_UW * surroundings.X_WC.translation};
  geometry::Image<std::int32_t> cluster_of(sampled.camera.width, sampled.camera.height, -1);
  for (std::size_t i = 0; i < clusters.size(); ++i)
    for (const int pixel : clusters[i].pixels) cluster_of.data()[pixel] = static_cast<std::int32_t>(i);
  std::vector<std::vector<Vector3d>> points(clusters.size());
  for (int y = 0; y < fine.camera.height; ++y)
    for (int x = 0; x < fine.camera.width; ++x) {
      const double z = static_cast<double>(fine.depth(x, y));
      if (!(z > 0.0)) continue;
      const Vector3d p = fine.camera.unproject(x, y, z);
      const Eigen::Vector2d pixel = sampled.camera.project(p);
      const int u = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, sampled.camera.width - 1);
      const int v = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, sampled.camera.height - 1);
      const std::int32_t cluster = cluster_of(u, v);
      if (cluster >= 0 && std::abs(z - static_cast<double>(sampled.depth(u, v))) < kSameSurface)
        points[static_cast<std::size_t>(cluster)].push_back(X_UC * p);
    }
  std::vector<ClusterShape> shapes;
  for (std::size_t i = 0; i < clusters.size(); ++i)
    shapes.push_back(
        ShapeFinder(std::move(points[i]), X_UC.translation, surroundings, R_UW.conjugate(), stream.at(i)).run());
  return shapes;
}

}  // namespace prescene::filter
