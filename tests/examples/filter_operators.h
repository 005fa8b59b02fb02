// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of filter/operators take for granted.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/augment.h"
#include "prescene/filter/operators/hold_joints.h"
#include "prescene/filter/operators/infer_release.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/learn_colors.h"
#include "prescene/filter/operators/learn_physics.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/standing.h"
#include "prescene/filter/operators/still_update.h"
#include "prescene/filter/operators/weigh_print.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/operators/world_terms.h"
#include "prescene/filter/operators/worlds.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/segmentation.h"
#include "prescene/filter/proposals/support_tracking.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/color_model.h"

namespace prescene::filter::given_filter_operators {

extern const std::shared_ptr<const belief::Scene> scene;
extern const std::uint64_t seed;
extern const belief::Observation observation;
extern belief::Belief belief;
extern belief::ObjectBelief object;
extern const FilterFrame frame;
extern const rendering::FrameTerms terms;
extern const SearchTarget target;
extern const FilterTools tools;
extern const core::RandomStream stream;
extern core::ThreadPool pool;
extern const Pose X_WC, X_CO, X_WO;
extern const geometry::DepthImage known;
extern const double dt;

namespace augment_h {
extern const rendering::PoseEvidence current;
extern const AugmentOptions options;
extern const WeightOptions weighting;
extern const InitialiseOptions spread;
}  // namespace augment_h

namespace initialise_h {
extern const core::TimeNs stamp_ns;
extern const InitialiseOptions options;
}  // namespace initialise_h

namespace learn_colors_h {
extern const std::vector<WeightReport> reports;
extern const ColorLearningOptions options;
}  // namespace learn_colors_h

namespace learn_physics_h {
extern const LearnPhysicsOptions options;
extern const simulation::SimulatorFactory simulators;
}  // namespace learn_physics_h

namespace predict_h {
extern const belief::Control control;
extern const std::vector<Pose> X_WG_now;
extern const PredictOptions options;
extern const simulation::SimulatorFactory simulators;
}  // namespace predict_h

namespace rivals_h {
extern const geometry::SymmetryGroup symmetry;
extern const std::vector<double> log_weights_before;
extern const WeightOptions weighting;
extern const InitialiseOptions spread;
}  // namespace rivals_h

namespace turn_looks_h {
extern const SearchTarget fine_target;
extern const geometry::SymmetryGroup symmetry;
extern const WeightOptions weighting;
extern const InitialiseOptions spread;
}  // namespace turn_looks_h

namespace unknown_objects_h {
extern const AugmentOptions options;
extern const InitialiseOptions spread;
}  // namespace unknown_objects_h

namespace wander_h {
extern const rendering::PoseEvidence evidence;
extern const AugmentOptions options;
extern const WeightOptions weighting;
extern const InitialiseOptions spread;
}  // namespace wander_h

namespace watched_renderer_h {
extern rendering::Renderer& renderer;
extern const geometry::PinholeCamera camera;
extern const Pose X_CO;
extern const SearchTarget target;
}  // namespace watched_renderer_h

namespace standing_h {
extern const RestingShape shape;
extern const rendering::RenderMesh mesh;
extern const SupportSurfaces supports;
extern const Vector3d up_W;
extern const Pose X_WO;
extern const std::function<SupportHeight(const Vector3d&, const Vector3d&)> height_at;
extern geometry::Matrix6d H;
extern geometry::Vector6d g;
}  // namespace standing_h

namespace still_update_h {
extern const geometry::Matrix6d covariance, information;
extern const geometry::Vector6d gradient;
}  // namespace still_update_h

namespace weigh_print_h {
extern const belief::ObjectModel model;
extern MeshCache meshes;
extern const WeighPrintOptions options;
}  // namespace weigh_print_h

namespace weight_h {
extern const WeightOptions options;
}

namespace world_terms_h {
extern const std::vector<WorldMember> others;
extern const std::vector<const geometry::DepthImage*> depths_of_all_else;
extern std::vector<belief::Particle> particles;
extern const WeightOptions options;
}  // namespace world_terms_h

namespace worlds_h {
extern const WorldsOptions options;
extern const ResampleOptions resampling;
extern TouchTest touch;
extern const belief::Control control;
extern const std::vector<Pose> X_WG;
extern const PredictOptions predicting;
extern const simulation::SimulatorFactory simulators;
extern RobotBounds bounds;
extern const std::vector<double> log_weights_before;
}  // namespace worlds_h

}  // namespace prescene::filter::given_filter_operators
