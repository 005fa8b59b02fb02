// SPDX-License-Identifier: Apache-2.0
// Pinned results: what a recorded scenario does, in files beside the tests. NAME.trace holds a hash for each stage of
// each step and particle, compared where a result has the same bits; NAME.json holds numbers that a person can read,
// with a tolerance, compared everywhere. Changed files are accepted with `./dev bless REASON`, never by hand. What must
// hold whatever is blessed, a test states as bounds of its own.
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
/// entry that differs, and the actual trace is kept in <build>/traces/<name>.trace for `./dev trace-diff`. `platform`
/// (one line) names all that the bits depend on besides sources, input and seed; a trace that was pinned on another
/// platform is not compared: success, and the message says so. With the environment variable PRESCENE_BLESS set to
/// anything, the file is written instead of compared.
testing::AssertionResult matches_pinned(std::string_view name, std::string_view platform,
                                        std::span<const TraceEntry> trace);

/// A result in the unit that its name says.
struct ReadableNumber {
  std::string name;        ///< As "carton: final x, m"; unique within a file.
  double value = 0.0;      ///< Finite.
  double tolerance = 0.0;  ///< Positive.
};

/// Success when tests/scenarios/pinned/<name>.json holds just these numbers within their tolerances, and the same
/// tolerances. Otherwise the message names every number that does not fit. With PRESCENE_BLESS set the file is written
/// instead, in which a number that still fits stays as it was, so that small changes do not add up unseen.
testing::AssertionResult matches_pinned(std::string_view name, std::span<const ReadableNumber> numbers);

}  // namespace prescene::tests
