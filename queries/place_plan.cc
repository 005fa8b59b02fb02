// SPDX-License-Identifier: Apache-2.0
// A held object is brought straight down to a place above a support and let go there.
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

// What is met in the last millimetres is what the object is put on; a tilted one meets it earlier than its lowest
// point.
constexpr double kTouching = 0.0015;
// Robot bodies that are not simulated stand so far above everything, m.
constexpr double kAway = 5.0;

/// What the object is put on.
struct Base {
  std::string name;
  geometry::Box room;   ///< In W: where heights are counted from, and between which x and y it is looked for.
  double height = 0.0;  ///< z in W that heights are counted from.
};

geometry::Box bounds_of(const std::vector<Vector3d>& points, const Pose& X_WB) {
  geometry::Box box;
  for (const Vector3d& p_BQ : points) box.extend(X_WB * p_BQ);
  return box;
}

std::vector<Vector3d> corners_of(const belief::Hollow& hollow) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Vector3d sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    corners.push_back(hollow.X_OV * Vector3d(sign.cwiseProduct(hollow.size)));
  }
  return corners;
}

Base base_of(const std::string& name, const std::vector<belief::CollisionShape>& shapes,
             const std::optional<belief::Hollow>& hollow, const Pose& X_WB) {
  Base base{name, {}, 0.0};
  if (hollow) {
    base.room = bounds_of(corners_of(*hollow), X_WB);
    base.height = base.room.min().z();
  } else {
    base.room = bounds_of(belief::collision_mesh(shapes).vertices, X_WB);
    base.height = base.room.max().z();
  }
  return base;
}

/// The support or object that the outcome is about: what it rests on, or whose hollow it is in.
std::string named_support(const belief::Scene& scene, const belief::Outcome& wanted) {
  for (const belief::Condition& condition : wanted.all_of) {
    if (condition.negated) continue;
    if (const auto* resting = std::get_if<belief::RestingOn>(&condition.predicate)) return resting->support;
    const auto* inside = std::get_if<belief::InsideVolume>(&condition.predicate);
    if (inside == nullptr) continue;
    for (const belief::Support& support : scene.supports)
      if (support.hollow && support.X_WS * support.hollow->X_OV == inside->X_WV && support.hollow->size == inside->size)
        return support.name;
  }
  return scene.supports.size() == 1 ? scene.supports.front().name : std::string();
}

core::Result<Base> find_base(const Prior& prior, const std::string& asked, const belief::Outcome& wanted,
                             std::size_t held) {
  const belief::Scene& scene = *prior.scene;
  const std::string name = asked.empty() ? named_support(scene, wanted) : asked;
  std::string names;
  for (const belief::Support& support : scene.supports) names += (names.empty() ? "" : ", ") + support.name;
  if (name.empty())
    return core::invalid_input("above which support is the object to be placed? The outcome names none: name one of " +
                               names + " (support)");
  for (const belief::Support& support : scene.supports)
    if (support.name == name) return base_of(name, support.collision, support.hollow, support.X_WS);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (scene.objects[i].name != name) continue;
    if (i == held) return core::invalid_input("'" + name + "' can't be placed on itself: name another support");
    const belief::ObjectModel& model = scene.model_of(scene.objects[i]);
    return base_of(name, model.collision, model.hollow, prior.likeliest.objects[i].X_WO);
  }
  return core::not_found("there is no support or object '" + name + "': name one of " + names);
}

class PlacePlan final : public PlannedAction {
 public:
  PlacePlan(const Prior& prior, const belief::AchieveQuery& query, std::size_t index, Base base, core::ThreadPool& pool)
      : PlannedAction(prior, query), index_(index), base_(std::move(base)), way_(pool) {
    const belief::SceneObject& held = prior.scene->objects[index];
    mesh_ = belief::collision_mesh(prior.scene->model_of(held));
    X_held_ = prior.likeliest.objects[index].X_WO;
    support_ = base_.name;
    disturbance_ = query.errors.disturbance.value_or(belief::TwistDistribution{});
    if (const belief::Action* own = own_release(*prior.scene, held.name); own && !query.errors.disturbance)
      disturbance_ = std::get<belief::Release>(own->what).disturbance;
    error_deviations_.head<3>() = query.errors.rotation;
    error_deviations_.tail<3>() = query.errors.position;
  }

  core::Status prepare() {
    const belief::Scene& scene = *prior_.scene;
    const belief::SceneObject& held = scene.objects[index_];
    auto begun = std::make_shared<belief::Scene>(scene);
    begun->actions.clear();
    begun->objects[index_].held_by.reset();
    for (const belief::Support& support : scene.supports)
      PRESCENE_RETURN_IF_ERROR(
          way_.add_obstacle(support.name, belief::collision_mesh(support.collision), support.X_WS));
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      if (i == index_) continue;
      PRESCENE_RETURN_IF_ERROR(way_.add_obstacle(scene.objects[i].name,
                                                 belief::collision_mesh(scene.model_of(scene.objects[i])),
                                                 prior_.likeliest.objects[i].X_WO));
    }
    PRESCENE_RETURN_IF_ERROR(way_.add_mover(held.name, mesh_));
    for (std::size_t r = 0; r < scene.robot.size(); ++r) {
      const belief::KinematicBody& body = scene.robot[r];
      Pose X_WG = belief::pose_at(body, 0.0);
      if (body.name == *held.held_by) {
        absent_.push_back(body.name);
        if (!body.collision.empty())
          PRESCENE_RETURN_IF_ERROR(way_.add_mover(body.name, belief::collision_mesh(body.collision)));
        X_OG_ = X_held_.inverse() * X_WG;
        X_WG.translation.z() += kAway;
      } else if (!body.collision.empty()) {
        PRESCENE_RETURN_IF_ERROR(way_.add_obstacle(body.name, belief::collision_mesh(body.collision), X_WG));
      }
      begun->robot[r].timeline = {{0.0, X_WG}};
    }
    scene_ = std::move(begun);
    remarks_.push_back("Instances begin when the hand opens. " + *held.held_by +
                       " must not hit anything on its way straight down to there, and then takes no part: that it lets "
                       "go without pushing is taken for granted, apart from the velocity that it adds.");
    return core::ok_status();
  }

  int noise_dimensions() const override {
    return (error_deviations_.isZero(0.0) ? 0 : 6) + belief::dimensions(disturbance_);
  }

  std::vector<belief::Action> begin(std::span<const double> values, std::span<const double> noise,
                                    belief::WorldState& start) const override {
    belief::ObjectState& object = start.objects[index_];
    // What is not known of how it lies in the hand stays as it is, wherever the hand goes.
    Pose X_WO = *goal(values) * (X_held_.inverse() * object.X_WO);
    std::size_t used = 0;
    if (!error_deviations_.isZero(0.0)) {
      geometry::Vector6d error;
      for (; used < 6; ++used)
        error[static_cast<Eigen::Index>(used)] =
            error_deviations_[static_cast<Eigen::Index>(used)] * core::inverse_normal_cdf(noise[used]);
      X_WO = geometry::box_plus(X_WO, error);
    }
    object.X_WO = geometry::normalized(X_WO);
    object.V_WO = belief::draw(disturbance_, noise.subspan(used));
    object.mode = belief::MotionMode::kMoving;
    return {};
  }

  std::optional<std::string> obstacle(std::span<const double> values) override {
    const Pose X_WO = *goal(values);
    const Vector3d down(0.0, 0.0, -value("approach", values));
    for (std::size_t mover = 0; mover < way_.movers(); ++mover)
      if (auto hit = way_.first_hit(mover, mover == 0 ? X_WO : X_WO * X_OG_, down, kTouching)) return hit;
    return std::nullopt;
  }

  std::optional<Pose> goal(std::span<const double> values) const override {
    const auto turn = [&](const char* name, const Vector3d& axis) {
      return geometry::exp_rotation(geometry::kDegree * value(name, values) * axis);
    };
    Pose X_WO;
    X_WO.rotation = (turn("yaw_deg", Vector3d::UnitZ()) * turn("pitch_deg", Vector3d::UnitY()) *
                     turn("roll_deg", Vector3d::UnitX()) * X_held_.rotation)
                        .normalized();
    X_WO.translation = {value("x", values), value("y", values),
                        base_.height + value("height", values) - heights_of(mesh_, X_WO.rotation).first};
    return X_WO;
  }

  belief::Action exact(std::span<const double> values) const override {
    belief::Place place;
    place.object = object_;
    place.X_WO = belief::FixedPose{*goal(values)};
    return {0.0, place};
  }

 private:
  std::size_t index_;
  Base base_;
  SweptBodies way_;
  geometry::TriangleMesh mesh_;
  Pose X_held_, X_OG_;
  belief::TwistDistribution disturbance_;
  geometry::Vector6d error_deviations_;
};

}  // namespace

core::Result<std::unique_ptr<PlannedAction>> plan_place(const Prior& prior, const belief::AchieveQuery& query,
                                                        const belief::Outcome& wanted, std::size_t index,
                                                        core::ThreadPool& pool, std::vector<SceneValue>& scene_values) {
  if (belief::dimensions(query.errors.lateral_error) > 0 || belief::mean(query.errors.lateral_error) != 0.0)
    return core::invalid_input("errors.lateral_error: that is of a push; give errors.position to a place");
  if (belief::dimensions(query.errors.delay) > 0 || belief::mean(query.errors.delay) > 0.0)
    return core::invalid_input(
        "errors.delay: that is of a release or push; where an object is placed, the hand stands still until it opens, "
        "so "
        "that a delay changes nothing: leave it out");
  PRESCENE_TRY(Base base, find_base(prior, query.support, wanted, index));
  const auto along = [&](const char* name, Eigen::Index axis) {
    scene_values.push_back({name, base.room.center()[axis], base.room.min()[axis], base.room.max()[axis]});
  };
  along("x", 0);
  along("y", 1);
  auto plan = std::make_unique<PlacePlan>(prior, query, index, std::move(base), pool);
  PRESCENE_RETURN_IF_ERROR(plan->prepare());
  return std::unique_ptr<PlannedAction>(std::move(plan));
}

}  // namespace prescene::queries
