// SPDX-License-Identifier: Apache-2.0
#include "other_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

constexpr double kStaysInFrame = 0.45, kMoves = 0.45, kUnseen = 0.1;  // in a frame
constexpr std::size_t kDraws = 48;                                    // of the integral over poses
constexpr double kLeastShift = 0.003, kLeastTurn = 0.035;             // m and rad; deviations of the draws

double log_normal_density(double x, double deviation) {
  return -0.5 * x * x / (deviation * deviation) - std::log(deviation) - 0.5 * std::log(2.0 * std::numbers::pi);
}

/// Deviations of draws about an estimate.
struct DrawSpread {
  double shift = kLeastShift, turn = kLeastTurn;
};

}  // namespace

OtherMotion other_motion(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                         const std::vector<double>& times, const belief::EventPriors& priors,
                         const core::RandomStream& stream) {
  OtherMotion result;
  const geometry::SymmetryGroup& symmetry = events.model(object).symmetry;
  const SeenTrack& track = events.track(object);
  std::optional<Pose> at = events.start_pose(object);
  const Vector3d about = at ? at->translation : events.put_in_place(object).translation;
  std::vector<double> unseen(times.size());
  const ScenePath gone{{object}, {ObjectPath(times.size())}, false};
  likelihood.evaluate(std::span(&gone, 1), unseen);
  // Of orientations that look different.
  const double copies = static_cast<double>(symmetry.rotations.size() + 1);
  const double log_any_turn = symmetry.ball   ? 0.0
                              : symmetry.axis ? std::log(copies / (4.0 * std::numbers::pi))
                                              : std::log(copies / (8.0 * std::numbers::pi * std::numbers::pi));
  double variance = 0.0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    std::size_t seen = 0;
    while (seen < track.times.size() && track.times[seen] < times[k] - 1e-6) ++seen;
    const bool tracked = seen < track.times.size() && track.times[seen] < times[k] + 1e-6;
    const std::optional<Pose> centre = tracked ? std::optional(track.estimates[seen].mode) : at;
    double log_stays = -1e300, log_moves = -1e300;
    if (at) {
      likelihood.evaluate(k, object, std::span(&*at, 1), std::span(&log_stays, 1));
      log_stays += std::log(kStaysInFrame);
    }
    std::optional<Pose> best;
    double best_ratio = -1e300;
    if (centre) {
      DrawSpread spread;
      if (tracked) {
        const geometry::Matrix6d& covariance = track.estimates[seen].covariance;
        spread.shift = std::clamp(1.5 * std::sqrt(covariance.diagonal().tail<3>().mean()), kLeastShift, 0.05);
        spread.turn = std::clamp(1.5 * std::sqrt(covariance.diagonal().head<3>().mean()), kLeastTurn, 0.3);
      }
      std::vector<Pose> poses(kDraws);
      std::vector<double> log_share(kDraws), ratios(kDraws);
      for (std::size_t i = 0; i < kDraws; ++i) {
        core::RandomStream draws = stream.at(k, static_cast<std::uint32_t>(i));
        geometry::Vector6d d;
        for (int c = 0; c < 6; ++c) d[c] = (c < 3 ? spread.turn : spread.shift) * draws.normal();
        double log_q = 0.0;
        if (symmetry.axis) {
          const Vector3d axis = *symmetry.axis;
          d.head<3>() -= axis * axis.dot(d.head<3>());
          log_q = -0.5 * d.head<3>().squaredNorm() / (spread.turn * spread.turn) -
                  std::log(2.0 * std::numbers::pi * spread.turn * spread.turn);
        } else if (!symmetry.ball) {
          for (int c = 0; c < 3; ++c) log_q += log_normal_density(d[c], spread.turn);
        }
        double log_u = log_any_turn;
        poses[i] = geometry::box_plus(*centre, d);
        for (int c = 0; c < 3; ++c) {
          log_q += log_normal_density(d[3 + c], spread.shift);
          log_u += log_normal_density(poses[i].translation[c] - about[c], priors.carry_distance);
        }
        log_share[i] = log_u - log_q;
      }
      likelihood.evaluate(k, object, poses, ratios);
      result.evaluations += static_cast<int>(kDraws);
      double top = -1e300, sum = 0.0, squares = 0.0;
      for (std::size_t i = 0; i < kDraws; ++i) {
        top = std::max(top, ratios[i] + log_share[i]);
        if (ratios[i] > best_ratio) best_ratio = ratios[i], best = poses[i];
      }
      for (std::size_t i = 0; i < kDraws; ++i) {
        const double w = std::exp(ratios[i] + log_share[i] - top);
        sum += w;
        squares += w * w;
      }
      const auto n = static_cast<double>(kDraws);
      log_moves = std::log(kMoves) + top + std::log(sum / n);
      // As far as moving counts in this frame.
      if (log_moves > log_stays) variance += std::max(0.0, n * squares / (sum * sum) - 1.0) / n;
    }
    result.most_likely += std::max({log_stays - std::log(kStaysInFrame), best_ratio, unseen[k]});
    const double log_unseen = std::log(kUnseen) + unseen[k];
    const double top = std::max({log_stays, log_moves, log_unseen});
    result.frames.push_back(
        top + std::log(std::exp(log_stays - top) + std::exp(log_moves - top) + std::exp(log_unseen - top)));
    result.log_evidence += result.frames.back();
    if (log_unseen == top)
      at.reset();
    else if (log_moves == top)
      at = best;
    result.path.push_back(at);
  }
  result.error = std::sqrt(variance);
  return result;
}

}  // namespace prescene::queries
