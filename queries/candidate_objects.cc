// SPDX-License-Identifier: Apache-2.0
#include "candidate_objects.h"

#include <algorithm>
#include <utility>

#include "frame_peaks.h"
#include "missing_objects.h"

namespace prescene::queries {
namespace {

using belief::Pose;

constexpr std::size_t kMostCandidates = 4;
constexpr double kElsewhere = 0.01;  // m; tracked further from its start than this ...
constexpr double kTurned = 0.15;     // rad; ... or turned by more, an object is looked at
constexpr double kRefuted = -1.0;    // nats: what speaks so much against where it was is looked at

}  // namespace

bool CandidateObjects::may_be_explained(std::size_t object) const {
  return events_->is_present(object) || !events_->track(object).times.empty();
}

core::Status CandidateObjects::look_for_missing(const WindowFrame& last, const ExplainContext& context,
                                                const filter::FilterTools& tools) {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < events_->objects().size(); ++i)
    if (!may_be_explained(i) && (query_.object.empty() || query_.object == events_->objects()[i].name))
      missing.push_back(i);
  if (missing.empty()) return core::ok_status();
  PRESCENE_TRY(const auto found, find_missing(last, context, tools, query_.seed));
  for (const std::size_t i : missing) {
    const auto index = belief::find_object(*last.belief, events_->objects()[i].name);
    if (!index || !found[static_cast<std::size_t>(*index)]) continue;
    const Pose& X_WO = *found[static_cast<std::size_t>(*index)];
    const std::vector<double> absent = absent_ratios(i);
    // From when on it is seen there.
    std::vector<double> seen;
    for (std::size_t k = times_.size(); k-- > 0;) {
      double there = 0.0;
      likelihood_->evaluate(k, i, std::span(&X_WO, 1), std::span(&there, 1));
      if (is_silent(there, absent[k])) continue;
      if (there <= absent[k]) break;
      seen.insert(seen.begin(), times_[k]);
    }
    if (!seen.empty()) events_->note_found(i, X_WO, std::move(seen));
  }
  return core::ok_status();
}

void CandidateObjects::note_when_seen(std::size_t object) {
  const SeenTrack& track = events_->track(object);
  const std::size_t n = times_.size();
  const std::vector<double> absent = absent_ratios(object);
  std::vector<double> here(n, -1e300), there(n, -1e300);
  for (std::size_t k = 0; k < n; ++k) {
    if (const auto& base = likelihood_->base()[object][k])
      likelihood_->evaluate(k, object, std::span(&*base, 1), std::span(&here[k], 1));
    if (!track.estimates.empty())
      likelihood_->evaluate(k, object, std::span(&track.estimates.back().mode, 1), std::span(&there[k], 1));
  }
  std::size_t left = n, came = n;
  for (std::size_t k = n; k > 0; --k) {
    const double best = std::max(absent[k - 1], there[k - 1]);
    if (is_silent(here[k - 1], best)) continue;
    if (!(here[k - 1] < best)) break;
    left = k - 1;
  }
  for (std::size_t k = n; k > 0; --k) {
    const double best = std::max(absent[k - 1], here[k - 1]);
    if (is_silent(there[k - 1], best)) continue;
    if (!(there[k - 1] > best)) break;
    came = k - 1;
  }
  if (left == n && came == n) return;
  const auto time = [&](std::size_t k) { return k < n ? times_[k] : events_->duration(); };
  const auto before = [&](std::size_t k) { return k > 0 ? times_[k - 1] : 0.0; };
  SeenTimes seen{before(left), time(left), before(came), time(came)};
  if (came == n) seen.came_after = seen.came_before = events_->duration();
  events_->note_seen(object, seen);
}

void CandidateObjects::look_for_peaks(const std::vector<std::size_t>& candidates) {
  const core::RandomStream stream(query_.seed, core::Purpose::kProposal);
  for (std::size_t i = 0; i < events_->objects().size(); ++i) {
    const bool is_candidate = std::find(candidates.begin(), candidates.end(), i) != candidates.end();
    if (!is_candidate && !(events_->is_present(i) && tracked_elsewhere(i).elsewhere)) continue;
    FoundPeaks found = find_peaks(*events_, *likelihood_, i, times_, stream);
    if (found.peaks.back().seen) events_->note_seen_in_the_end(i);
    likelihood_->set_peaks(i, std::move(found.peaks));
    evaluated_ += found.evaluations;
  }
}

CandidateObjects::Elsewhere CandidateObjects::tracked_elsewhere(std::size_t object) const {
  Elsewhere result;
  const SeenTrack& track = events_->track(object);
  for (std::size_t j = 0; j < track.times.size(); ++j) {
    const Pose base = base_at(object, track.times[j]);
    const double distance = (track.estimates[j].mean.translation - base.translation).norm();
    const double angle = geometry::symmetric_angle(track.estimates[j].mean, base, events_->model(object).symmetry);
    result.elsewhere = result.elsewhere || distance > kElsewhere || angle > kTurned;
    result.moved = std::max(result.moved, distance + 0.05 * angle);
  }
  return result;
}

std::vector<std::size_t> CandidateObjects::to_look_at() {
  std::vector<std::pair<double, std::size_t>> order;
  double least = 1e300;
  std::size_t doubtful = 0;
  for (std::size_t i = 0; i < events_->objects().size(); ++i) {
    if (!events_->is_present(i)) {
      if (may_be_explained(i)) order.emplace_back(-1.0, i);
      continue;
    }
    const auto [moved, elsewhere] = tracked_elsewhere(i);
    const std::vector<double> absent = absent_ratios(i);
    double worst = 1e300;
    for (std::size_t k = 0; k < times_.size(); ++k) {
      if (!likelihood_->base()[i][k]) continue;
      double ratio = 0.0;
      likelihood_->evaluate(k, i, std::span(&*likelihood_->base()[i][k], 1), std::span(&ratio, 1));
      worst = std::min(worst, ratio - absent[k]);
    }
    if (worst < least) least = worst, doubtful = i;
    if (elsewhere || worst < kRefuted) order.emplace_back(-moved, i);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> candidates;
  for (const auto& [key, i] : order)
    if (candidates.size() < kMostCandidates) candidates.push_back(i);
  if (order.size() > candidates.size())
    remarks_.push_back(std::to_string(order.size()) + " objects are elsewhere; only the " +
                       std::to_string(kMostCandidates) + " that moved furthest were looked at.");
  if (candidates.empty()) candidates.push_back(doubtful);
  return candidates;
}

std::vector<double> CandidateObjects::absent_ratios(std::size_t object) const {
  std::vector<double> ratios(times_.size());
  const ScenePath gone = path_of(object, ObjectPath(times_.size()));
  likelihood_->evaluate(std::span(&gone, 1), ratios);
  return ratios;
}

Pose CandidateObjects::base_at(std::size_t object, double time) const {
  std::size_t k = 0;
  while (k + 1 < times_.size() && times_[k] < time - 1e-6) ++k;
  return likelihood_->base()[object][k].value_or(Pose{});
}

}  // namespace prescene::queries
