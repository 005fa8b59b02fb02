// SPDX-License-Identifier: Apache-2.0
// Colours that are learned while tracking: the law of blending, when nothing is learned, and what the belief carries.
#include "prescene/filter/proposals/learned_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "filter_fixture.h"
#include "prescene/belief/json.h"
#include "prescene/filter/operators/learn_colors.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::LearnedColors;
using belief::TrackState;
using geometry::Rgb;

rendering::ColorHistogram histogram(std::initializer_list<std::pair<Rgb, double>> colors) {
  rendering::ColorHistogram result;
  for (const auto& [color, weight] : colors) result.add(color, weight);
  return result;
}

double share_of(const LearnedColors& colors, const Rgb& color) {
  const int bin = static_cast<int>(rendering::ColorHistogram::bin(color));
  if (colors.shares)
    for (const belief::ColorShare& share : *colors.shares)
      if (share.bin == bin) return share.object;
  return 0.0;
}

constexpr Rgb kRed{200, 30, 30}, kGreen{30, 200, 30}, kGrey{128, 128, 128};

TEST(LearnedColors, TheFirstFramesAreAveragedEvenly) {
  ColorLearningOptions options;
  options.gain = 0.1;
  LearnedColors colors;
  for (int frame = 0; frame < 10; ++frame)
    blend(histogram({{frame < 3 ? kRed : kGreen, 7.0}}), histogram({{kGrey, 100.0}}), options, colors);
  EXPECT_EQ(colors.frames, 10);
  EXPECT_NEAR(share_of(colors, kRed), 0.3, 1e-12);
  EXPECT_NEAR(share_of(colors, kGreen), 0.7, 1e-12);
}

TEST(LearnedColors, ThenAnOldColourFadesGeometrically) {
  ColorLearningOptions options;
  options.gain = 0.05;
  LearnedColors colors;
  const auto rest = histogram({{kGrey, 100.0}});
  for (int frame = 0; frame < 20; ++frame) blend(histogram({{kRed, 5.0}}), rest, options, colors);
  EXPECT_NEAR(share_of(colors, kRed), 1.0, 1e-12);
  for (int frame = 1; frame <= 100; ++frame) {
    blend(histogram({{kGreen, 5.0}}), rest, options, colors);
    EXPECT_NEAR(share_of(colors, kRed), std::pow(0.95, frame), 1e-12);
    EXPECT_NEAR(share_of(colors, kGreen), 1.0 - std::pow(0.95, frame), 1e-12);
  }
  // At last it is forgotten, and the table no longer has a row for it.
  for (int frame = 0; frame < 200; ++frame) blend(histogram({{kGreen, 5.0}}), rest, options, colors);
  EXPECT_EQ(colors.shares->size(), 2u);
}

TEST(LearnedColors, CopiesShareATableThatBlendingDoesNotChange) {
  LearnedColors colors;
  blend(histogram({{kRed, 1.0}}), histogram({{kGrey, 1.0}}), {}, colors);
  const LearnedColors copy = colors;
  EXPECT_EQ(copy, colors);
  blend(histogram({{kGreen, 1.0}}), histogram({{kGrey, 1.0}}), {}, colors);
  EXPECT_NEAR(share_of(copy, kRed), 1.0, 1e-12);
  EXPECT_FALSE(copy == colors);
}

/// Not red, green or blue alone, so that light and shade move it over several bins.
belief::ObjectModel colored(belief::ObjectModel model, double r, double g, double b) {
  model.color = {r, g, b};
  return model;
}

FilterSettings learning() {
  FilterSettings settings;
  settings.frame.colors.learn = true;
  return settings;
}

const Pose kBoxPose = Pose::from_translation({0.0, 0.0, 0.09});
SimulatedSequence orange_box() {
  return still_sequence({colored(box_model("box", {0.06, 0.10, 0.18}), 0.9, 0.5, 0.1)}, {kBoxPose});
}

TEST(LearnColors, SeparateABoxFromTheTable) {
  Backends backends;
  const SimulatedSequence sequence = orange_box();
  ParticleFilter filter = backends.make_filter(learning());
  Belief belief = filter.start(sequence.scene, 3);
  for (int frame = 0; frame < 8; ++frame)
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
  ASSERT_GE(belief.objects[0].colors.frames, 6);
  const rendering::ColorModel model = learned_models(belief, filter.settings().frame.colors).at("box");
  // By the true silhouette, well inside and well outside of it.
  const belief::Observation observation = sequence.observe(9, *backends.renderer);
  const SearchTarget target{backends.meshes.get(sequence.scene->models[0].visual, MeshDetail::kDisplay), {}};
  const geometry::DepthImage truth =
      depth_of(target, sequence.X_WC.inverse() * kBoxPose, sequence.camera, *backends.renderer);
  int inside = 0, inside_for = 0, outside = 0, outside_against = 0;
  for (int y = 0; y < truth.height(); ++y)
    for (int x = 0; x < truth.width(); ++x) {
      const float ratio = model((*observation.frame.color)(x, y));
      (truth(x, y) > 0.0f ? inside : outside)++;
      if (truth(x, y) > 0.0f)
        inside_for += ratio > 1.0f;
      else
        outside_against += ratio < -1.0f;
    }
  EXPECT_GT(inside_for, 0.97 * inside);
  EXPECT_GT(outside_against, 0.97 * outside);
}

TEST(LearnColors, OnlyFromWhatIsSurelySeen) {
  const ColorLearningOptions options;
  belief::ObjectModel model;
  belief::ObjectBelief object;
  object.particles.resize(1);
  object.particles[0].covariance.diagonal().setConstant(1e-6);
  WeightReport report;
  report.particles.resize(1);
  report.evidence_per_pixel = options.min_evidence;
  report.visible_share = options.min_visible_share;
  report.particles[0].evidence.visible = 100;
  report.particles[0].evidence.hits = 90;
  EXPECT_TRUE(surely_seen(object, model, report, options));
  const auto refused = [&](auto&& change) {
    auto changed_object = object;
    auto changed_model = model;
    auto changed_report = report;
    change(changed_object, changed_model, changed_report);
    return !surely_seen(changed_object, changed_model, changed_report, options);
  };
  for (const TrackState state : {TrackState::kDoubtful, TrackState::kUnseen, TrackState::kLost})
    EXPECT_TRUE(refused([&](auto& o, auto&, auto&) { o.state = state; }));
  EXPECT_TRUE(refused([](auto& o, auto&, auto&) { o.existence = 0.8; }));
  EXPECT_TRUE(refused([](auto& o, auto&, auto&) { o.particles[0].covariance.diagonal().setConstant(1e-3); }));
  EXPECT_TRUE(refused([](auto&, auto& m, auto&) { m.surface = belief::SurfaceKind::kTransparent; }));
  EXPECT_TRUE(refused([](auto&, auto& m, auto&) { m.surface = belief::SurfaceKind::kMirror; }));
  EXPECT_TRUE(refused([](auto&, auto&, auto& r) { r.evidence_per_pixel -= 0.1; }));
  EXPECT_TRUE(refused([](auto&, auto&, auto& r) { r.visible_share -= 0.1; }));
  EXPECT_TRUE(refused([](auto&, auto&, auto& r) { r.particles[0].evidence.hits = 70; }));
  EXPECT_TRUE(refused([](auto&, auto&, auto& r) { r.particles[0].hidden = true; }));
}

TEST(LearnColors, NothingWhileItIsHidden) {
  Backends backends;
  SimulatedSequence sequence = orange_box();
  sequence.occluders.push_back(plate(sequence.X_WC, sequence.objects[0], 0.12, 0.34, 0.34, 0.5, 1.2));
  ParticleFilter filter = backends.make_filter(learning());
  Belief belief = filter.start(sequence.scene, 3);
  int hidden = 0, learned = 0;
  for (int frame = 0; frame < 50; ++frame) {
    const LearnedColors before = belief.objects[0].colors;
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    const bool is_learned = !(belief.objects[0].colors == before);
    learned += is_learned;
    if (belief.objects[0].state != TrackState::kTracked || sequence.visible_share(0, frame, *backends.renderer) < 0.5) {
      ++hidden;
      EXPECT_FALSE(is_learned) << "frame " << frame;
    }
  }
  EXPECT_GE(hidden, 18);
  EXPECT_GE(learned, 15);
}

TEST(LearnColors, NothingWithoutAColourImageOrWhenOff) {
  Backends backends;
  const SimulatedSequence sequence = orange_box();
  for (const bool off : {false, true}) {
    FilterSettings settings = learning();
    settings.frame.colors.learn = !off;
    ParticleFilter filter = backends.make_filter(settings);
    Belief belief = filter.start(sequence.scene, 3);
    for (int frame = 0; frame < 6; ++frame) {
      belief::Observation observation = sequence.observe(frame, *backends.renderer);
      if (!off) observation.frame.color = nullptr;
      belief = filter.step(belief, observation, {}).belief;
    }
    EXPECT_EQ(belief.objects[0].colors, LearnedColors());
  }
}

TEST(LearnColors, TheBeliefCarriesAllOfIt) {
  // One filter throughout, against one made anew each frame, with other threads, on a belief read back from its text.
  Backends backends(1), others(2);
  const SimulatedSequence sequence = orange_box();
  ParticleFilter filter = backends.make_filter(learning());
  Belief belief = filter.start(sequence.scene, 3), copy = belief;
  for (int frame = 0; frame < 10; ++frame) {
    const belief::Observation observation = sequence.observe(frame, *backends.renderer);
    belief = filter.step(belief, observation, {}).belief;
    const auto read = belief::belief_from_json(nlohmann::ordered_json::parse(to_json(copy).dump()), copy.scene);
    ASSERT_EQ(read.status(), core::ok_status());
    copy = others.make_filter(learning()).step(*read, observation, {}).belief;
    ASSERT_EQ(belief::content_hash(copy), belief::content_hash(belief)) << "frame " << frame;
    ASSERT_EQ(copy.objects[0].colors, belief.objects[0].colors);
  }
  EXPECT_GE(belief.objects[0].colors.frames, 7);
  // The hash sees the table.
  copy.objects[0].colors = {};
  EXPECT_NE(belief::content_hash(copy), belief::content_hash(belief));
}

}  // namespace
}  // namespace prescene::filter_tests
