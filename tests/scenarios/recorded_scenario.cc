// SPDX-License-Identifier: Apache-2.0
#include "recorded_scenario.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <variant>

#include "prescene/belief/json.h"
#include "prescene/core/hash.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "tests/support/paths.h"

namespace prescene::tests {

std::shared_ptr<const belief::Scene> scenario(const std::string& name) {
  const auto loaded = service::load_scene(source_dir() / "scenarios" / (name + ".yaml"), {});
  if (!loaded.ok()) {
    ADD_FAILURE() << loaded.status().message();
    return nullptr;
  }
  return *loaded;
}

void record(belief::Scene scene, double rate, double seconds, std::uint64_t seed, const std::filesystem::path& path) {
  scene.duration = seconds;
  core::ThreadPool pool(1);
  service::Backends backends(pool);
  service::SimulatedRecordingOptions options;
  options.rate = rate;
  auto recording = service::RecordingWriter::create(path, {});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  const core::Status simulated = service::simulate_recording(scene, options, seed, backends, {}, {}, **recording);
  ASSERT_TRUE(simulated.ok()) << simulated.message();
  const core::Status closed = (*recording)->close();
  ASSERT_TRUE(closed.ok()) << closed.message();
}

Replayed replay(const std::filesystem::path& path, const std::shared_ptr<const belief::Scene>& scene,
                std::uint64_t seed, int threads) {
  Replayed replayed;
  core::ThreadPool pool(threads);
  service::Backends backends(pool);
  const auto tracker = service::Tracker::create(scene, {}, seed, backends);
  if (!tracker.ok()) {
    ADD_FAILURE() << tracker.status().message();
    return replayed;
  }
  (*tracker)->trace_stages(true);
  service::TrackingScore score(scene);
  const service::StepSink on_step = [&](const service::TrackerStep& step, const service::Tracker& at) {
    const auto number = static_cast<std::int64_t>(step.record.step);
    for (const auto& [stage, hash] : step.trace) replayed.trace.push_back({number, stage, 0, hash});
    replayed.trace.push_back({number, "belief", 0, belief::content_hash(*at.belief())});
    replayed.last_belief = service::summary_of(*at.belief());
    score.add(replayed.last_belief);
    return core::ok_status();
  };
  const service::JsonSink on_json = [&](const std::string& topic, const std::string& json, core::TimeNs) {
    if (topic != service::kTruthTopic) return core::ok_status();
    auto truth = service::truth_from_json(json);
    if (!truth.ok()) return truth.status();
    replayed.last_truth = *std::move(truth);
    score.add(replayed.last_truth);
    return core::ok_status();
  };
  const auto summary = service::replay_recording(path, {}, **tracker, {}, {}, on_step, on_json);
  if (!summary.ok()) {
    ADD_FAILURE() << summary.status().message();
    return replayed;
  }
  EXPECT_EQ(summary->refused, 0u) << summary->first_refusal;
  EXPECT_EQ(summary->skipped, 0u);
  EXPECT_EQ(summary->loss, "");
  replayed.tracking = score.rows();
  return replayed;
}

belief::Answer predict(std::shared_ptr<const belief::Scene> scene, int instances, std::uint64_t seed, int threads) {
  core::ThreadPool pool(threads);
  service::Backends backends(pool);
  belief::PredictQuery query;
  query.effort.exact_instances = instances;
  return queries::answer(std::move(scene), seed, {"predict", query}, backends.query_context(pool));
}

std::uint64_t content_hash(belief::Answer answer) {
  if (auto* predicted = std::get_if<belief::PredictAnswer>(&answer.what)) {
    predicted->wall_seconds = predicted->cpu_seconds = 0.0;
    // Who simulated is told beside the numbers and is none of them.
    predicted->stepper.clear();
    predicted->not_lockstep.clear();
  }
  return core::Hasher().text(belief::to_json(answer).dump()).digest();
}

}  // namespace prescene::tests
