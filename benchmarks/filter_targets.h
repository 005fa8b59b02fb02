// SPDX-License-Identifier: Apache-2.0
// What the filter is meant to reach, and what it reached: one target for each number.
#pragma once

#include <filesystem>
#include <optional>

#include "benchmarks/report.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::benchmarks {

/// How much is measured. The defaults of bench_filter take some minutes; `all` is what the targets ask for.
struct FilterEffort {
  std::uint64_t seed = 301;  ///< The first; settings were chosen on others.
  int sequences = 2;         ///< Of each kind of the simulated suite.
  int cube_starts = 5;       ///< Of the carried cube.
  int ycb_seeds = 5;         ///< Of finding from the frame alone.
  int rooms = 40;            ///< Simulated, with several supports.
  int pushes = 60;
  int law_seeds = 5;        ///< Of still frames, ...
  int law_frames = 300;     ///< ... asked after 30, 300 and 3000 of them, as far as they go.
  int cost_frames = 45;     ///< Of each recording that processor time is measured on.
  int memory_frames = 600;  ///< Tracked while memory is watched.
};
FilterEffort whole_filter_effort();

/// Resident memory while 20 models are known; measure this first, as memory that was once taken stays.
core::Status add_memory_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report);
/// Still frames leave answers at the priors; a push tells friction.
core::Status add_physics_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report);
/// `data`: the folder of the recorded data, if it is there.
core::Status add_tracking_targets(const FilterEffort& effort, const std::optional<std::filesystem::path>& cube,
                                  core::ThreadPool& threads, Report* report);
core::Status add_finding_targets(const FilterEffort& effort, const std::optional<std::filesystem::path>& ycb_video,
                                 core::ThreadPool& threads, Report* report);
/// Processor time of a frame with 1, 5 and 12 resting objects, and of one more that moves.
core::Status add_cost_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report);

}  // namespace prescene::benchmarks
