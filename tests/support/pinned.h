// SPDX-License-Identifier: Apache-2.0
// Pinned results: what a recorded scenario does, as a hash for each stage of each step and particle, kept in a file
// beside the tests. A changed file is accepted with `./dev bless REASON`, never by hand. Beside the hashes a test
// states readable numbers with a tolerance, which must hold even when a hash changes.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace prescene::tests {

/// One line of a step trace: what `stage` of step `step` made of particle `particle`.
struct TraceEntry {
  std::int64_t step = 0;
  std::string stage;  ///< One word.
  std::int64_t particle = 0;
  std::uint64_t hash = 0;

  friend bool operator==(const TraceEntry&, const TraceEntry&) = default;
};

/// The text of a trace: one line "step stage particle hash" an entry; `tools/trace-diff` compares two of them.
std::string trace_text(std::span<const TraceEntry> trace);

/// Success when `trace` equals the file tests/scenarios/pinned/<name>.trace. Otherwise the message names the first
/// entry that differs, and the actual trace is kept in <build>/traces/<name>.trace for `./dev trace-diff`. With the
/// environment variable PRESCENE_BLESS set to anything, the file is written instead of compared.
testing::AssertionResult matches_pinned(std::string_view name, std::span<const TraceEntry> trace);

}  // namespace prescene::tests
