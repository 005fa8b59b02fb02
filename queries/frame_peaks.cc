// SPDX-License-Identifier: Apache-2.0
#include "frame_peaks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/belief/body_names.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

constexpr std::array<std::size_t, 3> kPeakRounds = {64, 64, 96};  // draws; the last measure
constexpr double kLeastShift = 0.002, kLeastTurn = 0.02;          // m and rad; deviations of the draws
constexpr double kFinestShift = 0.0005, kFinestTurn = 0.005;      // ... and of what is found
constexpr double kWider = 1.3;         // by which draws are wider than what they are to measure
constexpr double kEffective = 0.25;    // share of the draws that may count between rounds, at least
constexpr double kUncorrelated = 0.3;  // Correlations that few draws show are shrunk by this share.
// Nats by which what is typical of a peak is above the frame without the object. Less is no peak: draws find what is as
// likely, and the image itself weighs them.
constexpr double kSeen = 1.0;
constexpr double kHiddenTurn = 10.0;  // rad; deviation of turns that change nothing

/// Where to look in a frame.
struct SearchPlace {
  Pose X_WO;
  double shift = kLeastShift, turn = kLeastTurn;  // deviations
};

/// Coordinates that change something: directions in those of geometry::box_plus.
Eigen::MatrixXd visible_coordinates(const geometry::SymmetryGroup& symmetry) {
  const geometry::Matrix6d all = geometry::Matrix6d::Identity();
  if (symmetry.ball) return all.rightCols<3>();
  if (!symmetry.axis) return all;
  const Vector3d axis = symmetry.axis->normalized();
  const Vector3d across = axis.unitOrthogonal();
  Eigen::MatrixXd some = Eigen::MatrixXd::Zero(6, 5);
  some.col(0).head<3>() = across;
  some.col(1).head<3>() = axis.cross(across);
  some.rightCols(3) = all.rightCols<3>();
  return some;
}

std::optional<SearchPlace> place_in(const EventPaths& events, std::size_t object, double time) {
  const SeenTrack& track = events.track(object);
  std::size_t next = 0;
  while (next < track.times.size() && track.times[next] < time - 1e-6) ++next;
  if (next < track.times.size() && track.times[next] < time + 1e-6) {
    const belief::ObjectEstimate& estimate = track.estimates[next];
    const auto deviation = [&](const auto& variances) { return 1.5 * std::sqrt(variances.mean()); };
    return SearchPlace{estimate.mode,
                       std::clamp(deviation(estimate.covariance.diagonal().tail<3>()), kLeastShift, 0.05),
                       std::clamp(deviation(estimate.covariance.diagonal().head<3>()), kLeastTurn, 0.3)};
  }
  std::optional<Pose> before = events.start_pose(object), after;
  double left = 0.0, came = time;
  if (next > 0) before = track.estimates[next - 1].mode, left = track.times[next - 1];
  if (next < track.times.size()) after = track.estimates[next].mode, came = track.times[next];
  if (!before && !after) return std::nullopt;
  if (!before) return SearchPlace{*after, 0.01, 0.1};  // not found yet: it may stand there already
  if (!after) return SearchPlace{*before, 0.03, 0.2};
  const Pose X = geometry::closest_equivalent(*after, *before, events.model(object).symmetry);
  SearchPlace place;
  place.X_WO = geometry::interpolate(*before, X, (time - left) / std::max(1e-3, came - left));
  place.shift = std::clamp(0.4 * (X.translation - before->translation).norm(), 0.01, 0.1);
  place.turn = std::clamp(0.4 * geometry::angle_between(X.rotation, before->rotation), 0.1, 0.8);
  return place;
}

/// Mean and covariance of draws by the weights exp(share * log_weight), with as much of them as leaves enough draws.
struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

Moments moments_of(const Eigen::MatrixXd& draws, const std::vector<double>& log_weight, double wanted) {
  const auto n = static_cast<Eigen::Index>(log_weight.size());
  const double top = *std::max_element(log_weight.begin(), log_weight.end());
  Eigen::VectorXd weight(n);
  const auto effective = [&](double share) {
    for (Eigen::Index i = 0; i < n; ++i) weight[i] = std::exp(share * (log_weight[static_cast<std::size_t>(i)] - top));
    return weight.sum() * weight.sum() / weight.squaredNorm();
  };
  if (effective(1.0) < wanted) {
    double low = 0.0, high = 1.0;
    for (int k = 0; k < 20; ++k) (effective(0.5 * (low + high)) < wanted ? high : low) = 0.5 * (low + high);
    effective(low);
  }
  weight /= weight.sum();
  Moments moments;
  moments.mean = draws * weight;
  const Eigen::MatrixXd off = draws.colwise() - moments.mean;
  moments.covariance = geometry::product(off * weight.asDiagonal(), off.transpose());
  const Eigen::VectorXd variances = moments.covariance.diagonal();
  moments.covariance *= 1.0 - kUncorrelated;
  moments.covariance.diagonal() = variances;
  return moments;
}

}  // namespace

FoundPeaks find_peaks(const EventPaths& events, WindowLikelihood& likelihood, std::size_t object,
                      const std::vector<double>& times, const core::RandomStream& stream) {
  FoundPeaks found;
  const Eigen::MatrixXd visible = visible_coordinates(events.model(object).symmetry);
  const Eigen::Index size = visible.cols(), turns = size - 3;
  std::vector<double> absent(times.size());
  const ScenePath gone = path_of(object, ObjectPath(times.size()));
  likelihood.evaluate(std::span(&gone, 1), absent);
  const double log_unit = 0.5 * static_cast<double>(size) * std::log(2.0 * std::numbers::pi);
  const auto widened = [&](const Eigen::MatrixXd& covariance, double factor, double turn, double shift) {
    Eigen::MatrixXd result = factor * factor * covariance;
    result.diagonal().head(turns).array() += turn * turn;
    result.diagonal().tail(3).array() += shift * shift;
    return result;
  };
  for (std::size_t k = 0; k < times.size(); ++k) {
    FramePeak& peak = found.peaks.emplace_back();
    const auto place = place_in(events, object, times[k]);
    if (!place) continue;
    Moments now{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size)};
    Eigen::MatrixXd spread = widened(now.covariance, 1.0, place->turn, place->shift);
    double highest = -1e300;
    for (std::size_t round = 0; round < kPeakRounds.size(); ++round) {
      const std::size_t count = kPeakRounds[round];
      const Eigen::MatrixXd factor = geometry::cholesky_factor(spread);
      const double log_volume = factor.diagonal().array().log().sum() + log_unit;
      Eigen::MatrixXd draws(size, static_cast<Eigen::Index>(count));
      std::vector<Pose> poses(count);
      std::vector<double> log_weight(count), ratios(count);
      for (std::size_t i = 0; i < count; ++i) {
        core::RandomStream random =
            stream.at(k * kPeakRounds.size() + round, static_cast<std::uint32_t>(object * 1000 + i));
        Eigen::VectorXd z(size);
        for (double& x : z) x = random.normal();
        const auto column = static_cast<Eigen::Index>(i);
        draws.col(column) = now.mean + factor * z;
        poses[i] = geometry::box_plus(place->X_WO, visible * draws.col(column));
        log_weight[i] = 0.5 * z.squaredNorm() + log_volume;
      }
      likelihood.evaluate(k, object, poses, ratios);
      found.evaluations += static_cast<int>(count);
      for (std::size_t i = 0; i < count; ++i) log_weight[i] += ratios[i];
      highest = std::max(highest, *std::max_element(ratios.begin(), ratios.end()));
      const bool last = round + 1 == kPeakRounds.size();
      now = moments_of(draws, log_weight, kEffective * static_cast<double>(count));
      if (!last) {
        spread = widened(now.covariance, kWider, kLeastTurn, kLeastShift);
        continue;
      }
      const double top = *std::max_element(log_weight.begin(), log_weight.end());
      double sum = 0.0, squares = 0.0;
      for (const double w : log_weight) sum += std::exp(w - top), squares += std::exp(2.0 * (w - top));
      const auto n = static_cast<double>(count);
      peak.log_mass = top + std::log(sum / n);
      peak.error = std::sqrt(std::max(0.0, n * squares / (sum * sum) - 1.0) / n);
    }
    // Of a Gaussian, the log density is half its number of coordinates below the peak's on average.
    peak.seen = highest > absent[k] + 0.5 * static_cast<double>(size) + kSeen;
    const Eigen::MatrixXd covariance = widened(now.covariance, 1.0, kFinestTurn, kFinestShift);
    const double log_volume = geometry::cholesky_factor(covariance).diagonal().array().log().sum() + log_unit;
    // Of few draws: no peak is much higher than the highest of them.
    peak.log_peak = std::min(peak.log_mass - log_volume, highest + 1.0) - absent[k];
    peak.log_mass -= absent[k];
    peak.X_WO = geometry::box_plus(place->X_WO, visible * now.mean);
    geometry::Matrix6d in_body = geometry::product(visible * covariance, visible.transpose());
    const geometry::Matrix6d hidden =
        geometry::Matrix6d::Identity() - geometry::Matrix6d(visible * visible.transpose());
    in_body += kHiddenTurn * kHiddenTurn * hidden;
    peak.covariance = turns_about_W(peak.X_WO, in_body);
    peak.lift = events.lift(object, peak.X_WO);
    const Vector3d up = belief::up_of(events.scene());
    peak.log_put_down = events.log_put_down(object, peak.X_WO, up.dot(peak.covariance.bottomRightCorner<3, 3>() * up));
  }
  return found;
}

}  // namespace prescene::queries
