// SPDX-License-Identifier: Apache-2.0
// Runs the instances of an estimate in their order. Some of those that a certificate ended are run to rest all the
// same, which shows whether certificates are to be trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "instance_plan.h"
#include "prescene/simulation/outcomes/certifier.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

/// All that running instances takes.
struct InstanceRunner {
  const Simulator& simulator;
  std::span<const Variable> variables;
  RunRequest request;
  const core::RandomStream& stream;
  core::ThreadPool& pool;
  const core::Cancellation* cancellation;
  const std::vector<StartSampler>& samplers;
  const Certifier* certifier;  // null: run all to rest
  double audit_share;
  bool keep_contacts;
};

/// Numbers of the instances that ended by a certificate, ascending.
struct AuditTrail {
  std::vector<std::uint32_t> certified, audited, mismatched;

  /// Of the first `count` instances, whatever became of the others.
  CertificateUse use_of(std::size_t count) const;
  /// Whether more of the audited among them had another class than is tolerated.
  bool fails(std::size_t count, double tolerated) const;
};

/// Runs `planned` (numbers first, first + 1, ... of the order) and appends the records of those that were finished
/// before any that was cancelled. Returns false when one was.
bool run_chunk(const InstanceRunner& runner, std::span<const PlannedInstance> planned,
               std::vector<InstanceRecord>& records, AuditTrail& trail);
/// Runs to rest what ended by its certificate; returns whether certificates count for nothing then. Cancelled on the
/// way, it cuts to the instances that were repaired, or to those of which the audit had not failed, if those are more:
/// a replay of so many comes to the same.
bool repair_certified(const InstanceRunner& runner, const AuditTrail& trail, double tolerated,
                      std::vector<InstanceRecord>& records, bool& cancelled);

}  // namespace prescene::simulation
