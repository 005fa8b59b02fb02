// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/shift_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace prescene::queries {
namespace {

constexpr double kNoLength = std::numeric_limits<double>::infinity();
constexpr std::array<double, 5> kLengths = {0.125, 0.25, 0.5, 0.75, 1.0};  // of the longest, along single coordinates
constexpr double kStillOfUse = 2.0;  // what is so much longer than the shortest adds nothing to a mixture
constexpr int kBisections = 4;
constexpr std::size_t kFirstDraws = 6;  // more than may fail: that many are met first
// Random search: at so much of the best length, about the best direction, by deviations that shrink.
constexpr std::array<double, 6> kSpreads = {0.6, 0.6, 0.4, 0.4, 0.25, 0.25};
constexpr double kShorter = 0.85, kLittleShorter = 0.93;
constexpr std::size_t kShifts = 12;
constexpr std::uint64_t kChanceRounds = kSpreads.size();
constexpr std::size_t kChanceDirections = 24;  // directions by chance, where no coordinate does it alone
constexpr double kWorthMixing = 0.9;           // of a single coordinate's length, for several to be preferred
constexpr double kLittlePart = 0.15;  // share of the length: what is less is left out where it does as well without

Shift unit(const Shift& shift) { return scaled(shift, 1.0 / length_of(shift)); }

class ShiftSearcher {
 public:
  ShiftSearcher(const ShiftProblem& problem, const core::RandomStream& stream)
      : problem_(problem), stream_(stream), refused_(problem.draws, 0), order_(problem.draws) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
  }

  std::optional<Shift> run() {
    if (problem_.coordinates == 0 || problem_.draws == 0) return {};
    if (reached_by({Shift(problem_.coordinates, 0.0)}).front()) return Shift(problem_.coordinates, 0.0);
    try_single_coordinates();
    const std::optional<Shift> single = best_;
    if (single)
      try_mixtures();
    else
      try_anywhere();
    if (best_ && problem_.coordinates > 1) {
      shrink_by_chance();
      leave_out_little_parts();
    }
    const bool mixing_pays = !single || (best_ && length_of(*best_) <= kWorthMixing * length_of(*single));
    return mixing_pays ? best_ : single;
  }

 private:
  bool stopped() const { return problem_.stopped && problem_.stopped(); }

  std::vector<bool> reached_by(const std::vector<Shift>& shifts) {
    std::vector<std::size_t> failures(shifts.size(), 0);
    const std::size_t first = std::min(problem_.draws, problem_.allowed + kFirstDraws);
    std::size_t met = 0;
    for (const std::size_t until : {first, problem_.draws}) {
      std::vector<std::pair<std::size_t, std::size_t>> tries;
      for (std::size_t s = 0; s < shifts.size(); ++s)
        for (std::size_t d = met; failures[s] <= problem_.allowed && d < until; ++d) tries.emplace_back(s, order_[d]);
      std::vector<std::uint8_t> outcomes(tries.size(), 0);
      if (!tries.empty()) problem_.try_out(shifts, tries, outcomes);
      std::vector<std::size_t> failed(shifts.size(), 0);
      for (std::size_t t = 0; t < tries.size(); ++t)
        if (outcomes[t] == 0) ++failed[tries[t].first];
      const double share = static_cast<double>(until - met);
      for (std::size_t t = 0; t < tries.size(); ++t)
        // Of a shift that is far off, all fail alike.
        if (outcomes[t] == 0 && static_cast<double>(failed[tries[t].first]) < 0.5 * share) ++refused_[tries[t].second];
      for (std::size_t s = 0; s < shifts.size(); ++s) failures[s] += failed[s];
      met = until;
    }
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::size_t a, std::size_t b) { return refused_[a] > refused_[b]; });
    std::vector<bool> reached;
    for (const std::size_t failed : failures) reached.push_back(failed <= problem_.allowed);
    return reached;
  }

  /// The least length that was found for each direction, all bisected together; low[i] does not reach it, high[i]
  /// does. Notes the best.
  std::vector<double> bisected(const std::vector<Shift>& directions, std::vector<double> low,
                               std::vector<double> high) {
    for (int round = 0; round < kBisections && !directions.empty() && !stopped(); ++round) {
      std::vector<Shift> shifts;
      for (std::size_t i = 0; i < directions.size(); ++i)
        shifts.push_back(scaled(directions[i], 0.5 * (low[i] + high[i])));
      const std::vector<bool> reached = reached_by(shifts);
      if (stopped()) break;
      for (std::size_t i = 0; i < directions.size(); ++i) (reached[i] ? high : low)[i] = 0.5 * (low[i] + high[i]);
    }
    for (std::size_t i = 0; i < directions.size(); ++i)
      if (!best_ || high[i] < length_of(*best_)) best_ = scaled(directions[i], high[i]);
    return high;
  }

  void try_single_coordinates() {
    std::vector<Shift> directions;
    for (std::size_t i = 0; i < problem_.coordinates; ++i)
      for (const double sign : {1.0, -1.0}) {
        directions.emplace_back(problem_.coordinates, 0.0);
        directions.back()[i] = sign;
      }
    std::vector<double> lengths(directions.size(), kNoLength);
    double before = 0.0;
    for (const double share : kLengths) {
      const double length = share * problem_.longest;
      if (stopped() || (best_ && before >= kStillOfUse * length_of(*best_))) break;
      std::vector<std::size_t> open;
      std::vector<Shift> shifts;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        if (std::isfinite(lengths[i])) continue;
        open.push_back(i);
        shifts.push_back(scaled(directions[i], length));
      }
      const std::vector<bool> reached = reached_by(shifts);
      if (stopped()) break;
      std::vector<std::size_t> found;
      std::vector<Shift> towards;
      for (std::size_t k = 0; k < open.size(); ++k) {
        if (!reached[k]) continue;
        found.push_back(open[k]);
        towards.push_back(directions[open[k]]);
      }
      const std::vector<double> least =
          bisected(towards, std::vector<double>(found.size(), before), std::vector<double>(found.size(), length));
      for (std::size_t k = 0; k < found.size(); ++k) lengths[found[k]] = least[k];
      before = length;
    }
    for (std::size_t i = 0; i < problem_.coordinates; ++i) {
      const std::size_t better = lengths[2 * i + 1] < lengths[2 * i] ? 2 * i + 1 : 2 * i;
      if (std::isfinite(lengths[better])) alone_.emplace_back(lengths[better], directions[better]);
    }
    std::stable_sort(alone_.begin(), alone_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }

  /// Of the coordinates that do it alone, the two best, the three best, ...: as if the boundary were flat.
  void try_mixtures() {
    std::vector<Shift> directions;
    std::vector<double> flat;
    Shift sum(problem_.coordinates, 0.0);
    for (std::size_t k = 0; k < alone_.size(); ++k) {
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += alone_[k].second[i] / alone_[k].first;
      if (k == 0) continue;
      directions.push_back(unit(sum));
      flat.push_back(1.0 / length_of(sum));
    }
    if (directions.empty() || stopped()) return;
    const double longest = length_of(*best_);
    std::vector<double> low(directions.size(), 0.0), high(directions.size(), kNoLength);
    for (const double factor : {0.85, 1.0, 1.2}) {
      std::vector<Shift> shifts;
      for (std::size_t i = 0; i < directions.size(); ++i)
        shifts.push_back(scaled(directions[i], std::min(longest, factor * flat[i])));
      const std::vector<bool> reached = reached_by(shifts);
      if (stopped()) return;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        if (std::isfinite(high[i])) continue;
        (reached[i] ? high : low)[i] = length_of(shifts[i]);
      }
    }
    std::vector<Shift> found;
    std::vector<double> from, to;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      if (!std::isfinite(high[i])) continue;
      found.push_back(directions[i]);
      from.push_back(std::max(low[i], 0.5 * high[i]));
      to.push_back(high[i]);
    }
    bisected(found, from, to);
  }

  /// Where none does it alone: pairs of coordinates, then by chance, both at half of the longest and at all of it.
  void try_anywhere() {
    std::vector<Shift> directions;
    for (std::size_t i = 0; i < problem_.coordinates; ++i)
      for (std::size_t j = i + 1; j < problem_.coordinates; ++j)
        for (const double a : {1.0, -1.0})
          for (const double b : {1.0, -1.0}) {
            directions.emplace_back(problem_.coordinates, 0.0);
            directions.back()[i] = a * std::numbers::sqrt2 / 2.0;
            directions.back()[j] = b * std::numbers::sqrt2 / 2.0;
          }
    for (std::size_t c = 0; c < kChanceDirections && problem_.coordinates > 2; ++c) {
      core::RandomStream random = stream_.at(kChanceRounds, static_cast<std::uint32_t>(c));
      Shift& direction = directions.emplace_back();
      for (std::size_t i = 0; i < problem_.coordinates; ++i) direction.push_back(random.normal());
      direction = unit(direction);
    }
    double before = 0.0;
    for (const double share : {0.5, 1.0}) {
      const double length = share * problem_.longest;
      std::vector<Shift> shifts;
      for (const Shift& direction : directions) shifts.push_back(scaled(direction, length));
      if (stopped()) return;
      const std::vector<bool> reached = reached_by(shifts);
      if (stopped()) return;
      std::vector<Shift> found;
      for (std::size_t i = 0; i < directions.size(); ++i)
        if (reached[i]) found.push_back(directions[i]);
      bisected(found, std::vector<double>(found.size(), before), std::vector<double>(found.size(), length));
      if (best_) return;
      before = length;
    }
  }

  void shrink_by_chance() {
    double share = kShorter;
    for (std::size_t round = 0; round < kSpreads.size() && !stopped(); ++round) {
      const double length = length_of(*best_);
      if (length == 0.0) return;
      std::vector<Shift> shifts;
      for (std::size_t c = 0; c < kShifts; ++c) {
        core::RandomStream random = stream_.at(round, static_cast<std::uint32_t>(c));
        Shift direction = scaled(*best_, 1.0 / length);
        const double spread = kSpreads[round] / std::sqrt(static_cast<double>(problem_.coordinates - 1));
        // Where only few coordinates matter, only few are to be moved.
        for (double& x : direction)
          if (c % 2 == 0 || random.uniform() < 0.4) x += spread * (c % 2 == 0 ? 1.0 : 1.5) * random.normal();
        shifts.push_back(scaled(unit(direction), share * length));
      }
      const std::vector<bool> reached = reached_by(shifts);
      if (stopped()) return;
      std::vector<Shift> found;
      for (std::size_t c = 0; c < kShifts; ++c)
        if (reached[c]) found.push_back(unit(shifts[c]));
      if (found.empty()) {
        share = kLittleShorter;
        continue;
      }
      if (found.size() > 2) found.resize(2);
      bisected(found, std::vector<double>(found.size(), 0.6 * share * length),
               std::vector<double>(found.size(), share * length));
      share = kShorter;
    }
  }

  void leave_out_little_parts() {
    const double length = length_of(*best_);
    if (length == 0.0 || stopped()) return;
    Shift plain = *best_;
    for (double& x : plain)
      if (std::abs(x) < kLittlePart * length) x = 0.0;
    if (plain == *best_) return;
    plain = scaled(unit(plain), length);
    if (reached_by({plain}).front() && !stopped()) best_ = plain;
  }

  const ShiftProblem& problem_;
  core::RandomStream stream_;
  std::vector<int> refused_;                     // by draw: shifts that few others refused
  std::vector<std::size_t> order_;               // of the draws
  std::vector<std::pair<double, Shift>> alone_;  // least length of a coordinate alone, and its direction
  std::optional<Shift> best_;
};

}  // namespace

double length_of(const Shift& shift) {
  double sum = 0.0;
  for (const double x : shift) sum += x * x;
  return std::sqrt(sum);
}

Shift scaled(Shift shift, double factor) {
  for (double& x : shift) x *= factor;
  return shift;
}

std::optional<Shift> shortest_shift(const ShiftProblem& problem, const core::RandomStream& stream) {
  return ShiftSearcher(problem, stream).run();
}

}  // namespace prescene::queries
