// SPDX-License-Identifier: Apache-2.0
// Certificates in scenes that nobody chose: what ends early ends as it would have at rest.
#include <gtest/gtest.h>

#include "certified_problem.h"
#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"

namespace prescene::simulation {
namespace {

using belief::FixedScalar;
using geometry::BoxShape;
using geometry::Pose;

/// Things of random shape, size and friction fall, slide and roll on a random table with something fixed on it, above a
/// floor.
class RandomScene {
 public:
  explicit RandomScene(std::uint64_t number) : random_(number, core::Purpose::kTest) {}

  std::shared_ptr<const belief::Scene> make() {
    auto scene = std::make_shared<belief::Scene>();
    scene->name = "random";
    scene->duration = 4.0;
    scene->supports.push_back(support("floor", {4.0, 4.0, 0.1}, {0.0, 0.0, -0.05 - between(0.1, 0.8)}));
    const double thickness = between(0.02, 0.1), depth = between(0.2, 0.6), width = between(0.2, 0.6);
    const Vector3d table(width, depth, thickness);
    scene->supports.push_back(support("table", table, {0.0, 0.0, -0.5 * table.z()}));
    if (chance(0.5)) {
      const double block_height = between(0.005, 0.15), block_depth = between(0.02, 0.3),
                   block_width = between(0.02, 0.15);
      const Vector3d block(block_width, block_depth, block_height);
      scene->supports.push_back(support("block", block, {between(-0.2, 0.2), between(-0.2, 0.2), 0.5 * block.z()}));
    }
    const int objects = chance(0.6) ? 1 : 2;
    for (int i = 0; i < objects; ++i) add_object(*scene, i);
    const double drop = -between(0.01, 0.1);
    scene->exclusive_outcomes.push_back(
        {"ends",
         {{"below", "thing1", {{belief::BelowHeight{drop}}}},
          {"upright", "thing1", {{belief::UprightWithin{Vector3d::UnitZ(), between(0.1, 0.6)}}}}}});
    if (chance(0.3)) {
      const belief::InsideVolume volume{Pose::from_translation({between(-0.2, 0.2), between(-0.2, 0.2), 0.1}),
                                        {between(0.1, 0.3), between(0.1, 0.3), 0.3}};
      scene->outcomes.push_back({"there", "thing1", {{volume}}});
    }
    PRESCENE_CHECK(validate(*scene).ok());
    return scene;
  }

 private:
  double between(double low, double high) { return low + (high - low) * random_.uniform(); }
  bool chance(double share) { return random_.uniform() < share; }

  belief::Support support(const std::string& name, const Vector3d& size, const Vector3d& center) {
    belief::Support made;
    made.name = name;
    made.collision.push_back(belief::PrimitiveShape{BoxShape{size}, Pose{}});
    made.X_WS = Pose::from_translation(center);
    made.contact.friction = FixedScalar{between(0.3, 1.0)};
    made.contact.restitution = FixedScalar{between(0.3, 1.0)};
    return made;
  }
  geometry::Primitive shape() {
    switch (random_.uniform_below(4)) {
      case 0:
        return geometry::Cylinder{between(0.015, 0.05), between(0.01, 0.2)};
      case 1:
        return geometry::Sphere{between(0.015, 0.05)};
      default:
        return BoxShape{{between(0.03, 0.15), between(0.03, 0.15), between(0.03, 0.2)}};
    }
  }
  void add_object(belief::Scene& scene, int number) {
    belief::ObjectModel model;
    model.name = "model" + std::to_string(number + 1);
    model.collision.push_back(belief::PrimitiveShape{shape(), Pose{}});
    model.mass = FixedScalar{between(0.1, 1.0)};
    model.contact.friction = FixedScalar{between(0.2, 1.0)};
    model.contact.restitution = FixedScalar{between(0.0, 0.6)};
    if (chance(0.6)) model.contact.rolling_friction = between(2e-4, 4e-3);
    scene.models.push_back(*belief::with_derived_properties(std::move(model)));

    belief::SceneObject object;
    object.name = "thing" + std::to_string(number + 1);
    object.model = number;
    belief::NormalPose pose;
    const double tilt = chance(0.5) ? 0.2 : 1.6;
    pose.mean = {geometry::exp_rotation({between(-tilt, tilt), between(-tilt, tilt), between(-3.0, 3.0)}),
                 {between(-0.25, 0.25), between(-0.25, 0.25), 0.2 + 0.3 * number + between(0.0, 0.1)}};
    geometry::Vector6d deviations;
    deviations << 0.15, 0.15, 0.3, 0.03, 0.03, 0.02;
    pose.covariance = deviations.cwiseAbs2().asDiagonal();
    object.pose = pose;
    const double speed = chance(0.5) ? 0.1 : 0.6;
    object.twist.linear = belief::Vector3Distribution::fixed({between(-speed, speed), between(-speed, speed), 0.0});
    object.twist.angular =
        belief::Vector3Distribution::fixed({between(-3.0, 3.0), between(-3.0, 3.0), between(-3.0, 3.0)});
    scene.objects.push_back(object);
  }

  core::RandomStream random_;
};

TEST(CertificatesInRandomScenes, AreRightWhenInstancesRunOnToRest) {
#ifdef NDEBUG
  constexpr int kScenes = 60, kInstances = 64;
#else
  constexpr int kScenes = 10, kInstances = 32;
#endif
  int certified = 0, wrong = 0;
  double seconds = 0.0, whole_seconds = 0.0;
  for (int number = 0; number < kScenes; ++number) {
    const Problem problem(RandomScene(static_cast<std::uint64_t>(number)).make());
    const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
    ASSERT_TRUE(certifier);
    const OutcomeEstimate whole = problem.run_exactly(kInstances, nullptr, 0.0);
    const OutcomeEstimate with = problem.run_exactly(kInstances, certifier.get(), 0.0);
    certified += with.certificates.certified;
    wrong += classed_otherwise(with, whole);
    seconds += with.simulated_seconds;
    whole_seconds += whole.simulated_seconds;
  }
  EXPECT_LE(wrong, 1);
  EXPECT_GT(certified, kScenes * kInstances * 6 / 10);
  EXPECT_LT(seconds, 0.75 * whole_seconds);
}

}  // namespace
}  // namespace prescene::simulation
