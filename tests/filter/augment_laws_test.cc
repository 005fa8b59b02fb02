// SPDX-License-Identifier: Apache-2.0
// What is looked for beyond the belief: recovery, hidden places and new objects, on frames whose truth is known, and
// against what each promises for any frame.
#include "prescene/filter/operators/augment.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "filter_fixture.h"
#include "prescene/geometry/primitives.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::ObjectBelief;
using belief::Particle;

double total_weight(const std::vector<Particle>& particles) {
  return std::accumulate(particles.begin(), particles.end(), 0.0,
                         [](double sum, const Particle& particle) { return sum + std::exp(particle.log_weight); });
}

/// How many particles of `before` are no more.
int replaced(const std::vector<Particle>& before, const std::vector<Particle>& after) {
  return static_cast<int>(std::ranges::count_if(before, [&](const Particle& old) {
    return std::ranges::none_of(after, [&](const Particle& particle) { return particle.X_WO == old.X_WO; });
  }));
}

TEST(WantsRecovery, CountsTurnsByHand) {
  AugmentOptions options;
  options.recover_after_frames = 4;
  options.recover_every = 3;
  options.suspicious_share = 0.75;
  options.suspicious_every = 10;
  options.short_share = 0.8;
  const auto turns = [&options](int frames_unseen, double visible_share, double evidence = 5.0) {
    ObjectBelief object;
    object.frames_unseen = frames_unseen;
    object.visible_share = visible_share;
    object.evidence_per_pixel = evidence;
    std::vector<std::uint64_t> frames;
    for (std::uint64_t frame = 0; frame < 31; ++frame)
      if (wants_recovery(options, object, 5.0, frame)) frames.push_back(frame);
    return frames;
  };
  EXPECT_THAT(turns(4, 1.0), testing::ElementsAre(0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30));
  EXPECT_EQ(turns(400, 0.0), turns(4, 1.0));
  EXPECT_THAT(turns(3, 0.74), testing::ElementsAre(0, 10, 20, 30));
  EXPECT_THAT(turns(3, 0.75), testing::IsEmpty());
  EXPECT_THAT(turns(0, 1.0), testing::IsEmpty());
  EXPECT_THAT(turns(0, 1.0, 3.9), testing::ElementsAre(0, 10, 20, 30));
  EXPECT_THAT(turns(0, 1.0, 4.1), testing::IsEmpty());
  options.recover_every = 0;  // as often as can be
  EXPECT_EQ(turns(4, 1.0).size(), 31u);
}

/// A box on the table, at a place that is known to the test and not to the belief.
class ABox : public ::testing::Test {
 protected:
  void see(const Pose& X_WO, const std::vector<Occluder>& occluders = {}) {
    sequence_ = still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {X_WO});
    sequence_.occluders = occluders;
    observation_ = sequence_.observe(30, *backends_.renderer);
    frame_ = backends_.frame_of(sequence_.scene, observation_);
    target_ = target_of(sequence_.scene->models[0], frame_, backends_.tools);
  }
  static ObjectBelief believed_at(const Pose& X_WO, core::TimeNs last_seen_ns) {
    ObjectBelief object;
    object.name = "box";
    object.particles = particles_about(X_WO, MotionMode::kResting, 16, {}, {4, core::Purpose::kStartBelief});
    core::RandomStream stream(9, core::Purpose::kTest);
    for (Particle& particle : object.particles) particle.log_weight = stream.uniform(-2.0, 0.0);
    belief::normalize(object.particles);
    object.last_seen_ns = last_seen_ns;
    return object;
  }
  rendering::PoseEvidence evidence_of(const Pose& X_WO) const {
    const auto pose = hypothesis(target_, frame_.X_CW * X_WO);
    rendering::PoseEvidence evidence;
    const auto workspace = backends_.likelihood->make_workspace();
    backends_.likelihood->evaluate(frame_.terms, std::span(&pose, 1), *workspace, std::span(&evidence, 1));
    return evidence;
  }
  bool recovered(ObjectBelief& object, const AugmentOptions& options = {}) {
    const rendering::PoseEvidence current = evidence_of(belief::heaviest(object.particles).X_WO);
    return recover(frame_, frame_.terms, target_, current, options, {}, {}, backends_.tools,
                   {6, core::Purpose::kRecovery}, object);
  }
  int hidden_proposed(ObjectBelief& object, const AugmentOptions& options = {}) {
    return propose_hidden(frame_, frame_.terms, target_, sequence_.scene->gravity_W, options, {}, {}, backends_.tools,
                          {6, core::Purpose::kRecovery}, object);
  }

  const Pose X_WO_{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, 0.10, 0.09}};
  Backends backends_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
  FilterFrame frame_;
  SearchTarget target_;
};

const Pose kElsewhere = Pose::from_translation({-0.05, -0.18, 0.09});
constexpr core::TimeNs kLongAgo = -60'000'000'000;

TEST_F(ABox, IsRecoveredWhereItStandsByTheLeastProbableHalf) {
  see(X_WO_);
  ObjectBelief object = believed_at(kElsewhere, kLongAgo);
  const std::vector<Particle> before = object.particles;
  ASSERT_TRUE(recovered(object));
  ASSERT_EQ(object.particles.size(), before.size());
  const Vector3d centre = X_WO_ * target_.centre();
  EXPECT_LT((belief::heaviest(object.particles).X_WO * target_.centre() - centre).norm(), 0.015);
  EXPECT_NEAR(total_weight(object.particles), 1.0, 1e-9);
  EXPECT_EQ(replaced(before, object.particles), 8);

  std::vector<Particle> heaviest_before = before;
  std::ranges::sort(heaviest_before, std::greater(), &Particle::log_weight);
  double found_weight = 0.0;
  std::vector<double> shifts;
  for (const Particle& particle : object.particles) {
    const auto old = std::ranges::find(before, particle.X_WO, &Particle::X_WO);
    if (old == before.end()) {
      found_weight += std::exp(particle.log_weight);
      EXPECT_LT((particle.X_WO * target_.centre() - centre).norm(), 0.06);  // 0.6 cm a direction and the find's error
      continue;
    }
    EXPECT_GE(old->log_weight, heaviest_before[7].log_weight);
    EXPECT_EQ(particle.covariance, old->covariance);
    shifts.push_back(particle.log_weight - old->log_weight);
  }
  EXPECT_GT(found_weight, 0.9 - 1e-9);
  // Those that stay have less, and keep their weights relative to each other.
  for (const double shift : shifts) {
    EXPECT_LT(shift, 0.0);
    EXPECT_NEAR(shift, shifts[0], 1e-9);
  }
}

TEST_F(ABox, IsNotRecoveredWhereItIsNotAndNothingChanges) {
  see(Pose::from_translation({0.0, 0.0, 5.0}));  // behind the camera: an empty table
  ObjectBelief object = believed_at(kElsewhere, kLongAgo);
  const ObjectBelief before = object;
  EXPECT_FALSE(recovered(object));
  EXPECT_EQ(object, before);
}

TEST_F(ABox, IsNotRecoveredInsideASupportThatLooksLikeItsTop) {
  see(Pose::from_translation({0.0, 0.0, 5.0}));
  // The table is 5 mm higher than the scene says, and so is all of it the top of a flat box that lies in the table.
  geometry::DepthImage higher = *observation_.frame.depth;
  const Vector3d up_C = frame_.X_CW.rotation * Vector3d::UnitZ();
  const Vector3d p_CT = frame_.X_CW * Vector3d(0.0, 0.0, 0.005);
  for (int y = 0; y < higher.height(); ++y)
    for (int x = 0; x < higher.width(); ++x) {
      const Vector3d ray = observation_.frame.camera.unproject(x, y, 1.0);
      if (higher(x, y) > 0.0F) higher(x, y) = static_cast<float>(up_C.dot(p_CT) / up_C.dot(ray));
    }
  observation_.frame.depth = std::make_shared<const geometry::DepthImage>(std::move(higher));
  frame_ = backends_.frame_of(sequence_.scene, observation_);
  target_ = target_of(sequence_.scene->models[0], frame_, backends_.tools);
  // The search begins near there.
  ObjectBelief object = believed_at(Pose::from_translation({0.02, 0.10, -0.085}), observation_.stamp_ns);
  AugmentOptions eager;
  eager.accept_evidence = 0.1;
  eager.accept_log_ratio = 1.0;
  EXPECT_FALSE(recovered(object, eager));
}

TEST_F(ABox, IsNotRecoveredFromWhereItIsExplainedAsWell) {
  see(X_WO_);
  ObjectBelief object = believed_at(kElsewhere, kLongAgo);
  const ObjectBelief before = object;
  // As good as at the truth already, and the least gain is more than what noise makes of a better pose.
  const rendering::PoseEvidence there = evidence_of(X_WO_);
  AugmentOptions options;
  options.min_gain = 0.5 * there.log_ratio;
  EXPECT_FALSE(recover(frame_, frame_.terms, target_, there, options, {}, {}, backends_.tools,
                       {6, core::Purpose::kRecovery}, object));
  EXPECT_EQ(object, before);
}

// Some pixels more that fit by chance do not move what is tracked by centimetres.
TEST_F(ABox, WhatIsTrackedJumpsOnlyWhereTheFrameSaysSoTheMoreTheFurtherItIs) {
  see(X_WO_);
  const rendering::PoseEvidence there = evidence_of(X_WO_);
  const auto jumps = [&](double distance, double gain, belief::TrackState state) {
    Pose aside = X_WO_;
    aside.translation.x() += distance;
    ObjectBelief object = believed_at(aside, frame_.stamp_ns);
    object.state = state;
    rendering::PoseEvidence current = there;
    current.tempered -= gain;
    current.log_ratio -= 2.0 * AugmentOptions().min_gain;
    return recover(frame_, frame_.terms, target_, current, {}, {}, {}, backends_.tools, {6, core::Purpose::kRecovery},
                   object);
  };
  EXPECT_FALSE(jumps(0.06, 8.0, belief::TrackState::kTracked));
  EXPECT_TRUE(jumps(0.06, 30.0, belief::TrackState::kTracked));
  EXPECT_TRUE(jumps(0.02, 10.0, belief::TrackState::kTracked));
  EXPECT_TRUE(jumps(0.06, 8.0, belief::TrackState::kUnseen));
}

TEST_F(ABox, AFindOutOfReachNeedsMoreEvidence) {
  see(X_WO_);
  AugmentOptions options;
  options.far_evidence = 1e6;
  ObjectBelief just_seen = believed_at(kElsewhere, frame_.stamp_ns);
  EXPECT_FALSE(recovered(just_seen, options));
  // In a second it can have gone the 0.29 m that the two places are apart.
  ObjectBelief seen_before = believed_at(kElsewhere, frame_.stamp_ns - 1'000'000'000);
  EXPECT_TRUE(recovered(seen_before, options));
  options.reach_speed = 0.1;
  ObjectBelief slow = believed_at(kElsewhere, frame_.stamp_ns - 1'000'000'000);
  EXPECT_FALSE(recovered(slow, options));
}

// As of an arm that no scene knows, of which more can be seen than of what it holds.
TEST_F(ABox, WhatIsSeenIsNotOutOfReachOfThereHoweverMuchLooksLikeIt) {
  const Vector3d size(0.06, 0.10, 0.18);
  sequence_ = still_sequence({box_model("box", size), box_model("looks_like_it", size)}, {X_WO_, kElsewhere});
  // Hides the lower half of the box.
  const Vector3d towards_camera = (sequence_.X_WC.translation - X_WO_.translation).normalized();
  Pose X_WM = X_WO_;
  X_WM.translation += 0.12 * Vector3d(towards_camera.x(), towards_camera.y(), 0.0).normalized();
  X_WM.translation.z() = 0.05;
  sequence_.occluders = {
      {geometry::make_mesh(geometry::BoxShape{{0.16, 0.16, 0.10}}), [X_WM](double) { return X_WM; }}};
  observation_ = sequence_.observe(30, *backends_.renderer);
  frame_ = backends_.frame_of(sequence_.scene, observation_);
  target_ = target_of(sequence_.scene->models[0], frame_, backends_.tools);
  ASSERT_GT(evidence_of(kElsewhere).log_ratio, evidence_of(X_WO_).log_ratio + AugmentOptions().min_gain);
  ASSERT_GT(evidence_of(X_WO_).log_ratio, AugmentOptions().accept_log_ratio);
  ObjectBelief just_seen = believed_at(X_WO_, frame_.stamp_ns);
  EXPECT_FALSE(recovered(just_seen));
  // Nor after a frame in which it was not seen.
  ObjectBelief missed = believed_at(X_WO_, frame_.stamp_ns - 33'000'000);
  EXPECT_FALSE(recovered(missed));
  // Where nothing like it is seen, it may have been wrong all along.
  ObjectBelief wrong = believed_at(Pose::from_translation({0.2, -0.05, 0.09}), frame_.stamp_ns);
  EXPECT_TRUE(recovered(wrong));
}

TEST_F(ABox, IsNotRecoveredInAnArmThatStandsALittleAsideOfWhereItIsSaidToBe) {
  see(X_WO_);  // or an arm of its size, with its pose said to be 2 cm farther from the camera
  auto scene = std::make_shared<belief::Scene>(*sequence_.scene);
  belief::KinematicBody arm;
  arm.name = "arm";
  arm.collision = scene->models[0].collision;
  scene->robot = {arm};
  const auto recovered_with_arm_at = [&](const Pose& X_WG) {
    frame_ = backends_.frame_of(scene, observation_, {{X_WG}});
    target_ = target_of(scene->models[0], frame_, backends_.tools);
    ObjectBelief object = believed_at(kElsewhere, kLongAgo);
    return recovered(object);
  };
  Pose aside = X_WO_;
  aside.translation += 0.02 * (X_WO_.translation - sequence_.X_WC.translation).normalized();
  EXPECT_FALSE(recovered_with_arm_at(aside));
  EXPECT_TRUE(recovered_with_arm_at(Pose::from_translation({0.0, 0.0, 3.0})));
}

TEST_F(ABox, UnexplainedAreItsPixelsUntilItIsKnown) {
  see(X_WO_);
  const std::vector<Vector3d> points = unexplained_points(frame_, frame_.terms, 0.015);
  const auto on_the_box = [&](const Vector3d& point) {
    const Vector3d p_O = (frame_.X_CW * X_WO_).inverse() * point;
    return (p_O.cwiseAbs() - Vector3d(0.03, 0.05, 0.09)).maxCoeff() < 0.02;
  };
  const auto its = std::ranges::count_if(points, on_the_box);
  const geometry::DepthImage alone = depth_of(target_, frame_.X_CW * X_WO_, frame_.terms.camera, *backends_.renderer);
  const auto covered = std::count_if(alone.data(), alone.data() + alone.size(), [](float z) { return z > 0.0f; });
  EXPECT_GT(static_cast<double>(its), 0.7 * static_cast<double>(covered));
  EXPECT_LE(its, covered);
  // The camera's false returns are points, too, wherever they are.
  const auto measured = std::count_if(frame_.terms.depth.data(), frame_.terms.depth.data() + frame_.terms.depth.size(),
                                      [&](float z) { return z > 0.0f && z < frame_.terms.model.options().max_depth; });
  const auto others = static_cast<std::ptrdiff_t>(points.size()) - its;
  EXPECT_LT(static_cast<double>(others), 0.01 * static_cast<double>(measured));

  rendering::FrameTerms known;
  with_known_surfaces(frame_.terms, alone, &known);
  const std::vector<Vector3d> left = unexplained_points(frame_, known, 0.015);
  EXPECT_LT(std::ranges::count_if(left, on_the_box), its / 20);
  EXPECT_LE(left.size(), static_cast<std::size_t>(others + its / 20));
  EXPECT_EQ(unexplained_points(frame_, frame_.terms, 10.0).size(), 0u);
  // What nothing is known about is unexplained, however wide the tolerance.
  rendering::FrameTerms nothing = frame_.terms;
  std::fill(nothing.absent_peak.data(), nothing.absent_peak.data() + nothing.absent_peak.size(), 0.0f);
  EXPECT_EQ(unexplained_points(frame_, nothing, 10.0).size(), static_cast<std::size_t>(measured));
}

TEST_F(ABox, HiddenPlacesAreHiddenFreeAndFewEnough) {
  // It was seen in the open just before; now nothing is there, but a plate stands beside that place.
  const Pose beside = X_WO_ * Pose::from_translation({0.05, 0.0, 0.0});
  see(Pose::from_translation({0.0, 0.0, 5.0}), {plate(test_camera_pose(), fixed(beside), 0.15, 0.16, 0.30, 0.0, 10.0)});
  ObjectBelief object = believed_at(X_WO_, frame_.stamp_ns - 200'000'000);
  object.frames_refuted = 1;
  const std::vector<Particle> before = object.particles;
  AugmentOptions options;
  options.hidden_share = 0.25;
  const int placed = hidden_proposed(object, options);
  EXPECT_GT(placed, 0);
  EXPECT_LE(placed, 4);
  EXPECT_EQ(replaced(before, object.particles), placed);
  EXPECT_NEAR(total_weight(object.particles), 1.0, 1e-9);
  const double fall = std::min(0.3, 0.5 * 9.81 * 0.2 * 0.2);
  for (const Particle& particle : object.particles) {
    if (std::ranges::find(before, particle.X_WO, &Particle::X_WO) != before.end()) continue;
    EXPECT_EQ(particle.mode, MotionMode::kMoving);
    EXPECT_EQ(frame_.surfaces->overlap(*target_.mesh, particle.X_WO, WeightOptions().support_tolerance), 0.0);
    const Vector3d from = X_WO_ * target_.centre(), to = particle.X_WO * target_.centre();
    EXPECT_FALSE(frame_.surfaces->crosses(from, to));
    EXPECT_LT((to - from).norm(), 5.0 * (0.06 + 0.2 * 0.3) + fall);  // of a standard deviation that grows by 0.3 m/s
    // Of its pixels, few have nothing measured in front of them.
    const geometry::DepthImage there =
        depth_of(target_, frame_.X_CW * particle.X_WO, frame_.terms.camera, *backends_.renderer);
    int measured = 0, in_the_open = 0;
    for (int y = 0; y < there.height(); ++y)
      for (int x = 0; x < there.width(); ++x) {
        if (there(x, y) == 0.0f || frame_.terms.depth(x, y) == 0.0f) continue;
        ++measured;
        in_the_open += frame_.terms.depth(x, y) > there(x, y) - 0.02f;
      }
    EXPECT_GT(measured, 0);
    EXPECT_LT(in_the_open, 0.45 * measured);
  }
}

TEST_F(ABox, NoPlaceIsHiddenOnAnEmptyTable) {
  see(Pose::from_translation({0.0, 0.0, 5.0}));
  ObjectBelief object = believed_at(X_WO_, frame_.stamp_ns - 33'000'000);
  const std::vector<Particle> before = object.particles;
  EXPECT_EQ(hidden_proposed(object), 0);
  EXPECT_EQ(replaced(before, object.particles), 0);
}

TEST_F(ABox, WhatAHandHoldsIsNotHiddenElsewhere) {
  see(Pose::from_translation({0.0, 0.0, 5.0}), {plate(test_camera_pose(), fixed(X_WO_), 0.15, 0.3, 0.4, 0.0, 10.0)});
  ObjectBelief object = believed_at(X_WO_, frame_.stamp_ns - 200'000'000);
  EXPECT_GT(hidden_proposed(object), 0);
  object = believed_at(X_WO_, frame_.stamp_ns - 200'000'000);
  for (Particle& particle : object.particles) particle.mode = MotionMode::kHeld;
  const std::vector<Particle> before = object.particles;
  EXPECT_EQ(hidden_proposed(object), 0);
  EXPECT_EQ(replaced(before, object.particles), 0);
}

/// A box that is tracked, and a can that nobody knows of.
class Newcomers : public ::testing::Test {
 protected:
  Newcomers() {
    const belief::ObjectModel box = box_model("box", {0.06, 0.10, 0.18}), can = can_model("can", 0.05, 0.16);
    SimulatedSequence sequence = still_sequence({box, can}, {X_W_box_, X_W_can_});
    observation_ = sequence.observe(0, *backends_.renderer);
    auto scene = std::make_shared<belief::Scene>(*sequence.scene);
    scene->objects.pop_back();  // it has the can's model, and no can
    scene_ = scene;
    frame_ = backends_.frame_of(scene_, observation_);
    belief_ = belief_from_priors(scene_, 1, observation_.stamp_ns, {});
    known_ = depth_of(target_of(box, frame_, backends_.tools), frame_.X_CW * X_W_box_, frame_.terms.camera,
                      *backends_.renderer);
  }
  int add(belief::Belief& belief, const geometry::DepthImage& known) {
    return new_objects(frame_, observation_, known, {}, {}, backends_.tools, {5, core::Purpose::kDetection}, belief);
  }

  const Pose X_W_box_ = Pose::from_translation({0.0, -0.15, 0.09});
  const Pose X_W_can_ = Pose::from_translation({0.0, 0.15, 0.08});
  Backends backends_;
  belief::Observation observation_;
  std::shared_ptr<const belief::Scene> scene_;
  FilterFrame frame_;
  belief::Belief belief_;
  geometry::DepthImage known_;
};

TEST_F(Newcomers, AreAddedToTheBeliefAndToACopyOfItsScene) {
  const belief::Belief before = belief_;
  ASSERT_EQ(add(belief_, known_), 1);
  ASSERT_EQ(belief_.objects.size(), 2u);
  EXPECT_EQ(belief_.objects[0], before.objects[0]);
  EXPECT_EQ(before.scene->objects.size(), 1u);
  ASSERT_EQ(belief_.scene->objects.size(), 2u);
  const ObjectBelief& can = belief_.objects[1];
  EXPECT_EQ(can.name, belief_.scene->objects[1].name);
  EXPECT_EQ(can.model, 1);
  EXPECT_EQ(belief_.scene->objects[1].model, 1);
  EXPECT_EQ(can.particles.size(), static_cast<std::size_t>(InitialiseOptions().particles));
  EXPECT_NEAR(total_weight(can.particles), 1.0, 1e-9);
  EXPECT_LT((belief::heaviest(can.particles).X_WO.translation - X_W_can_.translation).norm(), 0.02);
  EXPECT_GT(can.existence, 0.5);
  EXPECT_EQ(can.last_seen_ns, observation_.stamp_ns);
  EXPECT_EQ(can.physics, belief::PhysicalBelief{});  // the priors of its model

  // A second of its kind has a name of its own.
  belief::Belief named = before;
  auto scene = std::make_shared<belief::Scene>(*before.scene);
  scene->objects[0].name = named.objects[0].name = can.name;
  named.scene = scene;
  ASSERT_EQ(add(named, known_), 1);
  EXPECT_NE(named.objects[1].name, can.name);
}

TEST_F(Newcomers, AreNoneWhereAllIsKnown) {
  const SearchTarget can = target_of(scene_->models[1], frame_, backends_.tools);
  merge_nearest(depth_of(can, frame_.X_CW * X_W_can_, frame_.terms.camera, *backends_.renderer), &known_);
  const belief::Belief before = belief_;
  EXPECT_EQ(add(belief_, known_), 0);
  EXPECT_EQ(belief_, before);
  EXPECT_EQ(belief_.scene, before.scene);
}

}  // namespace
}  // namespace prescene::filter_tests
