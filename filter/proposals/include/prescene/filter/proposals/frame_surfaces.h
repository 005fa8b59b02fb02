// SPDX-License-Identifier: Apache-2.0
// The flat things that a frame shows besides objects: what objects may stand on, and walls. And everything that is
// known of supports, put together for a search.
//
//   const auto on_supports = pixels_on(sampled, X_WC, up_W, supports, options);
//   auto patches = find_flat_patches(sampled, up_C, on_supports, least_area, options, stream);
//   auto surroundings = surroundings_of(sampled, X_WC, up_W, supports, on_supports, {}, patches, options);
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "prescene/filter/proposals/segmentation.h"
#include "prescene/filter/proposals/support_surfaces.h"

namespace prescene::filter {

/// A connected flat part of what a frame shows, or several that lie in one plane with nothing seen through between.
struct FlatPatch {
  rendering::SupportRegion region;
  int pixels = 0;       ///< Sampled ones on it.
  double area = 0.0;    ///< m^2, of its outline.
  bool filled = false;  ///< Its pixels fill a fair share of the outline: it is no chance plane through several things.
  bool level = false;   ///< Its normal is within max_plane_tilt of up.
  bool large = false;   ///< Too large to be a face of an object: a support, or a wall if it is not level.
};

/// Flat patches, largest plane first: planes are drawn through near points of the image (RANSAC [Fischler & Bolles
/// 1981]), refined by least squares and cut into connected patches; their points are taken out, and so on. Pixels where
/// `explained` (sampled camera's size; empty = nothing) is not zero are left out. From `least_area` (m^2) on a patch is
/// no face of an object.
std::vector<FlatPatch> find_flat_patches(const SampledDepth& sampled, const Vector3d& up_C,
                                         const geometry::Image<std::uint8_t>& explained, double least_area,
                                         const SegmentationOptions& options, const core::RandomStream& stream);

/// The measured pixels of `sampled` that lie on known surfaces, as a mask of its size.
geometry::Image<std::uint8_t> pixels_on(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& up_W,
                                        const SupportSurfaces& surfaces, const SegmentationOptions& options);

/// Where objects can be in a frame.
struct Surroundings {
  Pose X_WC;
  Vector3d up_W = Vector3d::UnitZ();
  /// The support that most pixels show, in C: things are likelier there than elsewhere.
  std::optional<rendering::SupportRegion> main_support_C;
  SupportSurfaces solid;  ///< Objects stand on it and never reach through it.
  SupportSurfaces steps;  ///< Small level patches: objects may stand on these too, or be what the patch belongs to.
  /// Of the sampled camera's size: 0 where the frame may show an object, else what it shows, a Shown.
  geometry::Image<std::uint8_t> background;
  /// Likewise: an Over, which says what a pixel is at most max_height above.
  geometry::Image<std::uint8_t> over_support;
};
enum Over : std::uint8_t {
  kNoSupport = 0,
  kOtherSupport = 1,  ///< Of `solid`.
  kMainSupport = 2,
};
enum Shown : std::uint8_t {
  kSupport = 1,  ///< A surface that objects stand on, or anything of a support that is known.
  kWall = 2,     ///< A wall, or the side of a support of which only the upper face is known.
};

/// What the scene knows (`supports`, and the pixels that show them; of those in `upper_faces` it knows nothing else)
/// and what the frame shows besides.
Surroundings surroundings_of(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& up_W,
                             const SupportSurfaces& supports, const geometry::Image<std::uint8_t>& on_supports,
                             std::span<const rendering::SupportRegion> upper_faces, std::span<const FlatPatch> patches,
                             const SegmentationOptions& options);

}  // namespace prescene::filter
