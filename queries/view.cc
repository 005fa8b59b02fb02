// SPDX-License-Identifier: Apache-2.0
// Observation anticipation: Z*_t+1 ~ P(Z_t+1 | X_t+1), as the noise-free view of the predicted belief.
#include <algorithm>
#include <string>
#include <utility>

#include "basis.h"
#include "foresee.h"
#include "prescene/belief/robot_motion.h"
#include "view.h"

namespace prescene::queries {
namespace {

/// Views that presence is averaged over: a share is good to 0.06 at worst, to 0.02 where the scene is smooth.
constexpr int kViews = 64;
/// What the duration of standing still is called, s.
constexpr double kNow = 1e-3;

std::vector<belief::Pose> robot_at(const belief::Scene& scene, double time) {
  std::vector<belief::Pose> X_WG;
  for (std::size_t i = 0; i < scene.robot.size(); ++i)
    X_WG.push_back(belief::robot_pose_at(scene, scene.actions, static_cast<int>(i), time));
  return X_WG;
}

/// The view of now: nothing moves.
class StandingStill final : public simulation::Simulator {
 public:
  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest&, const core::RandomStream&,
           simulation::InstanceNumbers, core::ThreadPool&, std::span<belief::Trajectory> trajectories,
           const core::Cancellation*) const override {
    for (std::size_t i = 0; i < starts.size(); ++i) {
      trajectories[i] = {};
      trajectories[i].states = {starts[i]};
    }
  }
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>&,
                                                      const core::RandomStream&) const override {
    return nullptr;  // nothing here steps
  }
};

}  // namespace

core::Result<belief::ViewAnswer> view(const Prior& prior, const belief::ViewQuery& query, const QueryContext& context) {
  if (!prior.scene->camera)
    return core::not_found("the scene has no camera: give its intrinsics and pose in the scene file");
  if (!(query.time >= 0.0 && query.time <= 3600.0))
    return core::invalid_input("a time of " + std::to_string(query.time) + " s: give between 0 and 3600");
  if (!context.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  PRESCENE_TRY(
      auto scene,
      with_question(*prior.scene, query.actions.empty() && !prior.seen ? prior.scene->actions : query.actions, {}, {}));
  // The robot goes on moving when everything else is at rest.
  auto moving = std::make_shared<belief::Scene>(*scene);
  moving->stop_at_rest = false;
  belief::Effort effort;
  effort.exact_instances = kViews;
  QueryContext foreseen = context;
  if (query.time == 0.0) {
    foreseen.make_simulator = [](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
      return std::unique_ptr<simulation::Simulator>(std::make_unique<StandingStill>());
    };
  }
  PRESCENE_TRY(const Foresight foresight,
               foresee(prior, std::move(moving), std::max(query.time, kNow), effort, foreseen));

  if (foresight.estimate.instances.size() < kViews && !foresight.estimate.certain)
    return core::cancelled("stopped when " + std::to_string(foresight.estimate.instances.size()) + " of " +
                           std::to_string(kViews) + " views were foreseen: ask for an earlier time");
  belief::Trajectory likeliest;
  foresight.simulator->run(std::span(&prior.likeliest, 1), foresight.request, prior.stream, 0, *context.pool,
                           std::span(&likeliest, 1), context.cancellation);
  if (likeliest.end == belief::TrajectoryEnd::kCancelled)
    return core::cancelled("stopped before the view was foreseen");
  if (likeliest.end == belief::TrajectoryEnd::kDiverged)
    return core::invalid_input(
        "the likeliest start failed in the simulator: look at the scene's shapes, masses and speeds");

  PRESCENE_TRY(const std::unique_ptr<rendering::Renderer> renderer, context.make_renderer());
  filter::MeshCache own_meshes;
  filter::MeshCache& meshes = context.meshes != nullptr ? *context.meshes : own_meshes;
  const geometry::PinholeCamera& camera = foresight.scene->camera->intrinsics;
  const std::vector<belief::Pose> X_WG = robot_at(*foresight.scene, query.time);
  const auto draw = [&](const belief::WorldState& state, rendering::RenderedView* images) {
    filter::BeliefView drawn =
        filter::render_scene(*foresight.scene, state, X_WG, filter::MeshDetail::kDisplay, meshes);
    const core::Status status = renderer->render(drawn.scene, camera, prior.X_WC, {}, images);
    return std::make_pair(std::move(drawn), status);
  };

  belief::ViewAnswer answer;
  answer.presence = geometry::Image<float>(camera.width, camera.height, 0.0f);
  answer.failed_instances = foresight.estimate.failed;
  if (answer.failed_instances > 0)
    answer.remarks.push_back(std::to_string(answer.failed_instances) + " of " +
                             std::to_string(foresight.estimate.instances.size()) +
                             " foreseen states failed in the simulator; presence is that of the others. Look at the "
                             "scene's shapes, masses and speeds.");
  remark_on_leaving(foresight.estimate, foresight.request.stop.world_radius, answer.remarks);
  double followed = 0.0;  // of the weights
  for (const simulation::InstanceRecord& record : foresight.estimate.instances)
    if (!record.failed) followed += record.weight;
  rendering::RenderedView images;
  for (const simulation::InstanceRecord& record : foresight.estimate.instances) {
    if (record.failed) continue;
    if (context.cancellation && context.cancellation->requested())
      return core::cancelled("stopped before all views were drawn: give more time, or a smaller camera image");
    const auto [drawn, status] = draw(record.final, &images);
    PRESCENE_RETURN_IF_ERROR(status);
    const double share = foresight.estimate.failed > 0 ? record.weight / followed : record.weight;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::uint16_t label = images.labels(x, y);
        if (label != 0 && drawn.kinds[label - 1u] == filter::InstanceKind::kObject)
          answer.presence(x, y) += static_cast<float>(share);
      }
    }
  }
  const auto [drawn, status] = draw(likeliest.final(), &images);
  PRESCENE_RETURN_IF_ERROR(status);
  answer.label_names = drawn.names;
  answer.depth = std::move(images.depth);
  answer.labels = std::move(images.labels);
  return answer;
}

}  // namespace prescene::queries
