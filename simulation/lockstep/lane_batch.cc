// SPDX-License-Identifier: Apache-2.0
#include "lane_batch.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace prescene::simulation {
namespace {

// Steps between looks at whether the run was cancelled.
constexpr std::int64_t kCancellationSteps = 16;

}  // namespace

void touches_of(LaneEngine& engine, int slot, double mass, std::vector<LaneTouch>& touches) {
  touches.clear();
  const CompiledLockstep& scene = engine.scene();
  const auto contacts = engine.contacts(slot);
  if (contacts.empty()) return;
  const auto counts = [&](const LaneContact& c) {
    return c.impulse > 0 || static_cast<double>(c.gap) <= scene.options.touching_distance;
  };
  const auto body_of = [&](const LaneContact& c) { return scene.lanes.fixed[static_cast<std::size_t>(c.part)].body; };
  for (const LaneContact& c : contacts) {
    if (!counts(c)) continue;
    const int body = body_of(c);
    const bool known = std::any_of(touches.begin(), touches.end(), [&](const LaneTouch& t) { return t.body == body; });
    if (!known) touches.push_back({body, 0.0, 0.0});
  }
  std::sort(touches.begin(), touches.end(), [](const LaneTouch& a, const LaneTouch& b) { return a.body < b.body; });
  if (touches.empty()) return;
  const Vector3d up = engine.rotation(slot).conjugate() * Vector3d::UnitZ();
  for (LaneTouch& touch : touches) {
    Vector3d normal = Vector3d::Zero();
    for (const LaneContact& c : contacts) {
      if (!counts(c) || body_of(c) != touch.body) continue;
      const double impulse = static_cast<double>(c.impulse) * mass;
      touch.impulse += impulse;
      // The mean is weighted by impulse; touching without pressing counts only where nothing presses.
      normal += std::max(impulse, 1e-12) * Vector3d(static_cast<double>(c.normal[0]), static_cast<double>(c.normal[1]),
                                                    static_cast<double>(c.normal[2]));
    }
    const double norm = normal.norm();
    touch.normal_z = norm > 0.0 ? up.dot(normal) / norm : 0.0;
  }
}

LaneBatch::LaneBatch(std::shared_ptr<const CompiledLockstep> scene)
    : scene_(std::move(scene)), engine_(scene_, scene_->options.live_instances) {
  const std::size_t bodies = 1 + scene_->scene.supports.size();
  for (int i = 0; i < engine_.slots(); ++i) {
    auto slot = std::make_unique<Slot>();
    slot->open.resize(bodies);
    slot->touches.reserve(bodies);
    slots_.push_back(std::move(slot));
  }
  const auto count = slots_.size();
  steps_.reserve(count);
  wanted_.reserve(count);
  ended_.reserve(count);
  rest_steps_ = static_cast<int>(std::ceil(scene_->options.rest.time / scene_->options.step));
}

void LaneBatch::run(LaneQueue& queue, int live) {
  queue_ = &queue;
  live_ = 0;
  const double dt = scene_->options.step;
  // A duration is met to the nearest step; rounding in its division must not add one.
  most_steps_ = static_cast<std::int64_t>(std::ceil(queue.request->stop.duration / dt - 1e-6));
  live = std::min(live, engine_.slots());
  std::int64_t ticks = 0;
  for (;;) {
    while (live_ < live && take(queue)) {
    }
    if (live_ == 0) return;
    ended_.assign(static_cast<std::size_t>(live_), 0);
    if (queue.cancellation && ticks++ % kCancellationSteps == 0 && queue.cancellation->requested()) {
      for (int at = 0; at < live_; ++at) {
        Slot& slot = *slots_[static_cast<std::size_t>(at)];
        if (slot.mode == Mode::kNudged) slot.nudges.cancel(engine_, at);
        finish(at, belief::TrajectoryEnd::kCancelled);
      }
      remove_ended();
      continue;
    }
    wanted_.assign(static_cast<std::size_t>(live_), 1);
    steps_.assign(static_cast<std::size_t>(live_), 1);
    engine_.find_contacts(wanted_);
    for (int at = 0; at < live_; ++at) {
      Slot& slot = *slots_[static_cast<std::size_t>(at)];
      if (slot.mode != Mode::kCalm) continue;
      steps_[static_cast<std::size_t>(at)] = 0;
      const LaneFooting footing = footing_of(engine_, at);
      if (footing.firm) {
        finish(at, belief::TrajectoryEnd::kAtRest);
      } else {
        slot.mode = Mode::kNudged;
        slot.nudges.begin(engine_, at, footing.height);
      }
    }
    engine_.advance(steps_);
    for (int at = 0; at < live_; ++at) {
      if (steps_[static_cast<std::size_t>(at)]) after_step(at);
    }
    remove_ended();
  }
}

bool LaneBatch::take(LaneQueue& queue) {
  const std::size_t index = queue.next.fetch_add(1, std::memory_order_relaxed);
  if (index >= queue.starts.size()) return false;
  const int at = live_++;
  start(*slots_[static_cast<std::size_t>(at)], at, index, queue);
  if (most_steps_ > 0) return true;
  ended_.assign(static_cast<std::size_t>(live_), 0);
  finish(at, belief::TrajectoryEnd::kDuration);
  --live_;
  return true;
}

void LaneBatch::start(Slot& slot, int at, std::size_t index, LaneQueue& queue) {
  slot.index = index;
  slot.mode = Mode::kRuns;
  slot.done = 0;
  slot.calm_steps = 0;
  slot.tested = false;
  slot.next_sample = queue.request->sample_interval;
  slot.until_asked = queue.request->end_rule_steps;
  slot.touches.clear();
  for (Open& open : slot.open) open.open = false;
  engine_.reset(at, queue.starts[index].objects.front());
  belief::Trajectory& trajectory = queue.trajectories[index];
  trajectory = belief::Trajectory{};
  trajectory.states.push_back(queue.starts[index]);
}

void LaneBatch::read(int at, belief::WorldState& state) const {
  const Slot& slot = *slots_[static_cast<std::size_t>(at)];
  const belief::WorldState& begin = queue_->starts[slot.index];
  state = begin;
  state.time = begin.time + static_cast<double>(slot.done) * scene_->options.step;
  belief::ObjectState& object = state.objects.front();
  engine_.read(at, object);
  object.mode = slot.calm_steps >= rest_steps_ ? belief::MotionMode::kResting : belief::MotionMode::kMoving;
}

void LaneBatch::note_touches(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  const belief::WorldState& begin = queue_->starts[slot.index];
  touches_of(engine_, at, begin.objects.front().physical.mass, slot.touches);
  const double end_time = begin.time + static_cast<double>(slot.done) * scene_->options.step;
  const double begin_time = begin.time + static_cast<double>(slot.done - 1) * scene_->options.step;
  for (const LaneTouch& touch : slot.touches) {
    Open& open = slot.open[static_cast<std::size_t>(touch.body)];
    if (open.open && begin_time - open.interval.end > scene_->options.contact_merge_time) {
      queue_->trajectories[slot.index].contacts.push_back(open.interval);
      open.open = false;
    }
    if (!open.open) {
      open.open = true;
      open.interval = {};
      open.interval.second = touch.body;
      open.interval.begin = begin_time;
    }
    open.interval.end = end_time;
    open.interval.largest_impulse = std::max(open.interval.largest_impulse, touch.impulse);
    open.interval.normal_z = touch.normal_z;
  }
}

void LaneBatch::after_step(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  if (slot.mode == Mode::kNudged) {
    const NudgeTest::Verdict verdict = slot.nudges.after_step(engine_, at);
    if (verdict == NudgeTest::Verdict::kGoesOn) return;
    if (verdict == NudgeTest::Verdict::kReturns) {
      finish(at, belief::TrajectoryEnd::kAtRest);
      return;
    }
    slot.mode = Mode::kRuns;
    slot.tested = true;
    go_on(at);
    return;
  }
  ++slot.done;
  if (engine_.diverged(at)) {
    finish(at, belief::TrajectoryEnd::kDiverged);
    return;
  }
  slot.calm_steps = engine_.energy(at) < scene_->options.rest.energy ? slot.calm_steps + 1 : 0;
  note_touches(at);
  const StopRule& stop = queue_->request->stop;
  if (engine_.distance_squared(at) > stop.world_radius * stop.world_radius) {
    engine_.stop(at);
    finish(at, belief::TrajectoryEnd::kLeftTheWorld);
    return;
  }
  if (slot.calm_steps < rest_steps_) slot.tested = false;
  if (stop.stop_at_rest && slot.calm_steps >= rest_steps_ && !slot.tested) {
    slot.mode = Mode::kCalm;
    return;
  }
  go_on(at);
}

void LaneBatch::go_on(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  if (slot.done >= most_steps_) {
    finish(at, belief::TrajectoryEnd::kDuration);
    return;
  }
  const RunRequest& request = *queue_->request;
  const double dt = scene_->options.step;
  const double elapsed = static_cast<double>(slot.done) * dt;
  if (request.end_rule && --slot.until_asked <= 0) {
    slot.until_asked = request.end_rule_steps;
    read(at, seen_);
    if (request.end_rule->ends(seen_, request.stop.duration - elapsed)) {
      finish(at, belief::TrajectoryEnd::kDecided);
      return;
    }
  }
  const double interval = request.sample_interval;
  if (interval <= 0.0) return;
  if (elapsed < slot.next_sample - 0.5 * dt) return;
  auto& states = queue_->trajectories[slot.index].states;
  states.emplace_back();
  read(at, states.back());
  while (slot.next_sample - 0.5 * dt <= elapsed) slot.next_sample += interval;
}

void LaneBatch::finish(int at, belief::TrajectoryEnd end) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  belief::Trajectory& trajectory = queue_->trajectories[slot.index];
  trajectory.end = end;
  if (end != belief::TrajectoryEnd::kDiverged) {
    belief::WorldState final_state;
    read(at, final_state);
    trajectory.states.push_back(std::move(final_state));
    for (const LaneTouch& touch : slot.touches) trajectory.final_contacts.emplace_back(0, touch.body);
  } else {
    // The last state that was kept is the last that means something.
    trajectory.states.push_back(trajectory.states.back());
  }
  for (const Open& open : slot.open) {
    if (open.open) trajectory.contacts.push_back(open.interval);
  }
  std::sort(trajectory.contacts.begin(), trajectory.contacts.end(),
            [](const belief::ContactInterval& a, const belief::ContactInterval& b) {
              return std::tie(a.begin, a.first, a.second) < std::tie(b.begin, b.first, b.second);
            });
  trajectory.simulated_seconds = static_cast<double>(slot.done) * scene_->options.step;
  ended_[static_cast<std::size_t>(at)] = 1;
}

void LaneBatch::remove_ended() {
  for (int at = live_ - 1; at >= 0; --at) {
    if (!ended_[static_cast<std::size_t>(at)]) continue;
    const int last = --live_;
    if (at == last) continue;
    engine_.move(last, at);
    std::swap(slots_[static_cast<std::size_t>(at)], slots_[static_cast<std::size_t>(last)]);
  }
}

}  // namespace prescene::simulation
