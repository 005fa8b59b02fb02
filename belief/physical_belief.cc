// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/physical_belief.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "prescene/belief/physical_priors.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::belief {
namespace {

/// Weights that count as fewer than this share of the draws are too few to go on with.
constexpr double kFewestEffective = 0.25;
/// Share of the spread that resampled draws keep of their own; the rest is drawn anew [Liu & West 2001].
constexpr double kOwnSpread = 0.95;

/// The scalar priors of a model in their order, with the member that each sets.
struct Parameter {
  const char* name;
  const ScalarDistribution* prior;
  std::function<double&(PhysicalParameters&)> value;
};
std::vector<Parameter> parameters_of(const ObjectModel& model) {
  std::vector<Parameter> all = {
      {"friction", &model.contact.friction, [](PhysicalParameters& p) -> double& { return p.friction; }},
      {"restitution", &model.contact.restitution, [](PhysicalParameters& p) -> double& { return p.restitution; }},
      {"mass", &model.mass, [](PhysicalParameters& p) -> double& { return p.mass; }},
      {"center_of_mass_x", &model.center_of_mass.x,
       [](PhysicalParameters& p) -> double& { return p.center_of_mass.x(); }},
      {"center_of_mass_y", &model.center_of_mass.y,
       [](PhysicalParameters& p) -> double& { return p.center_of_mass.y(); }},
      {"center_of_mass_z", &model.center_of_mass.z,
       [](PhysicalParameters& p) -> double& { return p.center_of_mass.z(); }},
  };
  if (model.contact.impact_friction)
    all.push_back({"impact_friction", &*model.contact.impact_friction,
                   [](PhysicalParameters& p) -> double& { return p.impact_friction; }});
  return all;
}

/// Makes the weights sum to one; they must not all be -inf (checked).
void normalize_weights(std::vector<PhysicalDraw>& draws) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const PhysicalDraw& draw : draws) largest = std::max(largest, draw.log_weight);
  PRESCENE_CHECK(std::isfinite(largest));
  double sum = 0.0;
  for (const PhysicalDraw& draw : draws) sum += std::exp(draw.log_weight - largest);
  for (PhysicalDraw& draw : draws) draw.log_weight -= largest + std::log(sum);
}

double effective_draws(const std::vector<PhysicalDraw>& draws) {
  double squares = 0.0;
  for (const PhysicalDraw& draw : draws) squares += std::exp(2.0 * draw.log_weight);
  return 1.0 / squares;
}

/// Keeps a coordinate within the open unit interval, where inverse distribution functions are finite.
double inside(double u) { return std::clamp(u, 1e-9, 1.0 - 1e-9); }

/// Equally weighted draws of nearly the same mean and covariance, in the coordinates of a standard normal.
std::vector<PhysicalDraw> rejuvenated(const std::vector<PhysicalDraw>& draws, core::RandomStream stream) {
  const auto size = static_cast<Eigen::Index>(draws.front().uniforms.size());
  std::vector<Eigen::VectorXd> points;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  for (const PhysicalDraw& draw : draws) {
    Eigen::VectorXd& z = points.emplace_back(size);
    for (Eigen::Index i = 0; i < size; ++i)
      z[i] = core::inverse_normal_cdf(inside(draw.uniforms[static_cast<std::size_t>(i)]));
    mean += std::exp(draw.log_weight) * z;
  }
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < draws.size(); ++i)
    covariance += std::exp(draws[i].log_weight) * (points[i] - mean) * (points[i] - mean).transpose();
  const Eigen::MatrixXd root = covariance_square_root(covariance);
  const double fresh = std::sqrt(1.0 - kOwnSpread * kOwnSpread);
  const double count = static_cast<double>(draws.size());
  const double start = stream.uniform();
  std::vector<PhysicalDraw> result;
  double sum = 0.0;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    sum += std::exp(draws[i].log_weight);
    const bool last = i + 1 == draws.size();
    while (result.size() < draws.size() && ((static_cast<double>(result.size()) + start) / count < sum || last)) {
      Eigen::VectorXd z = mean + kOwnSpread * (points[i] - mean);
      for (Eigen::Index k = 0; k < root.cols(); ++k) z += fresh * stream.normal() * root.col(k);
      PhysicalDraw& draw = result.emplace_back();
      for (Eigen::Index k = 0; k < size; ++k) draw.uniforms.push_back(inside(core::normal_cdf(z[k])));
      draw.log_weight = -std::log(count);
    }
  }
  return result;
}

}  // namespace

int physical_dimensions(const ObjectModel& model) {
  int sum = 0;
  for (const Parameter& parameter : parameters_of(model)) sum += dimensions(*parameter.prior);
  return sum;
}

PhysicalParameters physical_at(const ObjectModel& model, std::span<const double> uniforms) {
  PhysicalParameters physical;
  for (const Parameter& parameter : parameters_of(model)) {
    const auto count = static_cast<std::size_t>(dimensions(*parameter.prior));
    PRESCENE_CHECK(count <= uniforms.size());
    parameter.value(physical) = draw(*parameter.prior, uniforms.first(count));
    uniforms = uniforms.subspan(count);
  }
  PRESCENE_CHECK(uniforms.empty());
  if (!model.contact.impact_friction) physical.impact_friction = physical.friction;
  return physical;
}

PhysicalParameters mean_physical(const ObjectModel& model) {
  PhysicalParameters physical;
  for (const Parameter& parameter : parameters_of(model)) parameter.value(physical) = mean(*parameter.prior);
  if (!model.contact.impact_friction) physical.impact_friction = physical.friction;
  return physical;
}

std::vector<PhysicalPrior> physical_priors(const ObjectModel& model) {
  std::vector<PhysicalPrior> priors;
  for (const Parameter& parameter : parameters_of(model)) priors.push_back({parameter.name, *parameter.prior});
  return priors;
}

bool operator==(const PhysicalBelief& a, const PhysicalBelief& b) {
  if (a.cell != b.cell || a.lessons != b.lessons || a.learned_ns != b.learned_ns) return false;
  return a.draws == b.draws || (a.draws && b.draws && *a.draws == *b.draws);
}

PhysicalSampler::PhysicalSampler(const ObjectModel& model, const PhysicalBelief& physics)
    : model_(&model), physics_(physics) {
  if (!physics_.draws) return;
  double sum = 0.0;
  for (const PhysicalDraw& draw : *physics_.draws) cumulative_.push_back(sum += std::exp(draw.log_weight));
}

int PhysicalSampler::dimensions() const { return physical_dimensions(*model_) + (physics_.draws ? 1 : 0); }

PhysicalParameters PhysicalSampler::draw(std::span<const double> uniforms) const {
  PRESCENE_CHECK(std::ssize(uniforms) == dimensions());
  if (!physics_.draws) return physical_at(*model_, uniforms);
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), uniforms[0]);
  const auto index =
      std::min<std::size_t>(static_cast<std::size_t>(found - cumulative_.begin()), cumulative_.size() - 1);
  std::vector<double> point = (*physics_.draws)[index].uniforms;
  if (physics_.cell > 0.0)
    for (std::size_t i = 0; i < point.size(); ++i)
      point[i] = inside((std::floor(point[i] / physics_.cell) + uniforms[1 + i]) * physics_.cell);
  return physical_at(*model_, point);
}

PhysicalParameters PhysicalSampler::mean() const {
  if (!physics_.draws) return mean_physical(*model_);
  PhysicalParameters sum{0.0, Vector3d::Zero(), 0.0, 0.0, 0.0};
  for (const PhysicalDraw& draw : *physics_.draws) {
    const PhysicalParameters one = physical_at(*model_, draw.uniforms);
    const double weight = std::exp(draw.log_weight);
    sum.mass += weight * one.mass;
    sum.center_of_mass += weight * one.center_of_mass;
    sum.friction += weight * one.friction;
    sum.impact_friction += weight * one.impact_friction;
    sum.restitution += weight * one.restitution;
  }
  return sum;
}

std::vector<PhysicalDraw> draws_of(const ObjectModel& model, const PhysicalBelief& physics, std::uint64_t seed) {
  if (physics.draws) return *physics.draws;
  const int size = physical_dimensions(model);
  std::vector<PhysicalDraw> draws;
  if (size == 0) return draws;
  const core::SobolNet net(size, core::RandomStream(seed, core::Purpose::kParameters).next_u64());
  for (std::uint64_t i = 0; i < kPhysicalDraws; ++i) {
    PhysicalDraw& draw = draws.emplace_back();
    draw.uniforms.resize(static_cast<std::size_t>(size));
    net.point(i, draw.uniforms);
    draw.log_weight = -std::log(static_cast<double>(kPhysicalDraws));
  }
  return draws;
}

PhysicalBelief after_evidence(const ObjectModel& model, const PhysicalBelief& physics, std::uint64_t seed,
                              std::span<const double> log_likelihoods, core::TimeNs stamp_ns) {
  std::vector<PhysicalDraw> draws = draws_of(model, physics, seed);
  PRESCENE_CHECK(!draws.empty() && draws.size() == log_likelihoods.size());
  for (std::size_t i = 0; i < draws.size(); ++i) draws[i].log_weight += log_likelihoods[i];
  normalize_weights(draws);
  PhysicalBelief result;
  result.cell = physics.draws ? physics.cell : 1.0 / kPhysicalDraws;
  result.lessons = physics.lessons + 1;
  result.learned_ns = stamp_ns;
  if (effective_draws(draws) < kFewestEffective * static_cast<double>(draws.size())) {
    const core::RandomStream stream(seed, core::Purpose::kParameters, static_cast<std::uint64_t>(result.lessons));
    draws = rejuvenated(draws, stream);
    result.cell = 0.0;
  }
  result.draws = std::make_shared<const std::vector<PhysicalDraw>>(std::move(draws));
  return result;
}

std::vector<ParameterEstimate> parameter_estimates(const ObjectModel& model, const PhysicalBelief& physics) {
  // Priors are shown by their net, too: what is exact does not depend on its seed beyond the figures shown.
  const std::vector<PhysicalDraw> draws = draws_of(model, physics, 0);
  std::vector<PhysicalParameters> values;
  for (const PhysicalDraw& draw : draws) values.push_back(physical_at(model, draw.uniforms));
  std::vector<ParameterEstimate> estimates;
  for (const Parameter& parameter : parameters_of(model)) {
    if (dimensions(*parameter.prior) == 0) continue;
    ParameterEstimate& estimate = estimates.emplace_back();
    estimate.name = parameter.name;
    std::vector<std::pair<double, double>> sorted;  // value, weight
    double squares = 0.0;
    for (std::size_t i = 0; i < draws.size(); ++i) {
      const double value = parameter.value(values[i]), weight = std::exp(draws[i].log_weight);
      sorted.emplace_back(value, weight);
      estimate.mean += weight * value;
    }
    for (const auto& [value, weight] : sorted) squares += weight * (value - estimate.mean) * (value - estimate.mean);
    estimate.standard_deviation = std::sqrt(squares);
    std::sort(sorted.begin(), sorted.end());
    const auto quantile = [&](double share) {
      double sum = 0.0;
      for (const auto& [value, weight] : sorted)
        if ((sum += weight) >= share) return value;
      return sorted.back().first;
    };
    estimate.low = quantile(0.05);
    estimate.high = quantile(0.95);
  }
  return estimates;
}

}  // namespace prescene::belief
