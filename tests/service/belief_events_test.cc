// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/belief_events.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "prescene/core/random.h"
#include "tests/support/simple_scenes.h"

namespace prescene::service::belief_events_test {
namespace {

using belief::MotionMode;
using belief::TrackState;
using Values = std::map<std::string, std::string>;

ObjectSummary object_of(const std::string& name, TrackState state, MotionMode motion) {
  ObjectSummary object;
  object.name = name;
  object.state = state;
  object.motion = motion;
  if (motion == MotionMode::kHeld) object.held_by = "hand";
  return object;
}

std::vector<std::string> words(const std::vector<BeliefEvent>& events) {
  std::vector<std::string> words;
  for (const BeliefEvent& event : events) words.push_back(event.event);
  return words;
}

/// What somebody knows who hears only of changes. Each change has to start from what was known.
class Listener {
 public:
  void hear(const std::vector<BeliefEvent>& events) {
    for (const BeliefEvent& event : events) {
      if (event.event == "clock_set_back" || event.event == "restarted") {
        states_.clear();
        hands_.clear();
        continue;
      }
      if (event.object.empty() || event.event == "moving" || event.event == "at_rest") continue;
      Values& values = event.event == "held" || event.event == "released" ? hands_ : states_;
      const auto known = values.find(event.object);
      EXPECT_EQ(event.from, known == values.end() ? std::nullopt : std::optional(known->second)) << event.event;
      if (event.to)
        values[event.object] = *event.to;
      else
        values.erase(event.object);
      if (event.event == "forgotten") hands_.erase(event.object);
    }
  }
  const Values& states() const { return states_; }
  const Values& hands() const { return hands_; }

 private:
  Values states_, hands_;
};

TEST(BeliefEvents, TellAllThatTheBeliefsSay) {
  const belief::Scene scene = tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.1, 0.1, 0.1}}));
  const TrackState states[] = {TrackState::kTracked, TrackState::kDoubtful, TrackState::kUnseen, TrackState::kLost};
  const MotionMode motions[] = {MotionMode::kResting, MotionMode::kHeld, MotionMode::kMoving};
  core::RandomStream stream(3, core::Purpose::kTest);
  BeliefEvents events;
  Listener listener;
  BeliefSummary summary{0, 1'000, {}};
  for (int step = 0; step < 2000; ++step) {
    StepNews news;
    if (stream.uniform_below(50) == 0) (stream.uniform_below(2) == 0 ? news.clock_went_back : news.restarted) = true;
    summary.step = news.clock_went_back || news.restarted ? 1 : summary.step + 1;
    summary.stamp_ns += 33;
    Values expected_states, expected_hands;
    std::vector<ObjectSummary> objects;
    for (const char* name : {"mug", "box", "unknown_1"}) {
      const auto before = std::find_if(summary.objects.begin(), summary.objects.end(),
                                       [&](const ObjectSummary& o) { return o.name == name; });
      const auto drawn = [&] {
        const auto motion = motions[stream.uniform_below(3)];
        return object_of(name, states[stream.uniform_below(4)], motion);
      };
      ObjectSummary object = before != summary.objects.end() && stream.uniform_below(3) > 0 ? *before : drawn();
      object.is_new = object.name == "unknown_1";
      if (object.is_new && stream.uniform_below(4) == 0) continue;
      expected_states[name] = belief::to_string(object.state);
      if (object.held_by) expected_hands[name] = *object.held_by;
      objects.push_back(std::move(object));
    }
    summary.objects = std::move(objects);
    const std::vector<BeliefEvent> happened = events.note(summary, scene, news);
    for (const BeliefEvent& event : happened) {
      EXPECT_EQ(event.stamp_ns, summary.stamp_ns);
      EXPECT_NE(event.event, "");
      EXPECT_TRUE(event.object.empty() || event.from != event.to) << event.event;
    }
    listener.hear(happened);
    ASSERT_EQ(listener.states(), expected_states) << "step " << step;
    ASSERT_EQ(listener.hands(), expected_hands) << "step " << step;
    ++summary.step;
    for (const std::string& word : words(events.note(summary, scene, {})))
      EXPECT_TRUE(word == "moving" || word == "at_rest") << word << ", but nothing changed";
  }
}

TEST(BeliefEvents, ObjectsAreToldOnceWhileTheFirstFramesAreRefused) {
  const belief::Scene scene = tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.1, 0.1, 0.1}}));
  BeliefEvents events;
  BeliefSummary summary{0, 1'000, {object_of("box", TrackState::kTracked, MotionMode::kResting)}};
  using Words = std::vector<std::string>;
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{"found"});
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{}) << "the second frame was refused, too";
  summary.step = 1;
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{});
  summary.step = 0;
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{"found"}) << "a belief that began anew";
}

TEST(BeliefEvents, AMotionIsToldOnceItLasts) {
  const belief::Scene scene = tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.1, 0.1, 0.1}}));
  BeliefEvents events;
  BeliefSummary summary{0, 1'000, {object_of("box", TrackState::kTracked, MotionMode::kResting)}};
  const auto next = [&](MotionMode motion) {
    ++summary.step;
    summary.objects[0].motion = motion;
    return words(events.note(summary, scene, {}));
  };
  using Words = std::vector<std::string>;
  EXPECT_EQ(next(MotionMode::kResting), Words{"found"});
  for (int i = 0; i < 10; ++i) {  // for two steps, again and again
    EXPECT_EQ(next(MotionMode::kMoving), Words{});
    EXPECT_EQ(next(MotionMode::kMoving), Words{});
    EXPECT_EQ(next(MotionMode::kResting), Words{});
  }
  EXPECT_EQ(next(MotionMode::kMoving), Words{});
  EXPECT_EQ(next(MotionMode::kMoving), Words{});
  EXPECT_EQ(next(MotionMode::kMoving), Words{"moving"});
  EXPECT_EQ(next(MotionMode::kMoving), Words{});
}

TEST(BeliefEvents, SupportsCamerasAndFramesAreToldOnce) {
  belief::Scene scene = tests::floor_scene(tests::primitive_model("box", geometry::BoxShape{{0.1, 0.1, 0.1}}));
  BeliefEvents events;
  BeliefSummary summary{1, 1'000, {}};
  using Words = std::vector<std::string>;
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{});
  scene.supports.push_back(tests::floor_support());
  scene.supports.back().name = "support_plane";
  StepNews news;
  news.silent = {{"side", "it sends no more depth images"}};
  ++summary.step;
  const auto happened = events.note(summary, scene, news);
  ASSERT_EQ(words(happened), (Words{"support_found", "camera_silent"}));
  EXPECT_EQ(happened[0].support, "support_plane");
  EXPECT_EQ(happened[1].camera, "side");
  EXPECT_EQ(happened[1].reason, "it sends no more depth images");
  ++summary.step;
  EXPECT_EQ(words(events.note(summary, scene, news)), Words{});
  ++summary.step;
  EXPECT_EQ(words(events.note(summary, scene, {})), Words{"camera_used"});

  const auto because = [](const std::string& text) { return [text] { return text; }; };
  const auto unneeded = [] {
    ADD_FAILURE() << "no event needs a reason";
    return std::string();
  };
  EXPECT_FALSE(events.note_frames(false, 1, unneeded));
  EXPECT_FALSE(events.note_frames(true, 2, unneeded));
  EXPECT_FALSE(events.note_frames(true, 3, unneeded));
  const auto silent = events.note_frames(false, 4, because("no frame is used any more"));
  ASSERT_TRUE(silent);
  EXPECT_EQ(silent->event, "frames_silent");
  EXPECT_EQ(silent->reason, "no frame is used any more");
  EXPECT_FALSE(events.note_frames(false, 5, unneeded));
  EXPECT_TRUE(events.note_frames(true, 6, unneeded));
}

TEST(BeliefEvents, JsonHasTheKeysOfTheSchema) {
  BeliefEvent event{7, 3, "lost"};
  event.object = "mug";
  event.from = "unseen";
  event.to = "lost";
  EXPECT_EQ(to_json(event).dump(),
            R"({"stamp_ns":7,"step":3,"event":"lost","object":"mug","from":"unseen","to":"lost","reason":null})");
  EXPECT_EQ(to_json(BeliefEvent{7, 3, "restarted"}).dump(),
            R"({"stamp_ns":7,"step":3,"event":"restarted","from":null,"to":null,"reason":null})");
}

}  // namespace
}  // namespace prescene::service::belief_events_test
