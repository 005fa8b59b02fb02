// SPDX-License-Identifier: Apache-2.0
#include "lane_batch.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "prescene/belief/body_names.h"

namespace prescene::simulation {
namespace {

// Steps between looks at whether the run was cancelled.
constexpr std::int64_t kCancellationSteps = 4;  // a step of all instances of a crowded scene takes 100 ms

}  // namespace

void touches_of(LaneEngine& engine, int slot, const LaneInstance& instance, std::vector<LaneTouch>& touches) {
  touches.clear();
  const CompiledLockstep& scene = engine.scene();
  const auto counts = [&](const LaneContact& c) {
    return c.impulse > 0 || static_cast<double>(c.gap) <= scene.options.touching_distance;
  };
  const Vector3d up_W = belief::up_of(scene.scene);
  const auto body_of = [&](const LaneContact& c) { return scene.lanes.parts[static_cast<std::size_t>(c.part)].number; };
  for (int object = 0; object < engine.objects(); ++object) {
    const auto contacts = engine.contacts(slot, object);
    if (contacts.empty()) continue;
    const std::size_t begin = touches.size();
    for (const LaneContact& c : contacts) {
      if (!counts(c)) continue;
      const int body = body_of(c);
      const bool known = std::any_of(touches.begin() + static_cast<std::ptrdiff_t>(begin), touches.end(),
                                     [&](const LaneTouch& t) { return t.second == body; });
      if (!known) touches.push_back({object, body, 0.0, 0.0});
    }
    std::sort(touches.begin() + static_cast<std::ptrdiff_t>(begin), touches.end(),
              [](const LaneTouch& a, const LaneTouch& b) { return a.second < b.second; });
    if (touches.size() == begin) continue;
    const double unit = engine.objects() == 1 ? instance.mass(0) : 1.0;
    const Vector3d up = engine.rotation(slot, object).conjugate() * up_W;
    for (std::size_t i = begin; i < touches.size(); ++i) {
      LaneTouch& touch = touches[i];
      Vector3d normal = Vector3d::Zero();
      for (const LaneContact& c : contacts) {
        if (!counts(c) || body_of(c) != touch.second) continue;
        const double impulse = static_cast<double>(c.impulse) * unit;
        touch.impulse += impulse;
        // The mean is weighted by impulse; touching without pressing counts only where nothing presses.
        normal +=
            std::max(impulse, 1e-12) * Vector3d(static_cast<double>(c.normal[0]), static_cast<double>(c.normal[1]),
                                                static_cast<double>(c.normal[2]));
      }
      const double norm = normal.norm();
      touch.normal_z = norm > 0.0 ? up.dot(normal) / norm : 0.0;
    }
  }
}

LaneBatch::LaneBatch(std::shared_ptr<const CompiledLockstep> scene)
    : scene_(std::move(scene)), engine_(scene_, scene_->options.live_instances) {
  bodies_ = static_cast<int>(scene_->scene.objects.size() + scene_->scene.supports.size() + scene_->scene.robot.size() +
                             scene_->pushers.size());
  const std::size_t pairs = scene_->scene.objects.size() * static_cast<std::size_t>(bodies_);
  for (int i = 0; i < engine_.slots(); ++i) {
    auto slot = std::make_unique<Slot>(*scene_);
    slot->open.resize(pairs);
    slot->touches.reserve(pairs);
    slots_.push_back(std::move(slot));
  }
  const auto count = slots_.size();
  steps_.reserve(count);
  wanted_.reserve(count);
  ended_.reserve(count);
}

void LaneBatch::run(LaneQueue& queue, int live) {
  queue_ = &queue;
  live_ = 0;
  const double dt = scene_->options.step;
  // A duration is met to the nearest step; rounding in its division must not add one.
  most_steps_ = static_cast<std::int64_t>(std::ceil(queue.request->stop.duration / dt - 1e-6));
  live = std::min(live, engine_.slots());
  std::int64_t ticks = 0;
  bool cancelled = false;
  for (;;) {
    while (live_ < live && take(queue)) {
    }
    if (live_ == 0) return;
    ended_.assign(static_cast<std::size_t>(live_), 0);
    cancelled =
        cancelled || (queue.cancellation && ticks++ % kCancellationSteps == 0 && queue.cancellation->requested());
    if (cancelled) {
      for (int at = 0; at < live_; ++at) {
        Slot& slot = *slots_[static_cast<std::size_t>(at)];
        if (slot.mode == Mode::kNudged) slot.nudges.cancel(engine_, at);
        finish(at, belief::TrajectoryEnd::kCancelled);
      }
      remove_ended();
      continue;
    }
    for (int at = 0; at < live_; ++at) {
      Slot& slot = *slots_[static_cast<std::size_t>(at)];
      if (slot.mode != Mode::kNudged) slot.instance.before_step(engine_, at);
    }
    wanted_.assign(static_cast<std::size_t>(live_), 1);
    steps_.assign(static_cast<std::size_t>(live_), 1);
    engine_.find_contacts(wanted_);
    test_balance();
    engine_.advance(steps_);
    for (int at = 0; at < live_; ++at) {
      if (steps_[static_cast<std::size_t>(at)]) after_step(at);
    }
    remove_ended();
  }
}

void LaneBatch::test_balance() {
  for (int at = 0; at < live_; ++at) {
    Slot& slot = *slots_[static_cast<std::size_t>(at)];
    if (slot.mode != Mode::kCalm) continue;
    if (slot.nudges.slides(engine_, at)) {
      slot.mode = Mode::kRuns;
      go_on(at);
      if (ended_[static_cast<std::size_t>(at)]) steps_[static_cast<std::size_t>(at)] = 0;
      continue;
    }
    steps_[static_cast<std::size_t>(at)] = 0;
    if (slot.nudges.stands_or_begins(engine_, at)) {
      finish_at_rest(at);
    } else {
      slot.mode = Mode::kNudged;
    }
  }
}

bool LaneBatch::take(LaneQueue& queue) {
  const std::size_t place = queue.next.fetch_add(1, std::memory_order_relaxed);
  if (place >= (queue.members.empty() ? queue.starts.size() : queue.members.size())) return false;
  const std::size_t index = queue.members.empty() ? place : queue.members[place];
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
  slot.tested = false;
  slot.next_sample = queue.request->sample_interval;
  slot.until_asked = queue.request->end_rule_steps;
  slot.touches.clear();
  for (Open& open : slot.open) open.open = false;
  slot.instance.start(engine_, at, queue.starts[index],
                      queue.actions.empty() ? queue.request->actions : queue.actions[index],
                      queue.stream->at(0, queue.numbers[index]));
  belief::Trajectory& trajectory = queue.trajectories[index];
  trajectory = belief::Trajectory{};
  trajectory.states.push_back(queue.starts[index]);
  skip_held(at);
}

void LaneBatch::skip_held(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  const double dt = scene_->options.step;
  // Up to the step before the next that is kept or the last, which are taken as any other.
  double until = static_cast<double>(most_steps_) - 1.0;
  if (queue_->request->sample_interval > 0.0) until = std::min(until, slot.next_sample / dt - 1.5);
  const auto most = static_cast<std::int64_t>(until - static_cast<double>(slot.instance.steps()));
  const std::int64_t skipped = slot.instance.skip_held(engine_, at, most);
  if (skipped == 0 || !queue_->request->end_rule) return;
  // What is held is not decided: the rule is asked when it would be next.
  const int each = std::max(queue_->request->end_rule_steps, 1);
  slot.until_asked = static_cast<int>((slot.until_asked - skipped) % each);
  if (slot.until_asked <= 0) slot.until_asked += each;
}

void LaneBatch::note_touches(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  const belief::WorldState& begin = queue_->starts[slot.index];
  touches_of(engine_, at, slot.instance, slot.touches);
  const double end_time = slot.instance.time();
  const double begin_time = begin.time + static_cast<double>(slot.instance.steps() - 1) * scene_->options.step;
  for (const LaneTouch& touch : slot.touches) {
    Open& open = open_of(slot, touch);
    if (open.open && begin_time - open.interval.end > scene_->options.contact_merge_time) {
      queue_->trajectories[slot.index].contacts.push_back(open.interval);
      open.open = false;
    }
    if (!open.open) {
      open.open = true;
      open.interval = {};
      open.interval.first = touch.first;
      open.interval.second = touch.second;
      open.interval.begin = begin_time;
    }
    open.interval.end = end_time;
    open.interval.largest_impulse = std::max(open.interval.largest_impulse, touch.impulse);
    open.interval.normal_z = touch.normal_z;
  }
}

void LaneBatch::note_overlap(int at) {
  double& deepest = queue_->trajectories[slots_[static_cast<std::size_t>(at)]->index].deepest_overlap;
  for (int object = 0; object < engine_.objects(); ++object)
    for (const LaneContact& c : engine_.contacts(at, object)) deepest = std::max(deepest, -static_cast<double>(c.gap));
}

void LaneBatch::after_step(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  if (slot.mode == Mode::kNudged) {
    const NudgeTest::Verdict verdict = slot.nudges.after_step(engine_, at);
    if (verdict == NudgeTest::Verdict::kGoesOn) return;
    if (verdict == NudgeTest::Verdict::kReturns) {
      finish_at_rest(at);
      return;
    }
    slot.mode = Mode::kRuns;
    slot.tested = true;
    go_on(at);
    return;
  }
  slot.instance.after_step(engine_, at);
  if (engine_.diverged(at)) {
    finish(at, belief::TrajectoryEnd::kDiverged);
    return;
  }
  note_touches(at);
  for (int object = 0; object < engine_.objects(); ++object)
    queue_->trajectories[slot.index].dropped_contacts += engine_.dropped(at, object);
  if (slot.instance.began()) note_overlap(at);
  freeze_beyond(at);
  const bool calm = slot.instance.calm(engine_, at);
  if (!calm) slot.tested = false;
  if (!queue_->request->stop.stop_at_rest) {
    if (slot.instance.all_frozen(engine_, at)) {
      finish_at_rest(at);
      return;
    }
  } else if (calm && !slot.tested) {
    slot.mode = Mode::kCalm;
    return;
  }
  go_on(at);
}

void LaneBatch::freeze_beyond(int at) {
  const double radius = queue_->request->stop.world_radius;
  for (int object = 0; object < engine_.objects(); ++object) {
    if (engine_.free(at, object) && engine_.distance_squared(at, object) > radius * radius) engine_.freeze(at, object);
  }
}

void LaneBatch::finish_at_rest(int at) {
  bool left = false;
  for (int object = 0; object < engine_.objects(); ++object) {
    left = left || engine_.motion(at, object) == LaneMotion::kFrozen;
  }
  finish(at, left ? belief::TrajectoryEnd::kLeftTheWorld : belief::TrajectoryEnd::kAtRest);
}

void LaneBatch::go_on(int at) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  if (slot.instance.steps() >= most_steps_) {
    finish(at, belief::TrajectoryEnd::kDuration);
    return;
  }
  const RunRequest& request = *queue_->request;
  const double dt = scene_->options.step;
  const double elapsed = static_cast<double>(slot.instance.steps()) * dt;
  if (request.end_rule && --slot.until_asked <= 0) {
    slot.until_asked = request.end_rule_steps;
    slot.instance.read(engine_, at, seen_);
    if (request.end_rule->ends(seen_, request.stop.duration - elapsed)) {
      finish(at, belief::TrajectoryEnd::kDecided);
      return;
    }
  }
  const double interval = request.sample_interval;
  if (interval > 0.0 && elapsed >= slot.next_sample - 0.5 * dt) {
    auto& states = queue_->trajectories[slot.index].states;
    states.emplace_back();
    slot.instance.read(engine_, at, states.back());
    while (slot.next_sample - 0.5 * dt <= elapsed) slot.next_sample += interval;
  }
  skip_held(at);
}

void LaneBatch::finish(int at, belief::TrajectoryEnd end) {
  Slot& slot = *slots_[static_cast<std::size_t>(at)];
  belief::Trajectory& trajectory = queue_->trajectories[slot.index];
  trajectory.end = end;
  if (end != belief::TrajectoryEnd::kDiverged) {
    belief::WorldState final_state;
    slot.instance.read(engine_, at, final_state);
    trajectory.states.push_back(std::move(final_state));
    for (const LaneTouch& touch : slot.touches) trajectory.final_contacts.emplace_back(touch.first, touch.second);
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
  trajectory.simulated_seconds = static_cast<double>(slot.instance.steps()) * scene_->options.step;
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
