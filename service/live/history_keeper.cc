// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/history_keeper.h"

#include <exception>
#include <utility>

namespace prescene::service {

HistoryKeeper::HistoryKeeper(Backends& backends, const HistorySettings& settings)
    : backends_(backends), settings_(settings), thread_([this] { work(); }) {}

HistoryKeeper::~HistoryKeeper() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  changed_.notify_all();
  thread_.join();
}

void HistoryKeeper::note(std::shared_ptr<const belief::Belief> belief) {
  if (!(settings_.rate > 0.0)) return;
  const std::lock_guard lock(mutex_);
  const core::TimeNs since = belief->stamp_ns - taken_ns_;
  // Two cameras may have taken frames at one instant.
  const bool goes_on = since > 0 || (since == 0 && !belief->cameras.empty());
  const bool is_soon = taken_ns_ != 0 && goes_on && core::seconds_of(since) < 1.0 / settings_.rate - 1e-3;
  if (is_soon) {
    ++skipped_;
    return;
  }
  taken_ns_ = belief->stamp_ns;
  if (next_) ++skipped_;  // it was not begun yet
  next_ = std::move(belief);
  changed_.notify_one();
}

std::shared_ptr<const belief::ObservedTimeline> HistoryKeeper::timeline() const {
  const std::lock_guard lock(mutex_);
  return timeline_;
}

void HistoryKeeper::work() {
  queries::RelationHistory history(settings_.history);
  for (;;) {
    std::shared_ptr<const belief::Belief> belief;
    std::uint64_t skipped = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_.requested() || next_; });
      if (stop_.requested()) return;
      belief = std::exchange(next_, nullptr);
      skipped = std::exchange(skipped_, 0);
    }
    history.skip(skipped);
    try {
      queries::QueryContext context = backends_.query_context(pool_);
      context.cancellation = context.abandoned = &stop_;
      static_cast<void>(history.add(*belief, context));  // the history counts and tells those that failed
    } catch (const std::exception& error) {
      history.fail(error.what());
    }
    auto timeline = history.timeline();
    const std::lock_guard lock(mutex_);
    timeline_ = std::move(timeline);
  }
}

}  // namespace prescene::service
