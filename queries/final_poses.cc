// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/final_poses.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/queries/merge_components.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Matrix6d;
using geometry::Vector3d;
using geometry::Vector6d;

// Widths below which a kernel never falls: a density of equal ends stays a density. What ended once only is known
// worse.
constexpr double kMinAngle = 0.01, kMinLength = 0.001;
constexpr double kLoneAngle = 0.1, kLoneLength = 0.01;
// Instances on the two sides of an empty stretch ended in different places: it is at least as long as this many of
// their standard deviations, and the longer the fewer there are on one side. (Beyond m of an exponential tail a stretch
// of g deviations is empty with the probability exp(-g m).)
constexpr double kEmptyStretch = 0.5;
constexpr double kEmptyStretchOfOne = 6.0;

struct Spread {
  Pose mean;
  Vector6d deviation = Vector6d::Zero();  ///< Standard deviations in the coordinates of geometry::box_plus.
};

Spread spread_of(std::span<const FinalSample> samples, const std::vector<std::size_t>& members,
                 const std::vector<Pose>& poses) {
  double mass = 0.0;
  for (std::size_t i : members) mass += samples[i].weight;
  Spread spread;
  spread.mean = poses[members.front()];
  for (int round = 0; round < 8; ++round) {  // the rotation's mean is a fixed point
    Vector6d step = Vector6d::Zero();
    for (std::size_t i : members) step += samples[i].weight / mass * geometry::box_minus(poses[i], spread.mean);
    spread.mean = geometry::normalized(geometry::box_plus(spread.mean, step));
    if (step.norm() < 1e-10) break;
  }
  Vector6d variance = Vector6d::Zero();
  for (std::size_t i : members)
    variance += samples[i].weight / mass * geometry::box_minus(poses[i], spread.mean).cwiseAbs2();
  spread.deviation = variance.cwiseSqrt();
  return spread;
}

Matrix6d kernel_covariance(const Spread& spread, std::size_t count, double bandwidth) {
  Vector6d width;
  if (count == 1) {
    width << Vector3d::Constant(kLoneAngle), Vector3d::Constant(kLoneLength);
  } else {
    width = bandwidth * std::pow(static_cast<double>(count), -1.0 / 6.0) * spread.deviation;
    width.head<3>() = width.head<3>().cwiseMax(kMinAngle);
    width.tail<3>() = width.tail<3>().cwiseMax(kMinLength);
  }
  return width.cwiseAbs2().asDiagonal();
}

/// Parts of a group with nothing between them, on any axis of the coordinates about its mean: split and split again.
void split_apart(std::span<const FinalSample> samples, std::vector<std::size_t> members, const std::vector<Pose>& poses,
                 std::vector<std::vector<std::size_t>>* parts) {
  const Spread spread = spread_of(samples, members, poses);
  double widest = 0.0;
  std::vector<std::pair<double, std::size_t>> split;  // by the coordinate that parts the group best
  std::size_t below = 0;
  std::vector<std::pair<double, std::size_t>> line;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const double least = axis < 3 ? kMinAngle : kMinLength;
    line.clear();
    for (std::size_t i : members) line.emplace_back(geometry::box_minus(poses[i], spread.mean)[axis], i);
    std::sort(line.begin(), line.end());
    std::size_t at = 0;
    for (std::size_t k = 1; k < line.size(); ++k) {
      const double stretch = (line[k].first - line[k - 1].first) / std::max(spread.deviation[axis], least);
      const auto fewer = static_cast<double>(std::min(k, line.size() - k));
      if (stretch <= widest || stretch < kEmptyStretch || stretch * fewer < kEmptyStretchOfOne) continue;
      widest = stretch;
      at = k;
    }
    if (at == 0) continue;
    split = line;
    below = at;
  }
  if (below == 0) {
    parts->push_back(std::move(members));
    return;
  }
  for (const auto& [from, to] : {std::pair(std::size_t{0}, below), std::pair(below, split.size())}) {
    std::vector<std::size_t> side;
    for (std::size_t k = from; k < to; ++k) side.push_back(split[k].second);
    std::sort(side.begin(), side.end());
    split_apart(samples, std::move(side), poses, parts);
  }
}

}  // namespace

std::vector<Kernel> kernels(std::span<const FinalSample> samples, std::span<const std::string> outcomes,
                            const geometry::SymmetryGroup& symmetry, const DensityOptions& options) {
  // The first of an outcome and face is what the others are turned to; a symmetry may change the face, so the face is
  // looked at after turning to the first of the outcome.
  std::vector<Pose> poses;
  std::map<int, Pose> first_of_outcome;
  std::map<std::pair<int, int>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const FinalSample& sample = samples[i];
    const Pose& reference = first_of_outcome.try_emplace(sample.outcome, sample.X_WO).first->second;
    poses.push_back(symmetry.trivial() ? sample.X_WO : geometry::closest_equivalent(sample.X_WO, reference, symmetry));
    groups[{sample.outcome, geometry::face_up(poses.back().rotation)}].push_back(i);
  }

  std::vector<Kernel> result(samples.size());
  int number = 0;
  for (const auto& [key, group] : groups) {
    std::vector<std::vector<std::size_t>> parts;
    split_apart(samples, group, poses, &parts);
    for (const std::vector<std::size_t>& members : parts) {
      const Matrix6d covariance =
          kernel_covariance(spread_of(samples, members, poses), members.size(), options.bandwidth);
      for (std::size_t i : members) {
        result[i].component = {samples[i].weight, outcomes[static_cast<std::size_t>(key.first)], poses[i], covariance};
        result[i].group = number;
      }
    }
    ++number;
  }
  return result;
}

belief::HeatMap heat_map(std::span<const Kernel> kernels, const DensityOptions& options) {
  PRESCENE_CHECK(!kernels.empty());
  constexpr double kReach = 4.0;  // standard deviations: 6e-5 of a kernel lies beyond and is spread over the rest
  const auto sigma = [](const Kernel& kernel, Eigen::Index axis) {
    return std::sqrt(kernel.component.covariance(3 + axis, 3 + axis));
  };
  Eigen::Array2d low = Eigen::Array2d::Constant(1e300), high = -low;
  for (const Kernel& kernel : kernels) {
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const double p = kernel.component.mean.translation[axis], reach = kReach * sigma(kernel, axis);
      low[axis] = std::min(low[axis], p - reach);
      high[axis] = std::max(high[axis], p + reach);
    }
  }

  belief::HeatMap map;
  map.cell = options.cell;
  while ((high - low).maxCoeff() > (options.max_cells - 2) * map.cell) map.cell *= 2.0;
  map.x0 = std::floor(low.x() / map.cell) * map.cell;
  map.y0 = std::floor(low.y() / map.cell) * map.cell;
  map.nx = static_cast<int>(std::ceil((high.x() - map.x0) / map.cell));
  map.ny = static_cast<int>(std::ceil((high.y() - map.y0) / map.cell));
  map.mass.assign(static_cast<std::size_t>(map.nx) * static_cast<std::size_t>(map.ny), 0.0);

  // First cell and masses of a kernel along one axis.
  const auto along = [&](double mean, double width, double origin, int count, std::vector<double>& masses) {
    const int first = std::clamp(static_cast<int>((mean - kReach * width - origin) / map.cell), 0, count - 1);
    const int last = std::clamp(static_cast<int>((mean + kReach * width - origin) / map.cell), first, count - 1);
    masses.clear();
    double before = core::normal_cdf((origin + first * map.cell - mean) / width);
    for (int i = first; i <= last; ++i) {
      const double after = core::normal_cdf((origin + (i + 1) * map.cell - mean) / width);
      masses.push_back(after - before);
      before = after;
    }
    return first;
  };
  std::vector<double> in_x, in_y;
  double total = 0.0;
  for (const Kernel& kernel : kernels) {
    const Vector3d& p = kernel.component.mean.translation;
    const int ix = along(p.x(), sigma(kernel, 0), map.x0, map.nx, in_x);
    const int iy = along(p.y(), sigma(kernel, 1), map.y0, map.ny, in_y);
    for (std::size_t j = 0; j < in_y.size(); ++j) {
      double* row = &map.mass[(static_cast<std::size_t>(iy) + j) * static_cast<std::size_t>(map.nx)];
      for (std::size_t i = 0; i < in_x.size(); ++i) {
        const double mass = kernel.component.weight * in_x[i] * in_y[j];
        row[static_cast<std::size_t>(ix) + i] += mass;
        total += mass;
      }
    }
  }
  for (double& mass : map.mass) mass /= total;
  return map;
}

belief::FinalPoses final_poses(const std::string& object, std::span<const FinalSample> samples,
                               std::span<const std::string> outcomes, const geometry::SymmetryGroup& symmetry,
                               const DensityOptions& options, core::ThreadPool& pool) {
  PRESCENE_CHECK(!samples.empty());
  belief::FinalPoses result;
  result.object = object;
  for (const FinalSample& sample : samples) result.mean_position += sample.weight * sample.X_WO.translation;
  for (const FinalSample& sample : samples) {
    const Vector3d d = sample.X_WO.translation - result.mean_position;
    result.position_covariance += sample.weight * d * d.transpose();
  }
  std::vector<Kernel> all = kernels(samples, outcomes, symmetry, options);
  result.heat_map = heat_map(all, options);
  result.components = merged(std::move(all), options, pool);
  return result;
}

}  // namespace prescene::queries
