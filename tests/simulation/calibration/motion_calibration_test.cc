// SPDX-License-Identifier: Apache-2.0
// Motions that were simulated with known properties, recorded with noise.
#include "prescene/simulation/calibration/motion_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/simulation/calibration/find_beginning.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests {
namespace {

using simulation::calibrate_motions;
using simulation::CalibratedParameter;
using simulation::find_beginning;
using simulation::MotionBeginning;
using simulation::MotionCalibration;
using simulation::MotionCalibrationOptions;
using simulation::MotionParameter;
using simulation::MotionPrior;
using simulation::RecordedMotion;
using simulation::TimedPose;
using ::testing::AllOf;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::Lt;

class MotionCalibrationTest : public ::testing::Test {
 protected:
  MotionCalibrationTest() {
    make_simulator_ = [this](const belief::Scene& scene, double) {
      return simulation::make_lockstep_simulator(scene, shapes_, {});
    };
    options_.samples = 8;
    options_.max_evaluations = 150;
    options_.horizon = 0.4;
    options_.checkpoints = 4;
    options_.position_noise = noise_.position;
    options_.rotation_noise = noise_.rotation;
  }

  static std::vector<TimedPose> frames_of(const SimulatedMotion& motion) {
    std::vector<TimedPose> frames;
    for (std::size_t i = 0; i < motion.times.size(); ++i) frames.push_back({motion.times[i], motion.X_WO[i]});
    return frames;
  }

  core::Result<std::vector<RecordedMotion>> begun(const std::vector<SimulatedMotion>& motions) {
    const belief::Scene scene = box_scene({});
    PRESCENE_TRY(const auto simulator, make_simulator_(scene, 1.0));
    std::vector<RecordedMotion> result;
    for (const SimulatedMotion& motion : motions) {
      PRESCENE_TRY(RecordedMotion made, find_beginning("toss " + std::to_string(result.size()), frames_of(motion),
                                                       scene, *simulator, pool_));
      result.push_back(std::move(made));
    }
    return result;
  }

  std::vector<SimulatedMotion> tosses(const BoxTruth& truth, int count) {
    const belief::Scene scene = box_scene(truth);
    return simulated_tosses(scene, **make_simulator_(scene, 1.0), count, core::RandomStream(3, core::Purpose::kTest),
                            pool_, noise_);
  }
  std::vector<SimulatedMotion> slides(const BoxTruth& truth, int count, std::uint64_t seed = 3) {
    const belief::Scene scene = box_scene(truth);
    return simulated_slides(scene, **make_simulator_(scene, 1.0), count, core::RandomStream(seed, core::Purpose::kTest),
                            pool_, noise_);
  }

  /// Of the frictions and restitution; everything else is as it was simulated.
  static MotionPrior contact_prior() {
    MotionPrior prior{};
    prior[0] = {0.3, 0.2};
    prior[1] = {0.3, 0.2};
    prior[2] = {0.2, 0.2};
    prior[4] = {BoxTruth{}.edge_radius, 0.0};
    return prior;
  }

  core::Result<MotionCalibration> calibrated(const std::vector<RecordedMotion>& motions, const MotionPrior& prior,
                                             core::ThreadPool& pool, const core::Cancellation* cancellation = nullptr) {
    return calibrate_motions(motions, box_scene({}), prior, make_simulator_,
                             core::RandomStream(5, core::Purpose::kTest), pool, options_, {}, cancellation);
  }

  TrackerNoise noise_;
  simulation::ShapeStore shapes_;
  core::ThreadPool pool_{1};
  simulation::SimulatorFactory make_simulator_;
  MotionCalibrationOptions options_;
};

TEST_F(MotionCalibrationTest, RecoversFrictionsAndRestitution) {
  const auto motions = begun(tosses({}, 14));
  ASSERT_TRUE(motions.ok()) << motions.status().message();
  const auto found = calibrated(*motions, contact_prior(), pool_);
  ASSERT_TRUE(found.ok()) << found.status().message();
  ASSERT_EQ(found->parameters.size(), 3U);
  const double truth[] = {0.22, 0.16, 0.3};
  for (std::size_t i = 0; i < 3; ++i) {
    const CalibratedParameter& p = found->parameters[i];
    // Four errors: what 90 % intervals promise is counted in docs/reference/calibration.md.
    EXPECT_NEAR(p.value, truth[i], 4.0 * p.standard_error) << to_string(p.parameter);
    EXPECT_LT(p.left_of_prior, 0.3) << to_string(p.parameter);
  }
  EXPECT_LT(found->cost, found->start_cost);
}

// As where nature differs from the simulator: starts scatter far more than the tracker's noise says.
TEST_F(MotionCalibrationTest, FindsStartsThatAreFarLessCertainThanTheTracker) {
  const auto motions = begun(tosses({}, 14));
  ASSERT_TRUE(motions.ok()) << motions.status().message();
  options_.position_noise = noise_.position / 100.0;
  options_.rotation_noise = noise_.rotation / 100.0;
  const auto found = calibrated(*motions, contact_prior(), pool_);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_THAT(found->start_noise, AllOf(Gt(20.0), Lt(300.0)));  // 1.5 where searches begin with little noise only
  EXPECT_LT(found->friction_scatter, 0.06);
}

TEST_F(MotionCalibrationTest, AnyNumberOfThreadsGivesTheSameBits) {
  const auto motions = begun(tosses({}, 8));
  ASSERT_TRUE(motions.ok());
  options_.max_evaluations = 20;
  options_.estimate.most_rounds = 2;
  core::ThreadPool two(2);
  const auto a = calibrated(*motions, contact_prior(), pool_);
  const auto b = calibrated(*motions, contact_prior(), two);
  ASSERT_TRUE(a.ok() && b.ok());
  for (std::size_t i = 0; i < a->parameters.size(); ++i) {
    EXPECT_EQ(a->parameters[i].value, b->parameters[i].value);
    EXPECT_EQ(a->parameters[i].standard_error, b->parameters[i].standard_error);
  }
  EXPECT_EQ(a->cost, b->cost);
}

TEST_F(MotionCalibrationTest, SlidesTellFrictionAndNothingOfRestitution) {
  const auto motions = begun(slides({}, 8));
  ASSERT_TRUE(motions.ok()) << motions.status().message();
  for (const RecordedMotion& motion : *motions) EXPECT_EQ(motion.beginning, MotionBeginning::kSlide);
  MotionPrior prior = contact_prior();
  prior[1] = {BoxTruth{}.impact_friction, 0.0};
  const auto found = calibrated(*motions, prior, pool_);
  ASSERT_TRUE(found.ok()) << found.status().message();
  const CalibratedParameter& friction = found->parameters[0];
  EXPECT_NEAR(friction.value, 0.22, 4.0 * friction.standard_error);
  EXPECT_LT(friction.left_of_prior, 0.2);
  const CalibratedParameter& restitution = found->parameters[1];
  EXPECT_EQ(restitution.left_of_prior, 1.0);
  EXPECT_EQ(restitution.value, 0.2);
  EXPECT_EQ(restitution.standard_error, 0.2);
}

TEST_F(MotionCalibrationTest, NoiseOfSlidesTellsNothingOfRestitution) {
  // Noise lifts starts off the board by 0.1 mm, and they bounce. Of these recordings, that took a tenth to a half of
  // the prior.
  MotionPrior prior = contact_prior();
  prior[1] = {BoxTruth{}.impact_friction, 0.0};
  for (const std::uint64_t seed : {2U, 4U, 16U, 29U}) {
    const auto motions = begun(slides({}, 8, seed));
    ASSERT_TRUE(motions.ok()) << motions.status().message();
    const auto found = calibrated(*motions, prior, pool_);
    ASSERT_TRUE(found.ok()) << found.status().message();
    const CalibratedParameter& friction = found->parameters[0];
    EXPECT_NEAR(friction.value, 0.22, 4.0 * friction.standard_error) << seed;
    EXPECT_LT(friction.left_of_prior, 0.2) << seed;
    EXPECT_EQ(found->parameters[1].left_of_prior, 1.0) << seed;
  }
}

TEST_F(MotionCalibrationTest, EdgesThatNothingIsToldOfAreNotRoundedInside) {
  const auto motions = begun(slides({}, 8));
  ASSERT_TRUE(motions.ok());
  MotionPrior prior = contact_prior();
  prior[1] = {BoxTruth{}.impact_friction, 0.0};
  prior[4] = {0.0, 0.002};  // half of what is believed is below 0
  const auto found = calibrated(*motions, prior, pool_);
  ASSERT_TRUE(found.ok()) << found.status().message();
  const CalibratedParameter& edges = found->parameters.back();
  ASSERT_EQ(edges.parameter, MotionParameter::kEdgeRadius);
  EXPECT_GE(edges.value, 0.0);
  EXPECT_LE(edges.left_of_prior, 1.0);
}

TEST_F(MotionCalibrationTest, LeavesThePlateauWhereAllImpactsGrip) {
  // Spinning balls: with friction above some 0.1 each impact ends their slip, and its value makes no difference.
  constexpr double kRadius = 0.03;
  BoxTruth truth;
  truth.impact_friction = 0.05;
  truth.friction = 0.05;
  truth.restitution = 0.6;
  truth.edge_radius = 0.0;
  belief::Scene scene = box_scene(truth);
  scene.models[0].collision = {belief::PrimitiveShape{geometry::Sphere{kRadius}, geometry::Pose{}}};
  scene.models[0].unit_inertia = 0.4 * kRadius * kRadius * geometry::Matrix3d::Identity();
  const auto simulator = make_simulator_(scene, 1.0);
  ASSERT_TRUE(simulator.ok());
  std::vector<RecordedMotion> motions;
  for (const SimulatedMotion& motion :
       simulated_spins(scene, **simulator, 12, core::RandomStream(3, core::Purpose::kTest), pool_, noise_)) {
    auto begun = find_beginning("toss", frames_of(motion), scene, **simulator, pool_);
    ASSERT_TRUE(begun.ok()) << begun.status().message();
    motions.push_back(*std::move(begun));
  }
  MotionPrior prior{};
  prior[0] = {0.05, 0.0};
  prior[1] = {0.5, 0.2};
  prior[2] = {0.55, 0.2};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto found = calibrate_motions(motions, scene, prior, make_simulator_,
                                         core::RandomStream(seed, core::Purpose::kTest), pool_, options_);
    ASSERT_TRUE(found.ok()) << found.status().message();
    const CalibratedParameter& impact = found->parameters[0];
    EXPECT_NEAR(impact.value, 0.05, 4.0 * impact.standard_error) << seed;
    EXPECT_LT(impact.left_of_prior, 0.1) << seed;
  }
}

TEST_F(MotionCalibrationTest, ACentreThatFlightsTellExactlyStaysThere) {
  noise_ = {0.0, 0.0};
  options_.position_noise = 1e-5;
  options_.rotation_noise = 1e-4;
  const auto motions = begun(tosses({}, 14));
  ASSERT_TRUE(motions.ok()) << motions.status().message();
  MotionPrior prior = contact_prior();
  for (std::size_t i = 5; i < 8; ++i) prior[i] = {0.0, simulation::least_center_error(1e-5)};
  const auto found = calibrated(*motions, prior, pool_);
  ASSERT_TRUE(found.ok()) << found.status().message();
  for (std::size_t i = 3; i < 6; ++i) {
    const CalibratedParameter& center = found->parameters[i];
    EXPECT_NEAR(center.value, 0.0, 2.0 * center.standard_error) << to_string(center.parameter);
    // Never better than a tenth of a tracker's noise.
    EXPECT_GE(center.standard_error, 1e-5) << to_string(center.parameter);
    EXPECT_LE(center.left_of_prior, 1.0) << to_string(center.parameter);
  }
}

TEST_F(MotionCalibrationTest, ASearchThatWasCutHasNotSettled) {
  const auto motions = begun(tosses({}, 14));
  ASSERT_TRUE(motions.ok());
  options_.max_evaluations = 12;
  const auto cut = calibrated(*motions, contact_prior(), pool_);
  ASSERT_TRUE(cut.ok());
  EXPECT_FALSE(cut->settled());
  EXPECT_FALSE(cut->search_settled);
  options_.max_evaluations = 1000;
  const auto whole = calibrated(*motions, contact_prior(), pool_);
  ASSERT_TRUE(whole.ok());
  EXPECT_TRUE(whole->settled());
  EXPECT_LE(whole->cost, cut->cost + 0.1);
}

TEST_F(MotionCalibrationTest, SharedFramesCountOnce) {
  using simulation::error_of_shared_frames;
  // The same told twice: the mean of two equal errors is as large as each.
  EXPECT_NEAR(error_of_shared_frames(1.0, std::sqrt(0.5)), 1.0, 1e-12);
  // Little known before, or little added.
  EXPECT_NEAR(error_of_shared_frames(1e6, 0.01), 0.01, 1e-6);
  EXPECT_NEAR(error_of_shared_frames(1.0, 1.0 - 1e-10), 1.0, 1e-4);
  EXPECT_EQ(error_of_shared_frames(1.0, 1.5), 1.5);
}

TEST_F(MotionCalibrationTest, KeepsDistributionsThatNothingIsToldOf) {
  belief::ObjectModel model = box_scene({}).models[0];
  model.contact.friction = belief::NormalScalar{0.5, 0.2, 0.05, 2.0};
  model.contact.impact_friction.reset();
  model.contact.restitution = belief::UniformScalar{0.2, 0.9};
  MotionCalibration found;
  found.parameters = {
      {MotionParameter::kFriction, 0.3, 0.01, 0.05},     {MotionParameter::kImpactFriction, 0.5, 0.2, 1.0},
      {MotionParameter::kRestitution, 0.55, 0.202, 1.0}, {MotionParameter::kInertiaSize, 0.0, 0.15, 1.0},
      {MotionParameter::kEdgeRadius, 0.002, 0.002, 1.0}, {MotionParameter::kCenterOfMassX, 0.0, 0.006, 1.0}};
  const belief::ObjectModel fitted = calibrated_model(model, found);
  EXPECT_NEAR(belief::mean(fitted.contact.friction), 0.3, 1e-9);
  // What stood for impacts before, not what sliding was found to have.
  ASSERT_TRUE(fitted.contact.impact_friction.has_value());
  EXPECT_EQ(*fitted.contact.impact_friction, model.contact.friction);
  EXPECT_EQ(fitted.contact.restitution, model.contact.restitution);
  EXPECT_EQ(fitted.unit_inertia, model.unit_inertia);
  EXPECT_EQ(fitted.contact.edge_radius, model.contact.edge_radius);
  // A plain number has the prior's deviation now.
  EXPECT_NEAR(belief::variance(fitted.center_of_mass.x), 0.006 * 0.006, 1e-12);
}

TEST_F(MotionCalibrationTest, EdgesAreNoRounderThanTheThinnestPart) {
  belief::ObjectModel coin = box_scene({}).models[0];
  coin.collision = {belief::PrimitiveShape{geometry::Cylinder{0.012, 0.002}, {}}};
  MotionCalibration found;
  found.parameters = {{MotionParameter::kEdgeRadius, 0.0018, 0.0002, 0.1}};
  EXPECT_NEAR(calibrated_model(coin, found).contact.edge_radius, 0.001, 1e-9);
}

TEST_F(MotionCalibrationTest, StopsWhenTold) {
  const auto motions = begun(tosses({}, 8));
  ASSERT_TRUE(motions.ok());
  core::Cancellation cancellation;
  cancellation.request();
  const auto found = calibrated(*motions, contact_prior(), pool_, &cancellation);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.status().code(), core::StatusCode::kCancelled);
}

TEST_F(MotionCalibrationTest, FindsTheFlightBeforeTheFirstContact) {
  const std::vector<SimulatedMotion> simulated = tosses({}, 10);
  const auto motions = begun(simulated);
  ASSERT_TRUE(motions.ok()) << motions.status().message();
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    const RecordedMotion& motion = (*motions)[i];
    EXPECT_EQ(motion.beginning, MotionBeginning::kFlight);
    const double last = motion.frames[motion.first_frames - 1].time;
    EXPECT_LT(last, simulated[i].first_contact) << motion.name;
    EXPECT_GT(last, simulated[i].first_contact - 0.03) << motion.name;
  }
}

TEST_F(MotionCalibrationTest, RefusesBadRecordingsByName) {
  const auto motions = begun(tosses({}, 8));
  ASSERT_TRUE(motions.ok());
  const auto message = [&](const std::vector<RecordedMotion>& changed, const MotionPrior& prior) {
    const auto found = calibrated(changed, prior, pool_);
    return found.ok() ? std::string("accepted") : std::string(found.status().message());
  };
  EXPECT_THAT(message({motions->begin(), motions->begin() + 5}, contact_prior()),
              HasSubstr("only 5 recordings; 3 parameters take at least 6"));
  EXPECT_THAT(message(*motions, MotionPrior{}), HasSubstr("no parameter"));
  auto bad = *motions;
  bad[3].first_frames = 2;
  EXPECT_THAT(message(bad, contact_prior()), HasSubstr("toss 3: it takes three frames of flight"));
  bad = *motions;
  bad[4].frames[7].X_WO.translation.y() = std::nan("");
  EXPECT_THAT(message(bad, contact_prior()), HasSubstr("toss 4: frame 7 is not finite"));
  bad = *motions;
  std::swap(bad[5].frames[2].time, bad[5].frames[3].time);
  EXPECT_THAT(message(bad, contact_prior()), HasSubstr("toss 5: the times do not ascend"));
  bad = *motions;
  bad[6].frames.resize(bad[6].first_frames + 2);
  EXPECT_THAT(message(bad, contact_prior()), HasSubstr("toss 6: it ends before the first checkpoint"));
}

TEST_F(MotionCalibrationTest, RefusesBeginningsThatAreNeitherFlightNorSlide) {
  std::vector<SimulatedMotion> late = tosses({}, 1);
  const auto contact = static_cast<std::ptrdiff_t>(late[0].first_contact * 120.0);
  late[0].times.erase(late[0].times.begin(), late[0].times.begin() + contact - 3);
  late[0].X_WO.erase(late[0].X_WO.begin(), late[0].X_WO.begin() + contact - 3);
  const auto refused = begun(late);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("toss 0: "));
}

}  // namespace
}  // namespace prescene::tests
