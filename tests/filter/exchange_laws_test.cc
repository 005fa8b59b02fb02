// SPDX-License-Identifier: Apache-2.0
// Twins that were taken for each other: what is exchanged, and when.
#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <tuple>
#include <vector>

#include "filter_fixture.h"
#include "prescene/filter/operators/augment.h"

namespace prescene::filter_tests {
namespace {

using belief::ObjectBelief;
using belief::Particle;

ObjectBelief some_object(const std::string& name, int particles, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  ObjectBelief object;
  object.name = name;
  object.model = static_cast<int>(stream.uniform_below(5));
  object.existence = stream.uniform();
  object.state = belief::TrackState::kDoubtful;
  object.evidence_per_pixel = stream.uniform();
  object.visible_share = stream.uniform();
  object.frames_unseen = static_cast<int>(stream.uniform_below(100));
  object.frames_refuted = static_cast<int>(stream.uniform_below(100));
  object.last_seen_ns = static_cast<core::TimeNs>(stream.uniform_below(1000));
  object.island = static_cast<int>(stream.uniform_below(10));
  object.colors.frames = static_cast<int>(stream.uniform_below(50));
  const std::vector<belief::PhysicalDraw> draws = {{{stream.uniform()}, 0.0}};
  object.physics.draws = std::make_shared<const std::vector<belief::PhysicalDraw>>(draws);
  for (int i = 0; i < particles; ++i) {
    Particle particle;
    const double z = stream.uniform(), y = stream.uniform(), x = stream.uniform();
    particle.X_WO.translation = Vector3d(x, y, z);
    particle.V_WO.linear.x() = stream.uniform();
    particle.log_weight = -std::log(particles);
    object.particles.push_back(particle);
  }
  return object;
}

TEST(Exchange, SwapsWhereTheyAreAndNotWhatTheyAre) {
  const ObjectBelief red = some_object("red", 6, 1), blue = some_object("blue", 6, 2);
  ObjectBelief first = red, second = blue;
  exchange(first, second);
  for (const auto& [now, was, other] : {std::tuple(first, red, blue), std::tuple(second, blue, red)}) {
    EXPECT_EQ(now.name, was.name);
    EXPECT_EQ(now.model, was.model);
    EXPECT_EQ(now.existence, was.existence);
    EXPECT_TRUE(now.colors == was.colors);
    EXPECT_TRUE(now.physics == was.physics);
    EXPECT_EQ(now.last_seen_ns, other.last_seen_ns);
    EXPECT_EQ(now.frames_unseen, other.frames_unseen);
    EXPECT_EQ(now.frames_refuted, other.frames_refuted);
    EXPECT_EQ(now.visible_share, other.visible_share);
    EXPECT_EQ(now.evidence_per_pixel, other.evidence_per_pixel);
    EXPECT_EQ(now.island, other.island);
    ASSERT_EQ(now.particles.size(), other.particles.size());
    for (std::size_t i = 0; i < now.particles.size(); ++i) {
      EXPECT_EQ(now.particles[i].X_WO, other.particles[i].X_WO);
      EXPECT_EQ(now.particles[i].V_WO, other.particles[i].V_WO);
      EXPECT_EQ(now.particles[i].log_weight, other.particles[i].log_weight);
    }
  }
  exchange(first, second);
  EXPECT_EQ(first, red);
  EXPECT_EQ(second, blue);
}

TEST(Exchange, KeepsSetsOfDifferentSizesWhole) {
  const ObjectBelief few = some_object("few", 3, 1), many = some_object("many", 8, 2);
  ObjectBelief first = few, second = many;
  exchange(first, second);
  ASSERT_EQ(first.particles.size(), 8u);
  ASSERT_EQ(second.particles.size(), 3u);
}

/// Red and blue cans of one shape whose colours are known.
class Twins : public ::testing::Test {
 protected:
  Twins() {
    belief::ObjectModel red = can_model("red", 0.035, 0.12), blue = can_model("blue", 0.035, 0.12);
    red.color = {0.85, 0.15, 0.1};
    blue.color = {0.1, 0.25, 0.8};
    blue.visual = red.visual;
    sequence_ = still_sequence({red, blue}, {left_, right_});
  }
  void see(std::uint64_t seed) {
    sequence_.seed = seed;
    const belief::Observation observation = sequence_.observe(0, *backends_.renderer);
    // What is red, and what is blue, by the pixels of the truth.
    FrameColors colors;
    const geometry::ColorImage& image = *observation.frame.color;
    for (std::size_t i = 0; i < 2; ++i) {
      rendering::ColorHistogram object, rest;
      for (std::size_t k = 0; k < image.size(); ++k) {
        const geometry::Rgb& pixel = image.data()[k];
        const bool is_red = pixel[0] > 2 * pixel[2], is_blue = pixel[2] > 2 * pixel[0];
        (i == 0 ? is_red : is_blue) ? object.add(pixel) : rest.add(pixel);
      }
      ASSERT_GT(object.total(), 100.0);
      colors.of_models[sequence_.scene->models[i].name] = rendering::make_color_model(object, rest, {});
    }
    FrameCache cache;
    ASSERT_TRUE(prepare_frame(sequence_.scene, observation, {}, colors, {}, backends_.tools, cache, &frame_).ok());
    for (std::size_t i = 0; i < 2; ++i) targets_[i] = target_of(sequence_.scene->models[i], frame_, backends_.tools);
    ASSERT_NE(targets_[0].color_model, targets_[1].color_model);
  }
  bool exchanged(const Pose& X_W_red, const Pose& X_W_blue, bool other_order = false) const {
    const std::size_t a = other_order ? 1 : 0, b = 1 - a;
    const std::array<Pose, 2> X_CO = {frame_.X_CW * X_W_red, frame_.X_CW * X_W_blue};
    return are_exchanged({&frame_.terms, &frame_.terms}, {&targets_[a], &targets_[b]}, {X_CO[a], X_CO[b]}, {},
                         backends_.tools);
  }

  const Pose left_ = Pose::from_translation({0.0, 0.07, 0.06}), right_ = Pose::from_translation({0.0, -0.07, 0.06});
  Backends backends_;
  SimulatedSequence sequence_;
  FilterFrame frame_;
  std::array<SearchTarget, 2> targets_;
};

TEST_F(Twins, AreToldToBeExchangedWhereTheirColoursSaySo) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    ASSERT_NO_FATAL_FAILURE(see(seed));
    EXPECT_FALSE(exchanged(left_, right_));
    EXPECT_TRUE(exchanged(right_, left_));
    EXPECT_FALSE(exchanged(left_, right_, true));
    EXPECT_TRUE(exchanged(right_, left_, true));
  }
}

TEST_F(Twins, AreNotWithoutEnoughThatSpeaksForIt) {
  ASSERT_NO_FATAL_FAILURE(see(1));
  const std::array<Pose, 2> X_CO = {frame_.X_CW * right_, frame_.X_CW * left_};
  AugmentOptions options;
  options.exchange_gain = 1e9;
  EXPECT_FALSE(
      are_exchanged({&frame_.terms, &frame_.terms}, {&targets_[0], &targets_[1]}, X_CO, options, backends_.tools));
  options = {};
  options.exchange_evidence = 1e9;
  EXPECT_FALSE(
      are_exchanged({&frame_.terms, &frame_.terms}, {&targets_[0], &targets_[1]}, X_CO, options, backends_.tools));
  // Where neither is seen, there is nothing to tell.
  const Pose away = Pose::from_translation({0.0, 0.0, 5.0});
  EXPECT_FALSE(exchanged(away, away));
}

}  // namespace
}  // namespace prescene::filter_tests
