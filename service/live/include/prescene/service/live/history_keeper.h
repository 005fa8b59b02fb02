// SPDX-License-Identifier: Apache-2.0
// Keeps the history of relations of a live service, on a thread of its own and at a bounded rate, so that no frame
// waits for it. Where it can't keep up the newest belief is taken; those left out are counted in the timeline.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>

#include "prescene/belief/belief.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/queries/relation_history.h"
#include "prescene/service/backends.h"

namespace prescene::service {

struct HistorySettings {
  queries::HistoryOptions history = {.seconds = 20.0, .most_intervals = 2048, .draws = 32, .begins = 0.6, .ends = 0.4};
  double rate = 10.0;  ///< Beliefs a second of their stamps, at most; 0 = no history is kept.
};

class HistoryKeeper {
 public:
  /// `backends` must outlive it.
  HistoryKeeper(Backends& backends, const HistorySettings& settings);
  /// Stops what is being worked out.
  ~HistoryKeeper();
  HistoryKeeper(const HistoryKeeper&) = delete;
  HistoryKeeper& operator=(const HistoryKeeper&) = delete;

  /// A step's belief; returns at once.
  void note(std::shared_ptr<const belief::Belief> belief);
  /// What is known by now; null before the first belief. From any thread.
  std::shared_ptr<const belief::ObservedTimeline> timeline() const;

 private:
  void work();

  Backends& backends_;
  HistorySettings settings_;
  core::ThreadPool pool_{1};
  core::Cancellation stop_;
  mutable std::mutex mutex_;  // guards all below but the thread
  std::condition_variable changed_;
  std::shared_ptr<const belief::Belief> next_;
  core::TimeNs taken_ns_ = 0;
  std::uint64_t skipped_ = 0;  // since the last that was worked out
  std::shared_ptr<const belief::ObservedTimeline> timeline_;
  std::thread thread_;  // last: it uses all above
};

}  // namespace prescene::service
