// SPDX-License-Identifier: Apache-2.0
#include "tests/support/overlap_volume.h"

#include <algorithm>
#include <cmath>

namespace prescene::tests {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

float cross(const Vector2f& a, const Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

SolidCells::SolidCells(const collision::Mesh& mesh, int resolution) {
  Vector3f high = mesh.vertices()[0];
  low_ = high;
  for (const Vector3f& vertex : mesh.vertices()) {
    low_ = low_.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  cell_ = (high - low_).maxCoeff() / static_cast<float>(resolution);
  if (cell_ <= 0.0F) return;
  for (int k = 0; k < 3; ++k) count_[k] = std::min(resolution, static_cast<int>((high[k] - low_[k]) / cell_) + 1);
  filled_.assign(static_cast<std::size_t>(count_.x()) * static_cast<std::size_t>(count_.y()) *
                     static_cast<std::size_t>(count_.z()),
                 0);

  const std::size_t columns = static_cast<std::size_t>(count_.x()) * static_cast<std::size_t>(count_.y());
  std::vector<std::vector<float>> crossings(columns);
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const std::array<Vector3f, 3> corners = mesh.corners(t);
    const Vector2f a = corners[0].head<2>(), b = corners[1].head<2>(), c = corners[2].head<2>();
    const float area = cross(b - a, c - a);
    if (area == 0.0F) continue;
    const Vector2f first = (a.cwiseMin(b).cwiseMin(c) - low_.head<2>()) / cell_;
    const Vector2f last = (a.cwiseMax(b).cwiseMax(c) - low_.head<2>()) / cell_;
    for (int x = std::max(0, static_cast<int>(first.x())); x <= std::min(count_.x() - 1, static_cast<int>(last.x()));
         ++x) {
      for (int y = std::max(0, static_cast<int>(first.y())); y <= std::min(count_.y() - 1, static_cast<int>(last.y()));
           ++y) {
        const Vector2f p =
            low_.head<2>() + cell_ * Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        const float u = cross(b - p, c - p) / area, v = cross(c - p, a - p) / area, w = 1.0F - u - v;
        if (u < 0.0F || v < 0.0F || w < 0.0F) continue;
        crossings[static_cast<std::size_t>(x) * static_cast<std::size_t>(count_.y()) + static_cast<std::size_t>(y)]
            .push_back(u * corners[0].z() + v * corners[1].z() + w * corners[2].z());
      }
    }
  }
  for (int x = 0; x < count_.x(); ++x) {
    for (int y = 0; y < count_.y(); ++y) {
      fill_column(
          x, y,
          &crossings[static_cast<std::size_t>(x) * static_cast<std::size_t>(count_.y()) + static_cast<std::size_t>(y)]);
    }
  }
}

void SolidCells::fill_column(int x, int y, std::vector<float>* crossings) {
  std::sort(crossings->begin(), crossings->end());
  for (std::size_t i = 0; i + 1 < crossings->size(); i += 2) {
    for (int z = 0; z < count_.z(); ++z) {
      const float height = low_.z() + cell_ * (static_cast<float>(z) + 0.5F);
      if (height < (*crossings)[i] || height > (*crossings)[i + 1] || filled_[index(x, y, z)] != 0) continue;
      filled_[index(x, y, z)] = 1;
      inside_.push_back(low_ + cell_ * (Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
                                        Vector3f::Constant(0.5F)));
    }
  }
}

std::size_t SolidCells::index(int x, int y, int z) const {
  return (static_cast<std::size_t>(x) * static_cast<std::size_t>(count_.y()) + static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(count_.z()) +
         static_cast<std::size_t>(z);
}

double SolidCells::volume() const {
  return static_cast<double>(inside_.size()) * std::pow(static_cast<double>(cell_), 3);
}

bool SolidCells::contains(const Vector3f& p) const {
  if (inside_.empty()) return false;
  const Vector3f place = (p - low_) / cell_;
  for (int k = 0; k < 3; ++k)
    if (!(place[k] >= 0.0F && place[k] < static_cast<float>(count_[k]))) return false;
  return filled_[index(static_cast<int>(place.x()), static_cast<int>(place.y()), static_cast<int>(place.z()))] != 0;
}

double overlap_share(const SolidCells& a, const SolidCells& b, const collision::Transform& X_AB) {
  const double smaller = std::min(a.volume(), b.volume());
  if (smaller <= 0.0) return 0.0;
  std::size_t both = 0;
  for (const Vector3f& p_BQ : b.inside()) both += a.contains(X_AB * p_BQ) ? 1 : 0;
  return static_cast<double>(both) / static_cast<double>(b.inside().size()) * b.volume() / smaller;
}

}  // namespace prescene::tests
