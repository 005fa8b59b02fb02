// SPDX-License-Identifier: Apache-2.0
// Puts points and boxes to the test: with trials in fresh scenarios, which had no part in finding them.
#pragma once

#include <cstdint>
#include <optional>

#include "prescene/core/random.h"
#include "prescene/queries/parameter_search.h"
#include "tried_points.h"

namespace prescene::queries {

class ClaimTests {
 public:
  /// `stream` is of the places in boxes. Counts in `result`; what is given by reference must outlive this.
  ClaimTests(TrialRunner& runner, const SearchOptions& options, const core::RandomStream& stream, TriedPoints& tried,
             SearchResult& result)
      : runner_(runner), options_(options), stream_(stream), tried_(tried), result_(result) {}

  /// Of the tolerated error, the share of the test with this number; the first is 1.
  double error_of(int number) const;
  /// Fresh trials at `at`, or anywhere in the box, until the claim holds or is given up. Nothing: stopped before.
  std::optional<SearchClaim> test(SearchClaim claim, double error);
  /// Gives a point for which no claim holds its interval, if there is time; beyond the limits of the search.
  void look_at(SearchClaim& nearest);

 private:
  bool run_fresh(SearchClaim& claim, int count);

  TrialRunner& runner_;
  const SearchOptions& options_;
  core::RandomStream stream_;
  TriedPoints& tried_;
  SearchResult& result_;
  std::uint32_t next_fresh_ = 0;
};

}  // namespace prescene::queries
