// SPDX-License-Identifier: Apache-2.0
// What was learned of a scene's models by imagining scenes (service/training): what places on their surfaces look like,
// by which a place in a frame proposes poses, how they come to rest, and how far a fit is to be believed.
//
//   const LearnedModel* learned = find(*proposals, *target.mesh);
//   std::vector<Pose> starts = learned_starts(*learned, depth, camera, points_C, up_C, 24, stream);
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/filter/proposals/boosted_trees.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::filter {

/// The relief around a place of a depth image: how much nearer or further than the place the image is at the points of
/// a square grid across its ray, in its metric neighbourhood. The grid's down is down in the world, so that the
/// relief does not change with the camera's roll or distance.
struct SurfacePatch {
  static constexpr int kSide = 7;
  static constexpr std::size_t kCells = 49;
  static constexpr std::uint8_t kUnknown = 0;  ///< Not measured.
  static constexpr std::uint8_t kOpen = 255;   ///< Nothing there, as far as one can see.
  /// 1 to 254: three grid spacings nearer to three spacings further; outside of that the nearest of both.
  std::array<std::uint8_t, kCells> relief{};
  std::uint8_t elevation = 0;  ///< Of the ray: 0 = it goes straight up, 255 = straight down.
  friend bool operator==(const SurfacePatch&, const SurfacePatch&) = default;
};

/// The frame A of a place p_CQ (m, z > 0): at it, z along its ray, y down in the image as far as the world's up says.
geometry::Pose patch_frame(const geometry::Vector3d& p_CQ, const geometry::Vector3d& up_C);
/// The relief around a place, `spacing` (m) from point to point. A pixel of depth 0 is kUnknown, or kOpen if `open`.
SurfacePatch patch_at(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                      const geometry::Vector3d& p_CQ, const geometry::Vector3d& up_C, double spacing,
                      bool open = false);

/// A pose in single precision, as it is kept.
struct StoredPose {
  std::array<float, 4> rotation{1.0F, 0.0F, 0.0F, 0.0F};  ///< w, x, y, z
  std::array<float, 3> translation{};                     ///< m
  friend bool operator==(const StoredPose&, const StoredPose&) = default;
};
StoredPose stored(const geometry::Pose& pose);
geometry::Pose restored(const StoredPose& pose);

/// Up in the model's frame when it lies on a level surface.
struct LearnedRest {
  std::array<float, 3> up_O{0.0F, 0.0F, 1.0F};
  float probability = 0.0F;
  friend bool operator==(const LearnedRest&, const LearnedRest&) = default;
};

struct LearnedModel {
  std::string name;                ///< Of the model it was learned of.
  std::uint64_t mesh = 0;          ///< mesh_hash of its mesh.
  float spacing = 0.01F;           ///< m, of the patches' grid.
  std::vector<LearnedRest> rests;  ///< Likeliest first.
  std::vector<SurfacePatch> patches;
  std::vector<StoredPose> X_AO;  ///< Of each patch: where the object is in the patch's frame.
  friend bool operator==(const LearnedModel&, const LearnedModel&) = default;
};

/// The numbers that a fit is judged by; see fit_judgement.h for what they are.
inline constexpr int kFitNumbers = 27;

struct LearnedProposals {
  std::vector<LearnedModel> models;
  BoostedTrees fit;  ///< Log odds that a candidate is right, from its kFitNumbers; empty = fits are not judged.
  /// Log odds that a find is right: [0] + [1] times the log odds as it is at the end + [2] times those as it was
  /// accepted.
  std::array<double, 3> confidence{0.0, 1.0, 0.0};
  friend bool operator==(const LearnedProposals&, const LearnedProposals&) = default;
};

/// Hash of a mesh's vertices and triangles as likelihoods see them: what is learned belongs to it.
std::uint64_t mesh_hash(const rendering::RenderMesh& mesh);
/// What was learned of this mesh; null if nothing was.
const LearnedModel* find(const LearnedProposals& proposals, const rendering::RenderMesh& mesh);

/// Poses X_CO of the model, from places drawn of `points_C` (m, measured in `depth`, not empty): each place proposes
/// the poses of the two learned patches that resemble its own most.
std::vector<geometry::Pose> learned_starts(const LearnedModel& model, const geometry::DepthImage& depth,
                                           const geometry::PinholeCamera& camera,
                                           std::span<const geometry::Vector3d> points_C, const geometry::Vector3d& up_C,
                                           int count, core::RandomStream stream);

}  // namespace prescene::filter
