// SPDX-License-Identifier: Apache-2.0
#include "event_hypotheses.h"

#include <algorithm>

namespace prescene::queries {

using belief::EventKind;

namespace {

constexpr double kLeastAbsent = 1e-3;  // probability that a thing is not there, from which on it may be put in
// Of a belief that is wrong about whether a thing is there: no less, no more.
constexpr double kLeastWrong = 1e-6;

/// How much more probable than what the belief holds it is that the thing is there, or not there, otherwise.
double odds_of_otherwise(const EventPaths& events, std::size_t object) {
  const double absent = events.may_be_absent(object);
  const double wrong = std::clamp(events.is_present(object) ? absent : 1.0 - absent, kLeastWrong, 1.0 - kLeastWrong);
  return wrong / (1.0 - wrong);
}

}  // namespace

std::vector<Hypothesis> hypotheses_about(const std::vector<std::size_t>& candidates, const EventPaths& events,
                                         const belief::EventWeights& weights, filter::MeshCache& meshes) {
  std::vector<Hypothesis> all;
  const std::size_t n = events.objects().size();
  const auto looked_at = [&](std::size_t i) {
    return std::find(candidates.begin(), candidates.end(), i) != candidates.end();
  };
  const auto share = [&](EventKind kind, std::vector<Hypothesis> of_kind) {
    for (Hypothesis& h : of_kind) {
      h.prior = weights.of(kind) / static_cast<double>(of_kind.size());
      all.push_back(h);
    }
  };
  const auto add = [&](EventKind kind, const auto& may) {
    std::vector<Hypothesis> of_kind;
    for (std::size_t i = 0; i < n; ++i)
      if (may(i)) of_kind.push_back({kind, i, {}, 0.0});
    share(kind, std::move(of_kind));
  };
  const auto free = [&](std::size_t i) { return events.is_present(i) && !events.is_held(i); };
  const auto held = [&](std::size_t i) { return events.is_held(i); };
  all.push_back({EventKind::kNothing, candidates.front(), {}, weights.of(EventKind::kNothing)});
  for (const EventKind kind : {EventKind::kPushed, EventKind::kBumped, EventKind::kMoved, EventKind::kTakenAway})
    add(kind, free);
  add(EventKind::kSlipped, held);
  // All others begin as the belief has them; so does what an event happens to, but for what is put in.
  double absent = 0.0;
  for (std::size_t i = 0; i < n; ++i) absent += events.may_be_absent(i);
  for (std::size_t i = 0; i < n; ++i) {
    const double odds = odds_of_otherwise(events, i);
    if (!held(i)) all.push_back({EventKind::kNothing, i, {}, weights.of(EventKind::kNothing) * odds, true});
    if (events.may_be_absent(i) > kLeastAbsent)
      all.push_back({EventKind::kPutIn,
                     i,
                     {},
                     weights.of(EventKind::kPutIn) * (events.is_present(i) ? odds : 1.0) / std::max(1.0, absent)});
  }
  add(EventKind::kOther, [](std::size_t) { return true; });
  std::vector<Hypothesis> pairs;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      if (!free(i) || !free(j)) continue;
      const belief::ObjectModel &a = events.model(i), &b = events.model(j);
      const bool same = a.name == b.name || meshes.get(a.visual, a.collision, filter::MeshDetail::kLikelihood) ==
                                                meshes.get(b.visual, b.collision, filter::MeshDetail::kLikelihood);
      if (!same) continue;
      const std::size_t first = looked_at(i) ? i : j;
      pairs.push_back({EventKind::kExchanged, first, first == i ? j : i, 0.0});
    }
  share(EventKind::kExchanged, std::move(pairs));
  double sum = 0.0;
  for (const Hypothesis& h : all) sum += h.prior;
  for (Hypothesis& h : all) h.prior /= sum > 0.0 ? sum : 1.0;
  std::erase_if(all, [&](const Hypothesis& h) { return h.prior <= 0.0 || !looked_at(h.object); });
  return all;
}

}  // namespace prescene::queries
