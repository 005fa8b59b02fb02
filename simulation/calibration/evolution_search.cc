// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/evolution_search.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "reflect.h"

#include "prescene/geometry/dense_solvers.h"

namespace prescene::simulation {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The constants of [Hansen 2016, table 1], for positive weights.
struct Constants {
  explicit Constants(double n) : children(4 + static_cast<int>(3.0 * std::log(n))) {
    const int parents = children / 2;
    weights.resize(parents);
    for (int i = 0; i < parents; ++i) weights[i] = std::log(parents + 0.5) - std::log(i + 1.0);
    weights /= weights.sum();
    mass = 1.0 / weights.squaredNorm();
    step_rate = (mass + 2.0) / (n + mass + 5.0);
    damping = 1.0 + 2.0 * std::max(0.0, std::sqrt((mass - 1.0) / (n + 1.0)) - 1.0) + step_rate;
    path_rate = (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n);
    rank_one = 2.0 / ((n + 1.3) * (n + 1.3) + mass);
    rank_many = std::min(1.0 - rank_one, 2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0) * (n + 2.0) + mass));
    // Expected length of a standard normal vector.
    length = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  }

  int children;
  VectorXd weights;  ///< Of the parents, best first; their sum is one.
  double mass;       ///< Effective number of parents.
  double step_rate, damping, path_rate, rank_one, rank_many, length;
};

}  // namespace

struct EvolutionSearch::State {
  State(std::vector<SearchParameter> all, const SearchEnd& when, core::RandomStream draws)
      : parameters(std::move(all)),
        end(when),
        stream(draws),
        n(static_cast<Eigen::Index>(parameters.size())),
        k(static_cast<double>(n)),
        mean(VectorXd::Zero(n)),
        covariance(MatrixXd::Identity(n, n)),
        path(VectorXd::Zero(n)),
        step_path(VectorXd::Zero(n)) {}

  std::vector<double> values_of(const VectorXd& x) const {
    std::vector<double> values;
    for (Eigen::Index i = 0; i < n; ++i) {
      const SearchParameter& p = parameters[static_cast<std::size_t>(i)];
      values.push_back(reflected(p.value + x[i] * p.step, p.low, p.high));
    }
    return values;
  }
  bool done() const {
    if (sigma * std::sqrt(covariance.diagonal().maxCoeff()) < end.accuracy) return true;
    const auto back = static_cast<std::size_t>(end.patience);
    return back > 0 && reached.size() > back && reached[reached.size() - 1 - back] - best.cost < end.gain;
  }
  /// Of the children, those of least cost first; of moves in units of sigma.
  void adapt(const std::vector<VectorXd>& moves, const std::vector<double>& costs, const MatrixXd& axes,
             const VectorXd& lengths);

  std::vector<SearchParameter> parameters;
  SearchEnd end;
  core::RandomStream stream;
  Eigen::Index n;
  Constants k;
  // In units of the parameters' steps from their starts.
  VectorXd mean;
  double sigma = 1.0;
  MatrixXd covariance;
  VectorXd path, step_path;
  int generation = 0;
  SearchResult best;
  std::vector<double> reached;  ///< Least cost after each evaluation.
};

void EvolutionSearch::State::adapt(const std::vector<VectorXd>& moves, const std::vector<double>& costs,
                                   const MatrixXd& axes, const VectorXd& lengths) {
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return costs[i]; });

  VectorXd move = VectorXd::Zero(n);
  MatrixXd spread = MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < k.weights.size(); ++i) {
    const VectorXd& parent = moves[order[static_cast<std::size_t>(i)]];
    move += k.weights[i] * parent;
    spread += k.weights[i] * parent * parent.transpose();
  }
  mean += sigma * move;
  const VectorXd whitened = axes * (axes.transpose() * move).cwiseQuotient(lengths);
  step_path = (1.0 - k.step_rate) * step_path + std::sqrt(k.step_rate * (2.0 - k.step_rate) * k.mass) * whitened;
  const double warming = std::sqrt(1.0 - std::pow(1.0 - k.step_rate, 2.0 * (generation + 1)));
  const bool stalled = step_path.norm() / warming > (1.4 + 2.0 / static_cast<double>(n + 1)) * k.length;
  path = (1.0 - k.path_rate) * path;
  if (!stalled) path += std::sqrt(k.path_rate * (2.0 - k.path_rate) * k.mass) * move;
  const double kept = stalled ? k.path_rate * (2.0 - k.path_rate) : 0.0;
  covariance = (1.0 - k.rank_one - k.rank_many + k.rank_one * kept) * covariance +
               k.rank_one * path * path.transpose() + k.rank_many * spread;
  sigma *= std::exp(k.step_rate / k.damping * (step_path.norm() / k.length - 1.0));
  ++generation;
}

EvolutionSearch::EvolutionSearch(std::vector<SearchParameter> parameters, const SearchEnd& end,
                                 core::RandomStream stream)
    : state_(std::make_unique<State>(std::move(parameters), end, stream)) {}
EvolutionSearch::~EvolutionSearch() = default;
EvolutionSearch::EvolutionSearch(EvolutionSearch&&) noexcept = default;
EvolutionSearch& EvolutionSearch::operator=(EvolutionSearch&&) noexcept = default;

const SearchResult& EvolutionSearch::best() const { return state_->best; }

void EvolutionSearch::run(const Cost& cost, int max_evaluations, const SearchProgress& progress) {
  State& s = *state_;
  SearchResult& best = s.best;
  bool stopped = false;
  const auto tried = [&](std::vector<double> values) {
    const double found = cost(values);
    ++best.evaluations;
    if (best.evaluations == 1 || found < best.cost) {
      best.cost = found;
      best.values = std::move(values);
    }
    s.reached.push_back(best.cost);
    stopped = progress && !progress(best);
    return found;
  };
  if (best.evaluations == 0 && max_evaluations > 0) tried(s.values_of(s.mean));
  while (!stopped && !best.settled && best.evaluations < max_evaluations) {
    best.settled = s.done();
    if (best.settled) break;
    const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(s.covariance);
    const VectorXd lengths = eigen.values.cwiseMax(1e-20).cwiseSqrt();
    std::vector<VectorXd> moves;
    std::vector<double> costs;
    for (int child = 0; child < s.k.children && !stopped && best.evaluations < max_evaluations; ++child) {
      VectorXd z(s.n);
      for (Eigen::Index i = 0; i < s.n; ++i) z[i] = s.stream.normal();
      moves.emplace_back(eigen.vectors * lengths.cwiseProduct(z));
      costs.push_back(tried(s.values_of(s.mean + s.sigma * moves.back())));
    }
    if (static_cast<int>(costs.size()) < s.k.children) break;
    s.adapt(moves, costs, eigen.vectors, lengths);
  }
}

}  // namespace prescene::simulation
