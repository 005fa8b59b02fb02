// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/surface_spheres.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "mesh_holes.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// rad: faces that meet at more than this have a sharp edge between them.
constexpr double kSharp = 0.5;
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
// Patches reach a little further than the farthest dart that they kept away.
constexpr double kReachRoom = 1.15;
constexpr int kMostShrinks = 40;
// Facets stand for a surface that bends: its spheres may rise over them by this times their angle times their width (a
// quarter is how far the round surface does where it bends both ways).
constexpr double kRise = 0.35;
// Share of that by which places are put on to the round surface at most.
constexpr double kLiftShare = 0.8;
// Share of the body's size: no sphere is smaller.
constexpr double kLeastRadius = 1e-5;

/// A sharp edge and the normals of the faces beside it.
struct SharpEdge {
  Vector3d from, to;
  Vector3d normal_a, normal_b;
};

struct Sample {
  Vector3d point, normal;
  double spacing = 0.0;
  double reach = 0.0;
  double rise = 0.0;  // by which its sphere may leave the facets
};

/// Points in cubes, to find those near a place.
class Cells {
 public:
  explicit Cells(double edge) : edge_(edge) {}
  void add(const Vector3d& p, std::size_t index) { cells_[key(p)].push_back(index); }
  template <class Visit>
  void for_near(const Vector3d& p, const Visit& visit) const {
    const Key middle = key(p);
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto found = cells_.find({middle[0] + x, middle[1] + y, middle[2] + z});
          if (found == cells_.end()) continue;
          for (const std::size_t i : found->second) visit(i);
        }
  }

 private:
  using Key = std::array<std::int64_t, 3>;
  Key key(const Vector3d& p) const {
    const auto of = [&](double x) { return static_cast<std::int64_t>(std::floor(x / edge_)); };
    return {of(p.x()), of(p.y()), of(p.z())};
  }
  double edge_;
  std::map<Key, std::vector<std::size_t>> cells_;
};

/// For each vertex the lowest index of one at the same position.
std::vector<std::uint32_t> welded_vertices(const Mesh& mesh) {
  std::map<std::tuple<float, float, float>, std::uint32_t> first;
  std::vector<std::uint32_t> welded;
  for (std::uint32_t i = 0; i < mesh.vertices().size(); ++i) {
    const Vector3f& v = mesh.vertices()[i];
    welded.push_back(first.emplace(std::tuple(v.x(), v.y(), v.z()), i).first->second);
  }
  return welded;
}

/// Of an edge, one triangle that has it.
struct EdgeUse {
  std::uint32_t low, high;  // vertices; at equal positions they are one
  std::uint32_t triangle;
  std::uint32_t opposite;  // its third vertex
};

/// Sorted by the edge.
std::vector<EdgeUse> edge_uses(const Mesh& mesh, const std::vector<std::uint32_t>& welded) {
  std::vector<EdgeUse> uses;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = welded[mesh.triangles()[t][k]];
      const std::uint32_t b = welded[mesh.triangles()[t][(k + 1) % 3]];
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), t, welded[mesh.triangles()[t][(k + 2) % 3]]});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& x, const EdgeUse& y) {
    return std::tuple(x.low, x.high, x.triangle) < std::tuple(y.low, y.high, y.triangle);
  });
  return uses;
}

class Cover {
 public:
  Cover(const std::shared_ptr<const Mesh>& mesh, const SurfaceSphereOptions& options, core::ThreadPool& pool)
      : mesh_(*mesh), options_(options), pool_(pool), tree_(TriangleTree::build(mesh, {}, pool)) {
    size_ = static_cast<double>(mesh_.size());
    depth_ = options.edge_fidelity > 0.0 ? options.edge_fidelity : 0.003 * size_;
  }

  core::Result<SurfaceSpheres> make() {
    welded_ = welded_vertices(mesh_);
    measure_triangles();
    if (!(volume_ > 0.0))
      return core::invalid_input("mesh " + mesh_.name() +
                                 ": its surface is turned inside out or encloses nothing; turn its triangles around");
    find_edges();
    smooth_normals();
    PRESCENE_RETURN_IF_ERROR(part_triangles());
    choose_spacing();
    throw_darts();
    std::vector<SurfacePatch> patches(samples_.size());
    std::vector<std::uint8_t> kept(samples_.size(), 0);
    pool_.for_blocks(samples_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) kept[i] = make_patch(samples_[i], &patches[i]) ? 1 : 0;
    });
    SurfaceSpheres result;
    result.spacing = spacing_;
    result.rise = static_cast<float>(*std::max_element(rises_.begin(), rises_.end()));
    for (std::size_t i = 0; i < patches.size(); ++i)
      if (kept[i]) result.patches.push_back(patches[i]);
    const std::size_t on_faces = result.patches.size();
    add_edge_spheres(&result.patches);
    result.edge_spheres = static_cast<int>(result.patches.size() - on_faces);
    return with_tree(std::move(result));
  }

 private:
  Vector3d corner(std::uint32_t triangle, std::size_t k) const {
    return mesh_.vertices()[mesh_.triangles()[triangle][k]].cast<double>();
  }

  void measure_triangles() {
    const std::uint32_t count = mesh_.triangle_count();
    normals_.resize(count);
    areas_.resize(count);
    for (std::uint32_t t = 0; t < count; ++t) {
      const Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      const Vector3d cross = (b - a).cross(c - a);
      const double norm = cross.norm();
      areas_[t] = 0.5 * norm;
      normals_[t] = norm > 0.0 ? Vector3d(cross / norm) : Vector3d::UnitZ();
      volume_ += a.dot(b.cross(c)) / 6.0;
    }
  }

  void find_edges() {
    bends_.assign(mesh_.triangle_count(), 0.0);
    rises_.assign(mesh_.triangle_count(), 0.0);
    std::map<std::uint32_t, Corner> corners;
    const std::vector<EdgeUse> uses = edge_uses(mesh_, welded_);
    for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
      while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
      if (end - begin == 2) look_at_edge(uses[begin], uses[begin + 1], &corners);
    }
    find_corners(corners);
  }

  struct Corner {
    std::vector<Vector3d> normals, neighbours;
  };
  Vector3d vertex(std::uint32_t index) const { return mesh_.vertices()[index].cast<double>(); }

  void look_at_edge(const EdgeUse& x, const EdgeUse& y, std::map<std::uint32_t, Corner>* corners) {
    if (areas_[x.triangle] == 0.0 || areas_[y.triangle] == 0.0) return;
    const Vector3d from = vertex(x.low), to = vertex(x.high);
    const Vector3d& normal_x = normals_[x.triangle];
    const Vector3d& normal_y = normals_[y.triangle];
    const double angle = std::atan2(normal_x.cross(normal_y).norm(), normal_x.dot(normal_y));
    const bool convex = normal_x.dot(vertex(y.opposite) - from) < 0.0;
    if (angle < kSharp) {
      const double width = (areas_[x.triangle] + areas_[y.triangle]) / (to - from).norm();
      for (const std::uint32_t t : {x.triangle, y.triangle}) {
        bends_[t] = std::max(bends_[t], angle / width);
        rises_[t] = std::max(rises_[t], kRise * angle * width);
      }
    } else if (convex) {
      edges_.push_back({from, to, normal_x, normal_y});
    }
    for (const auto& [here, there] : {std::pair(x.low, x.high), std::pair(x.high, x.low)}) {
      Corner& c = (*corners)[here];
      c.neighbours.push_back(vertex(there));
      for (const Vector3d& normal : {normal_x, normal_y}) {
        const bool known =
            std::any_of(c.normals.begin(), c.normals.end(), [&](const Vector3d& n) { return n.dot(normal) > 0.95; });
        if (!known) c.normals.push_back(normal);
      }
    }
  }

  void find_corners(const std::map<std::uint32_t, Corner>& corners) {
    // Corners: all edges fall away from the mean normal, and the faces are far from flat.
    for (const auto& [index, c] : corners) {
      Vector3d mean = Vector3d::Zero();
      for (const Vector3d& n : c.normals) mean += n;
      if (mean.norm() < 1e-6) continue;
      mean.normalize();
      const Vector3d p = vertex(index);
      const bool convex = std::all_of(c.neighbours.begin(), c.neighbours.end(),
                                      [&](const Vector3d& q) { return mean.dot(q - p) < 1e-9 * size_; });
      const bool sharp =
          std::any_of(c.normals.begin(), c.normals.end(), [&](const Vector3d& n) { return n.dot(mean) < 0.9; });
      if (convex && sharp) corners_.emplace_back(p, mean);
    }
  }

  /// The normals at the corners of each triangle, of the surface that its facets stand for: means by area over the
  /// triangles around a corner that no sharp edge parts from it.
  void smooth_normals() {
    std::vector<std::vector<std::uint32_t>> around(mesh_.vertices().size());
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t)
      for (const std::uint32_t v : mesh_.triangles()[t]) around[welded_[v]].push_back(t);
    corner_normals_.resize(mesh_.triangle_count());
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        Vector3d sum = Vector3d::Zero();
        if (bends_[t] > 0.0) {
          for (const std::uint32_t other : around[welded_[mesh_.triangles()[t][k]]])
            if (normals_[other].dot(normals_[t]) > std::cos(kSharp)) sum += areas_[other] * normals_[other];
        }
        corner_normals_[t][k] = sum.norm() > 0.0 ? Vector3d(sum.normalized()) : normals_[t];
      }
    }
  }

  double spacing_on(std::uint32_t triangle, double spacing) const {
    const double bend = bends_[triangle];
    return bend > 0.0 ? std::clamp(kBendShare / bend, kClosest * spacing, spacing) : spacing;
  }

  void choose_spacing() {
    const auto count = [&](double spacing) {
      double sum = 0.0;
      for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
        const double s = spacing_on(t, spacing);
        sum += kDartArea * areas_[t] / (s * s);
      }
      return sum;
    };
    double low = 1e-6 * size_, high = size_;
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      (count(middle) > options_.count ? low : high) = middle;
    }
    spacing_ = high;
  }

  void throw_darts() {
    // Each triangle gets its share of the darts, at places that an additive sequence spreads over it.
    Cells cells(spacing_);
    double due = 0.5;
    double u = 0.5, v = 0.5;
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      const double spacing = spacing_on(t, spacing_);
      due += kDarts * kDartArea * areas_[t] / (spacing * spacing);
      const Vector3d a = corner(t, 0), ab = corner(t, 1) - a, ac = corner(t, 2) - a;
      for (; due >= 1.0; due -= 1.0) {
        u += 0.7548776662466927;
        v += 0.5698402909980532;
        u -= std::floor(u);
        v -= std::floor(v);
        const bool beyond = u + v > 1.0;
        const double x = beyond ? 1.0 - u : u;
        const double y = beyond ? 1.0 - v : v;
        const std::array<Vector3d, 3>& n = corner_normals_[t];
        const Vector3d normal = ((1.0 - x - y) * n[0] + x * n[1] + y * n[2]).normalized();
        Vector3d p = a + x * ab + y * ac;
        // On to the round surface: halfway to where the corners' tangent planes have it [Boubekeur and Alexa 2008].
        const double to_planes[3] = {n[0].dot(p - a), n[1].dot(p - a - ab), n[2].dot(p - a - ac)};
        const Vector3d lift =
            -0.5 * ((1.0 - x - y) * to_planes[0] * n[0] + x * to_planes[1] * n[1] + y * to_planes[2] * n[2]);
        const double most = kLiftShare * rises_[t];
        p += lift.norm() > most ? Vector3d(lift * (most / lift.norm())) : lift;
        throw_dart({p, normal, spacing, 0.5 * spacing, rises_[t]}, &cells);
      }
    }
  }

  void throw_dart(const Sample& dart, Cells* cells) {
    double least = dart.spacing;
    std::size_t nearest = samples_.size();
    cells->for_near(dart.point, [&](std::size_t i) {
      const double distance = (samples_[i].point - dart.point).norm();
      if (samples_[i].normal.dot(dart.normal) < kSameSide || distance >= least) return;
      least = distance;
      nearest = i;
    });
    if (nearest < samples_.size()) {
      samples_[nearest].reach = std::max(samples_[nearest].reach, least);
      return;
    }
    cells->add(dart.point, samples_.size());
    samples_.push_back(dart);
  }

  /// Triangles that stand for a surface that bends apart from all others.
  core::Status part_triangles() {
    std::array<std::vector<TriangleIndices>, 2> parts;
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t)
      parts[rises_[t] > 0.0 ? 1 : 0].push_back(mesh_.triangles()[t]);
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

  bool make_patch(const Sample& sample, SurfacePatch* patch) const {
    // Surfaces inside of the body (parts that overlap) are met by nothing.
    if (winding_number(tree_, sample.point + (sample.rise + 1e-4 * spacing_) * sample.normal) > 0) return false;
    const double radius = std::max(room_at(sample.point, sample.normal, sample.rise), kLeastRadius * size_);
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

  void set_limits(const Sample& sample, double reach, SurfacePatch* patch) const {
    struct Found {
      Vector3d out;
      double distance;
    };
    std::vector<Found> found;
    for (const SharpEdge& edge : edges_) {
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
  void set_bend(const Sample& sample, const Vector3d& u, const Vector3d& v, double reach, SurfacePatch* patch) const {
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
      if (!nearest || normals_[nearest->triangle].dot(sample.normal) < 0.5) continue;
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
    Cells cells(step);
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
    for (const auto& [p, outward] : corners_) place(p, outward, 0.25 * step);
    for (const SharpEdge& edge : edges_) {
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
  double size_ = 0.0, depth_ = 0.0, volume_ = 0.0, spacing_ = 0.0;
  std::vector<Vector3d> normals_;
  std::vector<std::uint32_t> welded_;
  std::vector<double> areas_;
  // Across edges that are not sharp: 1/m, and how far spheres may rise over the facets, m.
  std::vector<double> bends_, rises_;
  std::vector<std::array<Vector3d, 3>> corner_normals_;
  std::vector<SharpEdge> edges_;
  std::vector<std::pair<Vector3d, Vector3d>> corners_;  // place, outward
  std::vector<Sample> samples_;
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
