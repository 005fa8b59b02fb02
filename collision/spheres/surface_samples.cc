// SPDX-License-Identifier: Apache-2.0
#include "surface_samples.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "point_cells.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// Darts thrown for each sphere that is wanted on the faces, and about the share of a square of the spacing's edge that
// each of them then has.
constexpr int kDarts = 24;
constexpr double kDartArea = 0.8;
// Samples of one side only keep each other away: cosine of the angle between normals.
constexpr double kSameSide = 0.8;
// Where a surface bends with a radius, samples are no further apart than this share of it, but never nearer to each
// other than the other share of the spacing on flat faces.
constexpr double kBendShare = 0.6;
constexpr double kClosest = 0.25;
// Share of that by which places are put on to the round surface at most.
constexpr double kLiftShare = 0.8;

class DartThrower {
 public:
  DartThrower(const Mesh& mesh, const SurfaceFeatures& features, int count)
      : mesh_(mesh), features_(features), count_(count), size_(static_cast<double>(mesh.size())) {}

  SurfaceSamples sample() {
    choose_spacing();
    throw_darts();
    return std::move(found_);
  }

 private:
  Vector3d corner(std::uint32_t triangle, std::size_t k) const {
    return mesh_.vertices()[mesh_.triangles()[triangle][k]].cast<double>();
  }

  double spacing_on(std::uint32_t triangle, double spacing) const {
    const double bend = features_.bends[triangle];
    return bend > 0.0 ? std::clamp(kBendShare / bend, kClosest * spacing, spacing) : spacing;
  }

  void choose_spacing() {
    const auto count = [&](double spacing) {
      double sum = 0.0;
      for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
        const double s = spacing_on(t, spacing);
        sum += kDartArea * features_.areas[t] / (s * s);
      }
      return sum;
    };
    double low = 1e-6 * size_, high = size_;
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      (count(middle) > count_ ? low : high) = middle;
    }
    found_.spacing = high;
  }

  void throw_darts() {
    // Each triangle gets its share of the darts, at places that an additive sequence spreads over it.
    PointCells cells(found_.spacing);
    double due = 0.5;
    double u = 0.5, v = 0.5;
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      const double spacing = spacing_on(t, found_.spacing);
      due += kDarts * kDartArea * features_.areas[t] / (spacing * spacing);
      const Vector3d a = corner(t, 0), ab = corner(t, 1) - a, ac = corner(t, 2) - a;
      for (; due >= 1.0; due -= 1.0) {
        u += 0.7548776662466927;
        v += 0.5698402909980532;
        u -= std::floor(u);
        v -= std::floor(v);
        const bool beyond = u + v > 1.0;
        const double x = beyond ? 1.0 - u : u;
        const double y = beyond ? 1.0 - v : v;
        const std::array<Vector3d, 3>& n = features_.corner_normals[t];
        const Vector3d normal = ((1.0 - x - y) * n[0] + x * n[1] + y * n[2]).normalized();
        Vector3d p = a + x * ab + y * ac;
        // On to the round surface: halfway to where the corners' tangent planes have it [Boubekeur and Alexa 2008].
        const double to_planes[3] = {n[0].dot(p - a), n[1].dot(p - a - ab), n[2].dot(p - a - ac)};
        const Vector3d lift =
            -0.5 * ((1.0 - x - y) * to_planes[0] * n[0] + x * to_planes[1] * n[1] + y * to_planes[2] * n[2]);
        const double most = kLiftShare * features_.rises[t];
        p += lift.norm() > most ? Vector3d(lift * (most / lift.norm())) : lift;
        throw_dart({p, normal, spacing, 0.5 * spacing, features_.rises[t]}, &cells);
      }
    }
  }

  void throw_dart(const SurfaceSample& dart, PointCells* cells) {
    double least = dart.spacing;
    std::size_t nearest = found_.samples.size();
    cells->for_near(dart.point, [&](std::size_t i) {
      const double distance = (found_.samples[i].point - dart.point).norm();
      if (found_.samples[i].normal.dot(dart.normal) < kSameSide || distance >= least) return;
      least = distance;
      nearest = i;
    });
    if (nearest < found_.samples.size()) {
      found_.samples[nearest].reach = std::max(found_.samples[nearest].reach, least);
      return;
    }
    cells->add(dart.point, found_.samples.size());
    found_.samples.push_back(dart);
  }

  const Mesh& mesh_;
  const SurfaceFeatures& features_;
  int count_;
  double size_;
  SurfaceSamples found_;
};

}  // namespace

SurfaceSamples sample_faces(const Mesh& mesh, const SurfaceFeatures& features, int count) {
  return DartThrower(mesh, features, count).sample();
}

}  // namespace prescene::collision
