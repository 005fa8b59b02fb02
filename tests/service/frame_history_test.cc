// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/frame_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/service/pictures/explanation_strip.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/why_answer.h"
#include "prescene/service/tracking/tracker.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::frame_history_test {
namespace {

using ::testing::HasSubstr;

constexpr core::TimeNs kSecond = 1'000'000'000;
constexpr core::TimeNs kBegin = 1'700'000'000 * kSecond;

belief::Observation observation_at(core::TimeNs stamp_ns, int width, int height) {
  belief::Observation observation;
  observation.stamp_ns = stamp_ns;
  observation.frame.camera.width = width;
  observation.frame.camera.height = height;
  observation.frame.camera.fx = observation.frame.camera.fy = width;
  observation.frame.camera.cx = 0.5 * width;
  observation.frame.camera.cy = 0.5 * height;
  auto depth = std::make_shared<geometry::DepthImage>(width, height);
  auto color = std::make_shared<geometry::ColorImage>(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      (*depth)(x, y) = 0.5F + 1e-3F * static_cast<float>(x) + 1e-4F * static_cast<float>(y);
      (*color)(x, y) = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 7};
    }
  observation.frame.depth = depth;
  observation.frame.color = color;
  return observation;
}

std::shared_ptr<const belief::Belief> belief_with(core::TimeNs stamp_ns, std::uint64_t step = 1) {
  auto belief = std::make_shared<belief::Belief>();
  belief->step = step;
  belief->stamp_ns = stamp_ns;
  belief->objects.resize(2);
  for (belief::ObjectBelief& object : belief->objects) object.particles.resize(16);
  return belief;
}

/// Frames of so many seconds, `rate` a second.
void fill(FrameHistory& history, double seconds, double rate) {
  const auto count = static_cast<std::uint64_t>(seconds * rate) + 1;
  for (std::uint64_t i = 0; i < count; ++i) {
    const core::TimeNs stamp_ns = kBegin + core::ns_of(static_cast<double>(i) / rate);
    history.add(observation_at(stamp_ns, 32, 24), belief_with(stamp_ns, i + 1));
  }
}

belief::ExplainQuestion between(double from, double to) {
  belief::ExplainQuestion question;
  question.from = from;
  question.to = to;
  return question;
}

std::string refusal(const FrameHistory& history, const belief::ExplainQuestion& question) {
  const auto window = history.window(question);
  return window ? "" : window.status().message();
}

TEST(FrameHistory, HoldsTheSecondsAndFramesThatItMayHoldAndNoMore) {
  FrameHistory history({.seconds = 4.0, .rate = 15.0});
  fill(history, 20.0, 30.0);
  EXPECT_GE(history.frames(), 4u * 15u);
  EXPECT_LE(history.frames(), 4u * 15u + 1u);
  const std::size_t bytes = history.bytes();
  EXPECT_GT(bytes, history.frames() * (32u * 24u * 7u + 2u * 16u * sizeof(belief::Particle)));
  FrameHistory small({.seconds = 4.0, .rate = 15.0, .most_bytes = bytes / 2});
  fill(small, 20.0, 30.0);
  EXPECT_LE(small.bytes(), bytes / 2);
  EXPECT_GT(small.frames(), 25u);
}

TEST(FrameHistory, KeepsTheFramesOfEveryCamera) {
  FrameHistory history({.seconds = 4.0, .rate = 15.0});
  for (std::uint64_t i = 0; i < 60; ++i) {  // triggered together, 30 a second
    const core::TimeNs stamp_ns = kBegin + core::ns_of(static_cast<double>(i) / 30.0);
    for (const int camera : {0, 1}) {
      auto belief = std::make_shared<belief::Belief>(*belief_with(stamp_ns, 2 * i + 1));
      belief->cameras.resize(2);
      belief::Observation observation = observation_at(stamp_ns, 32, 24);
      observation.camera = camera;
      history.add(observation, std::move(belief));
    }
  }
  const auto window = history.window(between(0.5, 1.5));
  ASSERT_TRUE(window.ok()) << window.status().message();
  std::map<int, int> frames;
  for (const queries::WindowFrame& frame : window->window.frames) ++frames[frame.observation.camera];
  EXPECT_EQ(frames[0], 15);
  EXPECT_EQ(frames[1], 15);
}

TEST(FrameHistory, GivesTheWindowWithTheBeliefBeforeIt) {
  FrameHistory history({.seconds = 10.0, .rate = 100.0});
  fill(history, 8.0, 10.0);
  const auto window = history.window(between(2.05, 4.0));
  ASSERT_TRUE(window.ok()) << window.status().message();
  EXPECT_NEAR(window->from, 2.0, 1e-9);
  EXPECT_NEAR(window->to, 4.0, 1e-9);
  EXPECT_EQ(window->window.start->step, 21u);
  ASSERT_EQ(window->window.frames.size(), 20u);
  EXPECT_EQ(window->window.frames.front().belief->step, 22u);
  belief::ExplainQuestion last;
  last.last = 1.0;
  const auto newest = history.window(last);
  ASSERT_TRUE(newest.ok());
  EXPECT_NEAR(newest->from, 7.0, 1e-9);
  EXPECT_EQ(newest->window.frames.back().belief->step, 81u);
}

TEST(FrameHistory, SaysWhyAWindowIsNotInIt) {
  FrameHistory history({.seconds = 5.0, .rate = 100.0});
  EXPECT_THAT(refusal(history, {}), HasSubstr("no frame was seen yet"));
  fill(history, 8.0, 10.0);
  EXPECT_THAT(refusal(history, between(1.0, 4.0)), HasSubstr("the history holds 3.00 to 8.00 s"));
  EXPECT_THAT(refusal(history, between(4.0, 9.0)), HasSubstr("ends after the newest frame"));
  EXPECT_THAT(refusal(history, between(4.0, 4.05)), HasSubstr("give a longer one"));
  belief::ExplainQuestion last;
  last.last = 60.0;
  EXPECT_THAT(refusal(history, last), HasSubstr("begins before the history"));
  const FrameHistory off({.seconds = 0.0});
  EXPECT_THAT(refusal(off, {}), HasSubstr("--history"));
  EXPECT_EQ(history.window(between(1.0, 4.0)).status().code(), core::StatusCode::kInvalidInput);
}

TEST(FrameHistory, BeginsAnewWhereTheClockGoesBack) {
  FrameHistory history({.seconds = 20.0, .rate = 100.0});
  fill(history, 3.0, 10.0);
  fill(history, 1.0, 10.0);
  EXPECT_EQ(history.frames(), 11u);
}

// The likelihood looks at these pixels and no others, so that a kept frame says the same as the whole one.
TEST(FrameHistory, KeepsThePixelsThatTheLikelihoodLooksAt) {
  for (const auto& [width, height] : {std::pair{640, 480}, {848, 480}, {424, 240}, {160, 120}, {119, 90}, {64, 48}}) {
    const belief::Observation whole = observation_at(kBegin, width, height);
    const queries::WindowFrame kept = sampled_frame(whole, belief_with(kBegin), 80);
    rendering::FrameTerms of_whole, of_kept;
    for (const auto& [observation, terms] : {std::pair{&whole, &of_whole}, {&kept.observation, &of_kept}}) {
      rendering::FrameTermsInput input;
      input.camera = observation->frame.camera;
      input.depth = observation->frame.depth->view();
      ASSERT_TRUE(make_frame_terms(input, {}, rendering::SensorModel(), terms).ok());
    }
    EXPECT_EQ(of_kept.depth, of_whole.depth) << width;
    EXPECT_EQ(of_kept.camera, of_whole.camera) << width;
    EXPECT_EQ(of_kept.step * kept.sampled, of_whole.step) << width;
    EXPECT_EQ((*kept.observation.frame.color)(1, 1)[0], static_cast<std::uint8_t>(kept.sampled / 2 + kept.sampled));
  }
}

TEST(ControlLog, PutsWhatIsDueIntoTheWindow) {
  ControlLog controls;
  controls.add(
      R"({"actions": [{"time": 0.5, "release": {"object": "cup"}}, {"time": 9, "release": {"object": "can"}}]})",
      kBegin);
  controls.add(R"({"actions": [{"time": 0, "release": {"object": "mug"}}]})", 5 * kSecond);
  controls.add("nonsense", kBegin);
  queries::ExplainWindow window;
  window.start = belief_with(kBegin);
  window.frames.push_back({observation_at(kBegin + 2 * kSecond, 32, 24), belief_with(kBegin + 2 * kSecond)});
  std::vector<std::string> remarks;
  controls.put_into(window, remarks);
  ASSERT_EQ(window.actions.size(), 1u);
  EXPECT_EQ(window.actions[0].first, kBegin + kSecond / 2);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_THAT(remarks[0], HasSubstr("1 actions have no stamp"));
}

TEST(ControlLog, OfAPlacementThatBeganBeforeTheWindowKnowsTheRelease) {
  ControlLog controls;
  controls.add(
      R"({"actions": [{"time": 0, "place": {"object": "cup", "pose": {"position": [0, 0, 0]}, "duration": 1.5}}]})",
      kBegin - kSecond);
  controls.forget(kBegin, 100);
  queries::ExplainWindow window;
  window.start = belief_with(kBegin);
  window.frames.push_back({observation_at(kBegin + 2 * kSecond, 32, 24), belief_with(kBegin + 2 * kSecond)});
  std::vector<std::string> remarks;
  controls.put_into(window, remarks);
  ASSERT_EQ(window.actions.size(), 1u);
  EXPECT_EQ(window.actions[0].first, kBegin + kSecond / 2);
  EXPECT_EQ(belief::kind_of(window.actions[0].second), "release");
}

/// A recording that was tracked, whose frames are asked about.
class TrackedRecording {
 public:
  /// Of the frames after the first `sighted`, no pixel is kept.
  TrackedRecording(const std::filesystem::path& path, int threads, int sighted = 1'000'000)
      : pool_(threads), backends_(pool_) {
    ReplayInputOptions opened;
    opened.path = path;
    const auto input = ReplayInput::open(opened, {});
    EXPECT_TRUE(input.ok()) << input.status().message();
    if (!input) return;
    const auto tracker = Tracker::create(input->scene(), {}, 1, backends_);
    EXPECT_TRUE(tracker.ok());
    const auto replayed =
        input->replay(**tracker, {}, {},
                      [&](const TrackerStep& step, const Tracker& at) -> core::Status {
                        belief::Observation kept = step.observation;
                        if (sighted-- <= 0) {
                          const geometry::PinholeCamera& camera = kept.frame.camera;
                          kept.frame.depth = std::make_shared<geometry::DepthImage>(camera.width, camera.height, 0.0F);
                        }
                        history_.add(kept, at.belief());
                        return {};
                      },
                      {});
    EXPECT_TRUE(replayed.ok()) << replayed.status().message();
  }

  using SoFar = std::function<void(const queries::ExplainAnswer&)>;
  core::Result<Explained> explained(const belief::ExplainQuestion& question, const SoFar& so_far = {}) {
    PRESCENE_TRY(auto past, history_.window(question));
    PRESCENE_TRY(const auto likelihood, backends_.make_likelihood());
    const queries::ExplainContext context{backends_.query_context(pool_), likelihood.get(), {}, so_far};
    return explain_past(std::move(past), question, {}, context);
  }
  /// The answer but for how long it took.
  nlohmann::ordered_json answer(const belief::ExplainQuestion& question, const SoFar& so_far = {}) {
    const auto found = explained(question, so_far);
    EXPECT_TRUE(found.ok()) << found.status().message();
    if (!found) return {};
    nlohmann::ordered_json answer = explain_answer_json(question, *found);
    EXPECT_EQ(answer["explain"].erase("wall_seconds"), 1u);
    EXPECT_EQ(answer["explain"].erase("cpu_seconds"), 1u);
    return answer;
  }
  core::Result<nlohmann::ordered_json> why(const belief::WhyQuestion& question) {
    PRESCENE_TRY(const PastWindow past, history_.window(asked_window(question)));
    PRESCENE_TRY(const auto likelihood, backends_.make_likelihood());
    const queries::ExplainContext context{backends_.query_context(pool_), likelihood.get(), {}};
    PRESCENE_TRY(const Reasons reasons, why_past(past, question, context));
    nlohmann::ordered_json answer = why_answer_json(question, reasons);
    for (const char* key : {"wall_seconds", "cpu_seconds"}) EXPECT_EQ(answer["why"].erase(key), 1u);
    return answer;
  }
  Backends& backends() { return backends_; }

 private:
  core::ThreadPool pool_;
  Backends backends_;
  FrameHistory history_{{.seconds = 20.0, .rate = 15.0}};
};

/// Records what a camera sees of a scene in which something happens that nobody tells of.
void record_change(const std::string& yaml, const UnannouncedChange& change, const std::filesystem::path& path) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto scene = load_scene_text(yaml, "scene.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto recording = RecordingWriter::create(path, {"scene.yaml", yaml, 1, ""});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  SimulatedRecordingOptions options;
  options.rate = 10.0;
  options.changes = {change};
  ASSERT_TRUE(simulate_recording(**scene, options, 1, backends, {}, {}, **recording).ok());
  ASSERT_TRUE((*recording)->close().ok());
}

belief::ExplainQuestion quick_question(double last) {
  belief::ExplainQuestion question;
  question.id = "why";
  question.last = last;
  question.points = 8;
  question.runs = 2;
  return question;
}

TEST(FrameHistory, ExplainsWithTheSameBitsOnAnyThreadsAndWhenAskedAgain) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.mcap";
  record_change(tests::box_on_table("1.6", ", normal: {position: [0.003, 0.003, 0]}"), {1.2, "box", std::nullopt},
                path);
  TrackedRecording on_one(path, 1), on_two(path, 2);
  const nlohmann::ordered_json one = on_one.answer(quick_question(0.8));
  EXPECT_EQ(one, on_two.answer(quick_question(0.8)));
  EXPECT_EQ(one["id"], "why");
  EXPECT_EQ(one["explain"]["explanations"][0]["event"], "taken_away") << one["explain"]["text"];
  EXPECT_NEAR(one["explain"]["explanations"][0]["time"]["mean"].get<double>(), 1.2, 0.15);
  // Asked again with what is said to have been asked, the answer is the same.
  const auto asked =
      belief::explain_question_from_json(belief::json_text({{"id", "why"}, {"explain", one["explain"]["asked"]}}));
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  EXPECT_EQ(on_one.answer(*asked), one);

  // What is asked for in vain.
  belief::ExplainQuestion unknown = quick_question(0.8);
  unknown.object = "bx";
  const auto refused = on_one.explained(unknown);
  EXPECT_THAT(refused.status().message(), HasSubstr("did you mean 'box'?"));
  unknown = quick_question(0.8);
  unknown.change = true;
  unknown.wanted_name = "stands";
  EXPECT_THAT(on_one.explained(unknown).status().message(), HasSubstr("the scene has no outcome 'stands'"));
  // What somebody does by hand has no smallest change, which is said.
  unknown.wanted_name.clear();
  const auto taken = on_one.explained(unknown);
  ASSERT_TRUE(taken.ok());
  EXPECT_FALSE(taken->answer.change);
  EXPECT_THAT(taken->answer.remarks,
              ::testing::Contains(HasSubstr("No smallest change is worked out of 'taken_away'")));
}

TEST(FrameHistory, SaysOfAnExplanationThatItsFramesShowNothing) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.mcap";
  record_change(tests::box_on_table("0.8", ", normal: {position: [0.003, 0.003, 0]}"), {0.7, "box", std::nullopt},
                path);
  const auto remarks_of = [&](int sighted) {
    TrackedRecording tracked(path, 1, sighted);
    const auto found = tracked.explained(quick_question(0.4));
    EXPECT_TRUE(found.ok()) << found.status().message();
    return found ? found->answer.remarks : std::vector<std::string>();
  };
  EXPECT_THAT(remarks_of(1000), ::testing::Each(::testing::Not(HasSubstr("no pixel is measured"))));
  EXPECT_THAT(remarks_of(5), ::testing::Contains(HasSubstr("no pixel is measured")));
}

/// What is told on the way, each with its explanations as text.
struct ToldOnTheWay {
  std::vector<queries::ExplainAnswer> answers;
  std::vector<std::string> texts;
  nlohmann::ordered_json answer;
};

ToldOnTheWay told_by(TrackedRecording& recording, const belief::ExplainQuestion& question) {
  ToldOnTheWay told;
  told.answer = recording.answer(question, [&](const queries::ExplainAnswer& so_far) {
    told.answers.push_back(so_far);
    Explained known;
    known.answer = so_far;
    told.texts.push_back(belief::json_text(to_json(known)));
  });
  return told;
}

TEST(FrameHistory, TellsWhatIsKnownOfAnExplanationOnTheWay) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.mcap";
  record_change(tests::box_on_table("1.6", ", normal: {position: [0.003, 0.003, 0]}"), {1.2, "box", std::nullopt},
                path);
  TrackedRecording on_one(path, 1), on_two(path, 2);
  const belief::ExplainQuestion question = quick_question(0.8);
  const ToldOnTheWay told = told_by(on_one, question), on_others = told_by(on_two, question);
  EXPECT_EQ(told.texts, on_others.texts) << "does not depend on threads";
  EXPECT_EQ(told.answer, on_others.answer);
  EXPECT_EQ(told.answer, on_one.answer(question)) << "does not change the answer";

  ASSERT_GE(told.answers.size(), 3u);
  const auto& last = told.answers.back();
  // Before the first, only what comes before all searches: where the box may be seen.
  const int all = told.answer["explain"]["weighed_instances"];
  EXPECT_LT(told.answers.front().evaluated, all);
  EXPECT_EQ(told.answers.front().simulated, 0);
  const double found = told.answer["explain"]["explanations"][0]["probability"];
  for (std::size_t i = 0; i < told.answers.size(); ++i) {
    const queries::ExplainAnswer& known = told.answers[i];
    if (i > 0) {
      EXPECT_GT(known.evaluated, told.answers[i - 1].evaluated);
    }
    ASSERT_EQ(known.explanations.size(), last.explanations.size()) << "those that were not searched yet, too";
    double sum = 0.0;
    for (const queries::Explanation& e : known.explanations) {
      sum += e.probability;
      EXPECT_LE(e.low, e.probability) << e.sentence;
      EXPECT_GE(e.high, e.probability) << e.sentence;
      EXPECT_FALSE(e.time) << "takes more work";
      if (e.kind != belief::EventKind::kTakenAway) continue;
      EXPECT_LE(e.low, found) << "after " << known.evaluated;
      EXPECT_GE(e.high, found) << "after " << known.evaluated;
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    EXPECT_FALSE(known.text.empty());
  }
  // That something happened is known before it is known what.
  for (const queries::Explanation& e : told.answers[1].explanations)
    if (e.kind == belief::EventKind::kNothing && !e.present_at_start) {
      EXPECT_LT(e.high, 0.5);
    }
}

/// Probability by what is explained, in the order of the answer.
std::map<std::string, queries::Explanation> by_event(const queries::ExplainAnswer& answer) {
  std::map<std::string, queries::Explanation> all;
  for (const queries::Explanation& e : answer.explanations)
    all.emplace(std::string(belief::name_of(e.kind)) + " " + e.object + (e.present_at_start ? " otherwise" : ""), e);
  return all;
}

// Where things may move when the window begins, that nothing happens is simulated, too. What is told before that rules
// nothing out.
TEST(FrameHistory, TellsOfAnExplanationBeforeAnythingIsSimulated) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.mcap";
  record_change(tests::box_on_table("1.6", ", normal: {position: [0.003, 0.003, 0]}"), {1.2, "box", std::nullopt},
                path);
  TrackedRecording recording(path, 1);
  const ToldOnTheWay told = told_by(recording, quick_question(1.5));  // begins with a box that was seen once or twice
  ASSERT_GE(told.answers.size(), 3u);
  EXPECT_LE(told.answers[0].simulated, 1) << "where everything most probably would be";
  EXPECT_GT(told.answers[1].simulated, 1) << "nothing";
  const auto at_first = by_event(told.answers.front()), in_the_end = by_event(told.answers.back());
  for (const auto& [event, found] : in_the_end) {
    ASSERT_TRUE(at_first.contains(event)) << event;
    EXPECT_LE(at_first.at(event).low, found.probability + 1e-6) << event;
    EXPECT_GE(at_first.at(event).high, found.probability - 1e-6) << event;
  }
}

TEST(FrameHistory, GivesAsMuchOfAWindowThatNobodyAskedForAsItHas) {
  FrameHistory history({.seconds = 10.0, .rate = 100.0});
  fill(history, 1.0, 10.0);
  const auto window = history.window(AskedWindow{});
  ASSERT_TRUE(window.ok()) << window.status().message();
  EXPECT_NEAR(window->from, 0.0, 1e-9);
  EXPECT_EQ(window->window.frames.size(), 10u);
  EXPECT_EQ(window->first_ns, kBegin);
  fill(history, 5.0, 10.0);  // the clock goes back
  EXPECT_NEAR(history.window(AskedWindow{})->from, 3.0, 1e-9);
  EXPECT_FALSE(history.window(AskedWindow{.from = {}, .to = {}, .last = 30.0}).ok());
}

TEST(FrameHistory, SaysWhyAPoseIsBelievedWithTheSameBitsOnAnyThreadsAndWhenAskedAgain) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.mcap";
  record_change(tests::box_on_table("1.6", ", normal: {position: [0.003, 0.003, 0]}"), {1.5, "box", std::nullopt},
                path);
  TrackedRecording on_one(path, 1), on_two(path, 2);
  belief::WhyQuestion question;
  question.id = "why";
  question.object = "box";
  question.from = 0.2;
  question.to = 1.2;
  question.images = 2;
  const auto one = on_one.why(question), two = on_two.why(question);
  ASSERT_TRUE(one.ok()) << one.status().message();
  EXPECT_EQ(*one, *two);
  const nlohmann::ordered_json& why = one->at("why");
  EXPECT_EQ(why["comparisons"][0]["against"], "absence");
  EXPECT_GT(why["comparisons"][0]["tempered"].get<double>(), 10.0) << why["text"];
  EXPECT_EQ(why["comparisons"][0]["images"].size(), 2u);
  EXPECT_EQ(why["frames"].size(), why["comparisons"][0]["frames"].size());
  EXPECT_EQ(why["frames"][0]["pixels"]["hidden"], 0);
  const auto asked = belief::why_question_from_json(belief::json_text({{"id", "why"}, {"why", why["asked"]}}));
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  EXPECT_EQ(*on_one.why(*asked), *one);
  question.object = "bx";
  EXPECT_THAT(on_one.why(question).status().message(), HasSubstr("did you mean 'box'?"));
  question.to = 90.0;
  EXPECT_THAT(on_one.why(question).status().message(), HasSubstr("ends after the newest frame"));
}

TEST(ExplanationStrip, ColoursWhatIsNearerAndWhatIsFurther) {
  geometry::DepthImage measured(4, 1, 1.0F), explained(4, 1, 1.0F);
  measured(1, 0) = 0.9F;
  measured(2, 0) = 1.1F;
  measured(3, 0) = 0.0F;
  const geometry::ColorImage picture = depth_difference_picture(measured, explained);
  EXPECT_GT(picture(0, 0)[0], 200);
  EXPECT_GT(picture(0, 0)[2], 200);
  EXPECT_GT(picture(1, 0)[2], picture(1, 0)[0] + 50);
  EXPECT_GT(picture(2, 0)[0], picture(2, 0)[2] + 50);
  EXPECT_EQ(picture(3, 0)[0], picture(3, 0)[1] - 2);
}

}  // namespace
}  // namespace prescene::service::frame_history_test
