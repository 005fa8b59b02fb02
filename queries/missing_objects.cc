// SPDX-License-Identifier: Apache-2.0
#include "missing_objects.h"

#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/proposals/learned_colors.h"
#include "prior.h"

namespace prescene::queries {
namespace {

constexpr double kAnywhere = 10.0, kAnyTurn = 3.0;  // m and rad: deviations of a start that says nothing

}  // namespace

core::Result<std::vector<std::optional<belief::Pose>>> find_missing(const WindowFrame& last,
                                                                    const ExplainContext& context,
                                                                    const filter::FilterTools& tools,
                                                                    std::uint64_t seed) {
  belief::Belief belief = *last.belief;
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  const filter::FilterSettings& settings = context.settings;
  std::vector<std::optional<belief::Pose>> found(belief.objects.size());
  std::vector<bool> missing(belief.objects.size());
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    belief::ObjectBelief& object = belief.objects[i];
    belief::SceneObject& in_scene = scene->objects[i];
    missing[i] = !is_present(object);
    if (object.particles.empty()) object.particles.resize(1);
    if (!missing[i]) {
      object.particles.front().X_WO = belief::estimate(*last.belief, last.belief->objects[i]).mode;
      in_scene.pose = belief::FixedPose{object.particles.front().X_WO};
      continue;
    }
    in_scene.held_by.reset();
    if (filter::has_wide_prior(in_scene)) continue;
    geometry::Matrix6d wide = geometry::Matrix6d::Zero();
    wide.diagonal().head<3>().setConstant(kAnyTurn * kAnyTurn);
    wide.diagonal().tail<3>().setConstant(kAnywhere * kAnywhere);
    in_scene.pose = belief::NormalPose{object.particles.front().X_WO, wide};
  }
  belief.scene = scene;
  const filter::FrameColors colors{settings.colors,
                                   filter::learned_models(belief, settings.frame.colors, last.observation.camera)};
  filter::FrameCache cache;
  filter::FilterFrame frame;
  PRESCENE_RETURN_IF_ERROR(filter::prepare_frame(std::shared_ptr<const belief::Scene>(scene), last.observation,
                                                 belief.robot, colors, settings.frame, tools, cache, &frame));
  frame.terms.step *= last.sampled;
  filter::find_in_frame(frame, last.observation, settings.initialise, tools,
                        core::RandomStream(seed, core::Purpose::kDetection), belief);
  for (std::size_t i = 0; i < found.size(); ++i)
    if (missing[i] && belief.objects[i].state == belief::TrackState::kTracked)
      found[i] = belief.objects[i].particles.front().X_WO;
  return found;
}

}  // namespace prescene::queries
