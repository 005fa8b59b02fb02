// SPDX-License-Identifier: Apache-2.0
// Physical parameters: still frames leave live answers at the priors, a push tells friction, and a drop onto an edge
// little.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "benchmarks/filter_targets.h"
#include "prescene/belief/json.h"
#include "prescene/filter/operators/learn_physics.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/simulated_recording.h"
#include "tests/filter/pushed_box.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

constexpr double kCameraRate = 30.0;  // Hz
constexpr std::array<int, 3> kAsked = {30, 300, 3000};

/// A box that a hand holds just above a slope of 20 degrees: let go, it slides where its friction is below 0.364.
std::string slope_scene(double duration) {
  return "name: slope\nduration: " + std::to_string(duration) + R"(
models:
  box: {box: [0.1, 0.08, 0.06], mass: 0.4, friction: {uniform: [0.1, 0.9]}}
supports:
  slope: {box: [1.2, 0.8, 0.04], pose: {position: [-0.0068404, 0, -0.018793852], rotation: {axis_angle_deg: [0, 1, 0, 20]}}, friction: 1.0}
robot:
  hand: {box: [0.02, 0.02, 0.1], timeline: [{time: 0, position: [0.0345, 0, 0.125]}]}
objects:
  box:
    model: box
    pose: {position: [0.0104, 0, 0.0286], rotation: {axis_angle_deg: [0, 1, 0, 20]}}
    held_by: hand
camera:
  width: 160
  height: 120
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
)";
}

constexpr const char* kLetGo = R"({"predict": {"duration": 1.5,
  "actions": [{"time": 0, "release": {"object": "box", "retreat": [0, 0, 0.2]}}],
  "outcomes": {"slides": {"object": "box", "moved_more_than": 0.05}}}})";

core::Result<belief::OutcomeProbability> outcome_of(const belief::Answer& answer) {
  PRESCENE_RETURN_IF_ERROR(answer.error);
  return std::get<belief::PredictAnswer>(answer.what).outcomes.at(0);
}

core::Status add_law(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "still.mcap";
  service::Backends backends(threads, {});
  const std::string yaml = slope_scene((effort.law_frames + 1) / kCameraRate);
  PRESCENE_TRY(const auto scene, service::load_scene_text(yaml, "slope.yaml", {}));
  PRESCENE_TRY(const auto recording, service::RecordingWriter::create(path, {"slope.yaml", yaml, effort.seed, ""}));
  service::SimulatedRecordingOptions options;
  options.rate = kCameraRate;
  PRESCENE_RETURN_IF_ERROR(simulate_recording(*scene, options, effort.seed, backends, {}, {}, *recording));
  PRESCENE_RETURN_IF_ERROR(recording->close());
  PRESCENE_TRY(const belief::Query query, belief::query_from_json(kLetGo));
  PRESCENE_TRY(const belief::OutcomeProbability prior,
               outcome_of(queries::answer(scene, effort.seed, query, backends.query_context(threads))));
  int outside = 0, asked = 0;
  double largest = 0.0;
  Table table{"still_frames", {"seed", "frames", "live answer", "low", "high", "from the priors"}, {}};
  for (int k = 0; k < effort.law_seeds; ++k) {
    const std::uint64_t seed = effort.seed + static_cast<std::uint64_t>(k);
    PRESCENE_TRY(const auto tracker, service::Tracker::create(scene, {}, seed, backends));
    int frame = 0;
    const service::StepSink on_step = [&](const service::TrackerStep&, const service::Tracker& at) -> core::Status {
      if (std::find(kAsked.begin(), kAsked.end(), ++frame) == kAsked.end()) return core::ok_status();
      PRESCENE_TRY(const belief::OutcomeProbability live,
                   outcome_of(queries::answer(*at.belief(), query, backends.query_context(threads))));
      ++asked;
      outside += live.low > prior.high || live.high < prior.low;
      largest = std::max(largest, std::abs(live.probability - prior.probability));
      table.rows.push_back({static_cast<std::int64_t>(seed), std::int64_t{frame}, live.probability, live.low, live.high,
                            prior.probability});
      return core::ok_status();
    };
    PRESCENE_RETURN_IF_ERROR(service::replay_recording(path, {}, *tracker, {}, {}, on_step, {}).status());
  }
  report->add({.work = "still frames: live answers whose interval misses the prior's",
               .better = Better::kLower,
               .must = at_most(0.0),
               .aim = at_most(0.0),
               .reached = outside,
               .unit = "answers",
               .n = asked,
               .baseline = "the answer from the scene's priors",
               .why = "after 30, 300 and 3000 frames, up to " + std::to_string(effort.law_frames) + "; " +
                      std::to_string(effort.law_seeds) + " seeds; largest distance " + std::to_string(largest)});
  report->add(std::move(table));
  return core::ok_status();
}

struct Learned {
  bool lesson = false;
  std::vector<belief::ParameterEstimate> parameters;
};

Learned learned_from(std::vector<belief::Belief> frames, core::ThreadPool& threads) {
  belief::PhysicalBelief physics;
  belief::MotionRecord motion;
  for (belief::Belief& belief : frames) {
    belief.objects[0].physics = physics;
    belief.objects[0].motion = motion;
    filter::learn_physics(belief, {}, filter_tests::push_simulators(), threads);
    physics = belief.objects[0].physics;
    motion = belief.objects[0].motion;
  }
  return {physics.lessons > 0, belief::parameter_estimates(frames[0].scene->models[0], physics)};
}

bool holds(const belief::ParameterEstimate& estimate, double truth) {
  return estimate.low <= truth && truth <= estimate.high;
}

/// A box is dropped onto an edge and tumbles: little can be learned, and no more must be.
void add_drops(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  int held = 0, lessons = 0;
  for (int i = 0; i < effort.pushes; ++i) {
    const std::uint64_t seed = 1000 * effort.seed + static_cast<std::uint64_t>(i);
    core::RandomStream draws(seed, core::Purpose::kParameters);
    filter_tests::Drop drop;
    drop.friction = std::clamp(0.4 + 0.1 * draws.normal(), 0.1, 0.8);
    drop.restitution = std::clamp(0.2 + 0.1 * draws.normal(), 0.0, 0.6);
    drop.height = draws.uniform(0.05, 0.2);
    drop.over = draws.uniform(-0.01, 0.03);
    drop.tilt = draws.uniform(-0.2, 0.2);
    const Learned learned = learned_from(filter_tests::tracked_drop(drop, seed, threads), threads);
    lessons += learned.lesson;
    held += holds(learned.parameters[0], drop.friction) + holds(learned.parameters[1], drop.restitution);
  }
  report->add({.work = "friction and restitution after one drop onto an edge: 90 % interval holds the truth",
               .better = Better::kWithin,
               .must = Goal{85.0, 95.0},
               .aim = Goal{88.0, 92.0},
               .reached = 50.0 * held / std::max(1, effort.pushes),
               .unit = "%",
               .n = 2 * effort.pushes,
               .baseline = "the simulated values, drawn from the priors",
               .why = std::to_string(lessons) + " of " + std::to_string(effort.pushes) + " drops were learned from"});
}

void add_pushes(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  int held = 0, lessons = 0;
  double width = 0.0;
  for (int i = 0; i < effort.pushes; ++i) {
    const std::uint64_t seed = 1000 * effort.seed + static_cast<std::uint64_t>(i);
    core::RandomStream draws(seed, core::Purpose::kParameters);
    filter_tests::Push push;
    push.friction = draws.uniform(0.1, 0.9);
    push.mass = std::clamp(0.4 + 0.05 * draws.normal(), 0.2, 0.6);
    push.speed = draws.uniform(0.3, 0.8);
    push.aside = draws.uniform(-0.015, 0.015);
    const Learned learned = learned_from(filter_tests::tracked_push(push, seed, threads), threads);
    const belief::ParameterEstimate& friction = learned.parameters[0];
    lessons += learned.lesson;
    held += holds(friction, push.friction);
    width += (friction.high - friction.low) / effort.pushes;
  }
  constexpr double kPriorWidth = 0.9 * 0.8;  // 90 % of a uniform prior from 0.1 to 0.9
  const std::string why = std::to_string(lessons) + " of the pushes were learned from";
  report->add({.work = "friction after one push: 90 % interval holds the truth",
               .better = Better::kWithin,
               .must = Goal{85.0, 95.0},
               .aim = Goal{88.0, 92.0},
               .reached = 100.0 * held / std::max(1, effort.pushes),
               .unit = "%",
               .n = effort.pushes,
               .baseline = "the simulated friction, drawn from the prior",
               .why = why});
  report->add({.work = "friction after one push: interval narrower than the prior's",
               .must = at_least(2.0),
               .aim = at_least(4.0),
               .reached = kPriorWidth / std::max(width, 1e-9),
               .unit = "x",
               .n = effort.pushes,
               .baseline = "the prior's 90 % interval; mean width",
               .why = why});
}

}  // namespace

core::Status add_physics_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  PRESCENE_RETURN_IF_ERROR(add_law(effort, threads, report));
  add_pushes(effort, threads, report);
  add_drops(effort, threads, report);
  return core::ok_status();
}

}  // namespace prescene::benchmarks
