// SPDX-License-Identifier: Apache-2.0
#include "own_action_cases.h"

#include <cmath>

#include "prescene/geometry/angles.h"
#include "sliding_scene.h"

namespace prescene::queries::own_action_laws_test {

using belief::AchieveQuery;
using belief::Answer;
using geometry::Pose;
using geometry::Vector3d;

namespace {

double off(double value, double best, double scale) { return std::abs(value - best) / scale; }
double degrees(double radians) { return radians / geometry::kDegree; }

}  // namespace

double height_of(const belief::PoseDistribution& pose) { return belief::mean(pose).translation.z(); }

Vector3d level(double direction_deg) {
  return {std::cos(geometry::kDegree * direction_deg), std::sin(geometry::kDegree * direction_deg), 0.0};
}

belief::Transport carry_to(const Vector3d& p, double duration) {
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>().setConstant(1e-8);
  return {"carton", belief::NormalPose{Pose::from_translation(p), covariance}, duration};
}

std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({"tilt",
                 {0.2, belief::Tilt{"carton", Vector3d::UnitY(), 0.5, {0.0, 0.0, -0.1}, 1.0}},
                 {{"angle", 0.0, 90.0}, {"axis", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& tilt = own_of<belief::Tilt>(scene.actions);
                   tilt.angle = geometry::kDegree * values.at("angle_deg");
                   tilt.axis_W = level(values.at("axis_deg"));
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& tilt = own_of<belief::Tilt>(actions);
                   return off(degrees(tilt.angle), 60.0, 100.0) + (tilt.axis_W - level(120.0)).norm() / 5.0;
                 }});
  all.push_back({"pour",
                 {1.0, belief::Pour{"carton", Vector3d::UnitX(), 1.0, 0.5}},
                 {{"angle", 0.0, 150.0}, {"height", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   own_of<belief::Pour>(scene.actions).angle = geometry::kDegree * values.at("angle_deg");
                   auto& pose = std::get<belief::NormalPose>(own_of<belief::Transport>(scene.actions).X_WO);
                   pose.mean.translation.z() = values.at("height");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(degrees(own_of<belief::Pour>(actions).angle), 100.0, 200.0) +
                          off(height_of(own_of<belief::Transport>(actions).X_WO), 0.55, 0.5);
                 },
                 true});
  const auto write_insert = [](const Values& values, belief::Scene& scene, Pose& X_WO) {
    X_WO.translation.x() = values.at("x");
    X_WO.translation.y() = values.at("y");
    X_WO.rotation = geometry::exp_rotation(geometry::kDegree * values.at("yaw_deg") * Vector3d::UnitZ());
    std::get<belief::NormalScalar>(own_of<belief::Insert>(scene.actions).force).mean = values.at("force");
  };
  const auto miss_of_insert = [](const std::vector<Action>& actions, const Pose& X_WO) {
    const double yaw = degrees(geometry::log_rotation(X_WO.rotation).z());
    return off(X_WO.translation.x(), 0.01, 0.2) + off(X_WO.translation.y(), -0.01, 0.2) + off(yaw, 4.0, 200.0) +
           off(belief::mean(own_of<belief::Insert>(actions).force), 20.0, 200.0);
  };
  const belief::Insert insert{"carton", -Vector3d::UnitZ(), 0.1, 1.0, belief::NormalScalar{12.0, 2.0, 1.0}};
  all.push_back({"insert",
                 {0.5, insert},
                 {{"position", {}, {}}, {"yaw", {}, {}}, {"force", 5.0, 40.0}},
                 [write_insert](const Values& values, belief::Scene& scene) {
                   write_insert(values, scene, std::get<belief::NormalPose>(scene.objects[0].pose).mean);
                 },
                 [miss_of_insert](const std::vector<Action>& actions, const belief::WorldState& start) {
                   return miss_of_insert(actions, start.objects[0].X_WO);
                 }});
  all.push_back({"insert",
                 {1.0, insert},
                 {{"x", -0.02, 0.02}, {"y", {}, {}}, {"yaw", {}, {}}, {"force", {}, {}}},
                 [write_insert](const Values& values, belief::Scene& scene) {
                   auto& pose = std::get<belief::NormalPose>(own_of<belief::Transport>(scene.actions).X_WO);
                   write_insert(values, scene, pose.mean);
                 },
                 [miss_of_insert](const std::vector<Action>& actions, const belief::WorldState&) {
                   return miss_of_insert(actions, belief::mean(own_of<belief::Transport>(actions).X_WO));
                 },
                 true});
  all.push_back({"grasp",
                 {0.1, belief::Grasp{"cup", "hand", belief::Grip{belief::NormalScalar{8.0, 1.0, 0.0}}}},
                 {{"grip_force", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& grip = *own_of<belief::Grasp>(scene.actions).grip;
                   std::get<belief::NormalScalar>(grip.force).mean = values.at("grip_force");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(belief::mean(own_of<belief::Grasp>(actions).grip->force), 20.0, 40.0);
                 }});
  all.push_back({"pull",
                 {0.1, belief::Pull{"cup", {0.2, 0.0, 0.0}, 1.0, belief::UniformScalar{10.0, 12.0}}},
                 {{"distance", {}, {}}, {"force", {}, {}}, {"direction", -90.0, 90.0}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& pull = own_of<belief::Pull>(scene.actions);
                   pull.by = values.at("distance") * level(values.at("direction_deg"));
                   pull.force = belief::FixedScalar{values.at("force")};
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& pull = own_of<belief::Pull>(actions);
                   return (pull.by - 0.4 * level(30.0)).norm() + off(belief::mean(pull.force), 20.0, 100.0);
                 }});
  all.push_back({"move_joint",
                 {0.1, belief::MoveJoint{"slide", belief::JointType::kSlider, 0.1}},
                 {{"to", {}, {}}, {"force", {}, {}}},
                 [](const Values& values, belief::Scene& scene) {
                   auto& move = own_of<belief::MoveJoint>(scene.actions);
                   move.to = values.at("to");
                   move.force = belief::FixedScalar{values.at("force")};
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   const auto& move = own_of<belief::MoveJoint>(actions);
                   return off(move.to, 0.2, 1.0) + off(belief::mean(move.force), 50.0, 500.0);
                 }});
  all.push_back({"transport",
                 {1.0, carry_to({0.3, 0.4, 0.6}, 1.0)},
                 {{"speed", {}, {}}},
                 // From (0, 0, 0.6): half a metre.
                 [](const Values& values, belief::Scene& scene) {
                   own_of<belief::Transport>(scene.actions).duration = 0.5 / values.at("speed");
                 },
                 [](const std::vector<Action>& actions, const belief::WorldState&) {
                   return off(own_of<belief::Transport>(actions).duration, 0.6, 5.0);
                 },
                 true});
  return all;
}

std::shared_ptr<belief::Scene> scene_of(const Case& one) {
  auto scene = tests::sliding_scene();
  belief::SceneObject& carton = scene->objects[0];
  carton.held_by = "hand";
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>().setConstant(1e-8);
  carton.pose = belief::NormalPose{Pose::from_translation({0.0, 0.0, 0.5}), covariance};
  scene->robot[0].timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.75})}};
  belief::Joint slide;
  slide.name = "slide";
  slide.type = belief::JointType::kSlider;
  slide.parent = "table";
  slide.child = "cup";
  slide.axis_P = Vector3d::UnitX();
  slide.X_PC0 = scene->supports[0].X_WS.inverse() * std::get<belief::FixedPose>(scene->objects[1].pose).X_WO;
  slide.low = 0.0;
  slide.high = 0.4;
  if (one.kind == "move_joint") scene->joints = {slide};
  if (one.carried) scene->actions.push_back({0.3, carry_to({0.0, 0.0, 0.6})});
  scene->actions.push_back(one.own);
  scene->exclusive_outcomes.clear();
  scene->outcomes = {{"stays", "carton", {belief::Condition{belief::BelowHeight{-0.5}, belief::When::kAtEnd, true}}}};
  return scene;
}

AchieveQuery question(const Case& one) {
  AchieveQuery query;
  query.outcome = "stays";
  query.action = one.kind;
  query.free = one.free;
  query.effort.exact_instances = 1500;
  return query;
}

tests::FakeSimulator::Formula law_of(const Case& one) {
  return [miss = one.miss](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
    belief::WorldState end = start;
    if (start.objects[0].physical.friction > 0.85 - miss(request.actions, start))
      end.objects[0].X_WO.translation.z() -= 2.0;
    return end;
  };
}

Answer ask(const Case& one, const AchieveQuery& query, int threads) {
  core::ThreadPool pool(threads);
  return queries::answer(scene_of(one), 1, {"q", query}, tests::context_with(law_of(one), pool));
}

}  // namespace prescene::queries::own_action_laws_test
