// SPDX-License-Identifier: Apache-2.0
#include "tests/support/uncertain_scenes.h"

#include <utility>

#include "prescene/core/check.h"

namespace prescene::tests {
namespace {

using namespace belief;
using geometry::exp_rotation;
using geometry::Vector6d;

NormalScalar normal(double mean, double deviation) { return {mean, deviation}; }

ContactProperties contact(const ScalarDistribution& friction, const ScalarDistribution& restitution) {
  ContactProperties properties;
  properties.friction = friction;
  properties.restitution = restitution;
  return properties;
}

NormalScalar friction(double mean, double deviation) { return {mean, deviation, 0.02, 2.0}; }
NormalScalar restitution(double mean, double deviation) { return {mean, deviation, 0.0, 0.9}; }

ObjectModel model(const std::string& name, const geometry::Primitive& shape, double mass,
                  const ContactProperties& properties) {
  ObjectModel made;
  made.name = name;
  made.collision.push_back(PrimitiveShape{shape, Pose{}});
  made.mass = FixedScalar{mass};
  made.contact = properties;
  auto derived = with_derived_properties(std::move(made));
  PRESCENE_CHECK(derived.ok());
  return *std::move(derived);
}

Support support(const std::string& name, const std::vector<std::pair<Vector3d, Vector3d>>& sizes_and_centers) {
  Support made;
  made.name = name;
  for (const auto& [size, center] : sizes_and_centers)
    made.collision.push_back(PrimitiveShape{geometry::BoxShape{size}, Pose::from_translation(center)});
  made.contact = contact(FixedScalar{1.0}, FixedScalar{1.0});
  return made;
}

Support floor_at(double height) { return support("floor", {{{8.0, 8.0, 0.2}, {0.0, 0.0, height - 0.1}}}); }

/// Deviations in the order of NormalPose: rotation about O's axes (rad), then position (m).
NormalPose pose(const Pose& mean, const Vector6d& deviations) {
  NormalPose made;
  made.mean = mean;
  made.covariance = deviations.cwiseAbs2().asDiagonal();
  return made;
}

TwistDistribution twist(const Vector3d& w, const Vector3d& w_deviation, const Vector3d& v,
                        const Vector3d& v_deviation) {
  const auto coordinate = [](double mean, double deviation) -> ScalarDistribution {
    if (deviation == 0.0) return FixedScalar{mean};
    return normal(mean, deviation);
  };
  TwistDistribution made;
  made.angular = {coordinate(w.x(), w_deviation.x()), coordinate(w.y(), w_deviation.y()),
                  coordinate(w.z(), w_deviation.z())};
  made.linear = {coordinate(v.x(), v_deviation.x()), coordinate(v.y(), v_deviation.y()),
                 coordinate(v.z(), v_deviation.z())};
  return made;
}

Vector6d deviations(double rx, double ry, double rz, double x, double y, double z) {
  Vector6d all;
  all << rx, ry, rz, x, y, z;
  return all;
}

Scene finished(Scene scene) {
  PRESCENE_CHECK(validate(scene).ok());
  return scene;
}

}  // namespace

Scene carton_over_bin() {
  constexpr double kInner = 0.18, kHeight = 0.25, kWall = 0.01;
  constexpr double kOuter = kInner + 2.0 * kWall;
  constexpr double kMiddle = 0.5 * (kInner + kWall);
  Scene scene;
  scene.name = "carton_over_bin";
  scene.models.push_back(model("carton", geometry::BoxShape{{0.20, 0.07, 0.07}}, 1.0,
                               contact(friction(0.4, 0.08), restitution(0.2, 0.08))));
  scene.supports.push_back(floor_at(0.0));
  scene.supports.push_back(support("bin", {{{kOuter, kOuter, kWall}, {0.0, 0.0, 0.5 * kWall}},
                                           {{kWall, kOuter, kHeight}, {kMiddle, 0.0, 0.5 * kHeight}},
                                           {{kWall, kOuter, kHeight}, {-kMiddle, 0.0, 0.5 * kHeight}},
                                           {{kInner, kWall, kHeight}, {0.0, kMiddle, 0.5 * kHeight}},
                                           {{kInner, kWall, kHeight}, {0.0, -kMiddle, 0.5 * kHeight}}}));
  SceneObject carton;
  carton.name = "carton";
  carton.pose =
      pose(Pose::from_translation({0.105, 0.0, kHeight + 0.15}), deviations(0.1, 0.15, 0.25, 0.025, 0.025, 0.0));
  carton.twist = twist(Vector3d::Zero(), {0.0, 0.4, 0.0}, Vector3d::Zero(), {0.1, 0.1, 0.0});
  scene.objects.push_back(carton);
  const InsideVolume hollow{Pose::from_translation({0.0, 0.0, 0.5 * (kHeight + kWall)}),
                            {kInner, kInner, kHeight - kWall}};
  scene.exclusive_outcomes.push_back(
      {"carton_ends",
       {{"in", "carton", {Condition{hollow}}}, {"outside", "carton", {Condition{BelowHeight{kHeight}}}}}});
  return finished(std::move(scene));
}

Scene bottle_at_edge() {
  Scene scene;
  scene.name = "bottle_at_edge";
  ContactProperties glass = contact(friction(0.4, 0.08), restitution(0.1, 0.05));
  glass.rolling_friction = 0.001;  // without it a third of the bottles would roll until the time is up
  scene.models.push_back(model("bottle", geometry::Cylinder{0.035, 0.24}, 0.6, glass));
  scene.supports.push_back(support("table", {{{1.0, 1.0, 0.04}, {-0.5, 0.0, -0.02}}}));
  scene.supports.push_back(floor_at(-0.75));
  SceneObject bottle;
  bottle.name = "bottle";
  bottle.pose = pose({exp_rotation({0.0, 0.2, 0.0}), {-0.06, 0.0, 0.13}}, deviations(0.12, 0.10, 0.0, 0.03, 0.0, 0.0));
  bottle.twist = twist(Vector3d::Zero(), {0.0, 0.5, 0.0}, Vector3d::Zero(), {0.1, 0.1, 0.0});
  scene.objects.push_back(bottle);
  scene.exclusive_outcomes.push_back({"bottle_ends",
                                      {{"falls", "bottle", {Condition{BelowHeight{-0.1}}}},
                                       {"stands", "bottle", {Condition{UprightWithin{Vector3d::UnitZ(), 0.35}}}}}});
  return finished(std::move(scene));
}

Scene tumbling_box() {
  Scene scene;
  scene.name = "tumbling_box";
  scene.models.push_back(
      model("box", geometry::BoxShape{{0.10, 0.08, 0.06}}, 0.4, contact(friction(0.4, 0.08), restitution(0.4, 0.08))));
  scene.supports.push_back(floor_at(0.0));
  SceneObject box;
  box.name = "box";
  box.pose = pose(Pose::from_translation({0.0, 0.0, 0.5}), deviations(0.15, 0.15, 0.15, 0.0, 0.0, 0.0));
  box.twist = twist({3.0, 6.0, 2.0}, Vector3d::Constant(0.8), {1.0, 0.0, 0.5}, {0.1, 0.1, 0.0});
  scene.objects.push_back(box);
  scene.exclusive_outcomes.push_back(which_face_up("face_up", "box"));
  return finished(std::move(scene));
}

Scene shoved_stack() {
  Scene scene;
  scene.name = "shoved_stack";
  scene.models.push_back(
      model("upper", geometry::BoxShape{{0.08, 0.08, 0.14}}, 0.5, contact(friction(0.5, 0.06), FixedScalar{0.1})));
  scene.models.push_back(
      model("lower", geometry::BoxShape{{0.12, 0.12, 0.10}}, 1.0, contact(FixedScalar{1.0}, FixedScalar{1.0})));
  scene.supports.push_back(support("table", {{{2.0, 2.0, 0.04}, {0.0, 0.0, -0.02}}}));
  SceneObject upper;
  upper.name = "upper";
  upper.pose = pose(Pose::from_translation({0.0, 0.0, 0.17}), deviations(0.0, 0.0, 0.2, 0.01, 0.01, 0.0));
  upper.twist = twist(Vector3d::Zero(), {0.0, 0.4, 1.0}, {0.65, 0.0, 0.0}, {0.12, 0.1, 0.0});
  scene.objects.push_back(upper);
  SceneObject lower;
  lower.name = "lower";
  lower.model = 1;
  lower.pose = FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
  scene.objects.push_back(lower);
  Condition stays{BelowHeight{0.12}};
  stays.negated = true;
  scene.exclusive_outcomes.push_back({"upper_ends", {{"stays", "upper", {stays}}}});
  return finished(std::move(scene));
}

std::vector<NamedScene> uncertain_scenes() {
  std::vector<NamedScene> scenes;
  const auto add = [&](const std::string& name, Scene scene) {
    scenes.push_back({name, std::make_shared<const Scene>(std::move(scene))});
  };
  add("A", carton_over_bin());
  add("B", bottle_at_edge());
  add("C", tumbling_box());
  add("D", shoved_stack());
  return scenes;
}

}  // namespace prescene::tests
