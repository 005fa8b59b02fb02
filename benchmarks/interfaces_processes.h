// SPDX-License-Identifier: Apache-2.0
// The parts of a robot's computer as processes of their own, as on a robot: who tracks, who records, who only listens.
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "prescene/core/progress.h"

namespace prescene::benchmarks {

/// What a frame took, s from its writing.
struct FrameTimes {
  double begun = 0.0;  ///< Until the belief step began, at most: publishing the belief is counted in.
  double published = 0.0;
  double step = 0.0;
};

/// Memory that a process shares with those that it starts; for figures of trivial type.
template <class T>
class SharedFigures {
 public:
  explicit SharedFigures(std::size_t most);
  ~SharedFigures();
  SharedFigures(const SharedFigures&) = delete;
  SharedFigures& operator=(const SharedFigures&) = delete;

  /// By one process.
  void add(const T& figure) {
    const std::size_t i = block_->count.load();
    if (i < most_) values()[i] = figure;
    block_->count.store(std::min(most_, i + 1));
  }
  std::vector<T> all() const { return {values(), values() + block_->count.load()}; }

 private:
  struct Block {
    std::atomic<std::size_t> count;
  };
  T* values() const { return reinterpret_cast<T*>(block_ + 1); }
  std::size_t most_;
  Block* block_;
};

/// A process that runs `work` until it is stopped. To be started before this one has threads.
class Child {
 public:
  static Child start(const std::function<void(const core::Cancellation&)>& work);
  /// Waits until it ends by itself.
  void wait();
  /// Asks it to end, or kills it, and waits. Nothing where it has ended.
  void stop(bool by_kill = false);
  /// Processor seconds so far.
  double processor_seconds() const;

 private:
  explicit Child(pid_t id) : id_(id) {}
  pid_t id_;
};

/// Tracks a scene on a domain, with a live view at a port of this machine if one is given; one figure a step.
void run_service(const std::string& scene_yaml, int domain, SharedFigures<FrameTimes>& frames,
                 const core::Cancellation& cancellation, int view_port = 0);
/// So many pages at a live view of this machine, while the number of `phases` is odd. The first of them is frozen: it
/// takes nothing of what it is sent. `taken` has the bytes that the others took, one figure a phase.
void run_pages(int view_port, int count, const SharedFigures<double>& phases, SharedFigures<double>& taken,
               const core::Cancellation& cancellation);
/// Records the robot's topics to a file.
void run_recorder(int domain, const std::filesystem::path& path, const core::Cancellation& cancellation);
/// Takes depth images by Cyclone's C interface alone, and does nothing with them; s from writing to the sample in hand.
void run_bare_reader(int domain, SharedFigures<double>& delays, const core::Cancellation& cancellation);

}  // namespace prescene::benchmarks
