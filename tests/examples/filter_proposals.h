// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of filter/proposals take for granted.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/frame_surfaces.h"
#include "prescene/filter/proposals/segmentation.h"
#include "prescene/filter/proposals/support_tracking.h"
#include "prescene/filter/proposals/surface_print.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/color_model.h"

namespace prescene::filter::given_filter_proposals {

extern const std::shared_ptr<const belief::Scene> scene;
extern const belief::Observation observation;
extern belief::Belief belief;
extern belief::ObjectBelief object;
extern const FilterFrame frame;
extern const rendering::FrameTerms terms;
extern const SearchTarget target;
extern const SampledDepth sampled;
extern const FilterTools tools;
extern const core::RandomStream stream;
extern core::ThreadPool pool;
extern MeshCache meshes;
extern const Pose X_WC, X_CO, X_WO;
extern const std::vector<Pose> X_WG;
extern const geometry::DepthImage known;

namespace boosted_trees_h {
extern const std::vector<float> values, example;
extern const std::vector<std::uint8_t> yes;
}  // namespace boosted_trees_h

namespace fit_judgement_h {
extern const Fit fit;
extern const LearnedProposals proposals;
extern const std::unique_ptr<rendering::Renderer> renderer;
}  // namespace fit_judgement_h

namespace learned_proposals_h {
extern const std::unique_ptr<LearnedProposals> proposals;
extern const geometry::DepthImage depth;
extern const geometry::PinholeCamera camera;
extern const std::vector<Vector3d> points_C;
extern const Vector3d up_C;
}  // namespace learned_proposals_h

namespace detection_h {
extern const Surroundings surroundings;
extern const std::vector<WantedModel> wanted;
extern const DetectionOptions options;
}  // namespace detection_h

namespace edge_smear_h {
extern const belief::RgbdFrame frame;
}  // namespace edge_smear_h

namespace fine_frame_h {
extern const Surroundings surroundings;
extern const std::vector<WantedModel> wanted;
extern const DetectionOptions options;
}  // namespace fine_frame_h

namespace resting_starts_h {
extern const std::vector<Cluster> clusters;
extern const rendering::FrameTerms fine;
extern const Surroundings surroundings;
}  // namespace resting_starts_h

namespace frame_h {
extern const FrameColors colors;
extern const FrameOptions options;
}  // namespace frame_h

namespace frame_surfaces_h {
extern const Vector3d up_C, up_W;
extern const SupportSurfaces supports;
extern const double least_area;
extern const SegmentationOptions options;
}  // namespace frame_surfaces_h

namespace learned_colors_h {
extern const rendering::ColorHistogram object_histogram, rest_histogram;
extern const ColorLearningOptions options;
}  // namespace learned_colors_h

namespace outline_h {
extern const geometry::PinholeCamera camera;
extern const geometry::DepthImage depth;
extern const geometry::ColorImage color;
extern rendering::Renderer& renderer;
}  // namespace outline_h

namespace pose_search_h {
extern const rendering::LikelihoodBatch& batch;
extern const SearchOptions options;
}  // namespace pose_search_h

namespace render_scene_h {
extern const std::unique_ptr<rendering::Renderer> renderer;
extern const geometry::PinholeCamera camera;
extern rendering::RenderedView images;
extern const int x, y;
}  // namespace render_scene_h

namespace segmentation_h {
struct Frame {
  geometry::DepthImage depth;
  geometry::PinholeCamera camera;
};
extern const Frame frame;
extern const geometry::Image<std::uint8_t> explained;
extern const SegmentationOptions options;
}  // namespace segmentation_h

namespace support_surfaces_h {
extern const SupportSurfaces gripper;
extern const geometry::Pose X_WG;
}  // namespace support_surfaces_h

namespace support_tracking_h {
extern belief::Support support;
extern const double gain;
}  // namespace support_tracking_h

namespace surface_print_h {
extern const rendering::RenderMesh& mesh;
extern const rendering::SurfaceMaterial material;
extern const geometry::PinholeCamera camera;
extern const geometry::DepthImage depth;
extern const geometry::ColorImage color;
extern const Pose X_OS;
}  // namespace surface_print_h

}  // namespace prescene::filter::given_filter_proposals
