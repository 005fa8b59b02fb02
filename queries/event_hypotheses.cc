// SPDX-License-Identifier: Apache-2.0
#include "event_hypotheses.h"

#include <algorithm>

namespace prescene::queries {

using belief::EventKind;

namespace {

constexpr double kLeastAbsent = 1e-3;  // probability that a thing is not there, from which on it may be put in

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
  double absent = 0.0;
  for (std::size_t i = 0; i < n; ++i) absent += events.may_be_absent(i);
  for (std::size_t i = 0; i < n; ++i) {
    const double share_of_it = events.may_be_absent(i) / std::max(1.0, absent);
    if (share_of_it > kLeastAbsent)
      all.push_back({EventKind::kPutIn, i, {}, weights.of(EventKind::kPutIn) * share_of_it});
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
