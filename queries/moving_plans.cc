// SPDX-License-Identifier: Apache-2.0
// Actions that take place while the scene moves: a push along a line, a blow, and the opening of a hand on its way.
#include <algorithm>
#include <cmath>
#include <utility>

#include "planned_action.h"
#include "prescene/geometry/angles.h"
#include "swept_bodies.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

const double kFingerRadius = belief::Push{}.radius;
// How far before the object the finger tip comes down, and from how high, m.
constexpr double kStandOff = 0.01, kFromAbove = 0.1;

std::optional<std::string> moving_errors_reason(const belief::ActionErrors& errors) {
  if (!errors.position.isZero(0.0)) return "errors.position";
  if (!errors.rotation.isZero(0.0)) return "errors.rotation_deg";
  return std::nullopt;
}

/// An action that joins those of the scene, later than it should by the delay.
class DelayedPlan : public PlannedAction {
 public:
  using PlannedAction::PlannedAction;

  int noise_dimensions() const override { return belief::dimensions(query_.errors.delay); }
  std::vector<belief::Action> begin(std::span<const double> values, std::span<const double> noise,
                                    belief::WorldState&) const override {
    std::vector<belief::Action> actions = scene_->actions;
    actions.push_back(exact(values));
    actions.back().time += belief::draw(query_.errors.delay, noise);
    return actions;
  }
  /// What gives a blow, and the hand that opens, are not simulated.
  std::optional<std::string> obstacle(std::span<const double>) override { return std::nullopt; }
};

class PushPlan final : public DelayedPlan {
 public:
  PushPlan(const Prior& prior, const belief::AchieveQuery& query, std::size_t index, core::ThreadPool& pool)
      : DelayedPlan(prior, query), way_(pool) {
    scene_ = prior.scene;
    X_WO_ = prior.likeliest.objects[index].X_WO;
    mesh_ = belief::collision_mesh(prior.scene->model_of(prior.scene->objects[index]));
  }

  core::Status prepare() {
    const belief::Scene& scene = *prior_.scene;
    for (const belief::Support& support : scene.supports)
      PRESCENE_RETURN_IF_ERROR(
          way_.add_obstacle(support.name, belief::collision_mesh(support.collision), support.X_WS));
    for (std::size_t i = 0; i < scene.objects.size(); ++i)
      PRESCENE_RETURN_IF_ERROR(way_.add_obstacle(scene.objects[i].name,
                                                 belief::collision_mesh(scene.model_of(scene.objects[i])),
                                                 prior_.likeliest.objects[i].X_WO));
    const belief::CollisionShape tip = belief::PrimitiveShape{geometry::Sphere{kFingerRadius}, {}};
    return way_.add_mover("the finger tip", belief::collision_mesh({tip}));
  }

  std::vector<belief::Action> begin(std::span<const double> values, std::span<const double> noise,
                                    belief::WorldState& state) const override {
    std::vector<belief::Action> actions = DelayedPlan::begin(values, noise, state);
    std::get<belief::Push>(actions.back().what).lateral_error = query_.errors.lateral_error;
    return actions;
  }

  std::optional<std::string> obstacle(std::span<const double> values) override {
    const belief::Action action = exact(values);
    return way_.first_hit(0, Pose::from_translation(std::get<belief::Push>(action.what).from),
                          Vector3d(0.0, 0.0, -kFromAbove), 0.0);
  }

  belief::Action exact(std::span<const double> values) const override {
    const double angle = geometry::kDegree * value("direction_deg", values);
    const Vector3d along(std::cos(angle), std::sin(angle), 0.0), left(-along.y(), along.x(), 0.0);
    double behind = 0.0;  // how far the object reaches against the push
    for (const Vector3d& vertex : mesh_.vertices) behind = std::max(behind, -along.dot(X_WO_.rotation * vertex));
    Vector3d from = X_WO_.translation + value("offset", values) * left - (behind + kFingerRadius + kStandOff) * along;
    from.z() = X_WO_.translation.z() + heights_of(mesh_, X_WO_.rotation).first + value("height", values);
    const double way = kStandOff + value("distance", values);
    belief::Push push;
    push.from = from;
    push.to = from + way * along;
    push.duration = way / value("speed", values);
    push.radius = kFingerRadius;
    return {value("time", values), push};
  }

 private:
  SweptBodies way_;
  Pose X_WO_;
  geometry::TriangleMesh mesh_;
};

class BumpPlan final : public DelayedPlan {
 public:
  BumpPlan(const Prior& prior, const belief::AchieveQuery& query, std::size_t index) : DelayedPlan(prior, query) {
    scene_ = prior.scene;
    name_ = prior.scene->objects[index].name;
    X_WO_ = prior.likeliest.objects[index].X_WO;
    lowest_ =
        heights_of(belief::collision_mesh(prior.scene->model_of(prior.scene->objects[index])), X_WO_.rotation).first;
  }

  belief::Action exact(std::span<const double> values) const override {
    const double angle = geometry::kDegree * value("direction_deg", values);
    const Vector3d along(std::cos(angle), std::sin(angle), 0.0), left(-along.y(), along.x(), 0.0);
    Vector3d point = X_WO_.translation + value("offset", values) * left;
    point.z() += lowest_ + value("height", values);
    belief::Bump bump;
    bump.object = name_;
    bump.impulse = belief::Vector3Distribution::fixed(value("impulse", values) * along);
    bump.point_O = X_WO_.inverse() * point;
    return {value("time", values), bump};
  }

 private:
  std::string name_;
  Pose X_WO_;
  double lowest_ = 0.0;
};

class ReleasePlan final : public DelayedPlan {
 public:
  ReleasePlan(const Prior& prior, const belief::AchieveQuery& query, std::size_t index) : DelayedPlan(prior, query) {
    const belief::SceneObject& held = prior.scene->objects[index];
    release_.object = held.name;
    release_.retreat = kRetreat * Vector3d::UnitZ();
    release_.retreat_duration = kRetreatDuration;
    auto without = std::make_shared<belief::Scene>(*prior.scene);
    if (const belief::Action* own = own_release(*prior.scene, held.name)) {
      release_ = std::get<belief::Release>(own->what);
      std::erase_if(without->actions, [&](const belief::Action& action) {
        const auto* release = std::get_if<belief::Release>(&action.what);
        return release != nullptr && release->object == held.name;
      });
    }
    if (query.errors.disturbance) release_.disturbance = *query.errors.disturbance;
    scene_ = std::move(without);
  }

  belief::Action exact(std::span<const double> values) const override { return {value("time", values), release_}; }

 private:
  belief::Release release_;
};

}  // namespace

core::Result<std::unique_ptr<PlannedAction>> plan_bump(const Prior& prior, const belief::AchieveQuery& query,
                                                       std::size_t index, std::vector<SceneValue>& scene_values) {
  const belief::SceneObject& object = prior.scene->objects[index];
  if (object.held_by)
    return core::invalid_input("'" + object.name + "' is held by " + *object.held_by +
                               ", which takes every blow: name an object that is free");
  if (const auto key = moving_errors_reason(query.errors))
    return core::invalid_input(*key + ": that is of a place; give errors.delay to a bump");
  if (query.errors.disturbance)
    return core::invalid_input("errors.velocity: that is of an opening hand; give errors.delay to a bump");
  if (belief::dimensions(query.errors.lateral_error) > 0 || belief::mean(query.errors.lateral_error) != 0.0)
    return core::invalid_input("errors.lateral_error: that is of a push; give errors.delay to a bump");
  const belief::ObjectModel& model = prior.scene->model_of(object);
  const auto [low, high] = heights_of(belief::collision_mesh(model), prior.likeliest.objects[index].X_WO.rotation);
  const double mass = belief::mean(model.mass);
  // Enough for 0.5 m/s; from 0.05 to 2 m/s.
  scene_values.push_back({"impulse", 0.5 * mass, 0.05 * mass, 2.0 * mass});
  scene_values.push_back({"height", 0.5 * (high - low), 0.0, high - low});
  scene_values.push_back({"time", 0.0, 0.0, 1.0});
  return std::unique_ptr<PlannedAction>(std::make_unique<BumpPlan>(prior, query, index));
}

core::Result<std::unique_ptr<PlannedAction>> plan_push(const Prior& prior, const belief::AchieveQuery& query,
                                                       std::size_t index, core::ThreadPool& pool,
                                                       std::vector<SceneValue>& scene_values) {
  const belief::SceneObject& object = prior.scene->objects[index];
  if (object.held_by)
    return core::invalid_input("'" + object.name + "' is held by " + *object.held_by +
                               " and can't be pushed: name an object that is free");
  if (const auto key = moving_errors_reason(query.errors))
    return core::invalid_input(*key + ": that is of a place; give errors.lateral_error to a push");
  if (query.errors.disturbance)
    return core::invalid_input("errors.velocity: that is of an opening hand; give errors.lateral_error to a push");
  const auto [low, high] =
      heights_of(belief::collision_mesh(prior.scene->model_of(object)), prior.likeliest.objects[index].X_WO.rotation);
  const double tall = high - low;
  scene_values.push_back(
      {"height", std::max(0.5 * tall, 1.1 * kFingerRadius), 1.1 * kFingerRadius, std::max(tall, 1.2 * kFingerRadius)});
  scene_values.push_back({"time", 0.0, 0.0, 1.0});
  auto plan = std::make_unique<PushPlan>(prior, query, index, pool);
  PRESCENE_RETURN_IF_ERROR(plan->prepare());
  return std::unique_ptr<PlannedAction>(std::move(plan));
}

core::Result<std::unique_ptr<PlannedAction>> plan_release(const Prior& prior, const belief::AchieveQuery& query,
                                                          std::size_t index, std::vector<SceneValue>& scene_values) {
  const belief::SceneObject& held = prior.scene->objects[index];
  if (const auto key = moving_errors_reason(query.errors))
    return core::invalid_input(*key + ": that is of a place; give errors.delay or errors.velocity to a release");
  if (belief::dimensions(query.errors.lateral_error) > 0 || belief::mean(query.errors.lateral_error) != 0.0)
    return core::invalid_input("errors.lateral_error: that is of a push; give errors.delay to a release");
  // Until the hand has come to rest; a hand that does not move can open at any time.
  double last = 0.0;
  const std::optional<int> hand = belief::find_robot_body(*prior.scene, *held.held_by);
  if (hand) last = prior.scene->robot[static_cast<std::size_t>(*hand)].timeline.back().time;
  const belief::Action* own = own_release(*prior.scene, held.name);
  const double high = std::max(last, own ? own->time : 0.0) + (last > 0.0 ? 0.0 : 1.0);
  scene_values.push_back({"time", own ? own->time : last, 0.0, high});
  return std::unique_ptr<PlannedAction>(std::make_unique<ReleasePlan>(prior, query, index));
}

}  // namespace prescene::queries
