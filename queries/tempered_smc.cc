// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/tempered_smc.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace prescene::queries {
namespace {

constexpr double kGuessShare = 0.5;  // of what is not drawn where runs before found the posterior
constexpr double kFoundShare = 0.5;
constexpr double kFoundWider = 1.4;   // by which deviations of what was found are widened: few points determine them
constexpr double kImpossible = -1e5;  // log L of what can't be: finite, so that paths go on
constexpr double kNuisanceStep =
    0.35;  // of a move in nuisances, which leaves their prior as it is [Cotter et al. 2013]
constexpr double kLeastDeviation = 0.01;  // of a random walk
// Correlations that few points show are shrunk by this share. Chosen.
constexpr double kShrunk = 0.3;
constexpr double kWantedAcceptance = 0.25;

double log_normal(std::span<const double> z) {
  double sum = 0.0;
  for (const double x : z) sum -= 0.5 * x * x;
  return sum - 0.5 * std::log(2.0 * std::numbers::pi) * static_cast<double>(z.size());
}

double log_add(double a, double b) {
  const double top = std::max(a, b);
  return std::isinf(top) ? top : top + std::log(std::exp(a - top) + std::exp(b - top));
}

/// Shares of a run's first points.
struct Shares {
  explicit Shares(const TemperedTarget& target)
      : found(target.found_mean.empty() ? 0.0 : kFoundShare),
        guessed(target.guess_mean.empty() ? 0.0 : (1.0 - found) * kGuessShare),
        prior(1.0 - found - guessed) {}
  double found, guessed, prior;
};

/// Of a normal distribution by its mean and Cholesky's factor.
double log_found(const TemperedTarget& target, std::span<const double> z) {
  const std::size_t n = z.size();
  std::vector<double> d(n);
  double log_density = -0.5 * std::log(2.0 * std::numbers::pi) * static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    d[i] = z[i] - target.found_mean[i];
    for (std::size_t k = 0; k < i; ++k) d[i] -= target.found_factor[i * n + k] * d[k];
    d[i] /= target.found_factor[i * n + i];
    log_density -= 0.5 * d[i] * d[i] + std::log(target.found_factor[i * n + i]);
  }
  return log_density;
}

/// Of the moved coordinates.
double log_proposal(const TemperedTarget& target, std::span<const double> z) {
  const Shares shares(target);
  double log_density = std::log(shares.prior) + log_normal(z);
  if (shares.guessed > 0.0) {
    double guess = -0.5 * std::log(2.0 * std::numbers::pi) * static_cast<double>(z.size());
    for (std::size_t i = 0; i < z.size(); ++i) {
      const double d = (z[i] - target.guess_mean[i]) / target.guess_deviation[i];
      guess -= 0.5 * d * d + std::log(target.guess_deviation[i]);
    }
    log_density = log_add(log_density, std::log(shares.guessed) + guess);
  }
  if (shares.found > 0.0) log_density = log_add(log_density, std::log(shares.found) + log_found(target, z));
  return log_density;
}

struct Run {
  std::vector<LatentPoint> z;
  std::vector<double> log_l;
  double b = 0.0;
  double log_evidence = 0.0;
  double scale = 1.0;          // of the random walk
  std::vector<double> factor;  // of the spread: lower triangle, row by row
  bool moves = false;          // in this round
  int last_moves = 0;          // done at b = 1
  bool gave_up = false;
};

/// Cholesky's factor of a symmetric positive definite matrix, in place.
void factorise(std::vector<double>& a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i * n + k] * a[j * n + k];
      a[i * n + j] = i == j ? std::sqrt(std::max(1e-12, sum)) : sum / a[j * n + j];
    }
}

/// Mean, and Cholesky's factor of the covariance, of the first `n` coordinates of weighted points.
template <class PointAt>
void measure_spread(std::size_t n, std::span<const double> weight, const PointAt& point, std::vector<double>& mean,
                    std::vector<double>& factor) {
  mean.assign(n, 0.0);
  for (std::size_t i = 0; i < weight.size(); ++i)
    for (std::size_t k = 0; k < n; ++k) mean[k] += weight[i] * point(i)[k];
  factor.assign(n * n, 0.0);
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const LatentPoint& z = point(i);
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t l = 0; l <= k; ++l)
        factor[k * n + l] += weight[i] * (z[k] - mean[k]) * (z[l] - mean[l]) * (k == l ? 1.0 : 1.0 - kShrunk);
  }
  for (std::size_t k = 0; k < n; ++k)
    factor[k * n + k] = std::max(kLeastDeviation * kLeastDeviation, factor[k * n + k]);
  factorise(factor, n);
}

/// Mean over the runs, its error, and the points by their runs' evidence; `points` hold shares of their runs.
void summarise(TemperedResult& result, const std::vector<std::size_t>& run_of) {
  const double top = *std::max_element(result.log_evidence.begin(), result.log_evidence.end());
  double sum = 0.0, mean = 0.0, square = 0.0;
  const auto runs = static_cast<double>(result.log_evidence.size());
  for (const double e : result.log_evidence) sum += std::exp(e - top), mean += e / runs;
  for (const double e : result.log_evidence) square += (e - mean) * (e - mean);
  result.mean_log_evidence = top + std::log(sum / runs);
  result.error = runs > 1.0 ? std::sqrt(square / (runs - 1.0) / runs) : 0.0;
  for (std::size_t i = 0; i < run_of.size(); ++i)
    result.points[i].weight *= std::exp(result.log_evidence[run_of[i]] - top) / sum;
}

class TemperedSampler {
 public:
  TemperedSampler(const TemperedTarget& target, const TemperedOptions& options, const core::RandomStream& stream)
      : target_(target), options_(options), stream_(stream), moved_(static_cast<std::size_t>(target.moved)) {}

  TemperedResult run(const core::Cancellation* cancellation) {
    begin();
    for (int step = 1;; ++step) {
      if (cancellation && cancellation->requested()) break;
      const bool late = options_.out_of_time && options_.out_of_time();
      bool any = false;
      // Each run goes its own way, so that it does not depend on those beside it.
      for (std::size_t r = 0; r < runs_.size(); ++r) {
        Run& run = runs_[r];
        run.moves = true;
        if (run.b < 1.0 && !run.gave_up) {
          const auto stream =
              stream_.at(2 * static_cast<std::uint64_t>(step), static_cast<std::uint32_t>(number_of(r)));
          if (temper(run, late || step >= options_.most_steps, stream)) (late ? unfinished_ : cut_short_) = true;
          run.moves = !run.gave_up;
        } else if (!run.gave_up && run.last_moves < options_.last_moves) {
          ++run.last_moves;
          measure(run, std::vector<double>(run.z.size(), 1.0 / static_cast<double>(run.z.size())));
        } else {
          run.moves = false;
        }
        any = any || run.moves;
      }
      if (!any || late) break;
      if (target_.dimensions > 0) move(static_cast<std::uint64_t>(step));
    }
    return result();
  }

 private:
  std::size_t number_of(std::size_t run) const { return static_cast<std::size_t>(options_.first_run) + run; }
  std::uint32_t number_of(std::size_t run, std::size_t point) const {
    return static_cast<std::uint32_t>(number_of(run) * static_cast<std::size_t>(options_.points) + point);
  }
  std::span<const double> moved(const LatentPoint& z) const { return std::span(z).first(moved_); }

  /// log of (N L / q) at a point: what a step of b adds to its weight.
  double log_gain(const Run& run, std::size_t i) const {
    return log_normal(moved(run.z[i])) - log_proposal(target_, moved(run.z[i])) + run.log_l[i];
  }

  void evaluate(std::span<const LatentPoint> points, std::span<double> log_l) {
    target_.evaluate(points, log_l);
    for (double& value : log_l)
      if (!(value > kImpossible)) value = kImpossible;
    evaluations_ += static_cast<int>(points.size());
  }

  void begin() {
    const Shares shares(target_);
    // Without coordinates, all points are one.
    const auto count =
        static_cast<std::size_t>(options_.points * (target_.dimensions > 0 ? std::max(1, options_.first_points) : 1));
    std::vector<LatentPoint> all;
    for (int r = 0; r < options_.runs; ++r) {
      for (std::size_t i = 0; i < count; ++i) {
        core::RandomStream draws =
            stream_.at(0, static_cast<std::uint32_t>(number_of(static_cast<std::size_t>(r)) * count + i));
        LatentPoint z(static_cast<std::size_t>(target_.dimensions));
        // Stratified, so that no run is without points of either kind.
        const double place = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
        const bool guessed = place < shares.guessed, found = !guessed && place < shares.guessed + shares.found;
        for (double& x : z) x = draws.normal();
        for (std::size_t k = 0; guessed && k < moved_; ++k)
          z[k] = target_.guess_mean[k] + target_.guess_deviation[k] * z[k];
        for (std::size_t k = moved_; found && k-- > 0;) {
          double x = target_.found_mean[k];
          for (std::size_t l = 0; l <= k; ++l) x += target_.found_factor[k * moved_ + l] * z[l];
          z[k] = x;
        }
        all.push_back(std::move(z));
      }
    }
    std::vector<double> log_l(all.size());
    if (target_.dimensions > 0) {
      evaluate(all, log_l);
    } else {
      evaluate(std::span(all).first(1), std::span(log_l).first(1));
      std::fill(log_l.begin(), log_l.end(), log_l.front());
    }
    for (int r = 0; r < options_.runs; ++r) {
      Run& run = runs_.emplace_back();
      const auto from = static_cast<std::ptrdiff_t>(static_cast<std::size_t>(r) * count);
      const auto to = from + static_cast<std::ptrdiff_t>(count);
      run.z.assign(all.begin() + from, all.begin() + to);
      run.log_l.assign(log_l.begin() + from, log_l.begin() + to);
    }
  }

  /// The largest step of b that leaves enough effective points, but for the last, which goes to 1; resamples. Whether
  /// it was too large.
  bool temper(Run& run, bool last, core::RandomStream stream) {
    const std::size_t n = run.z.size();
    std::vector<double> gain(n), weight(n);
    for (std::size_t i = 0; i < n; ++i) gain[i] = log_gain(run, i);
    const double top = *std::max_element(gain.begin(), gain.end());
    const auto effective = [&](double step) {
      double sum = 0.0, squares = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        weight[i] = std::exp(step * (gain[i] - top));
        sum += weight[i];
        squares += weight[i] * weight[i];
      }
      return sum * sum / squares;
    };
    // What is to come is at most (1 - b) of the greatest gain, as N / q is at most one over the prior's share.
    const auto reachable = [&] {
      return run.log_evidence + (1.0 - run.b) * (options_.most_likely - std::log(Shares(target_).prior));
    };
    const double wanted = options_.least_effective * static_cast<double>(n);
    double step = 1.0 - run.b;
    if (effective(step) < wanted && !last) {
      double low = 0.0, high = step;
      for (int k = 0; k < 40; ++k) (effective(0.5 * (low + high)) < wanted ? high : low) = 0.5 * (low + high);
      step = std::max(low, 1e-6);
    }
    const bool too_large = effective(step) < wanted && last;
    if (too_large) at_most_ = std::max(at_most_, reachable());
    double sum = 0.0;
    for (const double w : weight) sum += w;
    run.log_evidence += step * top + std::log(sum / static_cast<double>(n));
    run.b = run.b + step >= 1.0 - 1e-9 ? 1.0 : run.b + step;
    if (run.b < 1.0 && reachable() < options_.give_up_below) {
      run.log_evidence = reachable();
      run.gave_up = true;
      run.z.resize(static_cast<std::size_t>(options_.points));
      run.log_l.resize(run.z.size());
      return false;
    }
    for (double& w : weight) w /= sum;
    measure(run, weight);
    // Systematic resampling.
    const double first = stream.uniform();
    const auto kept = static_cast<std::size_t>(options_.points);
    std::vector<LatentPoint> z(kept);
    std::vector<double> log_l(kept);
    double reached = weight[0] * static_cast<double>(kept);
    for (std::size_t i = 0, from = 0; i < kept; ++i) {
      while (reached < static_cast<double>(i) + first && from + 1 < n)
        reached += weight[++from] * static_cast<double>(kept);
      z[i] = run.z[from];
      log_l[i] = run.log_l[from];
    }
    run.z = std::move(z);
    run.log_l = std::move(log_l);
    return too_large;
  }

  /// The spread of the moved coordinates, along which random walks go.
  void measure(Run& run, const std::vector<double>& weight) const {
    std::vector<double> mean;
    measure_spread(
        moved_, weight, [&](std::size_t i) -> const LatentPoint& { return run.z[i]; }, mean, run.factor);
  }

  void move(std::uint64_t step) {
    std::vector<LatentPoint> proposed;
    std::vector<std::pair<std::size_t, std::size_t>> of;
    std::vector<double> log_uniform, step_of(moved_);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      Run& run = runs_[r];
      if (!run.moves) continue;
      const double walk = run.scale * 2.38 / std::sqrt(std::max(1.0, static_cast<double>(moved_)));
      for (std::size_t i = 0; i < run.z.size(); ++i) {
        core::RandomStream draws = stream_.at(2 * step + 1, number_of(r, i));
        LatentPoint z = run.z[i];
        for (double& draw : step_of) draw = draws.normal();
        for (std::size_t k = 0; k < moved_; ++k)
          for (std::size_t l = 0; l <= k; ++l) z[k] += walk * run.factor[k * moved_ + l] * step_of[l];
        for (std::size_t k = moved_; k < z.size(); ++k)
          z[k] = std::sqrt(1.0 - kNuisanceStep * kNuisanceStep) * z[k] + kNuisanceStep * draws.normal();
        log_uniform.push_back(std::log(draws.uniform()));
        proposed.push_back(std::move(z));
        of.emplace_back(r, i);
      }
    }
    std::vector<double> log_l(proposed.size());
    evaluate(proposed, log_l);
    std::vector<int> accepted(runs_.size(), 0);
    for (std::size_t j = 0; j < proposed.size(); ++j) {
      const auto [r, i] = of[j];
      Run& run = runs_[r];
      const auto log_density = [&](const LatentPoint& z, double l) {
        return (1.0 - run.b) * log_proposal(target_, moved(z)) + run.b * (log_normal(moved(z)) + l);
      };
      const double ratio = log_density(proposed[j], log_l[j]) - log_density(run.z[i], run.log_l[i]);
      if (!(log_uniform[j] < ratio)) continue;
      run.z[i] = std::move(proposed[j]);
      run.log_l[i] = log_l[j];
      ++accepted[r];
    }
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!runs_[r].moves) continue;
      const double share = static_cast<double>(accepted[r]) / static_cast<double>(runs_[r].z.size());
      runs_[r].scale = std::clamp(runs_[r].scale * std::exp(2.0 * (share - kWantedAcceptance)), 0.05, 2.0);
    }
  }

  TemperedResult result() const {
    TemperedResult result;
    result.evaluations = evaluations_;
    result.cut_short = cut_short_;
    result.unfinished = unfinished_;
    if (unfinished_) result.at_most = at_most_;
    std::vector<std::size_t> run_of;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const Run& run = runs_[r];
      result.log_evidence.push_back(run.log_evidence);
      result.gave_up = result.gave_up || run.gave_up;
      for (std::size_t i = 0; i < run.z.size(); ++i) {
        result.points.push_back({run.z[i], run.log_l[i], 1.0 / static_cast<double>(run.z.size())});
        run_of.push_back(r);
      }
    }
    summarise(result, run_of);
    return result;
  }

  const TemperedTarget& target_;
  const TemperedOptions& options_;
  core::RandomStream stream_;
  std::size_t moved_;
  std::vector<Run> runs_;
  int evaluations_ = 0;
  bool cut_short_ = false, unfinished_ = false;
  double at_most_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

void propose_from(const TemperedResult& found, TemperedTarget& target) {
  propose_from(found, static_cast<std::size_t>(target.moved), target);
}

void propose_from(const TemperedResult& found, std::size_t shared, TemperedTarget& target) {
  if (shared == 0 || found.points.empty()) return;
  std::vector<double> weight, mean, factor;
  for (const TemperedPoint& point : found.points) weight.push_back(point.weight);
  measure_spread(
      shared, weight, [&](std::size_t i) -> const LatentPoint& { return found.points[i].z; }, mean, factor);
  const auto n = static_cast<std::size_t>(target.moved);
  target.found_mean.assign(n, 0.0);
  target.found_factor.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const bool guessed = !target.guess_mean.empty();
    target.found_mean[i] = i < shared ? mean[i] : guessed ? target.guess_mean[i] : 0.0;
    if (i >= shared) target.found_factor[i * n + i] = guessed ? target.guess_deviation[i] : 1.0;
    for (std::size_t k = 0; i < shared && k <= i; ++k)
      target.found_factor[i * n + k] = kFoundWider * factor[i * shared + k];
  }
}

TemperedResult merge(const TemperedResult& a, const TemperedResult& b) {
  TemperedResult both;
  both.evaluations = a.evaluations + b.evaluations;
  both.cut_short = a.cut_short || b.cut_short;
  both.gave_up = a.gave_up || b.gave_up;
  both.unfinished = a.unfinished || b.unfinished;
  std::vector<std::size_t> run_of;
  for (const TemperedResult* one : {&a, &b}) {
    const std::size_t points = one->points.size() / one->log_evidence.size(), first = both.log_evidence.size();
    both.log_evidence.insert(both.log_evidence.end(), one->log_evidence.begin(), one->log_evidence.end());
    for (std::size_t i = 0; i < one->points.size(); ++i) {
      both.points.push_back(one->points[i]);
      both.points.back().weight = 1.0 / static_cast<double>(points);
      run_of.push_back(first + i / points);
    }
  }
  summarise(both, run_of);
  return both;
}

TemperedResult tempered_posterior(const TemperedTarget& target, const TemperedOptions& options,
                                  const core::RandomStream& stream, const core::Cancellation* cancellation) {
  return TemperedSampler(target, options, stream).run(cancellation);
}

}  // namespace prescene::queries
