// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_content.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/utf8.h"
#include "prescene/service/view/view_history.h"
#include "tests/service/view/page_client.h"

namespace prescene::service::view_content_test {
namespace {

/// Many particles about x = 0, a quarter of the weight at x = 1.
ShownStep spread_step(belief::TrackState state) {
  const ShownStep shown = tests::shown_step(3);
  auto belief = std::make_shared<belief::Belief>(*shown.belief);
  belief::ObjectBelief& box = belief->objects[0];
  box.state = state;
  box.particles.resize(100, box.particles[0]);
  for (std::size_t i = 0; i < box.particles.size(); ++i) {
    box.particles[i].log_weight = std::log(0.01);
    box.particles[i].X_WO.translation = {i % 4 == 0 ? 1.0 : 0.0, 0.01 * static_cast<double>(i), 0.0};
    box.particles[i].covariance.block<3, 3>(3, 3) = 1e-4 * geometry::Matrix3d::Identity();
  }
  return {belief, shown.observation, shown.seconds, {}};
}

TEST(ViewContent, GhostsAndRegionFollowTheWeights) {
  const ShownStep unseen = spread_step(belief::TrackState::kUnseen);
  const auto document = step_document(unseen, summary_of(*unseen.belief), 9);
  const auto& box = document["objects"][0];
  EXPECT_EQ(document["index"], 9);
  EXPECT_EQ(box["state"], "unseen");
  EXPECT_NEAR(static_cast<double>(box["ghosts"].size()), 24.0, 1.0);  // without one that is where the mean is
  int far = 0;
  for (const auto& ghost : box["ghosts"]) far += ghost[0] == 1.0 ? 1 : 0;
  EXPECT_NEAR(far, 6, 1);
  // Positions of the region: 160, with the mean and the spread in x of the mixture (0.25, and 0.433 with 0.01 of each
  // particle); the errors are four standard deviations of what 160 draws by weight could give, were they independent.
  ASSERT_EQ(box["region"].size(), 480U);
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < 480; i += 3) {
    const double x = box["region"][i].get<double>();
    sum += x;
    squares += (x - 0.25) * (x - 0.25);
  }
  EXPECT_NEAR(sum / 160.0, 0.25, 4.0 * 0.433 / std::sqrt(160.0));
  EXPECT_NEAR(squares / 160.0, 0.1876, 4.0 * 0.2165 / std::sqrt(160.0));
  EXPECT_EQ(document, step_document(unseen, summary_of(*unseen.belief), 9));
  const ShownStep tracked = spread_step(belief::TrackState::kTracked);
  EXPECT_FALSE(step_document(tracked, summary_of(*tracked.belief), 9)["objects"][0].contains("region"));
}

TEST(ViewContent, ScenesAreTheSameWhateverTheirPoses) {
  const auto belief = tests::belief_of(tests::kBoxScene);
  belief::Scene scene = *belief->scene;
  const std::uint64_t hash = scene_shape_hash(scene);
  scene.supports[0].X_WS.translation.x() += 0.1;
  EXPECT_EQ(scene_shape_hash(scene), hash);
  scene.supports.push_back(scene.supports[0]);
  EXPECT_NE(scene_shape_hash(scene), hash);
  const auto document = scene_document(scene);
  EXPECT_EQ(document["supports"].size(), 2U);
  EXPECT_EQ(document["models"][0]["mesh"]["triangles"].size() % 3, 0U);
}

TEST(ViewContent, PicturesAreMadeSmallerByWholeFactors) {
  const auto observation = tests::shown_step(1).observation;
  EXPECT_FALSE(picture_jpeg(observation, 40, 80).empty());
  EXPECT_FALSE(picture_jpeg(observation, 13, 80).empty());
  EXPECT_EQ(picture_jpeg({}, 40, 80), "");
}

BeliefSummary summary_at(std::uint64_t step) { return summary_of(*tests::shown_step(step).belief); }

TEST(ViewHistory, OfALongRunEveryFewStepsAreKept) {
  ViewHistory history(100);
  for (std::uint64_t i = 0; i < 1000; ++i) history.add(summary_at(i), i);
  EXPECT_LE(history.rows().size(), 100U);
  EXPECT_GE(history.rows().size(), 50U);
  for (std::size_t i = 0; i < history.rows().size(); ++i) {
    EXPECT_EQ(history.rows()[i].index, 16 * i);
    EXPECT_NEAR(history.rows()[i].time, 1.6 * static_cast<double>(i), 1e-9);
  }
}

TEST(ViewHistory, BeginsAnewWhereTheClockWentBack) {
  ViewHistory history;
  history.add(summary_at(5), 0);
  history.add(summary_at(6), 1);
  const std::uint64_t revision = history.revision();
  history.add(summary_at(2), 2);
  EXPECT_EQ(history.rows().size(), 1U);
  EXPECT_NE(history.revision(), revision);
  EXPECT_EQ(history.forgotten_steps(), 2U);
}

// A second object joins before the first one in the list; then it goes.
TEST(ViewHistory, ANewObjectLeavesTheEarlierCurves) {
  const auto with_another = [](std::uint64_t step) {
    BeliefSummary summary = summary_at(step);
    ObjectSummary another = summary.objects[0];
    another.name = "another";
    another.confidence = 0.25;
    summary.objects.insert(summary.objects.begin(), another);
    return summary;
  };
  ViewHistory alone, history;
  for (std::uint64_t i = 0; i < 3; ++i) {
    alone.add(summary_at(i), i);
    history.add(summary_at(i), i);
  }
  const std::uint64_t revision = history.revision();
  history.add(with_another(3), 3);
  EXPECT_NE(history.revision(), revision);
  EXPECT_EQ(history.forgotten_steps(), 0U);
  ASSERT_EQ(history.rows().size(), 4U);
  ASSERT_EQ(history.columns().size(), 2 * alone.columns().size());
  for (std::size_t column = 0; column < history.columns().size(); ++column) {
    const auto own = std::find(alone.columns().begin(), alone.columns().end(), history.columns()[column]);
    for (std::size_t row = 0; row < 3; ++row) {
      const double value = history.rows()[row].values[column];
      if (own == alone.columns().end()) {
        EXPECT_TRUE(std::isnan(value)) << history.columns()[column];
      } else {
        EXPECT_EQ(value, alone.rows()[row].values[static_cast<std::size_t>(own - alone.columns().begin())]);
      }
    }
    EXPECT_FALSE(std::isnan(history.rows()[3].values[column]));
  }
  EXPECT_TRUE(to_json(history.rows()[0])[2].is_null());
  // Its first state begins at its step; that of the other goes on.
  ASSERT_EQ(history.runs().size(), 2U);
  EXPECT_EQ(history.objects(), (std::vector<std::string>{"another", alone.objects()[0]}));
  EXPECT_EQ(history.runs()[0].object, 1U);
  EXPECT_EQ(history.runs()[0].index, 0U);
  EXPECT_EQ(history.runs()[1].object, 0U);
  EXPECT_EQ(history.runs()[1].index, 3U);
  history.add(summary_at(4), 4);
  EXPECT_EQ(history.rows().size(), 1U);
  EXPECT_EQ(history.forgotten_steps(), 4U);
}

// However many there are and however long their names: whole objects are taken in, the first ones, and the others
// count.
TEST(ViewHistory, OfTooManyObjectsTheFirstAreTakenIn) {
  const auto with_objects = [](std::uint64_t step, std::size_t count, std::size_t name_bytes) {
    BeliefSummary summary = summary_at(step);
    summary.objects.resize(count, ObjectSummary(summary.objects[0]));
    for (std::size_t i = 0; i < count; ++i) summary.objects[i].name = std::to_string(i) + std::string(name_bytes, 'x');
    return summary;
  };
  ViewHistory one;
  one.add(with_objects(0, 1, 0), 0);
  const std::size_t own = one.columns().size();
  ASSERT_GT(own, 0U);
  ViewHistory history(100, 100, 4 * own + own - 1);
  for (std::uint64_t i = 0; i < 10; ++i) history.add(with_objects(i, i == 5 ? 70 : 30, 0), i);
  EXPECT_EQ(history.objects(), (std::vector<std::string>{"0", "1", "2", "3"}));
  EXPECT_EQ(history.columns().size(), 4 * own);
  EXPECT_EQ(history.rows().size(), 10U);
  for (const ViewHistory::Row& row : history.rows()) EXPECT_EQ(row.values.size(), 4 * own);
  EXPECT_EQ(history.left_out_objects(), 66U);
  EXPECT_EQ(history.forgotten_steps(), 0U);
  EXPECT_EQ(to_json(history)["left_out_objects"], 66);
  ViewHistory few;
  few.add(with_objects(0, 30, 0), 0);
  EXPECT_EQ(few.left_out_objects(), 0U);
  ViewHistory of_long_names;
  of_long_names.add(with_objects(0, 3, std::size_t{10} << 20), 0);
  EXPECT_TRUE(of_long_names.columns().empty());
  EXPECT_EQ(of_long_names.left_out_objects(), 3U);
}

BeliefSummary state_at(std::uint64_t step, belief::TrackState state, const std::string& held_by = "") {
  static const BeliefSummary kFirst = summary_at(0);
  BeliefSummary summary = kFirst;
  summary.step = step;
  summary.stamp_ns += static_cast<core::TimeNs>(step) * 100'000'000;
  summary.objects[0].state = state;
  if (!held_by.empty()) summary.objects[0].held_by = held_by;
  return summary;
}

// A state of a single step, of which no row is kept, is in the runs.
TEST(ViewHistory, NoChangeIsLostWithTheRows) {
  using belief::TrackState;
  ViewHistory history(100);
  for (std::uint64_t i = 0; i < 1000; ++i)
    history.add(state_at(i, i == 501 ? TrackState::kLost : TrackState::kTracked, i >= 700 ? "gripper" : ""), i);
  ASSERT_EQ(history.runs().size(), 4U);
  EXPECT_EQ(history.runs()[1].index, 501U);
  EXPECT_EQ(history.runs()[1].state, TrackState::kLost);
  EXPECT_NEAR(history.runs()[1].time, 50.1, 1e-9);
  EXPECT_EQ(history.runs()[2].index, 502U);
  EXPECT_EQ(history.runs()[3].held_by, "gripper");
  EXPECT_EQ(belief::json_text(to_json(history.runs()[3])), R"([0,700,70.0,"tracked","gripper"])");
  EXPECT_EQ(history.joined_runs(), 0U);
}

// Of a hand whose name is longer than the bound its beginning stands, in whole characters.
TEST(ViewHistory, RunsKeepNoLongNames) {
  const std::string umlauts = [] {
    std::string text;
    for (int i = 0; i < 1000; ++i) text += "\xC3\xA4";
    return text;
  }();
  for (const std::string& name : {"x" + umlauts, umlauts, std::string(ViewHistory::kMostHandBytes + 1, 'x')}) {
    ViewHistory history;
    history.add(state_at(0, belief::TrackState::kTracked, name), 0);
    history.add(state_at(1, belief::TrackState::kTracked, name), 1);
    ASSERT_EQ(history.runs().size(), 1U);
    const std::string& kept = history.runs()[0].held_by;
    EXPECT_LE(kept.size(), ViewHistory::kMostHandBytes);
    EXPECT_GE(kept.size(), ViewHistory::kMostHandBytes - 1);
    EXPECT_TRUE(core::is_utf8(kept));
    EXPECT_EQ(kept, name.substr(0, kept.size() - 3) + "...");
  }
  const std::string longest(ViewHistory::kMostHandBytes, 'x');
  ViewHistory history;
  history.add(state_at(0, belief::TrackState::kTracked, longest), 0);
  EXPECT_EQ(history.runs()[0].held_by, longest);
}

// Whatever the states do: the runs are bounded, the first and the state that holds now are right, no two in a row are
// equal, and each that changed is either there or counted.
TEST(ViewHistory, RunsAreBoundedAndCounted) {
  constexpr std::size_t kMost = 50;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    core::RandomStream stream(seed, core::Purpose::kTest, 0, 0);
    ViewHistory history(100, kMost);
    std::uint64_t began = 0;
    auto state = belief::TrackState::kTracked;
    for (std::uint64_t i = 0; i < 2000; ++i) {
      const auto before = state;
      if (stream.uniform() < 0.02 * static_cast<double>(seed))
        state = static_cast<belief::TrackState>(static_cast<int>(4.0 * stream.uniform()));
      began += i == 0 || state != before ? 1 : 0;
      history.add(state_at(i, state), i);
      ASSERT_LE(history.runs().size(), kMost);
      ASSERT_EQ(history.runs().back().state, state);
    }
    EXPECT_EQ(history.runs().front().index, 0U);
    EXPECT_EQ(history.runs().size() + history.joined_runs(), began);
    for (std::size_t i = 1; i < history.runs().size(); ++i) {
      EXPECT_NE(history.runs()[i].state, history.runs()[i - 1].state);
      EXPECT_LT(history.runs()[i - 1].index, history.runs()[i].index);
    }
  }
}

}  // namespace
}  // namespace prescene::service::view_content_test
