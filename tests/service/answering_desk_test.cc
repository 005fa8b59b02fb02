// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/answering_desk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "prescene/service/load_scene.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

using ::testing::HasSubstr;

constexpr const char* kScene = R"(name: box
duration: 2
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {ground: {size: 2}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.2], rotation: any}}
outcomes:
  lies: {resting_on: floor}
)";

/// Keeps the answers and waits for them.
class Desk {
 public:
  explicit Desk(const DeskSettings& settings)
      : pool_(2),
        backends_(pool_),
        belief_(start()),
        desk_(std::make_unique<AnsweringDesk>(
            backends_, 1, settings, [this] { return belief_; },
            [this](const std::string&, const std::string& answer) {
              const std::lock_guard lock(mutex_);
              answers_.push_back(answer);
              changed_.notify_all();
            })) {}

  void ask(const std::string& question) { desk_->ask(question); }
  /// All of them before the second answer is begun: the first can't be handed over meanwhile.
  void ask_at_once(const std::vector<std::string>& questions) {
    const std::lock_guard lock(mutex_);
    for (const std::string& question : questions) desk_->ask(question);
  }
  std::vector<std::string> answers(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return answers_.size() >= count; });
    return answers_;
  }

 private:
  static std::shared_ptr<const belief::Belief> start() {
    const auto scene = load_scene_text(kScene, "box.yaml", {});
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    auto belief = std::make_shared<belief::Belief>();
    belief->scene = *scene;
    belief->objects.resize(1);
    belief->objects[0].name = "box";
    belief->objects[0].particles.resize(1);
    belief->objects[0].particles[0].X_WO.translation = {0.0, 0.0, 0.2};
    return belief;
  }

  core::ThreadPool pool_;
  Backends backends_;
  std::shared_ptr<const belief::Belief> belief_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> answers_;
  std::unique_ptr<AnsweringDesk> desk_;  // last: its thread ends first
};

TEST(AnsweringDesk, NoQuestionKeepsTheOthersWaitingForEver) {
  DeskSettings settings;
  settings.most_seconds = 0.2;
  Desk desk(settings);
  desk.ask(R"({"id": "long", "predict": {"effort": {"exact_instances": 4000000}}})");
  desk.ask(R"({"id": "short", "stability": {"object": "box"}})");
  const std::vector<std::string> answers = desk.answers(2);
  EXPECT_EQ(id_of(answers[0]), "long");
  const auto cut = parse_or_discard(answers[0]);
  if (cut.contains("predict")) {
    EXPECT_LT(cut["predict"]["instances"].get<int>(), 4000000);
  }
  EXPECT_EQ(id_of(answers[1]), "short");
  EXPECT_TRUE(answers[1].find("stable") != std::string::npos);
}

TEST(AnsweringDesk, WhereComesBeforeWhatHasToBeSimulated) {
  DeskSettings settings;
  settings.most_seconds = 0.2;
  Desk desk(settings);
  const auto slow = [](const std::string& id) {
    return R"({"predict": {"effort": {"exact_instances": 4000000}}, "id": ")" + id + "\"}";
  };
  desk.ask_at_once({slow("first"), slow("second"), slow("third"), R"({"id": "quick", "where": {}})",
                    R"({"id": "quick too", "where": {}})"});
  std::vector<std::string> ids;
  for (const std::string& answer : desk.answers(5)) ids.push_back(id_of(answer));
  EXPECT_LT(std::ranges::find(ids, "quick too"), std::ranges::find(ids, "second"));
  EXPECT_LT(std::ranges::find(ids, "quick"), std::ranges::find(ids, "quick too"));
}

TEST(AnsweringDesk, BeforeTheFirstFrameTheSceneFileAnswers) {
  Desk desk({});
  desk.ask(R"({"id": "1", "where": {}})");
  const auto answer = parse_or_discard(desk.answers(1).front());
  const auto covariance = answer.at("where").at("items").at(0).at("estimate").at("covariance");
  // The belief's single particle knows no turn; the scene says that any is possible.
  EXPECT_GT(covariance.at(0).at(0).get<double>(), 0.1) << answer.dump();
}

TEST(AnsweringDesk, AQuestionThatIsAskedAgainWhileItWaitsIsAnsweredOnce) {
  DeskSettings settings;
  settings.most_seconds = 0.2;
  Desk desk(settings);
  std::vector<std::string> questions = {R"({"id": "long", "predict": {"effort": {"exact_instances": 4000000}}})"};
  questions.insert(questions.end(), 40, R"({"id": "a", "stability": {"object": "box"}})");
  questions.push_back(R"({"id": "last", "stability": {"object": "box"}})");
  desk.ask_at_once(questions);
  const std::vector<std::string> answers = desk.answers(3);
  ASSERT_EQ(answers.size(), 3u);
  EXPECT_EQ(id_of(answers[0]), "long");
  EXPECT_EQ(id_of(answers[1]), "a");
  EXPECT_EQ(id_of(answers[2]), "last");
}

TEST(AnsweringDesk, AQuestionThatIsNotUnderstoodIsAnsweredWithTheReason) {
  Desk desk({});
  desk.ask("{");
  desk.ask(R"({"id": "deep", "where": )" + std::string(100000, '[') + std::string(100000, ']') + "}");
  desk.ask(R"({"id": "b", "wher": {}})");
  const std::vector<std::string> answers = desk.answers(3);
  EXPECT_THAT(answers[0], HasSubstr("not JSON"));
  EXPECT_THAT(answers[1], HasSubstr("nested deeper"));
  EXPECT_EQ(id_of(answers[2]), "b");
  EXPECT_THAT(answers[2], HasSubstr("where, predict"));
}

}  // namespace
}  // namespace prescene::service
