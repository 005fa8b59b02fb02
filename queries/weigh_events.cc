// SPDX-License-Identifier: Apache-2.0
#include "weigh_events.h"

#include <algorithm>
#include <cmath>

namespace prescene::queries {
namespace {

constexpr int kPosteriorDraws = 2000;
// What all hypotheses' scatter counts as, in runs, and between what it is taken to be, nats.
constexpr double kPriorFreedom = 3.0, kLeastScatter = 0.3, kMostScatter = 2.0;
constexpr double kCompetes = 10.0;      // nats behind the best
constexpr double kOtherFreedom = 30.0;  // of an importance sampler of some dozens of draws

struct EvidenceError {
  double error = 0.0;    // nats
  double freedom = 1.0;  // of Student's t
};

/// What the sum of squares would be of log evidences that scatter as their mean does, by the jackknife [Efron 1982]:
/// the evidence is that of the good runs, and a run that missed the posterior changes little.
double own_scatter(const Judged& judged) {
  const std::vector<double>& runs = judged.posterior.log_evidence;
  const std::size_t n = runs.size();
  if (n < 2) return 0.0;
  std::vector<double> without(n);
  double mean = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    double top = -1e300, sum = 0.0;
    for (std::size_t k = 0; k < n; ++k)
      if (k != i) top = std::max(top, runs[k]);
    for (std::size_t k = 0; k < n; ++k)
      if (k != i) sum += std::exp(runs[k] - top);
    without[i] = top + std::log(sum / static_cast<double>(n - 1));
    mean += without[i] / static_cast<double>(n);
  }
  double squares = 0.0;
  for (const double e : without) squares += (e - mean) * (e - mean);
  // n (n - 1) times the jackknife's variance of the log of the mean.
  const auto count = static_cast<double>(n);
  return (count - 1.0) * (count - 1.0) * squares;
}

bool is_searched(const Judged& judged) { return !judged.posterior.log_evidence.empty() && !judged.posterior.gave_up; }

EvidenceError error_of(const Judged& judged, double scatter) {
  if (judged.posterior.log_evidence.empty()) return {judged.error, kOtherFreedom};
  const auto n = static_cast<double>(judged.posterior.log_evidence.size());
  const double freedom = kPriorFreedom + n - 1.0;
  const double own = judged.posterior.gave_up ? 0.0 : own_scatter(judged);
  return {std::sqrt((kPriorFreedom * scatter + own) / freedom / n), freedom};
}

}  // namespace

void weigh_events(std::vector<Judged>& nothings, std::vector<Judged>& judged, double confidence, std::uint64_t seed) {
  const std::size_t n = judged.size();
  // The last is nothing: the mean over the candidates, whose starts are open in one each.
  std::vector<double> log_posterior(n + 1);
  double likeliest = -1e300, mean = 0.0;
  for (const Judged& nothing : nothings) likeliest = std::max(likeliest, nothing.log_bayes);
  for (const Judged& nothing : nothings)
    mean += std::exp(nothing.log_bayes - likeliest) / static_cast<double>(nothings.size());
  log_posterior[n] = std::log(nothings.front().hypothesis.prior) + likeliest + std::log(mean);
  for (std::size_t i = 0; i < n; ++i) {
    log_posterior[i] = std::log(judged[i].hypothesis.prior) + judged[i].log_bayes;
    for (const Judged& nothing : nothings)
      if (nothing.object == judged[i].object) log_posterior[i] += nothing.log_bayes;
  }
  const double top = *std::max_element(log_posterior.begin(), log_posterior.end());

  // Of those that compete: what is far from the frames scatters more, and does not matter.
  double squares = 0.0, freedom = 0.0;
  const auto note_scatter = [&](const Judged& one, double log_of_it) {
    if (!is_searched(one) || log_of_it < top - kCompetes) return;
    squares += own_scatter(one);
    freedom += static_cast<double>(one.posterior.log_evidence.size()) - 1.0;
  };
  for (const Judged& nothing : nothings) note_scatter(nothing, log_posterior[n]);
  for (std::size_t i = 0; i < n; ++i) note_scatter(judged[i], log_posterior[i]);
  const double scatter =
      std::clamp(freedom > 0.0 ? squares / freedom : 1.0, kLeastScatter * kLeastScatter, kMostScatter * kMostScatter);

  const auto shares = [](const std::vector<double>& log_of_each) {
    const double most = *std::max_element(log_of_each.begin(), log_of_each.end());
    std::vector<double> result(log_of_each.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < result.size(); ++i) sum += result[i] = std::exp(log_of_each[i] - most);
    for (double& share : result) share /= sum;
    return result;
  };
  std::vector<EvidenceError> errors;
  for (const Judged& one : judged) errors.push_back(error_of(one, scatter));
  const auto likeliest_nothing = std::max_element(
      nothings.begin(), nothings.end(), [](const Judged& a, const Judged& b) { return a.log_bayes < b.log_bayes; });
  errors.push_back(error_of(*likeliest_nothing, scatter));
  const double tail = 0.5 * (1.0 - confidence);
  const auto may_be_more = [&](std::size_t i) -> const std::optional<double>& {
    return i < n ? judged[i].may_be_more : likeliest_nothing->may_be_more;
  };
  std::vector<std::vector<double>> drawn(n + 1);
  const core::RandomStream stream(seed, core::Purpose::kResample);
  for (int d = 0; d < kPosteriorDraws; ++d) {
    core::RandomStream draws = stream.at(static_cast<std::uint64_t>(d));
    const auto student = [&](const EvidenceError& e) {
      double sum = 0.0;
      const auto whole = static_cast<int>(e.freedom);
      for (int k = 0; k < whole; ++k) {
        const double x = draws.normal();
        sum += x * x;
      }
      return e.error * draws.normal() / std::sqrt(sum / static_cast<double>(whole));
    };
    std::vector<double> varied = log_posterior;
    // An estimate without bias is so many times too large with a probability of at most one over that (Markov), however
    // much its runs scatter.
    // What was not searched to its end may have any evidence between what was found and the most that can be.
    for (std::size_t i = 0; i <= n; ++i) {
      const auto& more = may_be_more(i);
      varied[i] += more ? *more * draws.uniform() : std::max(student(errors[i]), std::log(tail));
    }
    const std::vector<double> sample = shares(varied);
    for (std::size_t i = 0; i <= n; ++i) drawn[i].push_back(sample[i]);
  }
  const auto put = [&](std::size_t i, Judged& one) {
    std::sort(drawn[i].begin(), drawn[i].end());
    const auto at = [&](double share) {
      return drawn[i][static_cast<std::size_t>(std::lround(share * (kPosteriorDraws - 1)))];
    };
    // The mean over what the evidences may be, not what their estimates say: searches miss, too.
    double mean_share = 0.0;
    for (const double share : drawn[i]) mean_share += share / kPosteriorDraws;
    one.probability = mean_share;
    one.low = one.posterior.gave_up || one.may_be_more ? 0.0 : std::min(mean_share, at(tail));
    one.high = std::max(mean_share, at(1.0 - tail));
    // Of many that were not searched, each is rarely the best in these draws, and one of them may be it all the same.
    if (const auto& more = may_be_more(i)) {
      std::vector<double> most = log_posterior;
      most[i] += *more;
      one.high = std::max(one.high, shares(most)[i]);
    }
  };
  for (std::size_t i = 0; i < n; ++i) put(i, judged[i]);
  put(n, nothings.front());
}

}  // namespace prescene::queries
