// SPDX-License-Identifier: Apache-2.0
// One frame as the operators see it: what was measured at the likelihood's resolution, and what is known about the
// surroundings without looking.
//
//   FrameCache cache;                                        // once
//   FilterFrame frame;
//   PRESCENE_RETURN_IF_ERROR(prepare_frame(scene, observation, X_WG, colors, options, tools, cache, &frame));
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/proposals/learned_colors.h"
#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/filter/proposals/pose_search.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/filter/proposals/segmentation.h"
#include "prescene/filter/proposals/support_surfaces.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

/// What the operators work with; it outlives their calls. `search`, `renderer` and `meshes` are never null where an
/// operator is called.
struct FilterTools {
  PoseSearch* search = nullptr;
  rendering::Renderer* renderer = nullptr;
  MeshCache* meshes = nullptr;
  const LearnedProposals* learned = nullptr;  ///< What training learned of the scene's models; null = nothing.
};

struct FrameOptions {
  rendering::FrameTermsOptions terms;
  /// pixels. Where the smallest thing in sight covers fewer of the reduced image, frames are sampled more densely than
  /// terms.target_width says, up to every fourth pixel. Range 0 to 10000. Measured: docs/studies/tracking.md.
  double enough_pixels = 60.0;
  /// The scene's depth_noise takes precedence.
  rendering::SensorModelOptions sensor;
  ColorLearningOptions colors;
};

/// `options` with what the scene says of its camera in their place.
rendering::SensorModelOptions with_settings(rendering::SensorModelOptions options,
                                            const belief::DepthNoiseSettings& noise);

/// How densely one frame is sampled.
struct FrameSampling {
  rendering::FrameTermsOptions terms;
  double density = 1.0;  ///< Pixels where FrameOptions::terms would take one.
};

/// A frame, prepared.
struct FilterFrame {
  core::TimeNs stamp_ns = 0;
  Pose X_WC;
  Pose X_CW;
  Vector3d up_W = Vector3d::UnitZ();                ///< Against gravity; W's z where there is none.
  std::vector<Pose> X_WG;                           ///< Of the robot's bodies, in the order of Scene::robot.
  rendering::FrameTerms terms;                      ///< With the supports as what is seen where no object is.
  double density = 1.0;                             ///< Pixels of `terms` where FrameOptions::terms would take one.
  rendering::TemperingOptions tempering;            ///< Of other images of the frame: that of FrameOptions::terms.
  geometry::DepthImage supports;                    ///< Their depth in terms.camera, 0 = none.
  geometry::DepthImage robot;                       ///< The same of the robot's bodies.
  std::shared_ptr<const SupportSurfaces> surfaces;  ///< Of the supports, where no object can be. Never null.
  SupportSurfaces solids;                           ///< The same, and the robot's bodies at X_WG.
  /// Names of models, then of objects, in the order of terms.color_ratio.
  std::vector<std::string> color_models;
  std::vector<std::string> color_objects;
};

/// The supports alone, rendered and as surfaces, kept while camera and supports stay where they are; and the robot's
/// bodies, each in its own frame, kept with the scene.
struct FrameCache {
  std::shared_ptr<const belief::Scene> scene;
  geometry::PinholeCamera camera;
  Pose X_WC;
  geometry::DepthImage supports;
  std::shared_ptr<const SupportSurfaces> surfaces;
  std::vector<SupportSurfaces> robot;
};

using ColorModels = std::map<std::string, rendering::ColorModel>;
/// What things look like; what is named by neither is known by depth only.
struct FrameColors {
  ColorModels of_models;   ///< By the name of the object model.
  ColorModels of_objects;  ///< By the name of the object; takes precedence over its model's.
};

/// Fails with kInvalidInput when the frame's sizes don't fit its camera, a pose is not finite, or there is no depth.
/// X_WG.size() == scene->robot.size(). `sampling` null: as options.terms say.
core::Status prepare_frame(const std::shared_ptr<const belief::Scene>& scene, const belief::Observation& observation,
                           std::span<const Pose> X_WG, const FrameColors& colors, const FrameOptions& options,
                           const FilterTools& tools, FrameCache& cache, FilterFrame* frame,
                           const FrameSampling* sampling = nullptr);

/// The target to look for, of a model of the scene.
SearchTarget target_of(const belief::ObjectModel& model, const FilterFrame& frame, const FilterTools& tools);
/// The same of an object of the scene, with its own colours if the frame has them.
SearchTarget target_of(const belief::ObjectBelief& object, const belief::Scene& scene, const FilterFrame& frame,
                       const FilterTools& tools);
/// A target of the model as fine images show it (MeshDetail::kFine).
SearchTarget in_fine(SearchTarget target, const belief::ObjectModel& model, const FilterTools& tools);

/// Depth of one object in the frame's reduced camera, 0 where it is not.
geometry::DepthImage depth_of(const SearchTarget& target, const Pose& X_CO, const geometry::PinholeCamera& camera,
                              rendering::Renderer& renderer);

/// What the frame says of the object if it is there (rendering::expected_evidence); infinite, without deviation, if it
/// can't be drawn.
rendering::ExpectedEvidence expected_evidence_of(const rendering::FrameTerms& terms, const SearchTarget& target,
                                                 const Pose& X_CO, rendering::Renderer& renderer);

using rendering::merge_nearest;

/// The frame for one object: robot, neighbours (`others`, one depth image each) and those supports that stand clearly
/// in front of it (nearer than the sphere of `radius` about p_CQ) explain what they show.
rendering::FrameTerms terms_for_object(const FilterFrame& frame, std::span<const geometry::DepthImage* const> others,
                                       const Vector3d& p_CQ, double radius);

/// What pixels without a return say of whether a surface ends. A surface that went on would return as often beyond the
/// outline as within it: those that are missing beyond that share may be where it ended.
enum class OutlineHoles { kSayNothing, kMayEnd };

/// Share of the edge of what matches an object (its rendered depth in terms.camera) at which the measured surface ends:
/// just outside, it is further away, or known to be something else. A surface that goes on, past the outline or in
/// front of the rest of the object, is not the object, however well it matches. 1 when no pixel can tell (hidden by
/// nearer things, or missing).
/// With `color` (of terms.camera; null or empty = none) a surface that goes on ends where another colour begins, by as
/// much as colours change there more often than within the object.
double outline_support(const rendering::FrameTerms& terms, const geometry::DepthImage& object_depth, double step,
                       OutlineHoles holes = OutlineHoles::kSayNothing, const geometry::ColorImage* color = nullptr);

}  // namespace prescene::filter
