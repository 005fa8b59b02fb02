// SPDX-License-Identifier: Apache-2.0
#include "prior.h"

#include <algorithm>
#include <utility>

#include "prescene/core/spelling.h"
#include "seating.h"

namespace prescene::queries {
namespace {

/// The robot body that holds an object: the one that the scene names, else the nearest.
std::optional<std::string> holder_of(const belief::Scene& scene, const belief::ObjectBelief& object,
                                     const std::vector<belief::Pose>& X_WG) {
  const bool held = std::any_of(object.particles.begin(), object.particles.end(), [](const belief::Particle& particle) {
    return particle.mode == belief::MotionMode::kHeld;
  });
  if (!held) return std::nullopt;
  const std::optional<int> known = belief::find_object(scene, object.name);
  if (known && scene.objects[static_cast<std::size_t>(*known)].held_by)
    return scene.objects[static_cast<std::size_t>(*known)].held_by;
  const geometry::Vector3d& p_WO = object.particles.front().X_WO.translation;
  std::optional<std::string> nearest;
  double least = 1e300;
  for (std::size_t i = 0; i < X_WG.size(); ++i) {
    const double distance = (X_WG[i].translation - p_WO).norm();
    if (distance >= least) continue;
    least = distance;
    nearest = scene.robot[i].name;
  }
  return nearest;
}

/// Outcomes that need objects which are not there can't be judged; returns their names and those of their groups.
std::vector<std::string> drop_outcomes_of_absent_objects(belief::Scene& scene) {
  std::vector<std::string> dropped;
  const auto can_be_judged = [&](const belief::Outcome& outcome) { return belief::validate(scene, outcome).ok(); };
  std::erase_if(scene.outcomes, [&](const belief::Outcome& outcome) {
    if (can_be_judged(outcome)) return false;
    dropped.push_back(outcome.name);
    return true;
  });
  std::erase_if(scene.exclusive_outcomes, [&](const belief::ExclusiveOutcomes& group) {
    if (std::ranges::all_of(group.outcomes, can_be_judged)) return false;
    dropped.push_back(group.name);
    return true;
  });
  return dropped;
}

std::shared_ptr<belief::Scene> scene_of(const belief::Belief& belief) {
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  std::vector<belief::Pose> X_WG = belief.robot;
  if (X_WG.size() != scene->robot.size()) {
    X_WG.clear();
    for (const belief::KinematicBody& body : scene->robot) X_WG.push_back(belief::pose_at(body, 0.0));
  }
  scene->objects.clear();
  for (const belief::ObjectBelief& object : belief.objects) {
    belief::SceneObject& known = scene->objects.emplace_back();
    known.name = object.name;
    known.model = object.model;
    known.pose = belief::FixedPose{belief::estimate(belief, object).mean};
    // What hangs on a joint is pulled by a hand, not carried.
    if (!belief::joint_of(*scene, object.name)) known.held_by = holder_of(*belief.scene, object, X_WG);
  }
  belief::drop_loose_joints(*scene);
  for (std::size_t i = 0; i < X_WG.size(); ++i) scene->robot[i].timeline = {{0.0, X_WG[i]}};
  if (scene->camera) scene->camera->X_WC = belief.X_WC;
  scene->actions.clear();
  return scene;
}

}  // namespace

Prior prior_of(const belief::Belief& belief) {
  auto present = std::make_shared<belief::Belief>(belief);
  std::erase_if(present->objects, [](const belief::ObjectBelief& object) { return !is_present(object); });
  const auto scene = scene_of(*present);
  std::vector<std::string> left_out = drop_outcomes_of_absent_objects(*scene);
  Prior prior{scene,
              {},
              belief::most_likely_state(*present),
              core::RandomStream(belief.seed, core::Purpose::kStartBelief, belief.step),
              belief.X_WC,
              true,
              std::move(left_out),
              {},
              {}};
  for (const belief::ObjectBelief& object : present->objects) {
    prior.existence.push_back(object.existence);
    prior.colors.push_back(object.colors.shares);
  }
  const auto seating = std::make_shared<const Seating>(*present, *scene);
  prior.starts = simulation::start_of(std::shared_ptr<const belief::Belief>(std::move(present)));
  if (!seating->any() && scene->joints.empty()) return prior;
  // Poses are drawn object by object: what they stand on and what they hang on ties them together.
  const auto tie = [seating, scene](belief::WorldState& state) {
    seating->apply(state);
    for (const belief::Joint& joint : scene->joints) {
      belief::ObjectState& child = state.objects[static_cast<std::size_t>(*belief::find_object(*scene, joint.child))];
      if (child.mode == belief::MotionMode::kHeld) child.mode = belief::MotionMode::kMoving;
    }
    belief::obey_joints(*scene, state);
  };
  tie(prior.likeliest);
  for (simulation::StartComponent& component : prior.starts.components) {
    component.draw = [tie, draw = std::move(component.draw)](std::span<const double> uniforms) {
      belief::WorldState state = draw(uniforms);
      tie(state);
      return state;
    };
  }
  return prior;
}

Prior prior_of(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed) {
  Prior prior{scene,
              simulation::start_of(scene),
              belief::mean_start(*scene),
              core::RandomStream(seed, core::Purpose::kStartBelief),
              scene->camera ? scene->camera->X_WC : belief::Pose{},
              false,
              {},
              std::vector<double>(scene->objects.size(), 1.0),
              std::vector<std::shared_ptr<const std::vector<belief::ColorShare>>>(scene->objects.size())};
  return prior;
}

core::Result<std::shared_ptr<const belief::Scene>> with_question(const belief::Scene& scene,
                                                                 std::vector<belief::Action> actions,
                                                                 std::vector<belief::Outcome> outcomes,
                                                                 std::vector<belief::ExclusiveOutcomes> exclusive) {
  auto asked = std::make_shared<belief::Scene>(scene);
  asked->actions = std::move(actions);
  asked->outcomes = std::move(outcomes);
  asked->exclusive_outcomes = std::move(exclusive);
  for (belief::Outcome& outcome : asked->outcomes) PRESCENE_RETURN_IF_ERROR(belief::complete_outcome(*asked, outcome));
  for (belief::ExclusiveOutcomes& group : asked->exclusive_outcomes)
    for (belief::Outcome& outcome : group.outcomes) PRESCENE_RETURN_IF_ERROR(belief::complete_outcome(*asked, outcome));
  PRESCENE_RETURN_IF_ERROR(belief::validate(*asked));
  return std::shared_ptr<const belief::Scene>(std::move(asked));
}

core::Status no_such_object(const Prior& prior, const std::string& name) {
  std::vector<std::string> known;
  for (const belief::SceneObject& object : prior.scene->objects) known.push_back(object.name);
  const std::string near = core::did_you_mean(name, known);
  const std::string all = known.empty() ? "none is there" : "those that are: " + core::comma_list(known);
  return core::not_found((prior.seen ? "there is no object '" + name + "' now (it may be lost or not there at all): "
                                     : "the scene has no object '" + name + "': ") +
                         (near.empty() ? all : near + " (" + all + ")"));
}

}  // namespace prescene::queries
