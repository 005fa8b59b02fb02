// SPDX-License-Identifier: Apache-2.0
// Damaged and extreme questions at a worker: each is answered or refused, one after the other, and what they leave
// behind answers a good question as before. That none takes for ever is watched by a patience that is far beyond a
// question's time, so that a failure names the question; what a question may take is QueryWorkerSettings::most_seconds
// and 2 s more.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/core/random.h"
#include "prescene/core/utf8.h"
#include "prescene/service/outside_json.h"
#include "query_worker_fixture.h"
#include "tests/support/sanitizers.h"

namespace prescene::service {
namespace {

using tests::WorkerUnderTest;
using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kPatience(600);
#if PRESCENE_SANITIZES_MEMORY
constexpr double kMostGigabytes = 6.0;  // the sanitizers' own
#else
constexpr double kMostGigabytes = 1.5;
#endif

constexpr const char* kScene = R"(name: flood
duration: 2
camera: {width: 48, height: 36, fx: 40, look: {from: [0, -1, 1], at: [0, 0, 0]}}
models:
  box: {box: [0.1, 0.06, 0.04], mass: {normal: [0.4, 0.02], min: 0.1}}
  ball: {sphere: 0.03, mass: 0.1}
supports:
  floor: {ground: {size: 2}}
  table: {box: [0.6, 0.6, 0.04], pose: {position: [0, 0, 0.3]}}
robot:
  hand: {sphere: 0.02, timeline: [{time: 0, position: [0, 0, 0.7]}]}
objects:
  box: {model: box, pose: {position: [0.28, 0, 0.42]}}
  ball: {model: ball, pose: {position: [0, 0.1, 0.36]}}
outcomes:
  falls: {object: box, below: 0.2}
)";

/// Of every task with every key.
const std::vector<std::string>& good_questions() {
  static const std::vector<std::string> kQuestions = {
      R"({"id": "1", "where": {"object": "box"}})",
      R"({"id": "2", "where": {}})",
      R"({"id": "3", "stability": {"object": "box", "max_move": 0.01, "max_turn_deg": 5, "duration": 0.5,
          "effort": {"tolerance": 0.1, "confidence": 0.9, "max_instances": 64, "max_seconds": 0.05}}})",
      R"({"id": "4", "view": {"actions": [], "time": 0.0}})",
      R"({"id": "5", "predict": {"effort": {"exact_instances": 64}, "detail": ["inputs", "chaos"], "duration": 0.5}})",
      R"({"id": "6", "predict": {
          "actions": [{"time": 0.0, "push": {"from": [0.5, 0, 0.35], "to": [0, 0, 0.35], "duration": 0.5, "radius": 0.02,
                       "lateral_error": {"normal": [0, 0.01], "min": -0.02, "max": 0.02}}},
                      {"time": 0.1, "grasp": {"object": "ball", "hand": "hand"}},
                      {"time": 0.2, "transport": {"object": "ball", "duration": 0.2,
                       "pose": {"position": [{"uniform": [0, 0.1]}, 0, {"samples": [0.5, 0.6]}], "rotation": "any"}}},
                      {"time": 0.4, "release": {"object": "ball", "retreat": [0, 0, 0.1], "retreat_duration": 0.1,
                       "velocity": [0, 0, {"normal": [0, 0.1]}], "angular_velocity": [0, 0, 0]}}],
          "outcomes": [{"name": "touches", "object": "box", "touched": "ball", "when": "ever"},
                       {"name": "in", "object": "ball", "all_of": [{"inside": {"position": [0, 0, 0.1],
                          "rotation": {"quaternion_wxyz": [1, 0, 0, 0]}, "size": [0.2, 0.2, 0.2]}}]}],
          "exclusive_outcomes": [{"name": "up", "object": "box", "face_up": true},
                                 {"name": "where", "outcomes": [{"name": "floor", "object": "box",
                                  "resting_on": "floor", "not": {"upright": {"within_deg": 15}}}]}],
          "duration": 0.5, "detail": ["final_poses", "typical_runs", "inputs", "contacts", "chaos", "model_error"],
          "paths": 3, "effort": {"max_instances": 64, "max_seconds": 0.05}}})",
      R"({"id": "7", "predict": {"actions": [
          {"time": 0, "pour": {"container": "box", "axis": "y", "angle_deg": 60, "duration": 0.2}},
          {"time": 0.3, "place": {"object": "ball", "duration": 0.2, "pose": {
            "position": [0, 0, 0.4], "rotation": {"quaternion_xyzw": [0, 0, 0, 1]},
            "normal": {"covariance": [[0,0,0,0,0,0],[0,0,0,0,0,0],[0,0,0,0,0,0],
                           [0,0,0,1e-4,0,0],[0,0,0,0,1e-4,0],[0,0,0,0,0,1e-4]]}}}}],
          "duration": 0.5, "detail": ["contacts"], "effort": {"max_instances": 64}}})"};
  return kQuestions;
}

/// Changes one thing about a question.
class Damage {
 public:
  explicit Damage(core::RandomStream stream) : stream_(stream) {}

  std::string operator()(const std::string& question) {
    if (below(4) == 0) return bytes_damaged(question);
    Json document = *belief::parse_json(question);
    for (std::size_t changes = 1 + below(3); changes > 0; --changes) change(document);
    return belief::json_text(document);
  }

 private:
  std::size_t below(std::size_t bound) { return static_cast<std::size_t>(stream_.uniform_below(bound)); }

  std::string bytes_damaged(std::string text) {
    const std::size_t place = below(text.size());
    switch (below(4)) {
      case 0:
        return text.substr(0, place);
      case 1:
        text[place] = static_cast<char>(below(256));
        return text;
      case 2: {
        const auto byte = static_cast<char>(0x80 + below(128));
        return text.insert(place, std::string(1 + below(3), byte));
      }
      default:
        return text.erase(place, 1 + below(20));
    }
  }

  void change(Json& value) {
    if (value.is_structured() && !value.empty() && below(8) != 0) {
      auto item = value.begin();
      for (std::size_t skipped = below(value.size()); skipped > 0; --skipped) ++item;
      if (below(10) == 0) {
        value.erase(item);
      } else if (value.is_array() && below(10) == 0) {
        value.insert(value.end(), 1 + below(300), Json(*item));
      } else {
        change(*item);
      }
      return;
    }
    value = other(value);
  }

  Json other(const Json& value) {
    static const std::vector<double> kNumbers = {0.0,
                                                 -0.0,
                                                 -1.0,
                                                 1.0,
                                                 0.5,
                                                 1e-300,
                                                 5e-324,
                                                 1e-9,
                                                 1e-3,
                                                 0.02,
                                                 0.9999,
                                                 2.0,
                                                 3.0,
                                                 60.0,
                                                 1e3,
                                                 3600.0,
                                                 1e4,
                                                 -1e4,
                                                 1e9,
                                                 1e18,
                                                 1e19,
                                                 1e300,
                                                 -1e300,
                                                 1.7976931348623157e308,
                                                 0.9999999999999999};
    static const std::vector<std::string> kTexts = {
        "", "box", "ball", "hand", "floor", "table", "mug", "ever", "always", "\xf0\x9f\xa5\x9b", "\\u0000"};
    const bool same_type = below(4) != 0;
    if ((value.is_number() && same_type) || below(3) == 0) return kNumbers[below(kNumbers.size())];
    if ((value.is_string() && same_type) || below(3) == 0) return kTexts[below(kTexts.size())];
    const std::vector<Json> rest = {nullptr,
                                    true,
                                    Json::array(),
                                    Json::object(),
                                    Json::array({0, 0, 1}),
                                    std::string(1000, 'n'),
                                    std::int64_t{1} << 40,
                                    std::numeric_limits<std::uint64_t>::max()};
    return rest[below(rest.size())];
  }

  core::RandomStream stream_;
};

/// Each asks for as much of something as it can.
std::vector<std::string> extreme_questions() {
  const auto predict = [](const std::string& fields) { return R"({"id": "x", "predict": {)" + fields + "}}"; };
  const auto repeated = [](const std::string& item, int count) {
    std::string text = "[";
    for (int i = 0; i < count; ++i) {
      std::string one = item;
      if (const auto at = one.find('#'); at != std::string::npos) one.replace(at, 1, std::to_string(i));
      text += (i > 0 ? "," : "") + one;
    }
    return text + "]";
  };
  const std::string all = R"("detail": ["final_poses", "typical_runs", "inputs", "contacts", "chaos", "model_error"])";
  const std::string falls = R"({"name": "o#", "object": "box", "below": 0.2})";
  const std::string volume =
      R"({"name": "o#", "object": "ball", "inside": {"position": [0, 0, 0.#], "size": [2, 2, 2]}})";
  const std::string ever = R"({"name": "o#", "object": "box", "touched": "ball", "when": "ever"})";
  const std::string push =
      R"({"time": 0, "push": {"from": [-1e4, 0, 0.35], "to": [1e4, 0, 0.35], "duration": 1e-3, "radius": 1e6}})";
  return {predict(R"("effort": {"confidence": 0.9999999999999999})"),
          predict(R"("effort": {"confidence": 0.9999, "tolerance": 0.0001, "max_instances": 4194304})"),
          predict(R"("effort": {"exact_instances": 4194304})"),
          predict(R"("effort": {"exact_instances": 200000}, )" + all),
          predict(R"("effort": {"max_seconds": 1e6, "tolerance": 0.0001, "max_instances": 4194304}, )" + all),
          predict(R"("effort": {"max_seconds": 1e-6})"),
          predict(R"("duration": 3600, "paths": 1000, )" + all),
          predict(R"("duration": 3600, "outcomes": )" + repeated(ever, 1)),
          predict(R"("duration": 3600, "outcomes": )" + repeated(ever, 256)),
          predict(R"("duration": 1e-4, )" + all),
          predict(R"("exclusive_outcomes": )" + repeated(R"({"name": "g#", "object": "box", "face_up": true})", 15000)),
          predict(R"("exclusive_outcomes": )" + repeated(R"({"name": "g#", "object": "box", "face_up": true})", 42) +
                  ", " + all),
          predict(R"("outcomes": )" + repeated(falls, 256) + ", " + all),
          predict(R"("detail": [], "outcomes": )" + repeated(volume, 256)),
          predict(R"("exclusive_outcomes": [{"name": "g", "outcomes": )" + repeated(falls, 15000) + "}]"),
          predict(R"("outcomes": [{"name": "o", "object": "box", "all_of": )" + repeated(R"({"below": 0.#})", 15000) +
                  "}]"),
          predict(R"("actions": )" + repeated(push, 256)),
          predict(R"("actions": )" + repeated(push, 5000)),
          predict(R"("actions": [{"time": 1e300, "grasp": {"object": "box", "hand": "hand"}}])"),
          predict(R"("actions": [{"time": 0, "grasp": {"object": "box", "hand": "hand"}},
                 {"time": 0, "release": {"object": "box", "retreat": [1e4, 1e4, 1e4], "retreat_duration": 1e-300,
                 "velocity": [1e4, {"uniform": [-1e4, 1e4]}, 0], "angular_velocity": [1e4, -1e4, 1e4]}}], )" +
                  all),
          predict(R"("actions": [{"time": 0, "place": {"object": "box", "duration": 1e-300, "pose": {
                 "position": [1e4, 1e4, 1e4], "normal": {"covariance": )" +
                  repeated("[1e8,1e8,1e8,1e8,1e8,1e8]", 6) + "}}}}], " + all),
          predict(R"("actions": [{"time": 0, "pour": {"container": "box", "axis": [1e-8, 0, 0], "angle_deg": 100,
                 "duration": 1e-9}}], )" +
                  all),
          R"({"id": "x", "stability": {"object": "ball", "max_move": 1000, "max_turn_deg": 180, "duration": 3600}})",
          R"({"id": "x", "stability": {"object": "ball", "max_move": 1e-6, "max_turn_deg": 1e-4, "duration": 3600}})",
          R"({"id": "x", "view": {"time": 3600}})",
          R"({"id": "x", "view": {"time": 1e-5, "actions": )" + repeated(push, 256) + "}}",
          "{\"id\": \"x\", " + repeated("\"k#\": 0", 80000).substr(1)};
}

double peak_gigabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

class QuestionFlood : public testing::Test {
 protected:
  static QueryWorkerSettings settings(double seconds) {
    QueryWorkerSettings settings;
    settings.default_seconds = settings.most_seconds = seconds;
    settings.most_bytes = std::size_t{128} << 20;
    return settings;
  }

  static std::shared_ptr<const belief::Belief> tracked() {
    const auto belief = tests::belief_of(kScene);
    belief->step = 3;
    belief->robot = {geometry::Pose::from_translation({0.0, 0.0, 0.7})};
    belief->X_WC = belief->scene->camera->X_WC;
    for (belief::ObjectBelief& object : belief->objects) {
      object.existence = 1.0;
      object.particles.resize(4, object.particles[0]);
      for (std::size_t i = 0; i < 4; ++i) {
        object.particles[i].log_weight = std::log(0.25);
        object.particles[i].X_WO.translation.x() += 0.002 * static_cast<double>(i);
      }
    }
    return belief;
  }

  /// Every one gets its answer, and every answer is a JSON object in UTF-8.
  void throw_at(WorkerUnderTest& worker, const std::vector<std::string>& questions) {
    for (const std::string& question : questions) {
      const core::Stopwatch watch;
      worker.ask(question);
      const std::vector<std::string> answers = worker.answers(++answered_, kPatience);
      ASSERT_EQ(answers.size(), answered_)
          << "no answer in " << kPatience.count() << " s: " << question.substr(0, 2000);
      if (watch.seconds() > slowest_) {
        slowest_ = watch.seconds();
        slowest_question_ = question.substr(0, 500);
      }
      ASSERT_TRUE(core::is_utf8(answers.back())) << question.substr(0, 2000);
      ASSERT_TRUE(parse_or_discard(answers.back()).is_object()) << question.substr(0, 2000);
    }
    EXPECT_LT(peak_gigabytes(), kMostGigabytes);
    // For the record, not judged: it depends on the machine.
    RecordProperty("slowest_seconds", std::to_string(slowest_));
    RecordProperty("slowest_question", slowest_question_);
    RecordProperty("peak_gigabytes", std::to_string(peak_gigabytes()));
    EXPECT_EQ(worker.counts().failed, 0u) << worker.counts().last_failure;
    EXPECT_EQ(worker.counts().answered + worker.counts().refused, answered_);
  }

  std::size_t answered_ = 0;
  double slowest_ = 0.0;
  std::string slowest_question_;
};

TEST_F(QuestionFlood, GoodQuestionsAreAnswered) {
  WorkerUnderTest worker(settings(300.0), tracked());
  std::vector<std::string> questions = good_questions();
  // On a busy machine a first instance may take longer than they give it.
  const std::string hasty = R"("max_seconds": 0.05)";
  for (std::string& question : questions)
    if (const std::size_t at = question.find(hasty); at != std::string::npos)
      question.replace(at, hasty.size(), R"("max_seconds": 300.0)");
  throw_at(worker, questions);
  for (const std::string& answer : worker.answers(answered_, kPatience))
    EXPECT_FALSE(parse_or_discard(answer).contains("error")) << answer;
  EXPECT_EQ(worker.counts().answered, questions.size());
}

TEST_F(QuestionFlood, ThreeThousandDamagedQuestionsAreAnsweredOrRefused) {
  WorkerUnderTest worker(settings(0.02), tracked());
  Damage damage(core::RandomStream(20, core::Purpose::kTest));
  std::vector<std::string> questions;
  for (std::size_t i = 0; i < 3000; ++i) questions.push_back(damage(good_questions()[i % good_questions().size()]));
  throw_at(worker, questions);
  EXPECT_GT(worker.counts().answered, 100u);
  EXPECT_GT(worker.counts().refused, 100u);
}

TEST_F(QuestionFlood, ExtremeQuestionsAreAnsweredOrRefused) {
  WorkerUnderTest worker(settings(0.3), tracked());
  const std::vector<std::string> questions = extreme_questions();
  EXPECT_EQ(questions.size(), 27u);
  throw_at(worker, questions);
  throw_at(worker, {good_questions()[0]});
  EXPECT_THAT(worker.answers(answered_).back(), testing::HasSubstr("covariance"));
}

}  // namespace
}  // namespace prescene::service
