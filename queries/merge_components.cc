// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/merge_components.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using belief::PoseComponent;
using geometry::Matrix6d;
using geometry::Vector6d;

// Groups larger than this are first thinned out in chunks, so that the work stays linear in the number of instances.
constexpr std::size_t kChunk = 64;
constexpr int kChunkGoal = 24;

/// Mean and covariance in one chart about the first's mean; the weights need not sum to one.
PoseComponent joined(const PoseComponent& a, const PoseComponent& b) {
  PoseComponent sum;
  sum.weight = a.weight + b.weight;
  sum.outcome = a.outcome;
  const double share_a = a.weight / sum.weight, share_b = b.weight / sum.weight;
  sum.mean = geometry::normalized(geometry::box_plus(a.mean, share_b * geometry::box_minus(b.mean, a.mean)));
  const Vector6d d_a = geometry::box_minus(a.mean, sum.mean), d_b = geometry::box_minus(b.mean, sum.mean);
  sum.covariance = share_a * (a.covariance + d_a * d_a.transpose()) + share_b * (b.covariance + d_b * d_b.transpose());
  return sum;
}

double log_determinant(const Matrix6d& covariance) {
  const geometry::Cholesky6 cholesky(covariance);
  PRESCENE_CHECK(cholesky.positive_definite());
  double sum = 0.0;
  for (Eigen::Index i = 0; i < 6; ++i) sum += std::log(cholesky.factor()(i, i));
  return 2.0 * sum;
}

/// Greedy merging of components of one or several groups.
class Merger {
 public:
  explicit Merger(std::vector<Kernel> kernels) : kernels_(std::move(kernels)) {
    for (const Kernel& kernel : kernels_) log_dets_.push_back(log_determinant(kernel.component.covariance));
    partners_.resize(kernels_.size());
    for (std::size_t i = 0; i < kernels_.size(); ++i) find_partner(i);
  }

  /// Merges the cheapest pair while more than `goal` are left or that costs less than `below`.
  void reduce(int goal, double below) {
    std::size_t left = kernels_.size();
    for (;;) {
      const std::size_t i = cheapest();
      if (i == kNone) return;
      if (left <= static_cast<std::size_t>(goal) && partners_[i].cost >= below) return;
      merge(i);
      --left;
    }
  }

  /// Merges each component lighter than `weight` into the heaviest of its group, unless it is that itself.
  void drop_below(double weight) {
    for (std::size_t i = 0; i < kernels_.size(); ++i) {
      if (!alive(i) || kernels_[i].component.weight >= weight) continue;
      std::size_t heaviest = i;
      for (std::size_t j = 0; j < kernels_.size(); ++j)
        if (kernels_[j].group == kernels_[i].group &&
            kernels_[j].component.weight > kernels_[heaviest].component.weight)
          heaviest = j;
      if (heaviest == i) continue;
      kernels_[heaviest].component = joined(kernels_[heaviest].component, kernels_[i].component);
      kernels_[i].component.weight = 0.0;
    }
  }

  std::vector<Kernel> result() const {
    std::vector<Kernel> rest;
    for (std::size_t i = 0; i < kernels_.size(); ++i)
      if (alive(i)) rest.push_back(kernels_[i]);
    return rest;
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  /// The component of higher index that is cheapest to merge with.
  struct Partner {
    std::size_t index = kNone;
    double cost = std::numeric_limits<double>::infinity();
  };

  bool alive(std::size_t i) const { return kernels_[i].component.weight > 0.0; }

  /// Upper bound of the Kullback-Leibler divergence that merging causes [Runnalls 2007, equation 21].
  double cost(std::size_t i, std::size_t j) const {
    const PoseComponent& a = kernels_[i].component;
    const PoseComponent& b = kernels_[j].component;
    return 0.5 * ((a.weight + b.weight) * log_determinant(joined(a, b).covariance) - a.weight * log_dets_[i] -
                  b.weight * log_dets_[j]);
  }

  void consider(std::size_t i, std::size_t j) {
    const double value = cost(i, j);
    if (value < partners_[i].cost) partners_[i] = {j, value};
  }

  void find_partner(std::size_t i) {
    partners_[i] = {};
    for (std::size_t j = i + 1; j < kernels_.size(); ++j)
      if (alive(j) && kernels_[j].group == kernels_[i].group) consider(i, j);
  }

  std::size_t cheapest() const {
    std::size_t best = kNone;
    for (std::size_t i = 0; i < kernels_.size(); ++i)
      if (alive(i) && partners_[i].index != kNone && (best == kNone || partners_[i].cost < partners_[best].cost))
        best = i;
    return best;
  }

  /// Merges i and its partner into i.
  void merge(std::size_t i) {
    const std::size_t gone = partners_[i].index;
    kernels_[i].component = joined(kernels_[i].component, kernels_[gone].component);
    kernels_[gone].component.weight = 0.0;
    log_dets_[i] = log_determinant(kernels_[i].component.covariance);
    find_partner(i);
    for (std::size_t j = 0; j < gone; ++j) {
      if (j == i || !alive(j) || kernels_[j].group != kernels_[i].group) continue;
      if (partners_[j].index == gone || partners_[j].index == i)
        find_partner(j);
      else if (j < i)
        consider(j, i);
    }
  }

  std::vector<Kernel> kernels_;
  std::vector<double> log_dets_;
  std::vector<Partner> partners_;
};

/// Thins each group out in chunks until all together are few enough to be looked at in pairs.
std::vector<Kernel> thinned(std::vector<Kernel> kernels, core::ThreadPool& pool) {
  for (;;) {
    std::map<int, std::vector<Kernel>> groups;
    for (Kernel& kernel : kernels) groups[kernel.group].push_back(std::move(kernel));
    std::vector<std::vector<Kernel>> chunks;
    bool small = true;
    for (auto& [number, group] : groups) {
      small = small && group.size() <= kChunk;
      for (std::size_t begin = 0; begin < group.size(); begin += kChunk) {
        const std::size_t end = std::min(begin + kChunk, group.size());
        chunks.emplace_back(group.begin() + static_cast<std::ptrdiff_t>(begin),
                            group.begin() + static_cast<std::ptrdiff_t>(end));
      }
    }
    if (!small) {
      pool.for_each_index(chunks.size(), [&](std::size_t i) {
        if (chunks[i].size() <= kChunkGoal) return;
        Merger merger(std::move(chunks[i]));
        merger.reduce(kChunkGoal, 0.0);
        chunks[i] = merger.result();
      });
    }
    kernels.clear();
    for (std::vector<Kernel>& chunk : chunks) std::move(chunk.begin(), chunk.end(), std::back_inserter(kernels));
    if (small) return kernels;
  }
}

}  // namespace

std::vector<PoseComponent> merged(std::vector<Kernel> kernels, const DensityOptions& options, core::ThreadPool& pool) {
  std::erase_if(kernels, [](const Kernel& kernel) { return !(kernel.component.weight > 0.0); });
  Merger merger(thinned(std::move(kernels), pool));
  merger.reduce(options.max_components, options.merge_below);
  merger.drop_below(options.min_weight);
  std::vector<PoseComponent> components;
  for (Kernel& kernel : merger.result()) components.push_back(std::move(kernel.component));
  std::stable_sort(components.begin(), components.end(),
                   [](const PoseComponent& a, const PoseComponent& b) { return a.weight > b.weight; });
  return components;
}

}  // namespace prescene::queries
