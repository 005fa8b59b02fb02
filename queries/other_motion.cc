// SPDX-License-Identifier: Apache-2.0
#include "other_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/belief/body_names.h"
#include "prescene/queries/path_error.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

constexpr double kStaysInFrame = 0.45, kMoves = 0.45, kUnseen = 0.1;  // in a frame

double log_normal_density(double x, double deviation) {
  return -0.5 * x * x / (deviation * deviation) - std::log(deviation) - 0.5 * std::log(2.0 * std::numbers::pi);
}

}  // namespace

OtherMotion other_motion(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                         const belief::EventPriors& priors) {
  OtherMotion result;
  const geometry::SymmetryGroup& symmetry = events.model(object).symmetry;
  const std::vector<FramePeak>& peaks = likelihood.peaks(object);
  std::optional<Pose> at = events.start_pose(object);
  // What stays is weighed as the other explanations weigh it.
  const Vector3d up = belief::up_of(events.scene());
  PathError error(0.0, 1.0, up, symmetry);
  if (at) {
    error.loosen(likelihood.start_error(object));
    error.move_to(*at);
  }
  const Vector3d about = at ? at->translation : events.put_in_place(object).translation;
  std::vector<double> unseen(peaks.size());
  const ScenePath gone = path_of(object, ObjectPath(peaks.size()));
  likelihood.evaluate(std::span(&gone, 1), unseen);
  // Of orientations that look different.
  const double copies = static_cast<double>(symmetry.rotations.size() + 1);
  const double log_any_turn = symmetry.ball   ? 0.0
                              : symmetry.axis ? std::log(copies / (4.0 * std::numbers::pi))
                                              : std::log(copies / (8.0 * std::numbers::pi * std::numbers::pi));
  double variance = 0.0;
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    const FramePeak& peak = peaks[k];
    double log_stays = -1e300, log_moves = -1e300, best_ratio = -1e300;
    if (at) {
      log_stays = likelihood.stays(k, object, error);
      best_ratio = log_stays;
      log_stays += std::log(kStaysInFrame);
    }
    if (peak.seen) {
      log_moves = std::log(kMoves) + unseen[k] + peak.log_mass + log_any_turn;
      for (int c = 0; c < 3; ++c)
        log_moves += log_normal_density(peak.X_WO.translation[c] - about[c], priors.carry_distance);
      best_ratio = std::max(best_ratio, unseen[k] + peak.log_peak);
      // As far as moving counts in this frame.
      if (log_moves > log_stays) variance += peak.error * peak.error;
    }
    result.most_likely += std::max(best_ratio, unseen[k]);
    const double log_unseen = std::log(kUnseen) + unseen[k];
    const double top = std::max({log_stays, log_moves, log_unseen});
    result.frames.push_back(
        top + std::log(std::exp(log_stays - top) + std::exp(log_moves - top) + std::exp(log_unseen - top)));
    result.log_evidence += result.frames.back();
    if (log_unseen == top) {
      at.reset();
    } else if (log_moves == top) {
      at = peak.X_WO;
      error = PathError(0.0, 1.0, up, symmetry);
      error.put_at(peak, false);
    }
    result.path.push_back(at);
  }
  result.error = std::sqrt(variance);
  return result;
}

}  // namespace prescene::queries
