// SPDX-License-Identifier: Apache-2.0
// A worker over a belief of one box, whose answers are kept.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "prescene/service/live/query_worker.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/outside_json.h"

namespace prescene::tests {

inline constexpr const char* kBoxScene = R"(name: box
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

/// The scene's objects where the scene says that they are on average, as before the first frame.
inline std::shared_ptr<belief::Belief> belief_of(const char* scene_text) {
  const auto scene = service::load_scene_text(scene_text, "scene.yaml", {});
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  auto belief = std::make_shared<belief::Belief>();
  belief->scene = *scene;
  for (const belief::SceneObject& object : (*scene)->objects) {
    belief::ObjectBelief& known = belief->objects.emplace_back();
    known.name = object.name;
    known.model = object.model;
    known.particles.resize(1);
    known.particles[0].X_WO = belief::mean(object.pose);
    known.particles[0].X_WO.rotation = geometry::Quaterniond::Identity();
  }
  return belief;
}

/// Is answered from so many instances however long they take, where the worker's own limit is far.
inline std::string short_question(const std::string& id) {
  std::string question = R"({"id": ")";
  question += id;
  question += R"(", "stability": {"object": "box", "effort": {"exact_instances": 8}}})";
  return question;
}

/// The answers by their ids, of which each is another. When one question is done the next one of its client begins, and
/// its answer may come before that of the first has been handed over: no order of the two is promised.
inline std::map<std::string, std::string> by_id(const std::vector<std::string>& answers) {
  std::map<std::string, std::string> found;
  for (const std::string& answer : answers)
    EXPECT_TRUE(found.emplace(service::id_of(answer), answer).second) << "answered twice: " << answer;
  return found;
}

/// Keeps the answers and waits for them.
class WorkerUnderTest {
 public:
  using Snapshot = std::function<std::shared_ptr<const belief::Belief>()>;

  /// `before` is called with each answer before it is kept.
  explicit WorkerUnderTest(const service::QueryWorkerSettings& settings,
                           std::shared_ptr<const belief::Belief> belief = {}, const Snapshot& snapshot = {},
                           const service::AnswerSink& before = {})
      : pool_(2), backends_(pool_), belief_(belief ? std::move(belief) : belief_of(kBoxScene)) {
    worker_ = std::make_unique<service::QueryWorker>(
        backends_, 1, settings, snapshot ? snapshot : [this] { return belief_; },
        [this, before](const std::string& answer) {
          if (before) before(answer);
          const std::lock_guard lock(mutex_);
          answers_.push_back(answer);
          changed_.notify_all();
        });
  }

  void ask(const std::string& question, const std::string& client = "") { worker_->ask(question, client); }
  /// All of them before any answer that comes meanwhile can be handed over; `then` is called before it can, too.
  void ask_at_once(const std::vector<std::string>& questions, const std::function<void()>& then = {}) {
    const std::lock_guard lock(mutex_);
    for (const std::string& question : questions) worker_->ask(question);
    if (then) then();
  }
  std::vector<std::string> answers(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return answers_.size() >= count; });
    return answers_;
  }
  /// As long as `patience` lasts; fewer than asked for then.
  std::vector<std::string> answers(std::size_t count, std::chrono::seconds patience) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, patience, [&] { return answers_.size() >= count; });
    return answers_;
  }
  void turn_away(const std::string& id, const core::Status& reason) { worker_->turn_away(id, reason); }
  void set_most_seconds(double seconds) { worker_->set_most_seconds(seconds); }
  void begin_session(core::TimeNs first_frame_ns) { worker_->begin_session(first_frame_ns); }
  service::QueryCounts counts() const { return worker_->counts(); }

 private:
  core::ThreadPool pool_;
  service::Backends backends_;
  std::shared_ptr<const belief::Belief> belief_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> answers_;
  std::unique_ptr<service::QueryWorker> worker_;  // last: its threads end first
};

}  // namespace prescene::tests
