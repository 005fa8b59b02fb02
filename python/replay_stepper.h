// SPDX-License-Identifier: Apache-2.0
// Tracks a recording step by step, each step when it is asked for: for a loop of the caller's. Nothing here knows
// Python.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "bound_scene.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/replay_input.h"

namespace prescene::python {

struct ReplayRequest {
  service::ReplayInputOptions input;
  std::optional<std::uint64_t> seed;  ///< Empty: the recording's own, or 1.
  std::string learned;                ///< A learned file to begin with; empty: none.
  int threads = 0;
};

/// What one step came to. Never changes.
struct ReplayFrame {
  std::shared_ptr<const belief::Belief> belief;
  service::BeliefSummary summary;
  service::StepRecord record;
  belief::RgbdFrame images;
  geometry::Pose X_WC;
  double seconds = 0.0;  ///< Since the first frame, by the stamps.
};

class ReplayStepper {
 public:
  /// As `prescene replay` opens it: errors of ReplayInput::open, Tracker::create and interfaces::parse_learned, and
  /// kInvalidInput for numbers out of range.
  static core::Result<std::unique_ptr<ReplayStepper>> open(const ReplayRequest& request, const core::LogSink& log);
  ~ReplayStepper() { close(); }
  ReplayStepper(const ReplayStepper&) = delete;
  ReplayStepper& operator=(const ReplayStepper&) = delete;

  /// The next step; null at the end. kCancelled where `cancellation` was requested before the step was done: it is
  /// then the next one. kInvalidInput where another thread is asking already, and, once, where no frame was of use.
  core::Result<std::shared_ptr<const ReplayFrame>> next(const core::Cancellation& cancellation);
  /// The frame that next() gave, where nobody has asked since, is the next one again.
  void give_back(std::shared_ptr<const ReplayFrame> frame);
  /// Ends it early, from any thread. Returns when its own thread has ended, which takes as long as a step at most.
  void close();

  const std::shared_ptr<const belief::Scene>& scene() const { return input_.scene(); }
  std::uint64_t seed() const { return seed_; }
  /// What was learned of physical parameters up to the newest step, as a learned file.
  std::string learned() const;
  /// What `prescene replay --json` says of the whole, as JSON; "" before the end.
  std::string summary_json() const;

 private:
  ReplayStepper(service::ReplayInput input, std::shared_ptr<Engine> engine, std::unique_ptr<service::Tracker> tracker,
                std::uint64_t seed);
  void track();
  core::Status deliver(const service::TrackerStep& step);

  const service::ReplayInput input_;
  const std::shared_ptr<Engine> engine_;
  const std::unique_ptr<service::Tracker> tracker_;
  const std::uint64_t seed_;
  core::Cancellation closed_;
  std::atomic<bool> is_asked_{false};
  std::optional<core::TimeNs> first_ns_;  // the tracking thread's

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  bool wanted_ = false;
  bool ended_ = false;
  std::shared_ptr<const ReplayFrame> frame_;  // made and not yet taken
  core::Status end_;                          // why it ended, until it was reported
  std::string summary_json_;
  std::exception_ptr exception_;  // that ended it, until it was reported

  std::mutex thread_mutex_;  // guards thread_
  std::thread thread_;       // made by the first next()
};

}  // namespace prescene::python
