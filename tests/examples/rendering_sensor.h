// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering/sensor take for granted.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/sensor_model.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::rendering::given_rendering_sensor {

extern const geometry::TriangleMesh triangle_mesh;
extern const MeshHandle mesh;
extern const SurfaceMaterial material;
extern const geometry::PinholeCamera camera;
extern const geometry::Pose X_CO, X_WC, X_WM;
extern const RenderScene scene;
extern const FrameTermsInput input;
extern const SensorModel model;
extern FrameTerms terms;
extern core::RandomStream stream;
extern const std::unique_ptr<Renderer> renderer;
extern const std::unique_ptr<LikelihoodBatch> batch;
extern const std::unique_ptr<LikelihoodWorkspace> workspace;
extern std::vector<PoseHypothesis> hypotheses;
extern const std::span<PoseEvidence> evidences;

namespace color_model_h {
extern const geometry::ImageView<const geometry::Rgb> image;
extern const geometry::ImageView<const std::uint8_t> mask;
}  // namespace color_model_h

namespace likelihood_batch_h {
extern const FrameTermsOptions options;
extern const geometry::DepthImage known_depth;
extern FrameTerms terms_of_object;
}  // namespace likelihood_batch_h

namespace sensor_model_h {
extern const double d, cosine, px, z, color_ratio;
extern const AbsentMixture absent;
}  // namespace sensor_model_h

namespace simulated_camera_h {
extern const SimulatedCameraOptions options;
extern const RenderedView view;
extern const std::uint64_t frame;
extern geometry::DepthImage depth;
extern geometry::ColorImage color;
}  // namespace simulated_camera_h

}  // namespace prescene::rendering::given_rendering_sensor
