// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/ground_density.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "prescene/core/random.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::Vector3d;

constexpr double kReach = 4.0;  // standard deviations of a kernel
constexpr int kLeastCells = 420, kMostCells = 800;
constexpr double kCellsInWindow = 4.0;

}  // namespace

GroundDensity::GroundDensity(std::span<const belief::PoseComponent> components, const Vector2d& low,
                             const Vector2d& high, double window)
    : low_(low) {
  const double extent = (high - low).maxCoeff();
  cell_ = extent / std::clamp(std::ceil(kCellsInWindow * extent / window), 1.0 * kLeastCells, 1.0 * kMostCells);
  nx_ = std::max(2, static_cast<int>(std::ceil((high.x() - low.x()) / cell_)) + 1);
  ny_ = std::max(2, static_cast<int>(std::ceil((high.y() - low.y()) / cell_)) + 1);
  values_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), 0.0);
  for (const belief::PoseComponent& component : components) add(component);
  sum_windows(window);
}

/// Each node holds the mean density of the cell around it.
void GroundDensity::add(const belief::PoseComponent& component) {
  Eigen::Matrix2d covariance = component.covariance.block<2, 2>(3, 3);
  const Vector2d sigma = covariance.diagonal().cwiseMax(1e-18).cwiseSqrt();
  const Vector2d mean = component.mean.translation.head<2>();
  const Vector2d place = (mean - low_) / cell_, reach = kReach * sigma / cell_;
  const auto first = [&](int axis) {
    return static_cast<int>(std::max(0.0, std::ceil(place[axis] - reach[axis] - 0.5)));
  };
  const auto last = [&](int axis, int count) {
    return static_cast<int>(std::clamp(std::floor(place[axis] + reach[axis] + 0.5), -1.0, count - 1.0));
  };
  // A Gaussian wider than a cell is sampled, with its correlation; of a narrower one the cells' exact masses are taken.
  const bool narrow = sigma.minCoeff() < cell_;
  covariance.diagonal().array() += 0.25 * cell_ * cell_;  // across a strong correlation it could still slip through
  const Eigen::Matrix2d inverse = narrow ? Eigen::Matrix2d::Zero().eval() : covariance.inverse().eval();
  const double peak = narrow ? 0.0 : component.weight / (2.0 * M_PI * std::sqrt(covariance.determinant()));
  const auto share = [&](int axis, int i) {
    const double width = sigma[axis] / cell_;
    return core::normal_cdf((i + 0.5 - place[axis]) / width) - core::normal_cdf((i - 0.5 - place[axis]) / width);
  };
  for (int iy = first(1); iy <= last(1, ny_); ++iy) {
    const double in_row = narrow ? share(1, iy) : 0.0;
    for (int ix = first(0); ix <= last(0, nx_); ++ix) {
      const Vector2d d = low_ + cell_ * Vector2d(ix, iy) - mean;
      values_[static_cast<std::size_t>(iy) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(ix)] +=
          narrow ? component.weight * in_row * share(0, ix) / (cell_ * cell_)
                 : peak * std::exp(-0.5 * d.dot(inverse * d));
    }
  }
}

/// Each node stands for the cell around it; a window takes a share of the cells at its border.
void GroundDensity::sum_windows(double window) {
  const auto width = static_cast<std::size_t>(nx_) + 1, height = static_cast<std::size_t>(ny_) + 1;
  std::vector<double> below(width * height, 0.0);  // mass left of and below the corners of the cells
  for (std::size_t y = 1; y < height; ++y) {
    double row = 0.0;
    for (std::size_t x = 1; x < width; ++x) {
      row += cell_ * cell_ * values_[(y - 1) * (width - 1) + x - 1];
      below[y * width + x] = below[(y - 1) * width + x] + row;
    }
  }
  const auto until = [&](double u, double v) {
    u = std::clamp(u, 0.0, nx_ - 1e-9);
    v = std::clamp(v, 0.0, ny_ - 1e-9);
    const auto x = static_cast<std::size_t>(u), y = static_cast<std::size_t>(v);
    const double a = u - static_cast<double>(x), b = v - static_cast<double>(y);
    const double* here = &below[y * width + x];
    return (1.0 - b) * ((1.0 - a) * here[0] + a * here[1]) + b * ((1.0 - a) * here[width] + a * here[width + 1]);
  };
  const double half = 0.5 * window / cell_;
  masses_.resize(values_.size());
  for (int iy = 0; iy < ny_; ++iy) {
    for (int ix = 0; ix < nx_; ++ix) {
      const double u = ix + 0.5, v = iy + 0.5;
      const double mass =
          until(u + half, v + half) - until(u - half, v + half) - until(u + half, v - half) + until(u - half, v - half);
      masses_[static_cast<std::size_t>(iy) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(ix)] =
          std::clamp(mass, 0.0, 1.0);  // rounding, and sums of samples
    }
  }
  largest_mass_ = *std::max_element(masses_.begin(), masses_.end());
}

double GroundDensity::interpolated(const std::vector<double>& grid, double x, double y) const {
  const double u = (x - low_.x()) / cell_, v = (y - low_.y()) / cell_;
  if (!(u >= 0.0 && v >= 0.0 && u < nx_ - 1.0 && v < ny_ - 1.0)) return 0.0;
  const auto ix = static_cast<std::size_t>(u), iy = static_cast<std::size_t>(v);
  const double a = u - static_cast<double>(ix), b = v - static_cast<double>(iy);
  const double* row = &grid[iy * static_cast<std::size_t>(nx_) + ix];
  const double* next = row + nx_;
  return (1.0 - b) * ((1.0 - a) * row[0] + a * row[1]) + b * ((1.0 - a) * next[0] + a * next[1]);
}

double GroundDensity::level_of(double share) const {
  std::vector<double> sorted;
  std::copy_if(values_.begin(), values_.end(), std::back_inserter(sorted), [](double value) { return value > 0.0; });
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  double sum = 0.0;
  for (double value : sorted) {
    sum += value * cell_ * cell_;
    if (sum >= share) return value;
  }
  return 0.0;  // the rest lies outside of the grid
}

std::optional<GroundDensity::Rectangle> GroundDensity::rectangle_of(double share) const {
  const double level = level_of(share);
  std::optional<Rectangle> found;
  for (int iy = 0; iy < ny_; ++iy) {
    for (int ix = 0; ix < nx_; ++ix) {
      const double value =
          values_[static_cast<std::size_t>(iy) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(ix)];
      if (!(value > 0.0) || value < level) continue;
      const Vector2d node = low_ + cell_ * Vector2d(ix, iy), half = Vector2d::Constant(0.5 * cell_);
      if (!found) found = Rectangle{node, node};
      found->low = found->low.cwiseMin(node - half);
      found->high = found->high.cwiseMax(node + half);
    }
  }
  return found;
}

std::vector<DensityLevel> levels_of(const belief::FinalPoses& poses, const geometry::TriangleMesh& mesh,
                                    const Vector2d& low, const Vector2d& high) {
  constexpr double kTogether = 0.03;  // m
  struct Placed {
    double height;
    belief::PoseComponent component;
  };
  std::vector<Placed> placed;
  for (const belief::PoseComponent& component : poses.components) {
    double lowest = 1e9;
    for (const Vector3d& vertex : mesh.vertices) lowest = std::min(lowest, (component.mean * vertex).z());
    placed.push_back({lowest, component});
  }
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) { return a.height < b.height; });
  std::vector<DensityLevel> levels;
  for (std::size_t begin = 0; begin < placed.size();) {
    std::size_t end = begin;
    double mass = 0.0, moment = 0.0;
    std::vector<belief::PoseComponent> components;
    while (end < placed.size() && placed[end].height - placed[begin].height < kTogether) {
      mass += placed[end].component.weight;
      moment += placed[end].component.weight * placed[end].height;
      components.push_back(placed[end++].component);
    }
    levels.push_back({moment / mass, GroundDensity(components, low, high, poses.heat_map.cell)});
    begin = end;
  }
  return levels;
}

}  // namespace prescene::service
