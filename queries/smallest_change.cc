// SPDX-License-Identifier: Apache-2.0
#include "smallest_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "prescene/queries/confidence_sequence.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using geometry::Vector3d;

constexpr std::size_t kSearchDraws = 16;  // of the posterior, in which candidates meet
// Of these, the share more than is wanted that must reach it: else the winner of many candidates would be one that only
// these draws favour.
constexpr double kReserve = 0.04;
constexpr double kFurthest = 4.0;  // deviations: what needs a longer shift is told as not found
constexpr std::array<double, 4> kLengths = {0.5, 1.0, 2.0, kFurthest};
constexpr int kBisections = 4, kShiftRounds = 4;
constexpr std::size_t kShifts = 20, kLeaders = 5;
// A shift of several parameters is preferred to one of a single parameter where it is so much shorter.
constexpr double kWorthMixing = 0.8;
constexpr double kReportedShare = 0.1;                                  // share of the shift's length
constexpr int kChangeTests = 3;                                         // at most, each with fresh draws; ...
constexpr double kStretch = 1.12;                                       // ... so much longer than the one before
constexpr double kKeptTilt = std::numbers::pi / 6.0, kKeptDrop = 0.05;  // rad and m

using Shift = std::vector<double>;  // one for each free coordinate

double length_of(const Shift& shift) {
  double sum = 0.0;
  for (const double x : shift) sum += x * x;
  return std::sqrt(sum);
}

Shift scaled(Shift shift, double factor) {
  for (double& x : shift) x *= factor;
  return shift;
}

struct NamedCoordinate {
  std::size_t at = 0;  // in a point
  std::string name, unit;
  double (*value)(const EventDraw&) = nullptr;  // null: of the start
};

std::vector<NamedCoordinate> free_coordinates(const EventPaths& events, const Hypothesis& hypothesis) {
  std::vector<NamedCoordinate> free;
  const bool pushed = hypothesis.kind == EventKind::kPushed, bumped = hypothesis.kind == EventKind::kBumped;
  if (pushed || bumped) {
    // Not the time: where all lies still it changes nothing.
    free.push_back({1, "direction", "deg", [](const EventDraw& d) { return 180.0 / std::numbers::pi * d.direction; }});
    free.push_back({2, "height of the touch", "m", [](const EventDraw& d) { return d.touched_height; }});
    free.push_back({3, "touch to the side", "of its half width", [](const EventDraw& d) { return d.sideways; }});
    free.push_back({4, "speed", "m/s", [](const EventDraw& d) { return d.speed; }});
    if (pushed) free.push_back({5, "duration", "s", [](const EventDraw& d) { return d.duration; }});
  } else if (hypothesis.kind == EventKind::kSlipped) {
    free.push_back({0, "time", "s", [](const EventDraw& d) { return d.time; }});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      static constexpr std::array<double (*)(const EventDraw&), 3> kAdded = {
          [](const EventDraw& d) { return d.added.linear.x(); }, [](const EventDraw& d) { return d.added.linear.y(); },
          [](const EventDraw& d) { return d.added.linear.z(); }};
      static constexpr std::array<double (*)(const EventDraw&), 3> kTurned = {
          [](const EventDraw& d) { return d.added.angular.x(); },
          [](const EventDraw& d) { return d.added.angular.y(); },
          [](const EventDraw& d) { return d.added.angular.z(); }};
      const std::string of = std::string(1, static_cast<char>('x' + axis));
      free.push_back({1 + axis, "velocity that the hand adds along " + of, "m/s", kAdded[axis]});
      free.push_back({4 + axis, "turning that the hand adds about " + of, "rad/s", kTurned[axis]});
    }
  }
  for (const std::size_t at : events.start_pose_coordinates(hypothesis)) free.push_back({at, "start", "m", nullptr});
  return free;
}

class ChangeSearcher {
 public:
  explicit ChangeSearcher(const ChangeSearch& search)
      : search_(search),
        events_(*search.events),
        free_(free_coordinates(events_, search.hypothesis)),
        stream_(search.seed, core::Purpose::kParameters) {}

  SmallestChange run() {
    SmallestChange change = find();
    change.instances_searched = instances_;
    return change;
  }

 private:
  SmallestChange find() {
    SmallestChange change;
    change.wanted = search_.wanted ? search_.wanted->name : "stays as it was";
    change.wanted_probability = search_.probability;
    take_search_draws();
    const Shift none(free_.size(), 0.0);
    if (draws_.empty()) return change;
    if (reached(shares_of({none}).front())) {
      test(none, change);
      if (change.probability >= search_.probability) return change;
    }
    const std::optional<Shift> shortest = shortest_shift();
    if (!shortest || stopped()) {
      test(none, change);
      change.found = false;
      return change;
    }
    Shift shift = *shortest;
    for (int attempt = 0; attempt < kChangeTests && !stopped(); ++attempt) {
      if (attempt > 0) shift = scaled(shift, kStretch);
      test(shift, change);
      if (change.probability >= search_.probability) break;
    }
    return change;
  }

  bool stopped() const { return search_.cancellation != nullptr && search_.cancellation->requested(); }
  bool reached(double share) const { return share >= std::min(1.0, search_.probability + kReserve) - 1e-9; }

  void take_search_draws() {
    const std::vector<LatentPoint> all = search_.draws(next_number_++);
    for (std::size_t i = 0; i < std::min(kSearchDraws, all.size()); ++i)
      draws_.push_back(all[i * all.size() / std::min(kSearchDraws, all.size())]);
  }

  LatentPoint shifted(const LatentPoint& point, const Shift& shift) const {
    LatentPoint z = point;
    for (std::size_t i = 0; i < free_.size(); ++i) z[free_[i].at] += shift[i];
    return z;
  }

  bool stays(const belief::Trajectory& run) const {
    if (run.states.empty()) return false;
    const std::size_t object = search_.hypothesis.object;
    const Vector3d up = -events_.scene().gravity_W.normalized();
    const belief::Pose& begin = run.states.front().objects[object].X_WO;
    const belief::Pose& end = run.states.back().objects[object].X_WO;
    const Vector3d com = belief::mean(events_.model(object).center_of_mass);
    const double tilt =
        std::acos(std::clamp((begin.rotation.conjugate() * up).dot(end.rotation.conjugate() * up), -1.0, 1.0));
    return tilt <= kKeptTilt && up.dot(begin * com - end * com) <= kKeptDrop;
  }

  std::vector<std::uint8_t> outcomes(const std::vector<LatentPoint>& points, std::vector<EventDraw>* events = nullptr) {
    std::vector<ScenePath> paths(points.size());
    std::vector<EventDraw> draws(points.size());
    std::vector<belief::Trajectory> runs(points.size());
    events_.simulate(search_.hypothesis, points, paths, draws, runs);
    instances_ += static_cast<int>(points.size());
    std::vector<std::uint8_t> wanted(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (paths[i].impossible || runs[i].states.empty()) continue;
      wanted[i] = (search_.wanted ? search_.wanted->holds(events_.scene(), runs[i]) : stays(runs[i])) ? 1 : 0;
    }
    if (events != nullptr) *events = std::move(draws);
    return wanted;
  }

  /// Of the search's draws, for each shift; all in one batch.
  std::vector<double> shares_of(const std::vector<Shift>& shifts) {
    std::vector<LatentPoint> points;
    for (const Shift& shift : shifts)
      for (const LatentPoint& draw : draws_) points.push_back(shifted(draw, shift));
    const std::vector<std::uint8_t> wanted = outcomes(points);
    std::vector<double> shares(shifts.size(), 0.0);
    for (std::size_t i = 0; i < wanted.size(); ++i)
      shares[i / draws_.size()] += wanted[i] / static_cast<double>(draws_.size());
    return shares;
  }

  /// Between a shift that does not reach it and one that does.
  Shift bisected(const Shift& direction, double low, double high) {
    for (int i = 0; i < kBisections && !stopped(); ++i) {
      const double middle = 0.5 * (low + high);
      (reached(shares_of({scaled(direction, middle)}).front()) ? high : low) = middle;
    }
    return scaled(direction, high);
  }

  std::optional<Shift> along_one_coordinate() {
    std::vector<Shift> directions;
    for (std::size_t i = 0; i < free_.size(); ++i)
      for (const double sign : {1.0, -1.0}) {
        directions.emplace_back(free_.size(), 0.0);
        directions.back()[i] = sign;
      }
    std::optional<Shift> best;
    double before = 0.0;
    for (const double length : kLengths) {
      if (stopped()) return best;
      std::vector<Shift> shifts;
      for (const Shift& direction : directions) shifts.push_back(scaled(direction, length));
      const std::vector<double> shares = shares_of(shifts);
      for (std::size_t i = 0; i < shifts.size(); ++i) {
        if (!reached(shares[i])) continue;
        Shift found = bisected(directions[i], before, length);
        if (!best || length_of(found) < length_of(*best)) best = std::move(found);
      }
      if (best) return best;
      before = length;
    }
    return best;
  }

  std::optional<Shift> shortest_shift() {
    std::optional<Shift> single = along_one_coordinate();
    const double bound = single ? length_of(*single) : kFurthest;
    // Mixtures: the mean follows the shortest that reach it, or else those that come nearest.
    std::optional<Shift> best;
    Shift mean = single ? scaled(*single, 0.5) : Shift(free_.size(), 0.0);
    std::vector<double> deviation(
        free_.size(), std::max(0.3, 0.5 * bound / std::sqrt(std::max<double>(1.0, static_cast<double>(free_.size())))));
    for (int round = 0; round < kShiftRounds && !stopped() && free_.size() > 1; ++round) {
      std::vector<Shift> shifts;
      for (std::size_t c = 0; c < kShifts; ++c) {
        core::RandomStream random = stream_.at(static_cast<std::uint64_t>(round), static_cast<std::uint32_t>(c));
        Shift shift = mean;
        for (std::size_t i = 0; i < shift.size(); ++i) shift[i] += deviation[i] * random.normal();
        const double longest = best ? length_of(*best) : bound;
        const double length = length_of(shift);
        if (length > longest && length > 0.0) shift = scaled(shift, longest * (0.6 + 0.4 * random.uniform()) / length);
        shifts.push_back(std::move(shift));
      }
      const std::vector<double> shares = shares_of(shifts);
      std::vector<std::size_t> order(shifts.size());
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const bool in_a = reached(shares[a]), in_b = reached(shares[b]);
        if (in_a != in_b) return in_a;
        return in_a ? length_of(shifts[a]) < length_of(shifts[b]) : shares[a] > shares[b];
      });
      if (reached(shares[order.front()]) && (!best || length_of(shifts[order.front()]) < length_of(*best)))
        best = shifts[order.front()];
      for (std::size_t i = 0; i < mean.size(); ++i) {
        double sum = 0.0, squares = 0.0;
        for (std::size_t e = 0; e < kLeaders; ++e) {
          const double x = shifts[order[e]][i];
          sum += x / kLeaders;
          squares += x * x / kLeaders;
        }
        mean[i] = sum;
        deviation[i] = 0.7 * std::sqrt(std::max(0.0, squares - sum * sum)) + 0.3 * deviation[i];
      }
    }
    if (best && !stopped()) {
      const double length = length_of(*best);
      if (length > 0.0) best = bisected(scaled(*best, 1.0 / length), 0.5 * length, length);
    }
    if (!best) return single;
    return single && length_of(*best) > kWorthMixing * length_of(*single) ? single : best;
  }

  /// With draws of numbers that nothing had yet.
  void test(const Shift& shift, SmallestChange& change) {
    std::vector<LatentPoint> at, unchanged;
    for (const LatentPoint& draw : search_.draws(next_number_++)) {
      unchanged.push_back(draw);
      at.push_back(shifted(draw, shift));
    }
    if (at.empty()) return;
    std::vector<EventDraw> events, events_before;
    const std::vector<std::uint8_t> wanted = outcomes(at, &events);
    const std::vector<std::uint8_t> without = outcomes(unchanged, &events_before);
    const auto n = static_cast<int>(at.size());
    const auto successes = static_cast<int>(std::count(wanted.begin(), wanted.end(), std::uint8_t{1}));
    // Each test may be the one that is told.
    const ShareInterval interval = clopper_pearson(successes, n, (1.0 - search_.confidence) / kChangeTests);
    change.size = length_of(shift);
    change.probability = static_cast<double>(successes) / n;
    change.low = interval.low;
    change.high = interval.high;
    change.instances = n;
    change.found = change.probability >= search_.probability;
    const auto kept = static_cast<double>(std::count(without.begin(), without.end(), std::uint8_t{1}));
    change.unchanged_probability = kept / n;
    tell_parts(shift, unchanged, at, events_before, events, change);
  }

  void tell_parts(const Shift& shift, const std::vector<LatentPoint>& before, const std::vector<LatentPoint>& after,
                  const std::vector<EventDraw>& events_before, const std::vector<EventDraw>& events_after,
                  SmallestChange& change) const {
    change.parts.clear();
    double of_start = 0.0;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      if (free_[i].value == nullptr) of_start += shift[i] * shift[i];
      if (free_[i].value == nullptr || std::abs(shift[i]) <= kReportedShare * change.size) continue;
      ChangedPart part{free_[i].name, free_[i].unit, 0.0, 0.0, std::abs(shift[i])};
      for (std::size_t d = 0; d < events_before.size(); ++d) {
        part.from += free_[i].value(events_before[d]) / static_cast<double>(events_before.size());
        part.to += free_[i].value(events_after[d]) / static_cast<double>(events_after.size());
      }
      change.parts.push_back(std::move(part));
    }
    of_start = std::sqrt(of_start);
    if (of_start <= kReportedShare * change.size) return;
    // How far its start moves, on average.
    ChangedPart part{"place at the begin", "m", 0.0, 0.0, of_start};
    for (std::size_t d = 0; d < before.size(); ++d)
      part.to += (events_.start_at(search_.hypothesis, after[d]).translation -
                  events_.start_at(search_.hypothesis, before[d]).translation)
                     .norm() /
                 static_cast<double>(before.size());
    change.parts.push_back(std::move(part));
  }

  const ChangeSearch& search_;
  EventPaths& events_;
  std::vector<NamedCoordinate> free_;
  core::RandomStream stream_;
  std::vector<LatentPoint> draws_;
  int next_number_ = 0;
  int instances_ = 0;
};

}  // namespace

SmallestChange smallest_change(const ChangeSearch& search) { return ChangeSearcher(search).run(); }

}  // namespace prescene::queries
