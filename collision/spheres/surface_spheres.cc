// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/surface_spheres.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "mesh_holes.h"
#include "point_cells.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/triangle_tree.h"
#include "surface_features.h"
#include "surface_samples.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// Patches reach a little further than the farthest dart that they kept away.
constexpr double kReachRoom = 1.15;
constexpr int kMostShrinks = 40;
// Share of the body's size: where no larger sphere has room (on an edge, in a notch), one that is hardly more than its
// point stands for the surface, so that it sticks out nowhere.
constexpr double kLeastRadius = 1e-5;
constexpr double kPointRadius = 1e-7;

class Cover {
 public:
  Cover(const std::shared_ptr<const Mesh>& mesh, const SurfaceSphereOptions& options, core::ThreadPool& pool)
      : mesh_(*mesh), options_(options), pool_(pool), tree_(TriangleTree::build(mesh, {}, pool)) {
    size_ = static_cast<double>(mesh_.size());
    depth_ = options.edge_fidelity > 0.0 ? options.edge_fidelity : 0.003 * size_;
  }

  core::Result<SurfaceSpheres> make() {
    features_ = surface_features(mesh_);
    if (!(features_.volume > 0.0))
      return core::invalid_input("mesh " + mesh_.name() +
                                 ": its surface is turned inside out or encloses nothing; turn its triangles around");
    PRESCENE_RETURN_IF_ERROR(part_triangles());
    const SurfaceSamples sampled = sample_faces(mesh_, features_, options_.count);
    const std::vector<SurfaceSample>& samples = sampled.samples;
    spacing_ = sampled.spacing;
    std::vector<SurfacePatch> patches(samples.size());
    std::vector<std::uint8_t> kept(samples.size(), 0);
    pool_.for_blocks(samples.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) kept[i] = make_patch(samples[i], &patches[i]) ? 1 : 0;
    });
    SurfaceSpheres result;
    result.spacing = spacing_;
    result.rise = static_cast<float>(*std::max_element(features_.rises.begin(), features_.rises.end()));
    for (std::size_t i = 0; i < patches.size(); ++i)
      if (kept[i]) result.patches.push_back(patches[i]);
    const std::size_t on_faces = result.patches.size();
    add_edge_spheres(&result.patches);
    result.edge_spheres = static_cast<int>(result.patches.size() - on_faces);
    return with_tree(std::move(result));
  }

 private:
  /// Triangles that stand for a surface that bends apart from all others.
  core::Status part_triangles() {
    std::array<std::vector<TriangleIndices>, 2> parts;
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t)
      parts[features_.rises[t] > 0.0 ? 1 : 0].push_back(mesh_.triangles()[t]);
    for (std::size_t i = 0; i < 2; ++i) {
      if (parts[i].empty()) continue;
      PRESCENE_TRY(auto part, Mesh::make(mesh_.vertices(), std::move(parts[i]), mesh_.name()));
      (i == 0 ? flat_ : bent_) = TriangleTree::build(std::move(part), {}, pool_);
    }
    return core::ok_status();
  }

  /// Largest radius of a sphere that touches the surface at p and leaves facets by no more than `rise` where they stand
  /// for a surface that bends.
  double room_at(const Vector3d& p, const Vector3d& normal, double rise) const {
    double radius = 0.5 * size_;
    for (int i = 0; i < kMostShrinks; ++i) {
      const Vector3d centre = p - radius * normal;
      const double within = radius * (1.0 - 1e-5);
      auto nearest = flat_ ? nearest_point(*flat_, centre, within) : std::nullopt;
      if (bent_ && within > rise)
        if (const auto other =
                nearest_point(*bent_, centre, nearest ? std::min(nearest->distance, within - rise) : within - rise))
          nearest = other;
      if (!nearest) break;
      const Vector3d to = p - nearest->point;
      const double along = normal.dot(to);
      if (!(along > 0.0)) return 0.0;
      const double smaller = 0.5 * to.squaredNorm() / along;
      if (!(smaller < radius)) break;
      radius = smaller;
      if (radius < kLeastRadius * size_) break;
    }
    return radius;
  }

  /// Samples of a round surface may lie over the edge of the face that ends it, where that does not bound their
  /// spheres: its plane does.
  double room_beside_edges(const SurfaceSample& sample) const {
    double room = size_;
    for (const SharpEdge& edge : features_.edges) {
      if (!(sample.rise > 0.0)) break;
      const Vector3d along = edge.to - edge.from;
      const double at = along.dot(sample.point - edge.from) / along.squaredNorm();
      if (at < 0.0 || at > 1.0 || (edge.from + at * along - sample.point).norm() > sample.spacing) continue;
      const bool on_a = sample.normal.dot(edge.normal_a) > sample.normal.dot(edge.normal_b);
      const Vector3d& beyond = on_a ? edge.normal_b : edge.normal_a;
      if (sample.normal.dot(on_a ? edge.normal_a : edge.normal_b) < 0.9) continue;
      const double depth = std::max(0.0, beyond.dot(edge.from - sample.point));
      room = std::min(room, depth / (1.0 - beyond.dot(sample.normal)));
    }
    return room;
  }

  bool make_patch(const SurfaceSample& sample, SurfacePatch* patch) const {
    // Surfaces inside of the body (parts that overlap) are met by nothing.
    if (winding_number(tree_, sample.point + (sample.rise + 1e-4 * spacing_) * sample.normal) > 0) return false;
    const double room = std::min(room_at(sample.point, sample.normal, sample.rise), room_beside_edges(sample));
    const double radius = room < kLeastRadius * size_ ? kPointRadius * size_ : room;
    patch->radius = static_cast<float>(radius);
    patch->centre = (sample.point - radius * sample.normal).cast<float>();
    patch->point = sample.point.cast<float>();
    patch->normal = sample.normal.cast<float>();
    const double reach = kReachRoom * sample.reach;
    patch->reach = static_cast<float>(reach);
    const Vector3d u = sample.normal.unitOrthogonal();
    const Vector3d v = sample.normal.cross(u);
    patch->tangent = u.cast<float>();
    patch->bitangent = v.cast<float>();
    set_limits(sample, reach, patch);
    set_bend(sample, u, v, reach, patch);
    return true;
  }

  void set_limits(const SurfaceSample& sample, double reach, SurfacePatch* patch) const {
    struct Found {
      Vector3d out;
      double distance;
    };
    std::vector<Found> found;
    for (const SharpEdge& edge : features_.edges) {
      const Vector3d along = edge.to - edge.from;
      const double at = std::clamp(along.dot(sample.point - edge.from) / along.squaredNorm(), 0.0, 1.0);
      const Vector3d to = edge.from + at * along - sample.point;
      if (to.squaredNorm() > reach * reach) continue;
      if (std::max(sample.normal.dot(edge.normal_a), sample.normal.dot(edge.normal_b)) < 0.9) continue;
      Vector3d out = along.cross(sample.normal).normalized();
      if (out.dot(to) < 0.0) out = -out;
      found.push_back({out, std::max(0.0, out.dot(to))});
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Found& a, const Found& b) { return a.distance < b.distance; });
    std::size_t used = 0;
    for (const Found& f : found) {
      if (used == patch->limits.size()) break;
      if (used > 0 && patch->limits[0].out.cast<double>().dot(f.out) > 0.95) continue;
      patch->limits[used++] = {f.out.cast<float>(), static_cast<float>(f.distance)};
    }
  }

  /// Fits the surface's bend to its heights around the point.
  void set_bend(const SurfaceSample& sample, const Vector3d& u, const Vector3d& v, double reach,
                SurfacePatch* patch) const {
    constexpr int kDirections = 12;
    Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    int used = 0;
    const double away = 0.8 * reach;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      const Vector3d direction = std::cos(angle) * u + std::sin(angle) * v;
      const auto beyond = [&](const SurfacePatch::Limit& limit) {
        return away * limit.out.cast<double>().dot(direction) > static_cast<double>(limit.distance) - 1e-9 * size_;
      };
      if (std::any_of(patch->limits.begin(), patch->limits.end(),
                      [&](const auto& l) { return l.out.squaredNorm() > 0.0F && beyond(l); }))
        continue;
      const auto nearest = nearest_point(tree_, sample.point + away * direction, away);
      if (!nearest || features_.normals[nearest->triangle].dot(sample.normal) < 0.5) continue;
      const Vector3d to = nearest->point - sample.point;
      const double x = u.dot(to), y = v.dot(to);
      const Vector3d row = 0.5 * Vector3d(x * x, x * y, y * y);
      normal_matrix += row * row.transpose();
      right += row * sample.normal.dot(to);
      ++used;
    }
    if (used < 6) return;
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal_matrix);
    if (solver.vectorD().minCoeff() < 1e-6 * solver.vectorD().maxCoeff()) return;
    const Vector3d bend = solver.solve(right);
    if (bend.cwiseAbs().maxCoeff() * reach > 2.0) return;
    if (bend.cwiseAbs().maxCoeff() * reach < 1e-3) return;  // flat: rounding of the mesh
    for (std::size_t k = 0; k < 3; ++k) patch->bend[k] = static_cast<float>(bend[static_cast<Eigen::Index>(k)]);
  }

  /// A sphere about a point inside of an edge or a corner, as large as fits.
  std::optional<SurfacePatch> edge_sphere(const Vector3d& p, const Vector3d& outward) const {
    double depth = depth_;
    for (int i = 0; i < 5; ++i, depth *= 0.5) {
      const Vector3d centre = p - depth * outward;
      if (winding_number(tree_, centre) <= 0) continue;
      const auto nearest = nearest_point(tree_, centre);
      if (!nearest || nearest->distance < kLeastRadius * size_) return std::nullopt;
      // An edge inside of another part of the body is met by nothing.
      if ((nearest->point - p).norm() > 2.0 * depth) return std::nullopt;
      SurfacePatch patch;
      patch.centre = centre.cast<float>();
      patch.radius = static_cast<float>(nearest->distance);
      patch.point = nearest->point.cast<float>();
      patch.normal = ((nearest->point - centre) / nearest->distance).cast<float>();
      return patch;
    }
    return std::nullopt;
  }

  void add_edge_spheres(std::vector<SurfacePatch>* patches) const {
    const double step = std::max(2.5 * depth_, 0.5 * spacing_);
    PointCells cells(step);
    std::vector<Vector3d> placed;
    const auto place = [&](const Vector3d& p, const Vector3d& outward, double room) {
      bool near = false;
      cells.for_near(p, [&](std::size_t i) { near = near || (placed[i] - p).squaredNorm() < room * room; });
      if (near || winding_number(tree_, p + 0.5 * depth_ * outward) > 0) return;
      const std::optional<SurfacePatch> patch = edge_sphere(p, outward);
      if (!patch) return;
      cells.add(p, placed.size());
      placed.push_back(p);
      patches->push_back(*patch);
    };
    for (const auto& [p, outward] : features_.corners) place(p, outward, 0.25 * step);
    for (const SharpEdge& edge : features_.edges) {
      const int count = std::max(1, static_cast<int>(std::ceil((edge.to - edge.from).norm() / step)));
      const Vector3d outward = (edge.normal_a + edge.normal_b).normalized();
      for (int i = 0; i < count; ++i) place(edge.from + (i + 0.5) / count * (edge.to - edge.from), outward, 0.7 * step);
    }
  }

  core::Result<SurfaceSpheres> with_tree(SurfaceSpheres result) const {
    std::vector<PackedSphere> spheres;
    std::vector<SurfaceAnchor> anchors;
    for (SurfacePatch& patch : result.patches) {
      const float radius = std::min(patch.radius, static_cast<float>(spacing_));
      spheres.push_back({patch.is_edge() ? patch.centre : Vector3f(patch.point - radius * patch.normal), radius});
      anchors.push_back({patch.point, patch.normal});
      result.longest_reach = std::max(result.longest_reach, std::hypot(radius, patch.reach) - radius);
    }
    PRESCENE_TRY(auto packing, SpherePacking::make(std::move(spheres), std::move(anchors), mesh_.name()));
    PRESCENE_TRY(result.tree, SphereTree::make(std::move(packing), {}, pool_));
    return result;
  }

  const Mesh& mesh_;
  SurfaceSphereOptions options_;
  core::ThreadPool& pool_;
  TriangleTree tree_;
  std::optional<TriangleTree> flat_, bent_;
  double size_ = 0.0, depth_ = 0.0, spacing_ = 0.0;
  SurfaceFeatures features_;
};

}  // namespace

core::Result<SurfaceSpheres> cover_surface(const std::shared_ptr<const Mesh>& mesh, const SurfaceSphereOptions& options,
                                           core::ThreadPool& pool) {
  if (options.count < 50 || options.count > 100'000)
    return core::invalid_input("mesh " + mesh->name() + ": count of spheres is " + std::to_string(options.count) +
                               "; give 50 to 100000");
  if (!(options.edge_fidelity >= 0.0) || options.edge_fidelity > 0.1 * static_cast<double>(mesh->size()))
    return core::invalid_input("mesh " + mesh->name() +
                               ": edge_fidelity is not between 0 and a tenth of the body's size; it is in metres");
  PRESCENE_RETURN_IF_ERROR(check_closed(*mesh, open_edges(*mesh), "take its convex hull"));
  return Cover(mesh, options, pool).make();
}

}  // namespace prescene::collision
