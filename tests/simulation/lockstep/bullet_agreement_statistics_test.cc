// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper against Bullet's, an implementation of the same mechanics in scalar double precision: step by
// step where nothing is chaotic, and in the probabilities of outcomes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"
#include "prescene/tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

/// How many starts fall in each class with both steppers, and in which they agree start by start.
struct Shares {
  std::vector<int> bullet, lockstep;
  int same = 0;
};
Shares shares_of(const Scene& scene, int count) {
  const std::vector<WorldState> starts = drawn_starts(scene, count, 11);
  simulation::RunRequest request;
  request.stop.duration = scene.duration;
  request.stop.stop_at_rest = scene.stop_at_rest;
  const auto bullet = run_all(*bullet_of(scene), starts, request);
  const auto lockstep = run_all(*lockstep_of(scene), starts, request);
  const belief::ExclusiveOutcomes& classes = scene.exclusive_outcomes.front();
  Shares shares;
  shares.bullet.assign(classes.outcomes.size() + 1, 0);
  shares.lockstep = shares.bullet;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const int a = belief::classify(scene, bullet[i], classes);
    const int b = belief::classify(scene, lockstep[i], classes);
    ++shares.bullet[static_cast<std::size_t>(a)];
    ++shares.lockstep[static_cast<std::size_t>(b)];
    shares.same += a == b ? 1 : 0;
  }
  return shares;
}

/// The same starts are given to both, so that a difference of n instances in a class has a variance of at most the
/// number of starts that disagree. False alarms: one in 1,000 a scene.
void expect_same_distribution(const Scene& scene, int count, double least_same) {
  const Shares shares = shares_of(scene, count);
  const int changed = count - shares.same;
  EXPECT_GE(shares.same, least_same * count) << scene.name;
  const double z = 3.8;  // six classes at most
  for (std::size_t k = 0; k < shares.bullet.size(); ++k) {
    testing::Test::RecordProperty(scene.name + "_" + std::to_string(k),
                                  std::to_string(shares.bullet[k]) + " / " + std::to_string(shares.lockstep[k]));
    EXPECT_LE(std::abs(shares.bullet[k] - shares.lockstep[k]), 1.0 + z * std::sqrt(static_cast<double>(changed)))
        << scene.name << " class " << k << ": " << shares.bullet[k] << " and " << shares.lockstep[k] << " of " << count;
  }
}

TEST(BulletAgreement, CartonOverBinEndsAlike) { expect_same_distribution(carton_over_bin(), 1024, 0.85); }
TEST(BulletAgreement, BottleAtEdgeEndsAlike) { expect_same_distribution(bottle_at_edge(), 1024, 0.9); }
// Chaotic: a rounding error is another face.
TEST(BulletAgreement, TumblingBoxEndsAlike) { expect_same_distribution(tumbling_box(), 1536, 0.3); }

/// Random poses and speeds of a thing about a table's edge and a hull: the change of velocity in a step is the same.
TEST(BulletAgreement, StepsAboutEdgesAreTheSame) {
  struct Case {
    const char* name;
    belief::CollisionShape shape;
  };
  const std::vector<Case> cases = {
      {"sphere", belief::PrimitiveShape{geometry::Sphere{0.05}, Pose{}}},
      {"box", belief::PrimitiveShape{BoxShape{{0.1, 0.06, 0.04}}, Pose{}}},
      {"cylinder", belief::PrimitiveShape{geometry::Cylinder{0.03, 0.1}, Pose{}}},
      {"capsule", belief::PrimitiveShape{geometry::Capsule{0.02, 0.1}, Pose{}}},
      {"carton", hull_of(geometry::make_gable_carton(0.07, 0.07, 0.1, 0.14))},
  };
  const belief::CollisionShape box = belief::PrimitiveShape{BoxShape{{0.5, 0.4, 0.1}}, Pose{}};
  const belief::CollisionShape roof = hull_of(geometry::make_gable_carton(0.3, 0.3, 0.05, 0.2));
  for (const Case& c : cases) {
    for (const bool on_hull : {false, true}) {
      Scene scene;
      scene.name = "edge";
      scene.supports.push_back(
          support_of("fixed", {on_hull ? roof : box}, Pose{about({1.0, 0.3, 0.2}, 0.4), Vector3d(0.02, 0.01, 0.03)}));
      ObjectModel model = model_of("thing", {c.shape});
      model.contact.restitution = belief::FixedScalar{0.4};
      add_object(scene, model, "thing");
      auto bullet = bullet_of(scene)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
      auto lockstep = lockstep_instance_of(scene);
      core::RandomStream stream(17, core::Purpose::kTest);
      std::size_t touching = 0;
      std::size_t different = 0;
      std::vector<double> errors;
      for (int i = 0; i < 16000; ++i) {
        WorldState start = start_of(scene);
        belief::ObjectState& object = start.objects[0];
        object.X_WO = Pose{geometry::uniform_rotation(stream),
                           {stream.uniform(-0.35, 0.35), stream.uniform(-0.3, 0.3), stream.uniform(-0.2, 0.25)}};
        // Overlap is parted another way, and shows at rest.
        bullet->set_state(start);
        bullet->step();
        const Vector3d fallen = bullet->state().objects[0].X_WO.translation - object.X_WO.translation;
        if ((fallen - 0.5 * scene.gravity_W / (240.0 * 240.0)).norm() > 1e-7) continue;
        object.V_WO.linear = -5.0 * object.X_WO.translation + 0.5 * geometry::normal_vector(stream);
        object.V_WO.angular = 5.0 * geometry::normal_vector(stream);
        bullet->set_state(start);
        lockstep->set_state(start);
        bullet->step();
        lockstep->step();
        const belief::ObjectState a = bullet->state().objects[0];
        const belief::ObjectState b = lockstep->state().objects[0];
        const Vector3d free = object.V_WO.linear + scene.gravity_W / 240.0;
        const double change = (a.V_WO.linear - free).norm();
        if (change < 1e-3 && (b.V_WO.linear - free).norm() < 1e-3) continue;
        ++touching;
        const double error = (a.V_WO.linear - b.V_WO.linear).norm() + 0.05 * (a.V_WO.angular - b.V_WO.angular).norm();
        errors.push_back(error);
        if (error > 0.01) ++different;
      }
      std::sort(errors.begin(), errors.end());
      // Where 60 iterations do not settle an impact, the order of its contacts shows.
      ASSERT_GT(touching, 100) << c.name;
      EXPECT_LT(errors[errors.size() / 2], 5e-6) << c.name << " on hull " << on_hull;
      EXPECT_LT(errors[errors.size() * 85 / 100], 1e-4) << c.name << " on hull " << on_hull;
      EXPECT_LE(different, touching / 10) << c.name << " on hull " << on_hull;
    }
  }
}

}  // namespace
}  // namespace prescene::tests
