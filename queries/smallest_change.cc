// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/smallest_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "prescene/queries/confidence_sequence.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kSearchDraws = 32;  // of the posterior, in which shifts meet at first
constexpr std::size_t kTestDraws = 192;   // of each test, at least
constexpr int kMostNumbers = 12;          // of draws for one test
constexpr int kChangeTests = 4;           // at most, each with fresh draws
// So much of what may fail, may in a search: the shortest shift of a search's draws is shorter than that of all, and
// each search after a failed test goes further inside.
constexpr std::array<double, kChangeTests> kMayFail = {0.35, 0.25, 0.15, 0.05};
constexpr int kMostInstances = 3000;    // of each search; then the best until then is tested
constexpr double kReportedShare = 0.1;  // of the shift's length

class ChangeSearcher {
 public:
  explicit ChangeSearcher(const ChangeSearch& search)
      : search_(search), coordinates_(search.events->coordinates().size()) {}

  SmallestChange run() {
    find();
    change_.instances_searched = instances_;
    return std::move(change_);
  }

 private:
  bool stopped() const { return search_.stopped && search_.stopped(); }

  void find() {
    change_.wanted = search_.wanted;
    change_.wanted_probability = search_.probability;
    take_search_draws();
    if (draws_.empty()) return;
    const Shift none(coordinates_, 0.0);
    for (int attempt = 0; attempt < kChangeTests && !stopped(); ++attempt) {
      const std::optional<Shift> shortest = search_shift(attempt);
      if (stopped()) return;
      if (!shortest) {
        // The shifts before did not do it, and longer ones are none.
        if (attempt == 0) test(none);
        return;
      }
      if (test(*shortest)) return;
    }
  }

  void take_search_draws() {
    std::vector<LatentPoint> all = search_.draws(next_number_++);
    const std::size_t n = std::min(kSearchDraws, all.size());
    for (std::size_t i = 0; i < n; ++i) draws_.push_back(std::move(all[i * all.size() / n]));
    met_ = draws_.size();
  }

  std::optional<Shift> search_shift(int attempt) {
    ShiftProblem problem;
    problem.coordinates = coordinates_;
    problem.draws = draws_.size();
    problem.allowed = static_cast<std::size_t>(
        kMayFail[static_cast<std::size_t>(attempt)] * (1.0 - search_.probability) * static_cast<double>(met_) + 1e-9);
    const int most = instances_ + kMostInstances;
    problem.stopped = [this, most] { return stopped() || instances_ >= most; };
    problem.try_out = [&](std::span<const Shift> shifts, std::span<const std::pair<std::size_t, std::size_t>> tries,
                          std::span<std::uint8_t> outcomes) {
      std::vector<ChangedDraw> changed;
      for (const auto& [shift, draw] : tries) changed.push_back({draws_[draw], shifts[shift]});
      const std::vector<std::uint8_t> wanted = outcomes_of(changed);
      std::copy(wanted.begin(), wanted.end(), outcomes.begin());
    };
    return shortest_shift(
        problem, core::RandomStream(search_.seed + static_cast<std::uint64_t>(attempt), core::Purpose::kParameters));
  }

  std::vector<std::uint8_t> outcomes_of(const std::vector<ChangedDraw>& changed,
                                        std::vector<std::vector<double>>* values = nullptr) {
    instances_ += static_cast<int>(changed.size());
    return search_.events->outcomes(changed, values);
  }

  /// With draws of numbers that nothing had yet. What refutes the shift joins the search's draws; true if it stands.
  bool test(const Shift& shift) {
    std::vector<ChangedDraw> changed, unchanged;
    for (int number = 0; number < kMostNumbers && changed.size() < kTestDraws && !stopped(); ++number)
      for (LatentPoint& draw : search_.draws(next_number_++)) {
        unchanged.push_back({draw, Shift(coordinates_, 0.0)});
        changed.push_back({std::move(draw), shift});
      }
    if (changed.empty() || stopped()) return false;
    std::vector<std::vector<double>> values, values_before;
    const std::vector<std::uint8_t> wanted = outcomes_of(changed, &values);
    const std::vector<std::uint8_t> without = outcomes_of(unchanged, &values_before);
    if (stopped()) return false;
    const auto n = static_cast<int>(changed.size());
    const auto successes = static_cast<int>(std::count(wanted.begin(), wanted.end(), std::uint8_t{1}));
    // Each test may be the one that is reported.
    const ShareInterval interval = clopper_pearson(successes, n, (1.0 - search_.confidence) / kChangeTests);
    const bool found = interval.low >= search_.probability;
    const double probability = static_cast<double>(successes) / n;
    met_ += changed.size();
    std::vector<LatentPoint> refuting;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      if (wanted[i] == 0) refuting.push_back(changed[i].draw);
    draws_.insert(draws_.begin(), std::make_move_iterator(refuting.begin()), std::make_move_iterator(refuting.end()));
    // Where none stands, the one that came nearest is reported.
    if (!found && probability <= change_.probability && change_.instances > 0) return false;
    change_.found = found;
    change_.size = length_of(shift);
    change_.probability = probability;
    change_.low = interval.low;
    change_.high = interval.high;
    change_.instances = n;
    change_.unchanged_probability =
        static_cast<double>(std::count(without.begin(), without.end(), std::uint8_t{1})) / n;
    tell_parts(shift, values_before, values);
    return found;
  }

  void tell_parts(const Shift& shift, const std::vector<std::vector<double>>& before,
                  const std::vector<std::vector<double>>& after) {
    change_.parts.clear();
    for (std::size_t c = 0; c < coordinates_; ++c) {
      if (std::abs(shift[c]) <= kReportedShare * change_.size) continue;
      const ChangeCoordinate& coordinate = search_.events->coordinates()[c];
      ChangedPart part{coordinate.name, coordinate.unit, 0.0, 0.0, std::abs(shift[c])};
      for (std::size_t d = 0; d < before.size(); ++d) {
        part.from += before[d][c] / static_cast<double>(before.size());
        part.to += after[d][c] / static_cast<double>(after.size());
      }
      change_.parts.push_back(std::move(part));
    }
  }

  const ChangeSearch& search_;
  std::size_t coordinates_;
  SmallestChange change_;
  std::vector<LatentPoint> draws_;  // those that refuted something first
  std::size_t met_ = 0;             // draws, those included that the last shift kept
  int next_number_ = 0;
  int instances_ = 0;
};

}  // namespace

SmallestChange smallest_change(const ChangeSearch& search) { return ChangeSearcher(search).run(); }

}  // namespace prescene::queries
