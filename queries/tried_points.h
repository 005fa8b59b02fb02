// SPDX-License-Identifier: Apache-2.0
// What a search of parameters (parameter_search.cc) knows: the points that were tried, and how good each is taken to be
// after its trials and those of its neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "prescene/queries/parameter_search.h"

namespace prescene::queries {

/// The value of a parameter in [0, 1] for one beyond: the nearest, or of a periodic parameter the same.
double in_cube(const SearchOptions& options, std::size_t parameter, double value);

class TriedPoints {
 public:
  /// A trial that is to be run.
  struct Pending {
    std::size_t point;
    std::uint32_t scenario;
  };
  struct Ranked {
    std::size_t point;
    double merit;
  };

  /// Counts points and trials in `result`, and says there why it is over. All must outlive this.
  TriedPoints(TrialRunner& runner, const SearchOptions& options, SearchResult& result)
      : runner_(runner), options_(options), dimensions_(options.periodic.size()), result_(result) {}

  std::size_t size() const { return points_.size(); }
  SearchPoint& operator[](std::size_t point) { return points_[point]; }
  const SearchPoint& operator[](std::size_t point) const { return points_[point]; }
  /// All of them; none are left.
  std::vector<SearchPoint> take() { return std::move(points_); }

  /// Returns the point's number. `explored`: it is one of the net's.
  std::size_t add(UnitPoint at, bool explored);
  /// Runs trials at points of the search and counts them; false once the search is over. If they are stopped, the
  /// points that were added for them are dropped.
  bool run_pending(std::vector<Pending>& pending);
  /// Counts towards the limits. The trials count for something even if they reach a limit: then nothing comes after.
  bool run_trials(std::span<const Trial> trials, std::span<TrialEnd> ends);
  /// Whether a limit was reached or the runner stopped: nothing is run any more.
  bool over() const { return over_; }

  /// How far a point says something of its neighbours: less than their mean distance.
  double reach() const;
  /// Possible points with a success, the best first; of many, those that their own trials speak for most.
  std::vector<Ranked> ranked() const;

 private:
  double distance_squared(const UnitPoint& a, const UnitPoint& b) const;
  double overall_share() const;
  double merit(std::size_t index) const;

  TrialRunner& runner_;
  const SearchOptions& options_;
  std::size_t dimensions_;
  SearchResult& result_;
  std::vector<SearchPoint> points_;
  struct {
    std::size_t points = 0;
    int explored = 0, impossible = 0;
  } round_;  // what there was after the last trials that were finished
  bool over_ = false;
};

}  // namespace prescene::queries
