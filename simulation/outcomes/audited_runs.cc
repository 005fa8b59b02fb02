// SPDX-License-Identifier: Apache-2.0
#include "audited_runs.h"

#include <algorithm>
#include <utility>

#include "instance_classes.h"
#include "prescene/core/clock.h"

namespace prescene::simulation {
namespace {

constexpr double kJudgedAfterCancelling = 0.1;  // s, at most, in which finished runs are still judged

void note_run(const InstanceRunner& runner, belief::Trajectory& run, InstanceRecord& record) {
  record.classes = classes_of(run, runner.variables, runner.certifier, runner.request.stop.duration);
  record.certified = run.end == belief::TrajectoryEnd::kDecided;
  record.failed = run.end == belief::TrajectoryEnd::kDiverged;
  record.final = std::move(run.states.back());
  record.end = run.end;
  record.deepest_overlap = std::max(record.deepest_overlap, run.deepest_overlap);
  record.dropped_contacts = std::max(record.dropped_contacts, run.dropped_contacts);
  if (runner.keep_contacts) record.contacts = std::move(run.contacts);
  record.simulated_seconds += run.simulated_seconds;
  record.flown_seconds += run.flown_seconds;
}

/// Runs the instances of these numbers to rest and replaces their records; returns how many, in order, were not
/// cancelled. `changed` gets those whose classes change.
std::size_t run_to_rest(const InstanceRunner& runner, std::span<const std::uint32_t> numbers,
                        std::vector<InstanceRecord>& records, std::vector<std::uint32_t>& changed) {
  RunRequest request = runner.request;
  request.end_rule = nullptr;
  std::vector<belief::WorldState> starts;
  for (const std::uint32_t number : numbers)
    starts.push_back(runner.samplers[static_cast<std::size_t>(records[number].component)].draw(records[number].point));
  std::vector<belief::Trajectory> runs(numbers.size());
  runner.simulator.run(starts, request, runner.stream, numbers, runner.pool, runs, runner.cancellation);
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    if (runs[n].end == belief::TrajectoryEnd::kCancelled) return n;
    InstanceRecord& record = records[numbers[n]];
    const std::vector<int> before = record.classes;
    note_run(runner, runs[n], record);
    if (record.classes != before) changed.push_back(numbers[n]);
  }
  return numbers.size();
}

}  // namespace

CertificateUse AuditTrail::use_of(std::size_t count) const {
  const auto below = [&](const std::vector<std::uint32_t>& numbers) {
    return static_cast<int>(std::ranges::lower_bound(numbers, count) - numbers.begin());
  };
  return {below(certified), below(audited), below(mismatched), false};
}

bool AuditTrail::fails(std::size_t count, double tolerated) const {
  const CertificateUse use = use_of(count);
  return use.mismatches > tolerated * use.audited;
}

bool run_chunk(const InstanceRunner& runner, std::span<const PlannedInstance> planned,
               std::vector<InstanceRecord>& records, AuditTrail& trail) {
  const std::size_t first = records.size();
  std::vector<belief::WorldState> starts(planned.size());
  runner.pool.for_each_index(planned.size(), [&](std::size_t i) {
    starts[i] = runner.samplers[static_cast<std::size_t>(planned[i].component)].draw(planned[i].point);
  });
  std::vector<belief::Trajectory> runs(planned.size());
  RunRequest request = runner.request;
  request.end_rule = runner.certifier;
  runner.simulator.run(starts, request, runner.stream, static_cast<std::uint32_t>(first), runner.pool, runs,
                       runner.cancellation);

  std::size_t finished = 0;
  while (finished < runs.size() && runs[finished].end != belief::TrajectoryEnd::kCancelled) ++finished;
  records.resize(first + finished);
  // What was cancelled in its runs keeps those that were finished; but judging many outcomes over many states takes its
  // time too, and whoever cancels does not wait for long.
  std::vector<std::uint8_t> noted(finished, 0);
  const core::Stopwatch judging;
  runner.pool.for_each_index(finished, [&](std::size_t i) {
    if (runner.cancellation && judging.seconds() > kJudgedAfterCancelling && runner.cancellation->requested()) return;
    InstanceRecord& record = records[first + i];
    record.component = planned[i].component;
    record.point = planned[i].point;
    note_run(runner, runs[i], record);
    noted[i] = 1;
  });
  finished = static_cast<std::size_t>(std::find(noted.begin(), noted.end(), 0) - noted.begin());
  records.resize(first + finished);
  std::vector<std::uint32_t> audited;
  for (auto n = static_cast<std::uint32_t>(first); n < first + finished; ++n) {
    if (!records[n].certified) continue;
    trail.certified.push_back(n);
    core::RandomStream draw = runner.stream.for_purpose(core::Purpose::kAudit).at(0, n);
    if (draw.uniform() < runner.audit_share) audited.push_back(n);
  }
  const std::size_t done = run_to_rest(runner, audited, records, trail.mismatched);
  trail.audited.insert(trail.audited.end(), audited.begin(), audited.begin() + static_cast<std::ptrdiff_t>(done));
  if (done < audited.size()) records.resize(audited[done]);
  return finished == runs.size() && done == audited.size();
}

bool repair_certified(const InstanceRunner& runner, const AuditTrail& trail, double tolerated,
                      std::vector<InstanceRecord>& records, bool& cancelled) {
  std::vector<InstanceRecord> repaired = records;
  std::vector<std::uint32_t> numbers, changed;
  for (std::uint32_t n = 0; n < records.size(); ++n)
    if (records[n].certified) numbers.push_back(n);
  const std::size_t done = run_to_rest(runner, numbers, repaired, changed);
  cancelled = done < numbers.size();
  if (cancelled) {
    repaired.resize(numbers[done]);
    std::size_t sound = records.size();
    while (trail.fails(sound, tolerated)) --sound;
    if (sound >= repaired.size()) {
      records.resize(sound);
      return false;
    }
  }
  records = std::move(repaired);
  return true;
}

}  // namespace prescene::simulation
