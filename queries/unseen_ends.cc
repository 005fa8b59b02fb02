// SPDX-License-Identifier: Apache-2.0
#include "unseen_ends.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using geometry::Vector6d;

/// The last frame that sees it; empty = none, or the last of all.
std::optional<std::size_t> last_sight(const std::vector<FramePeak>& peaks) {
  for (std::size_t k = peaks.size(); k-- > 0;)
    if (peaks[k].seen) return k + 1 < peaks.size() ? std::optional(k) : std::nullopt;
  return std::nullopt;
}

/// A draw of a Gaussian without mean.
Vector6d draw_of(const geometry::Matrix6d& covariance, core::RandomStream& random) {
  Vector6d z;
  for (double& x : z) x = random.normal();
  return geometry::Cholesky6(covariance + 1e-12 * geometry::Matrix6d::Identity()).factor() * z;
}

/// By what a true motion may be off an instance that is here at `speeds`.
StateError draw_error(const std::vector<NearPath>& near, const geometry::Twist& speeds, core::RandomStream& random) {
  double reached = random.uniform();
  std::size_t s = 0;
  while (s + 1 < near.size() && (reached -= near[s].weight) > 0.0) ++s;
  StateError error;
  error.pose = near[s].off + draw_of(near[s].error.covariance(), random);
  error.twist = draw_of(near[s].error.growth(speeds.linear, speeds.angular), random);
  return error;
}

}  // namespace

std::vector<UnseenEnd> unseen_ends(EventPaths& events, WindowLikelihood& likelihood, const std::vector<double>& times,
                                   const Judged& judged, std::span<const double> log_ratios) {
  const auto seen = last_sight(likelihood.peaks(judged.object));
  if (!seen) return {};
  const double time = times[*seen];
  std::vector<ScenePath> paths;
  std::vector<EventDraw> draws;
  std::vector<belief::Trajectory> runs;
  std::vector<StateError> errors;
  std::vector<std::size_t> of;
  const core::RandomStream stream(judged.number, core::Purpose::kNearbyStart);
  for (std::size_t i = 0; i < judged.paths.size(); ++i) {
    const ScenePath& path = judged.paths[i];
    if (path.impossible || !path.simulated || path.of(judged.object) == nullptr || judged.draws[i].time > time)
      continue;
    const auto near = likelihood.near(path, judged.object, *seen);
    if (near.empty()) continue;
    core::RandomStream random = stream.at(i);
    errors.push_back(draw_error(near, state_in(judged.runs[i], time).objects[judged.object].V_WO, random));
    paths.push_back(path);
    draws.push_back(judged.draws[i]);
    runs.push_back(judged.runs[i]);
    of.push_back(i);
  }
  const auto best = std::max_element(of.begin(), of.end(), [&](std::size_t a, std::size_t b) {
    return judged.posterior.points[a].log_likelihood < judged.posterior.points[b].log_likelihood;
  });
  if (best == of.end()) return {};
  for (const std::size_t k : likelihood.last_frames())
    if (!(likelihood.visible_share(judged.paths[*best], k, judged.object) < kOutOfSight)) return {};
  events.go_on(judged.hypothesis, time, draws, errors, runs, paths);
  // What the frames since then say of them, in place of what they said of the paths.
  std::vector<double> log_weight(paths.size());
  double top = -1e300, sum = 0.0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (paths[i].impossible) continue;
    log_weight[i] = std::log(judged.posterior.points[of[i]].weight);
    for (std::size_t k = *seen + 1; k < times.size(); ++k)
      log_weight[i] += likelihood.log_ratio(paths[i], k) - log_ratios[of[i] * times.size() + k];
    top = std::max(top, log_weight[i]);
  }
  std::vector<UnseenEnd> ends;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const auto& X_WO = paths[i].of(judged.object)->back();
    if (paths[i].impossible || !X_WO) continue;
    ends.push_back({*X_WO, std::exp(log_weight[i] - top)});
    sum += ends.back().weight;
  }
  for (UnseenEnd& end : ends) end.weight /= sum;
  return ends;
}

}  // namespace prescene::queries
