// SPDX-License-Identifier: Apache-2.0
#include "episode_evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"
#include "prescene/core/sobol.h"

namespace prescene::filter {
namespace {

using belief::PhysicalDraw;

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Powers of two from 1 on, and 0.
constexpr int kSharpnesses = 14;
double sharpness_of(int k) { return k + 1 == kSharpnesses ? 0.0 : std::exp2(-k); }

/// The least width of the kernels over which draws are spread, in standard normal coordinates of the priors: more
/// than a hundred draws do not say more.
constexpr double kLeastWidth = 0.02;

/// Bounds the score of a twin whose draw is ruled out.
constexpr double kLeastPosteriorDensity = 1e-12;

/// Mean squares by which each run is off what was seen, or off a twin.
std::vector<double> misfits_from(const EpisodeRuns& runs, std::span<const double> seen) {
  const auto length = static_cast<std::size_t>(kErrorSize * runs.samples);
  std::vector<double> result;
  for (std::size_t begin = 0; begin < runs.errors.size(); begin += length) {
    double sum = 0.0;
    for (std::size_t k = 0; k < length; k += kErrorSize) {
      double square = 0.0;
      for (std::size_t i = k; i < k + kErrorSize; ++i) {
        const double off = runs.errors[begin + i] - seen[i];
        square += off * off;
      }
      sum += std::min(square, runs.most_squares);
    }
    result.push_back(runs.errors[begin] == kNoPrediction ? kNever : sum / runs.samples);
  }
  return result;
}

class Evidence {
 public:
  Evidence(const EpisodeRuns& runs, const std::vector<PhysicalDraw>& draws, double other_cause)
      : runs_(runs),
        draws_(draws),
        other_cause_(other_cause),
        length_(static_cast<std::size_t>(kErrorSize * runs.samples)) {
    PRESCENE_CHECK(runs.samples > 0 && !draws.empty());
    count_ = runs.errors.size() / length_;
    PRESCENE_CHECK(count_ >= draws.size());
    for (const PhysicalDraw& draw : draws)
      for (const double u : draw.uniforms) coordinates_.push_back(core::inverse_normal_cdf(u));
  }

  /// Of each draw, relative to the best; `left_out` has none.
  std::vector<double> likelihoods(const std::vector<double>& misfits, double sharpness, std::size_t left_out) const {
    const double least = *std::min_element(misfits.begin(), misfits.end());
    std::vector<double> result(draws_.size(), 0.0);
    for (std::size_t r = 0; r < count_; ++r) {
      if (!std::isfinite(misfits[r])) continue;
      result[r % draws_.size()] += std::exp(-0.5 * runs_.independent * sharpness * (misfits[r] - least));
    }
    double evidence = 0.0, all = 0.0;
    for (std::size_t i = 0; i < draws_.size(); ++i) {
      if (i == left_out)
        result[i] = 0.0;
      else
        all += std::exp(draws_[i].log_weight);
      evidence += std::exp(draws_[i].log_weight) * result[i];
    }
    for (std::size_t i = 0; i < draws_.size(); ++i)
      if (i != left_out && all > 0.0) result[i] += other_cause_ * evidence / all;
    return result;
  }

  /// The logarithm of the density that the posterior of the other draws has at a draw, over the coordinates.
  double score(const std::vector<double>& likelihoods, std::size_t truth) const {
    std::vector<double> weights;
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < draws_.size(); ++i)
      sum += weights.emplace_back(std::exp(draws_[i].log_weight) * likelihoods[i]);
    if (!(sum > 0.0)) return static_cast<double>(draws_.front().uniforms.size()) * std::log(kLeastPosteriorDensity);
    for (double& weight : weights) {
      weight /= sum;
      squares += weight * weight;
    }
    const std::size_t size = draws_.front().uniforms.size();
    double score = 0.0;
    for (std::size_t d = 0; d < size; ++d) {
      double mean = 0.0, variance = 0.0;
      for (std::size_t i = 0; i < draws_.size(); ++i) mean += weights[i] * coordinates_[i * size + d];
      for (std::size_t i = 0; i < draws_.size(); ++i) {
        const double off = coordinates_[i * size + d] - mean;
        variance += weights[i] * off * off;
      }
      // Silverman's rule of the number of draws that count.
      const double width = std::max(kLeastWidth, 1.06 * std::sqrt(variance) * std::pow(squares, 0.2));
      double density = 0.0;
      for (std::size_t i = 0; i < draws_.size(); ++i) {
        const double off = (coordinates_[i * size + d] - coordinates_[truth * size + d]) / width;
        density += weights[i] * std::exp(-0.5 * off * off);
      }
      score += std::log(std::max(density / width, kLeastPosteriorDensity));
    }
    return score;
  }

  /// The scores of a twin, by sharpness; empty where no other draw has a run that is a prediction.
  std::vector<double> scores(std::size_t twin, std::span<const double> seen) const {
    const std::size_t draw = twin % draws_.size();
    std::vector<double> squares = misfits_from(runs_, seen);
    for (std::size_t r = draw; r < count_; r += draws_.size()) squares[r] = kNever;
    std::vector<double> result;
    if (std::none_of(squares.begin(), squares.end(), [](double value) { return std::isfinite(value); })) return result;
    for (int k = 0; k < kSharpnesses; ++k) result.push_back(score(likelihoods(squares, sharpness_of(k), draw), draw));
    return result;
  }

  std::size_t runs() const { return count_; }
  std::span<const double> run(std::size_t r) const { return runs_.errors.subspan(r * length_, length_); }

 private:
  const EpisodeRuns& runs_;
  const std::vector<PhysicalDraw>& draws_;
  double other_cause_;
  std::size_t length_, count_ = 0;
  std::vector<double> coordinates_;  // of the draws, in those of a standard normal
};

/// What a twin was recognised with, by sharpness, and how much the twin counts.
struct TwinScore {
  std::vector<double> scores;
  double weight;
};

/// The least sharp kernel whose mean score is less than a standard error below the best: sharper ones are not known to
/// be better (the one-standard-error rule of cross-validation [Breiman et al. 1984]).
double chosen_sharpness(const std::vector<TwinScore>& twins) {
  double all = 0.0;
  for (const TwinScore& twin : twins) all += twin.weight;
  if (!(all > 0.0)) return 0.0;
  const auto mean = [&](auto value) {
    double sum = 0.0;
    for (const TwinScore& twin : twins) sum += twin.weight * value(twin.scores);
    return sum / all;
  };
  std::size_t best = 0;
  std::vector<double> means;
  for (std::size_t k = 0; k < kSharpnesses; ++k) {
    means.push_back(mean([&](const std::vector<double>& scores) { return scores[k]; }));
    if (means[k] >= means[best]) best = k;
  }
  for (std::size_t k = kSharpnesses - 1; k > best; --k) {
    const double less = means[best] - means[k];
    const double variance = mean([&](const std::vector<double>& scores) {
      const double off = scores[best] - scores[k] - less;
      return off * off;
    });
    if (less * less * static_cast<double>(twins.size()) <= variance) return sharpness_of(static_cast<int>(k));
  }
  return sharpness_of(static_cast<int>(best));
}

}  // namespace

std::vector<double> misfits_of(const EpisodeRuns& runs) {
  return misfits_from(runs, std::vector<double>(static_cast<std::size_t>(kErrorSize * runs.samples), 0.0));
}

EpisodeEvidence evidence_of(const EpisodeRuns& runs, const std::vector<PhysicalDraw>& draws, double other_cause,
                            core::RandomStream stream) {
  const Evidence evidence(runs, draws, other_cause);
  EpisodeEvidence result;
  result.log_likelihoods.assign(draws.size(), 0.0);
  const std::vector<double> misfits = misfits_of(runs);
  result.least_misfit = *std::min_element(misfits.begin(), misfits.end());
  if (!std::isfinite(result.least_misfit)) return result;
  std::vector<TwinScore> twins;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    // Not always the first run of a draw, so that no start is preferred.
    const std::size_t twin = i + draws.size() * (i % (evidence.runs() / draws.size()));
    const std::span<const double> run = evidence.run(twin);
    if (run[0] == kNoPrediction) continue;
    std::vector<double> twin_seen(run.begin(), run.end());
    std::vector<double> noise(kErrorSize, 0.0);
    for (std::size_t k = 0; k < twin_seen.size(); ++k) {
      double& now = noise[k % kErrorSize];
      const double kept = k < kErrorSize ? 0.0 : runs.correlation;
      now = kept * now + std::sqrt(1.0 - kept * kept) * stream.normal();
      twin_seen[k] += now;
    }
    std::vector<double> scores = evidence.scores(twin, twin_seen);
    if (!scores.empty()) twins.push_back({std::move(scores), std::exp(draws[i].log_weight)});
  }
  result.sharpness = chosen_sharpness(twins);
  if (!(result.sharpness > 0.0)) return result;
  const std::vector<double> likelihoods = evidence.likelihoods(misfits, result.sharpness, draws.size());
  double probability = 0.0;
  for (std::size_t i = 0; i < draws.size(); ++i) probability += std::exp(draws[i].log_weight) * likelihoods[i];
  if (!(probability > 0.0)) return result;  // the draws that remain explain nothing
  for (std::size_t i = 0; i < draws.size(); ++i) result.log_likelihoods[i] = std::log(likelihoods[i]);
  return result;
}

}  // namespace prescene::filter
