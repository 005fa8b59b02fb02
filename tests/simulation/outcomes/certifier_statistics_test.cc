// SPDX-License-Identifier: Apache-2.0
// Certified classes are those that instances have when they run on to rest; an audit finds certificates that are not.
#include "prescene/simulation/outcomes/certifier.h"

#include <gtest/gtest.h>

#include <array>

#include "certified_problem.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::simulation {
namespace {

/// The benchmark runs more; rolling (B) and stacked (D) bodies take long to come to rest.
#ifdef NDEBUG
constexpr std::array kInstances = {5000, 2000, 5000, 2000};
#else
constexpr std::array kInstances = {300, 200, 300, 200};
#endif

class Certificates : public testing::TestWithParam<int> {};

TEST_P(Certificates, AreRightWhenInstancesRunOnToRest) {
  const tests::NamedScene named = tests::uncertain_scenes()[static_cast<std::size_t>(GetParam())];
  const int count = kInstances[static_cast<std::size_t>(GetParam())];
  const Problem problem(named.scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  ASSERT_TRUE(certifier);
  const OutcomeEstimate whole = problem.run_exactly(count, nullptr, 0.0);
  const OutcomeEstimate certified = problem.run_exactly(count, certifier.get(), 0.0);
  const int wrong = classed_otherwise(certified, whole);
  EXPECT_LE(wrong, 1) << named.name;
  EXPECT_GE(certified.certificates.certified, count * 8 / 10) << named.name;
  // They end a good deal earlier, or certificates are not worth their name.
  EXPECT_LT(certified.simulated_seconds, 0.8 * whole.simulated_seconds) << named.name;
  EXPECT_EQ(whole.certificates, CertificateUse{});
}
INSTANTIATE_TEST_SUITE_P(OfScenes, Certificates, testing::Range(0, 4));

TEST(Certificates, KnowHowRoundEdgesAre) {
  // A box with edges of 1 cm tips sooner than a sharp one.
  BulletOptions round;
  round.edge_rounding = 0.01;
  const Problem problem(tests::uncertain_scenes()[2].scene, round);
#ifdef NDEBUG
  const int count = 3000;
#else
  const int count = 200;
#endif
  const OutcomeEstimate whole = problem.run_exactly(count, nullptr, 0.0);
  const auto wrong_with = [&](const CertifierOptions& options) {
    const auto certifier = make_certifier(problem.scene, problem.variables, problem.request, options);
    const OutcomeEstimate certified = problem.run_exactly(count, certifier.get(), 0.0);
    EXPECT_GE(certified.certificates.certified, count * 8 / 10);
    return classed_otherwise(certified, whole);
  };
  CertifierOptions knowing;
  knowing.edge_rounding = round.edge_rounding;
  EXPECT_EQ(wrong_with(knowing), 0);
  EXPECT_GT(wrong_with({}), 0);
}

TEST(Certificates, ThatForgetTheEdgesOfSupportsAreCaughtAndRepaired) {
  const Problem problem(tests::uncertain_scenes()[3].scene);
  CertifierOptions forgetful;
  forgetful.shorten_arms = false;
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request, forgetful);
  const OutcomeEstimate found = problem.run_exactly(1000, certifier.get(), 0.02);
  EXPECT_TRUE(found.certificates.switched_off);
  EXPECT_GT(found.certificates.mismatches, 0);
  const OutcomeEstimate whole = problem.run_exactly(1000, nullptr, 0.0);
  EXPECT_EQ(found.variables, whole.variables);
  for (std::size_t i = 0; i < whole.instances.size(); ++i) {
    EXPECT_EQ(found.instances[i].classes, whole.instances[i].classes);
    EXPECT_EQ(found.instances[i].final, whole.instances[i].final);
  }
}

/// Believes that things move at a third of their speed: a ninth of their energy.
class Careless final : public Certifier {
 public:
  explicit Careless(const Certifier& of) : of_(of) {}
  std::optional<std::vector<int>> classes(const belief::WorldState& state, double seconds_left) const override {
    belief::WorldState slower = state;
    for (belief::ObjectState& object : slower.objects) {
      object.V_WO.linear /= 3.0;
      object.V_WO.angular /= 3.0;
    }
    return of_.classes(slower, seconds_left);
  }

 private:
  const Certifier& of_;
};

TEST(Certificates, ThatTakeEnergyForLessAreCaughtAndRepaired) {
  for (const std::size_t which : {2U, 3U}) {
    const tests::NamedScene named = tests::uncertain_scenes()[which];
    const Problem problem(named.scene);
    const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
    const Careless careless(*certifier);
    const OutcomeEstimate whole = problem.run_exactly(1024, nullptr, 0.0);
    const OutcomeEstimate certified = problem.run_exactly(1024, &careless, 0.0);
    const int wrong = classed_otherwise(certified, whole);
    EXPECT_GT(wrong, 10) << named.name;
    // One in forty is wrong in C: an audit of 2 % would have to be lucky.
    const OutcomeEstimate audited = problem.run_exactly(1024, &careless, 0.2);
    EXPECT_GT(audited.certificates.mismatches, 0) << named.name;
    EXPECT_TRUE(audited.certificates.switched_off) << named.name;
    EXPECT_EQ(audited.variables, whole.variables) << named.name;
  }
}

TEST(Certificates, GiveTheSameBitsForAnyNumberOfThreads) {
  const Problem problem(tests::uncertain_scenes()[0].scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  EstimatorOptions options;
  options.tolerance = 0.05;
  options.certifier = certifier.get();
  options.audit_share = 0.1;
  const OutcomeEstimate one = problem.run(options, 1);
  const OutcomeEstimate two = problem.run(options, 2);
  EXPECT_GT(one.certificates.audited, 0);
  EXPECT_EQ(one.certificates, two.certificates);
  EXPECT_EQ(one.variables, two.variables);
  EXPECT_EQ(one.simulated_seconds, two.simulated_seconds);
  ASSERT_EQ(one.instances.size(), two.instances.size());
  for (std::size_t i = 0; i < one.instances.size(); ++i) {
    EXPECT_EQ(one.instances[i].classes, two.instances[i].classes);
    EXPECT_EQ(one.instances[i].final, two.instances[i].final);
  }
}

TEST(Certificates, OfAlwaysTheSameOutcomeLeaveAnIntervalOfSomeWidth) {
  auto scene = std::make_shared<belief::Scene>(tests::tumbling_box());
  scene->exclusive_outcomes.clear();
  scene->outcomes = {{"below", "box", {belief::Condition{belief::BelowHeight{2.0}}}}};
  const Problem problem(scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  const OutcomeEstimate found = problem.run_exactly(64, certifier.get(), 0.02);
  EXPECT_EQ(found.certificates.certified, 64);
  EXPECT_EQ(found.variables[0].classes[0].probability, 1.0);
  EXPECT_GT(found.variables[0].classes[0].half_width, 0.005);
}

TEST(Certificates, AreNotGivenForWhatTheyDoNotUnderstand) {
  const auto none_for = [](belief::Condition condition) {
    auto scene = std::make_shared<belief::Scene>(tests::tumbling_box());
    scene->outcomes = {{"asked", "box", {std::move(condition)}}};
    const Problem problem(scene);
    return make_certifier(problem.scene, problem.variables, problem.request) == nullptr;
  };
  EXPECT_TRUE(none_for({belief::MovedMoreThan{0.1}}));
  EXPECT_TRUE(none_for({belief::Touched{"floor"}}));
  EXPECT_TRUE(none_for({belief::StillMoving{}}));
  EXPECT_TRUE(none_for({belief::BelowHeight{0.1}, belief::When::kEver}));
  EXPECT_FALSE(none_for({belief::BelowHeight{0.1}}));

  auto scene = std::make_shared<belief::Scene>(tests::tumbling_box());
  scene->gravity_W = {0.5, 0.0, -9.7};
  const Problem problem(scene);
  EXPECT_EQ(make_certifier(problem.scene, problem.variables, problem.request), nullptr);
}

/// The scene with spheres instead of its boxes.
std::shared_ptr<belief::Scene> of_spheres(const belief::Scene& scene) {
  auto packed = std::make_shared<belief::Scene>(scene);
  for (belief::ObjectModel& model : packed->models) {
    belief::MeshShape shape;
    shape.mesh = std::make_shared<const geometry::TriangleMesh>(belief::collision_mesh(model));
    shape.use = belief::MeshUse::kSpheres;
    shape.spheres = {600, 0.001};
    model.collision = {shape};
  }
  return packed;
}

/// An open cup, slid and tilted towards the edge of a table: it stands, lies or falls.
belief::Scene shoved_cup() {
  belief::Scene scene = tests::bottle_at_edge();
  scene.name = "shoved_cup";
  belief::MeshShape cup;
  cup.mesh = std::make_shared<const geometry::TriangleMesh>(
      geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.04, 0.09}, {0.036, 0.09}, {0.031, 0.005}, {0.0, 0.005}}, 32));
  cup.use = belief::MeshUse::kSpheres;
  cup.spheres = {800, 0.001};
  scene.models[0].collision = {cup};
  scene.models[0] = *belief::with_derived_properties(scene.models[0]);
  auto& pose = std::get<belief::NormalPose>(scene.objects[0].pose);
  pose.mean.translation = {-0.06, 0.0, 0.01};
  return scene;
}

class CertificatesOfSpheres : public testing::TestWithParam<int> {};

TEST_P(CertificatesOfSpheres, AreRightWhenInstancesRunOnToRest) {
  const std::vector<tests::NamedScene> scenes = tests::uncertain_scenes();
  const std::shared_ptr<const belief::Scene> of_boxes[] = {scenes[0].scene, scenes[2].scene};
  const int which = GetParam();
  const Problem problem(which < 2 ? of_spheres(*of_boxes[which]) : std::make_shared<belief::Scene>(shoved_cup()));
#ifdef NDEBUG
  const int count = 1000;
#else
  const int count = 60;
#endif
  ShapeStore shapes;
  CertifierOptions options;
  options.shapes = &shapes;
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request, options);
  ASSERT_TRUE(certifier);
  const OutcomeEstimate whole = problem.run_exactly(count, nullptr, 0.0);
  const OutcomeEstimate certified = problem.run_exactly(count, certifier.get(), 0.0);
  const int wrong = classed_otherwise(certified, whole);
  EXPECT_LE(wrong, 0) << problem.scene->name;
  EXPECT_GE(certified.certificates.certified, count * 6 / 10) << problem.scene->name;
  EXPECT_LT(certified.simulated_seconds, 0.85 * whole.simulated_seconds) << problem.scene->name;
}
INSTANTIATE_TEST_SUITE_P(OfScenes, CertificatesOfSpheres, testing::Range(0, 3));

TEST(Certificates, ThatKnowOfNoSpheresAreNotGivenWhereThereAreSome) {
  const std::shared_ptr<const belief::Scene> scene = of_spheres(tests::shoved_stack());
  const auto variables = variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
  EXPECT_FALSE(make_certifier(scene, variables, {}));
  ShapeStore shapes;
  CertifierOptions options;
  options.shapes = &shapes;
  EXPECT_TRUE(make_certifier(scene, variables, {}, options));
  // Of supports nothing is known that holds between spheres.
  auto on_spheres = std::make_shared<belief::Scene>(*scene);
  on_spheres->supports[0].collision = scene->models[1].collision;
  EXPECT_FALSE(make_certifier(on_spheres, variables, {}, options));
}

TEST(Certificates, KnowWhereTheWorldEnds) {
  // Some bottles fall from the table and for ever, until they leave the world and are frozen there.
  auto scene = std::make_shared<belief::Scene>(tests::bottle_at_edge());
  scene->supports.pop_back();
  for (const double depth : {0.3, 0.8, 1.5}) {
    scene->outcomes = {{"deep", scene->objects[0].name, {{belief::BelowHeight{-depth}}}}};
    scene->exclusive_outcomes = {};
    for (const double world_radius : {0.2, 0.5, 1.0, 4.0}) {
      Problem problem(scene);
      problem.request.stop.world_radius = world_radius;
      const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
      ASSERT_TRUE(certifier);
      const OutcomeEstimate whole = problem.run_exactly(200, nullptr, 0.0);
      const OutcomeEstimate certified = problem.run_exactly(200, certifier.get(), 0.0);
      EXPECT_EQ(classed_otherwise(certified, whole), 0) << depth << " m below in a world of " << world_radius << " m";
      if (world_radius == 4.0) {
        EXPECT_GT(certified.certificates.certified, 150);
      }
    }
  }
}

/// Scene B with a bottle that rolls on its side at `speed` (m/s) towards the table's edge, `way` (m) from it.
std::optional<std::vector<int>> certified_while_rolling(double rolling_friction, double way, double speed) {
  auto scene = std::make_shared<belief::Scene>(tests::bottle_at_edge());
  scene->models[0].contact.rolling_friction = rolling_friction;
  const Problem problem(scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  belief::WorldState state = belief::mean_start(*scene);
  state.objects[0].X_WO.rotation = geometry::exp_rotation({1.5707963267948966, 0.0, 0.0});
  state.objects[0].X_WO.translation = {-way, 0.0, 0.035};
  state.objects[0].V_WO.linear = {speed, 0.0, 0.0};
  state.objects[0].V_WO.angular = {0.0, speed / 0.035, 0.0};
  return certifier->classes(state, 4.0);
}

TEST(Certificates, OfWhatRollsNeedFrictionThatStopsIt) {
  const std::vector<int> lies = {2};  // neither falls nor stands
  EXPECT_EQ(certified_while_rolling(0.001, 0.2, 0.1), lies);
  // It rolls 3/2 v^2 / (2 g) / (1 mm / 35 mm) = 2.7 v^2.
  EXPECT_FALSE(certified_while_rolling(0.001, 0.02, 0.1));
  EXPECT_FALSE(certified_while_rolling(0.001, 0.2, 0.3));
  EXPECT_FALSE(certified_while_rolling(0.0, 0.2, 0.01));
}

TEST(Certificates, OfWhatStandsEndAtTheEdge) {
  const Problem problem(tests::uncertain_scenes()[1].scene);
  const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
  belief::WorldState state = belief::mean_start(*problem.scene);
  state.objects[0].X_WO = geometry::Pose::from_translation({-0.2, 0.0, 0.12});
  state.objects[0].V_WO = {};
  EXPECT_EQ(certifier->classes(state, 4.0), std::vector<int>{1});
  // Half of its foot beyond the edge it is not sure.
  state.objects[0].X_WO.translation.x() = -0.001;
  EXPECT_FALSE(certifier->classes(state, 4.0));
}

TEST(Certificates, OfWhatTipsOverAnEdgeNeedItsCentreBeyondIt) {
  auto scene = std::make_shared<belief::Scene>(tests::bottle_at_edge());
  const auto classes = [&](double beyond, double speed_out, double spin_out, double speed_up) {
    const Problem problem(scene);
    const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
    belief::WorldState state = belief::mean_start(*scene);
    state.objects[0].X_WO = {geometry::exp_rotation({0.0, 0.8, 0.0}), {beyond, 0.0, 0.09}};
    state.objects[0].V_WO.linear = {speed_out, 0.0, speed_up};
    state.objects[0].V_WO.angular = {0.0, spin_out, 0.0};
    return certifier->classes(state, 4.0);
  };
  const std::vector<int> falls = {0};
  EXPECT_EQ(classes(0.01, 0.1, 1.0, -0.1), falls);
  EXPECT_FALSE(classes(0.003, 0.1, 1.0, -0.1));  // too near above the edge
  EXPECT_FALSE(classes(0.01, -0.1, 1.0, -0.1));  // on its way back
  EXPECT_FALSE(classes(0.01, 0.1, -1.0, -0.1));  // turns back
  EXPECT_FALSE(classes(0.01, 0.1, 1.0, 0.1));    // rises
  // What is not convex may hang by a hook.
  belief::ObjectModel& bottle = scene->models[0];
  bottle.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.01, 0.01, 0.01}}, {}});
  EXPECT_FALSE(classes(0.01, 0.1, 1.0, -0.1));
  // Between two tables it may get stuck.
  bottle.collision.pop_back();
  belief::Support second = scene->supports[0];
  second.name = "second_table";
  second.X_WS.translation.x() = 1.1;
  scene->supports.push_back(second);
  EXPECT_FALSE(classes(0.01, 0.1, 1.0, -0.1));
}

/// A box on a support, sliding off along x, and what is asked of it.
std::shared_ptr<belief::Scene> slid_off(const geometry::Vector3d& size, belief::Support under, double start_x,
                                        const belief::NormalScalar& speed, const belief::ScalarDistribution& friction,
                                        const belief::Predicate& asked) {
  auto scene = std::make_shared<belief::Scene>(tests::tumbling_box());
  belief::ObjectModel model;
  model.name = "box";
  model.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{size}, {}});
  model.mass = belief::FixedScalar{0.3};
  model.contact.friction = friction;
  scene->models = {*belief::with_derived_properties(std::move(model))};
  belief::SceneObject& box = scene->objects[0];
  box.pose = belief::FixedPose{geometry::Pose::from_translation({start_x, 0.0, 0.5 * size.z()})};
  box.twist = {};
  box.twist.linear = {speed, belief::FixedScalar{0.0}, belief::FixedScalar{0.0}};
  scene->supports.insert(scene->supports.begin(), std::move(under));
  scene->exclusive_outcomes.clear();
  scene->outcomes = {{"asked", "box", {belief::Condition{asked}}}};
  return scene;
}

belief::Support block_below(const std::string& name, double half_width, double height) {
  belief::Support block;
  block.name = name;
  block.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{{2.0 * half_width, 2.0 * half_width, height}}, {}});
  block.X_WS = geometry::Pose::from_translation({-half_width, 0.0, -0.5 * height});
  block.contact.friction = belief::FixedScalar{1.0};
  return block;
}

TEST(Certificates, LeaveTimeForWhatHasStillToHappen) {
  const geometry::Vector3d cube(0.06, 0.06, 0.06), slab(0.2, 0.2, 0.05), board(0.3, 0.1, 0.02);
  // Falls of more than a second; slabs that still slide at the end; boards that tip off a step and lean on it.
  auto deep = slid_off(cube, block_below("table", 0.2, 0.04), 0.0, {0.6, 0.3}, belief::FixedScalar{0.5},
                       belief::BelowHeight{-9.0});
  deep->supports.pop_back();
  deep->duration = 1.6;
  auto sliding = slid_off(slab, block_below("floor", 10.0, 0.1), -10.0, {0.3, 0.1}, belief::UniformScalar{0.02, 0.5},
                          belief::RestingOn{"floor"});
  sliding->supports.pop_back();
  sliding->duration = 1.2;
  auto leaning = slid_off(board, block_below("step", 0.2, 0.05), 0.05, {0.9, 0.3},
                          belief::NormalScalar{0.12, 0.05, 0.02, 1.0}, belief::RestingOn{"step"});
  leaning->supports.back().X_WS.translation.z() -= 0.05;
  for (const auto& scene : {deep, sliding, leaning}) {
    ASSERT_TRUE(validate(*scene).ok()) << validate(*scene).message();
    const Problem problem(scene);
    const auto certifier = make_certifier(problem.scene, problem.variables, problem.request);
    ASSERT_TRUE(certifier);
#ifdef NDEBUG
    constexpr int kCount = 1024;
#else
    constexpr int kCount = 128;
#endif
    const OutcomeEstimate whole = problem.run_exactly(kCount, nullptr, 0.0);
    const OutcomeEstimate certified = problem.run_exactly(kCount, certifier.get(), 0.0);
    EXPECT_LE(classed_otherwise(certified, whole), 1) << scene->outcomes[0].all_of[0].predicate.index();
    EXPECT_GT(certified.certificates.certified, kCount / 2) << scene->outcomes[0].all_of[0].predicate.index();
  }
}

}  // namespace
}  // namespace prescene::simulation
