// SPDX-License-Identifier: Apache-2.0
#include "tests/support/engine_scenes.h"

#include <numbers>
#include <utility>

#include "prescene/core/check.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using namespace belief;
using geometry::BoxShape;
using geometry::exp_rotation;

constexpr double kDegree = std::numbers::pi / 180.0;
const Vector3d kZero = Vector3d::Zero();

CollisionShape part(const geometry::Primitive& shape, const Vector3d& at = kZero) {
  return PrimitiveShape{shape, Pose::from_translation(at)};
}

ScalarDistribution about(double mean, double deviation) {
  if (deviation == 0.0) return FixedScalar{mean};
  return NormalScalar{mean, deviation};
}

Condition negated(Predicate predicate) { return {std::move(predicate), When::kAtEnd, true}; }

/// A scene that is put together line by line.
class Builder {
 public:
  explicit Builder(const std::string& name, double duration) {
    scene_.name = name;
    scene_.duration = duration;
  }
  Builder& support(const std::string& name, const Vector3d& size, const Pose& X_WS) {
    Support made;
    made.name = name;
    made.collision = {part(BoxShape{size})};
    made.X_WS = X_WS;
    made.contact.friction = made.contact.restitution = FixedScalar{1.0};
    scene_.supports.push_back(std::move(made));
    return *this;
  }
  Builder& support(const std::string& name, const Vector3d& size, const Vector3d& center) {
    return support(name, size, Pose::from_translation(center));
  }
  Builder& floor(double height = 0.0) { return support("floor", {8.0, 8.0, 0.2}, Vector3d(0.0, 0.0, height - 0.1)); }
  Builder& object(const std::string& name, std::vector<CollisionShape> shapes, double mass, const Pose& mean,
                  const Vector3d& turn_deviation, const Vector3d& place_deviation) {
    ObjectModel model;
    model.name = name;
    model.collision = std::move(shapes);
    model.mass = FixedScalar{mass};
    model.contact.friction = FixedScalar{0.4};
    model.contact.restitution = FixedScalar{0.0};
    auto derived = with_derived_properties(std::move(model));
    PRESCENE_CHECK(derived.ok());
    scene_.models.push_back(*std::move(derived));
    SceneObject made;
    made.name = name;
    made.model = static_cast<int>(scene_.models.size()) - 1;
    NormalPose pose;
    pose.mean = mean;
    pose.covariance.diagonal() << turn_deviation.cwiseAbs2(), place_deviation.cwiseAbs2();
    made.pose = pose;
    scene_.objects.push_back(made);
    return *this;
  }
  /// Of the last object.
  Builder& friction(double mean, double deviation) {
    scene_.models.back().contact.friction =
        deviation > 0.0 ? ScalarDistribution(NormalScalar{mean, deviation, 0.02, 2.0}) : FixedScalar{mean};
    return *this;
  }
  Builder& restitution(double mean, double deviation) {
    scene_.models.back().contact.restitution = NormalScalar{mean, deviation, 0.0, 0.9};
    return *this;
  }
  Builder& any_rotation(const Vector3d& at) {
    scene_.objects.back().pose = BoxPose{Vector3Distribution::fixed(at), geometry::Quaterniond::Identity(), true};
    return *this;
  }
  Builder& moving(const Vector3d& v, const Vector3d& v_deviation, const Vector3d& w = kZero,
                  const Vector3d& w_deviation = kZero) {
    TwistDistribution& twist = scene_.objects.back().twist;
    twist.linear = {about(v.x(), v_deviation.x()), about(v.y(), v_deviation.y()), about(v.z(), v_deviation.z())};
    twist.angular = {about(w.x(), w_deviation.x()), about(w.y(), w_deviation.y()), about(w.z(), w_deviation.z())};
    return *this;
  }
  /// Asked of the last object; the rest is "other".
  Scene asks(const std::vector<std::pair<std::string, Condition>>& classes) {
    ExclusiveOutcomes group{"ends", {}};
    for (const auto& [name, condition] : classes)
      group.outcomes.push_back({name, scene_.objects.back().name, {condition}});
    scene_.exclusive_outcomes = {group};
    return finished();
  }
  Scene asks_which_face_is_up() {
    scene_.exclusive_outcomes = {which_face_up("face_up", scene_.objects.back().name)};
    return finished();
  }

 private:
  Scene finished() {
    PRESCENE_CHECK(validate(scene_).ok());
    return std::move(scene_);
  }
  Scene scene_;
};

Pose at(double x, double y, double z) { return Pose::from_translation({x, y, z}); }
Condition moved(double distance) { return {MovedMoreThan{distance}}; }
Condition turned(double angle) { return {TurnedMoreThan{angle}}; }
Condition below(double height) { return {BelowHeight{height}}; }
Condition upright(double angle) { return {UprightWithin{Vector3d::UnitZ(), angle}}; }
Condition upside_down(double angle) { return {UprightWithin{-Vector3d::UnitZ(), angle}}; }

/// An earlier scene without bounces.
Scene dull(Scene scene) {
  for (ObjectModel& model : scene.models) model.contact.restitution = FixedScalar{0.0};
  for (ObjectModel& model : scene.models) model.contact.rolling_friction = 0.0;
  return scene;
}

void add_drops(std::vector<std::pair<std::string, Scene>>& scenes) {
  scenes.emplace_back("box dropped any way round",
                      Builder("drop_box", 2.0)
                          .floor()
                          .object("box", {part(BoxShape{{0.10, 0.08, 0.06}})}, 0.4, at(0, 0, 0.2), kZero, kZero)
                          .any_rotation({0, 0, 0.2})
                          .asks_which_face_is_up());
  scenes.emplace_back("cylinder dropped any way round",
                      Builder("drop_cylinder", 2.0)
                          .floor()
                          .object("can", {part(geometry::Cylinder{0.03, 0.06})}, 0.3, at(0, 0, 0.15), kZero, kZero)
                          .any_rotation({0, 0, 0.15})
                          .asks({{"up", upright(0.3)}, {"down", upside_down(0.3)}}));
  const auto carton =
      std::make_shared<const geometry::TriangleMesh>(geometry::make_gable_carton(0.07, 0.07, 0.11, 0.14));
  scenes.emplace_back("milk carton dropped tilted",
                      Builder("drop_hull", 2.0)
                          .floor()
                          .object("carton", {MeshShape{carton, Pose{}, MeshUse::kConvexHull}}, 0.5, at(0, 0, 0.12),
                                  {0.4, 0.4, 0.5}, kZero)
                          .asks({{"stands", upright(0.3)}}));
  scenes.emplace_back("coin dropped tilted",
                      Builder("coin", 2.0)
                          .floor()
                          .object("coin", {part(geometry::Cylinder{0.0129, 0.0022})}, 0.0085,
                                  {exp_rotation({1.35, 0.0, 0.0}), {0, 0, 0.03}}, {0.3, 0.2, 0.2}, kZero)
                          .moving(kZero, {0.05, 0.05, 0.0}, kZero, {2.0, 2.0, 2.0})
                          .asks({{"heads", upright(0.3)}, {"tails", upside_down(0.3)}}));
  scenes.emplace_back("thick coin dropped any way round",
                      Builder("thick_coin", 2.0)
                          .floor()
                          .object("coin", {part(geometry::Cylinder{0.02, 0.023})}, 0.1, at(0, 0, 0.1), kZero, kZero)
                          .any_rotation({0, 0, 0.1})
                          .asks({{"heads", upright(0.3)}, {"tails", upside_down(0.3)}}));
  scenes.emplace_back("angle of two boxes let go tilted",
                      Builder("angle", 2.0)
                          .floor()
                          .object("angle",
                                  {part(BoxShape{{0.12, 0.06, 0.03}}, {0.0, 0.0, -0.045}),
                                   part(BoxShape{{0.03, 0.06, 0.09}}, {-0.045, 0.0, 0.015})},
                                  0.5, {exp_rotation({0.0, -0.65, 0.0}), {0, 0, 0.1}}, {0.1, 0.25, 0.2}, kZero)
                          .asks({{"stands", upright(0.3)}}));
}

void add_slides(std::vector<std::pair<std::string, Scene>>& scenes) {
  const std::vector<CollisionShape> brick{part(BoxShape{{0.12, 0.08, 0.04}})};
  scenes.emplace_back("box slides to a stop", Builder("slide", 2.0)
                                                  .floor()
                                                  .object("box", brick, 0.5, at(0, 0, 0.02), {0, 0, 0.3}, kZero)
                                                  .friction(0.3, 0.05)
                                                  .moving({1.0, 0, 0}, {0.15, 0, 0})
                                                  .asks({{"far", moved(0.17)}}));
  scenes.emplace_back("box on an incline about its threshold",
                      Builder("incline", 2.0)
                          .support("incline", {4.0, 4.0, 0.2},
                                   Pose{exp_rotation({0.0, 20.0 * kDegree, 0.0}),
                                        exp_rotation({0.0, 20.0 * kDegree, 0.0}) * Vector3d(0, 0, -0.1)})
                          .object("box", brick, 0.5,
                                  {exp_rotation({0.0, 20.0 * kDegree, 0.0}),
                                   exp_rotation({0.0, 20.0 * kDegree, 0.0}) * Vector3d(0, 0, 0.0201)},
                                  {0, 0, 0.3}, kZero)
                          .friction(0.364, 0.05)
                          .asks({{"slides", moved(0.02)}}));
  scenes.emplace_back("shoved box turns as it slides", Builder("shove", 2.0)
                                                           .floor()
                                                           .object("box", brick, 0.5, at(0, 0, 0.02), kZero, kZero)
                                                           .friction(0.3, 0.05)
                                                           .moving({0.6, 0, 0}, {0.15, 0, 0}, {0, 0, 6.0}, {0, 0, 2.0})
                                                           .asks({{"turns", turned(0.6)}}));
  scenes.emplace_back("spinning disc slides",
                      Builder("disc", 3.0)
                          .floor()
                          .object("disc", {part(geometry::Cylinder{0.05, 0.01})}, 0.2, at(0, 0, 0.005), kZero, kZero)
                          .friction(0.2, 0.03)
                          .moving({0.7, 0, 0}, {0.1, 0, 0}, {0, 0, 25.0}, {0, 0, 8.0})
                          .asks({{"far", moved(0.2)}}));
  scenes.emplace_back("box slides over a table's edge",
                      Builder("edge", 2.0)
                          .support("table", {1.0, 1.0, 0.04}, Vector3d(-0.5, 0, -0.02))
                          .floor(-0.75)
                          .object("box", brick, 0.5, at(-0.2, 0, 0.02), {0, 0, 0.5}, kZero)
                          .friction(0.3, 0.04)
                          .moving({1.1, 0, 0}, {0.12, 0, 0})
                          .asks({{"falls", below(-0.1)}}));
  scenes.emplace_back("tall box slides against a sill",
                      Builder("sill", 2.0)
                          .floor()
                          .support("sill", {0.04, 1.0, 0.01}, Vector3d(0.15, 0, 0.005))
                          .object("box", {part(BoxShape{{0.06, 0.06, 0.16}})}, 0.5, at(0, 0, 0.08), {0, 0, 0.1}, kZero)
                          .friction(0.15, 0.03)
                          .moving({0.75, 0, 0}, {0.15, 0, 0})
                          .asks({{"tips", negated(UprightWithin{Vector3d::UnitZ(), 0.5})}}));
}

void add_strikes(std::vector<std::pair<std::string, Scene>>& scenes) {
  const std::vector<CollisionShape> cube{part(BoxShape{{0.06, 0.06, 0.06}})};
  scenes.emplace_back("box strikes a box", Builder("two_boxes", 2.0)
                                               .floor()
                                               .object("first", cube, 0.3, at(-0.1, 0, 0.03), {0, 0, 0.1}, {0, 0.02, 0})
                                               .friction(0.5, 0.0)
                                               .moving({1.0, 0, 0}, {0.15, 0, 0})
                                               .object("second", cube, 0.3, at(0, 0, 0.03), kZero, kZero)
                                               .friction(0.3, 0.05)
                                               .asks({{"turns", turned(0.3)}, {"far", moved(0.02)}}));
  scenes.emplace_back("upper of two boxes is shoved", dull(shoved_stack()));
  const std::vector<CollisionShape> ball{part(geometry::Sphere{0.02})};
  scenes.emplace_back("ball slides, then rolls", Builder("ball", 1.0)
                                                     .floor()
                                                     .object("ball", ball, 0.05, at(0, 0, 0.02), kZero, kZero)
                                                     .friction(0.1, 0.03)
                                                     .moving({0.9, 0, 0}, {0.1, 0, 0})
                                                     .asks({{"far", moved(0.69)}}));
  scenes.emplace_back("balls roll against a rim of 4 mm",
                      Builder("rim", 2.0)
                          .floor()
                          .support("rim", {0.01, 2.0, 0.004}, Vector3d(0.2, 0, 0.002))
                          .object("other", ball, 0.05, at(-0.1, 0.3, 0.02), kZero, kZero)
                          .friction(1.0, 0.0)
                          .moving({0.3, 0, 0}, {0.05, 0, 0})
                          .object("ball", ball, 0.05, at(0, 0, 0.02), kZero, kZero)
                          .friction(0.6, 0.0)
                          .moving({0.42, 0, 0}, {0.06, 0.05, 0})
                          .asks({{"over", {InsideVolume{at(1.2, 0, 0), {2.0, 4.0, 1.0}}}}}));
  scenes.emplace_back("bottle let go at a table's edge", dull(bottle_at_edge()));
  scenes.emplace_back("carton falls on a bin's rim", dull(carton_over_bin()));
  scenes.emplace_back("ball bounces over a fence (restitution 0.7)",
                      Builder("bounce", 1.0)
                          .floor()
                          .support("fence", {0.01, 1.0, 0.15}, Vector3d(0.5, 0, 0.075))
                          .object("ball", ball, 0.05, at(0, 0, 0.42), kZero, kZero)
                          .restitution(0.7, 0.05)
                          .friction(0.3, 0.0)
                          .moving({1.05, 0, 0}, {0.08, 0, 0.1})
                          .asks({{"over", {InsideVolume{at(1.5, 0, 0), {2.0, 2.0, 2.0}}}}}));
  scenes.emplace_back("box thrown, tumbling (restitution 0.4)", tumbling_box());
}

}  // namespace

std::vector<EngineScene> engine_scenes() {
  std::vector<std::pair<std::string, Scene>> scenes;
  add_drops(scenes);
  add_slides(scenes);
  add_strikes(scenes);
  std::vector<EngineScene> all;
  for (auto& [name, scene] : scenes) all.push_back({name, std::make_shared<const Scene>(std::move(scene))});
  return all;
}

}  // namespace prescene::tests
