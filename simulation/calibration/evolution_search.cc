// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/evolution_search.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "reflect.h"

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

SearchResult evolution_search(const std::vector<SearchParameter>& parameters,
                              const std::function<double(std::span<const double>)>& cost, double accuracy,
                              int max_evaluations, core::RandomStream stream, const SearchProgress& progress) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  const Constants k(static_cast<double>(n));
  // In units of the parameters' steps from their starts.
  const auto values_of = [&](const VectorXd& x) {
    std::vector<double> values;
    for (Eigen::Index i = 0; i < n; ++i) {
      const SearchParameter& p = parameters[static_cast<std::size_t>(i)];
      values.push_back(reflected(p.value + x[i] * p.step, p.low, p.high));
    }
    return values;
  };
  VectorXd mean = VectorXd::Zero(n);
  double sigma = 1.0;
  MatrixXd covariance = MatrixXd::Identity(n, n);
  VectorXd path = VectorXd::Zero(n);
  VectorXd step_path = VectorXd::Zero(n);

  SearchResult best;
  best.values = values_of(mean);
  best.cost = cost(best.values);
  best.evaluations = 1;
  bool stopped = progress && !progress(best);
  for (int generation = 0; !stopped && best.evaluations < max_evaluations; ++generation) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
    const VectorXd lengths = eigen.eigenvalues().cwiseMax(1e-20).cwiseSqrt();
    if (sigma * std::sqrt(covariance.diagonal().maxCoeff()) < accuracy) break;
    std::vector<VectorXd> moves;
    std::vector<double> costs;
    for (int child = 0; child < k.children && !stopped && best.evaluations < max_evaluations; ++child) {
      VectorXd z(n);
      for (Eigen::Index i = 0; i < n; ++i) z[i] = stream.normal();
      moves.emplace_back(eigen.eigenvectors() * lengths.cwiseProduct(z));
      std::vector<double> values = values_of(mean + sigma * moves.back());
      costs.push_back(cost(values));
      ++best.evaluations;
      if (costs.back() < best.cost) {
        best.cost = costs.back();
        best.values = std::move(values);
      }
      stopped = progress && !progress(best);
    }
    if (static_cast<int>(costs.size()) < k.children) break;
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
    const VectorXd whitened = eigen.eigenvectors() * (eigen.eigenvectors().transpose() * move).cwiseQuotient(lengths);
    step_path = (1.0 - k.step_rate) * step_path + std::sqrt(k.step_rate * (2.0 - k.step_rate) * k.mass) * whitened;
    const double warming = std::sqrt(1.0 - std::pow(1.0 - k.step_rate, 2.0 * (generation + 1)));
    const bool stalled = step_path.norm() / warming > (1.4 + 2.0 / static_cast<double>(n + 1)) * k.length;
    path = (1.0 - k.path_rate) * path;
    if (!stalled) path += std::sqrt(k.path_rate * (2.0 - k.path_rate) * k.mass) * move;
    const double kept = stalled ? k.path_rate * (2.0 - k.path_rate) : 0.0;
    covariance = (1.0 - k.rank_one - k.rank_many + k.rank_one * kept) * covariance +
                 k.rank_one * path * path.transpose() + k.rank_many * spread;
    sigma *= std::exp(k.step_rate / k.damping * (step_path.norm() / k.length - 1.0));
  }
  return best;
}

}  // namespace prescene::simulation
