// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/frame_surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace prescene::filter {
namespace {

constexpr int kMostPlanes = 14;        // looked for one after the other, supports and walls
constexpr int kPatchDraws = 150;       // triples of near points tried for each of these
constexpr double kSideMargin = 0.03;   // m about the outline of a support, below it: its sides
constexpr int kPlaneReach = 8;         // pixels between the points that a plane is drawn through
constexpr std::size_t kScored = 4;     // every so many points count when planes are compared
constexpr std::size_t kFewest = 12;    // sampled pixels of a patch
constexpr double kFilled = 0.4;        // share of a patch's outline that its own pixels must fill
constexpr double kSeenThrough = 0.05;  // share of a region's pixels that may show something behind it

using Mask = std::vector<std::uint8_t>;

double area_of(const rendering::SupportRegion& region) {
  Vector3d twice = Vector3d::Zero();
  const auto& corners = region.outline_C;
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    twice += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  return 0.5 * std::abs(region.plane_C.normal.dot(twice));
}

/// Share of the pixels whose rays meet the region that show something behind it.
double seen_through(const SampledDepth& sampled, const rendering::SupportRegion& region,
                    const SegmentationOptions& options) {
  int inside = 0, behind = 0;
  for (int y = 0; y < sampled.camera.height; ++y)
    for (int x = 0; x < sampled.camera.width; ++x) {
      const Vector3d& p = sampled.points_C[static_cast<std::size_t>(y * sampled.camera.width + x)];
      if (p.z() <= 0.0) continue;
      const double slope = region.plane_C.normal.dot(p);
      if (std::abs(slope) < 1e-9) continue;
      const double t = -region.plane_C.offset / slope;
      if (t <= 0.0 || !stands_on(region, t * p)) continue;
      ++inside;
      behind += region.plane_C.signed_distance(p) < -3.0 * tolerance_at(options, p.z()) ? 1 : 0;
    }
  return inside > 0 ? static_cast<double>(behind) / inside : 0.0;
}

class PatchFinder {
 public:
  PatchFinder(const SampledDepth& sampled, const Vector3d& up_C, const geometry::Image<std::uint8_t>& explained,
              double least_area, const SegmentationOptions& options, const core::RandomStream& stream)
      : sampled_(sampled),
        up_C_(up_C),
        least_area_(least_area),
        options_(options),
        stream_(stream),
        draws_(stream.at(1)),
        free_(sampled.points_C.size(), 0) {
    for (std::size_t i = 0; i < free_.size(); ++i)
      free_[i] = sampled.points_C[i].z() > 0.0 && (explained.empty() || explained.data()[i] == 0) ? 1 : 0;
  }

  std::vector<FlatPatch> run() {
    std::vector<FlatPatch> patches;
    take_main_support(patches);
    for (int round = 0; round < kMostPlanes; ++round) {
      const std::optional<geometry::Plane> plane = largest_plane();
      if (!plane) break;
      take_patches(*plane, patches);
    }
    return patches;
  }

 private:
  const Vector3d& point(int i) const { return sampled_.points_C[static_cast<std::size_t>(i)]; }
  bool is_free(int i) const { return free_[static_cast<std::size_t>(i)] != 0; }
  bool on(const geometry::Plane& plane, int i) const {
    return std::abs(plane.signed_distance(point(i))) < tolerance_at(options_, point(i).z());
  }

  std::optional<geometry::Plane> drawn_plane(const std::vector<int>& pool) {
    const int width = sampled_.camera.width, height = sampled_.camera.height;
    std::array<int, 3> corner{};
    corner[0] = pool[draws_.uniform_below(pool.size())];
    for (int k = 1; k < 3; ++k) {
      const int x = corner[0] % width + static_cast<int>(draws_.uniform_below(2 * kPlaneReach + 1)) - kPlaneReach;
      const int y = corner[0] / width + static_cast<int>(draws_.uniform_below(2 * kPlaneReach + 1)) - kPlaneReach;
      if (x < 0 || y < 0 || x >= width || y >= height || !is_free(y * width + x)) return std::nullopt;
      corner[static_cast<std::size_t>(k)] = y * width + x;
    }
    return plane_through(point(corner[0]), point(corner[1]), point(corner[2]));
  }

  std::optional<geometry::Plane> largest_plane() {
    std::vector<int> pool;
    for (int i = 0; i < static_cast<int>(free_.size()); ++i)
      if (is_free(i)) pool.push_back(i);
    if (pool.size() < 3 * kFewest) return std::nullopt;
    geometry::Plane best;
    std::size_t most = 0;
    for (int draw = 0; draw < kPatchDraws; ++draw) {
      const auto plane = drawn_plane(pool);
      if (!plane) continue;
      std::size_t inliers = 0;
      for (std::size_t k = 0; k < pool.size(); k += kScored) inliers += on(*plane, pool[k]) ? 1 : 0;
      if (inliers > most) best = *plane, most = inliers;
    }
    if (most * kScored < 2 * kFewest) return std::nullopt;
    for (int refinement = 0; refinement < 3; ++refinement) {
      std::vector<Vector3d> inliers;
      for (const int i : pool)
        if (on(best, i)) inliers.push_back(point(i));
      if (inliers.size() < kFewest) return std::nullopt;
      best = fit_plane(inliers);
    }
    return best;
  }

  /// Free pixels on the plane that have no free neighbour off it.
  Mask core_of(const geometry::Plane& plane) const {
    const int width = sampled_.camera.width, height = sampled_.camera.height;
    Mask core(free_.size(), 0);
    for (int y = 1; y + 1 < height; ++y)
      for (int x = 1; x + 1 < width; ++x) {
        const int i = y * width + x;
        if (!is_free(i) || !on(plane, i)) continue;
        int inliers = 0, off = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int j = i + dy * width + dx;
            if (point(j).z() > 0.0) (is_free(j) && on(plane, j) ? inliers : off)++;
          }
        core[static_cast<std::size_t>(i)] = inliers >= 6 && off <= 1 ? 1 : 0;
      }
    return core;
  }

  FlatPatch patch_of(const geometry::Plane& plane, const std::vector<int>& pixels) const {
    FlatPatch patch;
    patch.pixels = static_cast<int>(pixels.size());
    patch.region.plane_C = plane;
    std::vector<Vector3d> points;
    double filled = 0.0;
    for (const int i : pixels) {
      const Vector3d& p = point(i);
      points.push_back(p);
      const double cosine = std::max(0.05, std::abs(plane.normal.dot(p.normalized())));
      filled += p.squaredNorm() * p.z() / (p.norm() * sampled_.camera.fx * sampled_.camera.fy * cosine);
    }
    patch.region.outline_C = convex_outline(plane, points, kSupportOutlineMargin);
    patch.area = area_of(patch.region);
    patch.filled = filled >= kFilled * patch.area;
    patch.level = plane.normal.dot(up_C_) >= std::cos(options_.max_plane_tilt);
    patch.large = patch.filled && patch.area >= least_area_;
    return patch;
  }

  /// The level plane that most of the free points lie on, with its largest connected part, is the first patch.
  void take_main_support(std::vector<FlatPatch>& patches) {
    SampledDepth rest = sampled_;
    for (std::size_t i = 0; i < free_.size(); ++i)
      if (free_[i] == 0) rest.points_C[i] = Vector3d::Zero();
    const std::optional<SupportPlane> plane = find_support_plane(rest, options_, stream_, up_C_);
    if (!plane || plane->region.outline_C.size() < 3) return;
    std::vector<int> pixels;
    for (int i = 0; i < static_cast<int>(free_.size()); ++i)
      if (is_free(i) && on(plane->region.plane_C, i) && stands_on(plane->region, point(i))) pixels.push_back(i);
    FlatPatch patch = patch_of(plane->region.plane_C, pixels);
    patch.region = plane->region;
    if (!patch.large || seen_through(sampled_, patch.region, options_) > kSeenThrough) return;
    for (const int i : pixels) free_[static_cast<std::size_t>(i)] = 0;
    patches.push_back(std::move(patch));
  }

  /// Appends the plane's patches and takes the plane's points out of what is left.
  void take_patches(const geometry::Plane& plane, std::vector<FlatPatch>& patches) {
    const Mask core = core_of(plane);
    auto parts = connected_pixels(
        sampled_.camera.width, sampled_.camera.height, [&](int i) { return core[static_cast<std::size_t>(i)] != 0; },
        [](int, int) { return true; });
    std::erase_if(parts, [](const std::vector<int>& pixels) { return pixels.size() < kFewest; });
    std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
    std::vector<bool> joined(parts.size(), false);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (joined[i]) continue;
      std::vector<int> pixels = parts[i];
      // Parts of one surface that something stands in front of; two tables of one height show what is between them.
      for (std::size_t j = i + 1; j < parts.size(); ++j) {
        if (joined[j] || plane.normal.dot(up_C_) < std::cos(options_.max_plane_tilt)) continue;
        std::vector<int> both = pixels;
        both.insert(both.end(), parts[j].begin(), parts[j].end());
        const FlatPatch joint = patch_of(plane, both);
        if (!joint.filled || seen_through(sampled_, joint.region, options_) > kSeenThrough) continue;
        pixels = std::move(both);
        joined[j] = true;
      }
      patches.push_back(patch_of(plane, pixels));
      for (std::size_t k = 0; k < free_.size(); ++k)
        if (free_[k] != 0 && on(plane, static_cast<int>(k)) && stands_on(patches.back().region, sampled_.points_C[k]))
          free_[k] = 0;
    }
    if (parts.empty())
      for (std::size_t k = 0; k < free_.size(); ++k)
        if (free_[k] != 0 && on(plane, static_cast<int>(k))) free_[k] = 0;
  }

  const SampledDepth& sampled_;
  Vector3d up_C_;
  double least_area_;
  const SegmentationOptions& options_;
  core::RandomStream stream_;
  core::RandomStream draws_;
  Mask free_;
};

/// Distance of a point's foot on the region's plane from the outline.
double from_outline(const rendering::SupportRegion& region, const Vector3d& p_CQ) {
  const Vector3d foot = p_CQ - region.plane_C.signed_distance(p_CQ) * region.plane_C.normal;
  double nearest = std::numeric_limits<double>::infinity();
  const auto& corners = region.outline_C;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d edge = corners[(i + 1) % corners.size()] - corners[i];
    const double along = std::clamp((foot - corners[i]).dot(edge) / std::max(edge.squaredNorm(), 1e-12), 0.0, 1.0);
    nearest = std::min(nearest, (foot - corners[i] - along * edge).norm());
  }
  return nearest;
}

}  // namespace

std::vector<FlatPatch> find_flat_patches(const SampledDepth& sampled, const Vector3d& up_C,
                                         const geometry::Image<std::uint8_t>& explained, double least_area,
                                         const SegmentationOptions& options, const core::RandomStream& stream) {
  return PatchFinder(sampled, up_C, explained, least_area, options, stream).run();
}

geometry::Image<std::uint8_t> pixels_on(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& up_W,
                                        const SupportSurfaces& surfaces, const SegmentationOptions& options) {
  geometry::Image<std::uint8_t> mask(sampled.camera.width, sampled.camera.height);
  if (surfaces.empty()) return mask;
  for (std::size_t i = 0; i < sampled.points_C.size(); ++i) {
    const Vector3d& p = sampled.points_C[i];
    if (p.z() <= 0.0) continue;
    const double tolerance = std::max(options.min_height, tolerance_at(options, p.z()));
    const Vector3d p_W = X_WC * p;
    const Vector3d along = tolerance * (X_WC.rotation * p.normalized());
    mask.data()[i] = surfaces.crosses(p_W - tolerance * up_W, p_W + tolerance * up_W) ||
                             surfaces.crosses(p_W - along, p_W + 2.0 * along)
                         ? 1
                         : 0;
  }
  return mask;
}

Surroundings surroundings_of(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& up_W,
                             const SupportSurfaces& supports, const geometry::Image<std::uint8_t>& on_supports,
                             std::span<const rendering::SupportRegion> upper_faces, std::span<const FlatPatch> patches,
                             const SegmentationOptions& options) {
  Surroundings surroundings;
  surroundings.X_WC = X_WC;
  surroundings.up_W = up_W;
  surroundings.solid = supports;
  surroundings.background = on_supports;
  if (surroundings.background.empty())
    surroundings.background = geometry::Image<std::uint8_t>(sampled.camera.width, sampled.camera.height);
  surroundings.over_support = geometry::Image<std::uint8_t>(sampled.camera.width, sampled.camera.height);
  for (const FlatPatch& patch : patches) {
    if (patch.level) (patch.large ? surroundings.solid : surroundings.steps).add(patch.region, X_WC);
  }
  if (!patches.empty() && patches.front().level && patches.front().large)
    surroundings.main_support_C = patches.front().region;
  const auto over_main = [&](const Vector3d& p) {
    if (!surroundings.main_support_C || !stands_on(*surroundings.main_support_C, p)) return false;
    const double height = surroundings.main_support_C->plane_C.signed_distance(p);
    return height > 0.0 && height < options.max_height;
  };
  for (std::size_t i = 0; i < sampled.points_C.size(); ++i) {
    const Vector3d& p = sampled.points_C[i];
    if (p.z() <= 0.0) continue;
    const double tolerance = std::max(options.min_height, tolerance_at(options, p.z()));
    std::uint8_t& shown = surroundings.background.data()[i];
    // What is right below a support's edge is its side.
    const auto is_side = [&](const rendering::SupportRegion& face) {
      return face.plane_C.signed_distance(p) < -tolerance && from_outline(face, p) < kSideMargin;
    };
    for (const FlatPatch& patch : patches) {
      if (shown != 0 || !patch.large) continue;
      if (std::abs(patch.region.plane_C.signed_distance(p)) < tolerance && stands_on(patch.region, p))
        shown = patch.level ? kSupport : kWall;
      else if (patch.level && is_side(patch.region))
        shown = kWall;
    }
    const Vector3d p_W = X_WC * p;
    std::uint8_t& over = surroundings.over_support.data()[i];
    if (over_main(p))
      over = kMainSupport;
    else if (surroundings.solid.crosses(p_W, p_W - options.max_height * up_W))
      over = kOtherSupport;
    if (shown == 0 && std::any_of(upper_faces.begin(), upper_faces.end(), is_side)) shown = kWall;
  }
  return surroundings;
}

}  // namespace prescene::filter
