// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "edge_spheres.h"
#include "hull_gap.h"
#include "mesh_holes.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/text.h"
#include "surface_search.h"
#include "void_search.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

constexpr double kSmallestShare = 1e-5;  // Of the body's size: the default smallest radius.
// The search is loose about the order: it places a tenth more, and the smallest are left out.
constexpr std::size_t kSpareShare = 10;

core::Status refuse(const Mesh& mesh, const std::string& what) {
  return core::invalid_input("mesh '" + mesh.name() + "': " + what);
}

std::string text_of(const Vector3d& p) {
  std::ostringstream out;
  out << std::setprecision(4) << "(" << p.x() << ", " << p.y() << ", " << p.z() << ") m";
  return out.str();
}

core::Status check(const Mesh& mesh, const PackingOptions& options) {
  constexpr int kMostSpheres = 10'000'000;
  if (options.max_spheres < 1 || options.max_spheres > kMostSpheres) {
    return refuse(mesh, "a packing of at most " + std::to_string(options.max_spheres) +
                            " spheres; set max_spheres to between 1 and " + std::to_string(kMostSpheres));
  }
  constexpr float kLeastSize = std::numeric_limits<float>::min();
  if (!(mesh.size() >= kLeastSize)) {
    return refuse(mesh, "it is " + core::rounded_text(static_cast<double>(mesh.size())) + " m large; scale it to " +
                            core::rounded_text(static_cast<double>(kLeastSize)) + " m at least");
  }
  constexpr int kMostLayouts = 1000;
  if (options.layouts < 1 || options.layouts > kMostLayouts) {
    return refuse(mesh, std::to_string(options.layouts) + " layouts to try; set layouts to between 1 and " +
                            std::to_string(kMostLayouts));
  }
  if (!(options.volume_share > 0.0) || !(options.volume_share <= 1.0))
    return refuse(mesh,
                  "a volume_share of " + core::rounded_text(options.volume_share) + "; it is above 0 and at most 1");
  for (const double length : {options.smallest_radius, options.edge_fidelity}) {
    if (!(length >= 0.0) || !std::isfinite(length))
      return refuse(
          mesh, "smallest_radius and edge_fidelity are lengths in m, at least 0; one is " + core::rounded_text(length));
  }
  return core::ok_status();
}

double enclosed_volume(const ClosedMesh& mesh) {
  const Vector3d origin = mesh.vertices[mesh.triangles[0][0]].cast<double>();
  double six_volumes = 0.0;
  for (const TriangleIndices& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]].cast<double>() - origin;
    const Vector3d b = mesh.vertices[t[1]].cast<double>() - origin;
    six_volumes += a.dot(b.cross(mesh.vertices[t[2]].cast<double>() - origin));
  }
  return six_volumes / 6.0;
}

core::Result<ClosedMesh> closed(const Mesh& mesh, bool close, PackingReport& report) {
  const OpenEdges open = open_edges(mesh);
  report.open_edges = static_cast<int>(open.edges.size());
  if (!close) PRESCENE_RETURN_IF_ERROR(check_closed(mesh, open, "have its holes covered with close_holes"));
  ClosedMesh result = close_holes(mesh, open);
  report.closed_holes = result.holes;
  report.body_volume = enclosed_volume(result);
  if (!(report.body_volume > 0.0)) {
    return refuse(mesh, "it encloses a volume of " + core::rounded_text(report.body_volume) +
                            " m^3; give a mesh that is not flat, with triangles counter-clockwise seen from outside");
  }
  return result;
}

// Towards which the spheres of a layout lie: directions spread over the sphere by the sequence that is made of powers
// of the plastic number, which fills squares evenly.
Vector3d downhill_of(int layout) {
  const auto share = [&](double step) { return std::fmod(0.5 + step * layout, 1.0); };
  const double z = 2.0 * share(0.7548776662466927) - 1.0;
  const double angle = 2.0 * std::numbers::pi * share(0.5698402909980532);
  const double slope = layout % 2 == 0 ? 0.05 : 0.1;
  return slope * Vector3d(std::sqrt(1.0 - z * z) * std::cos(angle), std::sqrt(1.0 - z * z) * std::sin(angle), z);
}

Vector3d best_downhill(const SurfaceSearch& surface, double smallest, const PackingOptions& options, double body_volume,
                       core::ThreadPool& pool) {
  constexpr std::size_t kTrialSpheres = 200;
  constexpr double kAlmostAll = 0.6;  // Of the body, filled by a single sphere: there is no choice.
  if (options.layouts == 1) return downhill_of(0);
  VoidSearch first(surface, smallest, downhill_of(0), pool);
  if (first.grow(1) && first.volume() > kAlmostAll * body_volume) return downhill_of(0);
  const std::size_t count = std::min(kTrialSpheres, static_cast<std::size_t>(options.max_spheres));
  std::vector<double> volumes(static_cast<std::size_t>(options.layouts));
  pool.for_each_index(volumes.size(), [&](std::size_t i) {
    VoidSearch voids(surface, smallest, downhill_of(static_cast<int>(i)), pool);
    while (voids.spheres().size() < count && voids.grow(count - voids.spheres().size())) {
    }
    volumes[i] = voids.volume();
  });
  return downhill_of(static_cast<int>(std::max_element(volumes.begin(), volumes.end()) - volumes.begin()));
}

// Drops the last spheres, but for the first `kept`, that aren't needed for a volume.
void drop_beyond(double volume, std::size_t kept, std::vector<PackedSphere>& spheres) {
  double sum = 0.0;
  std::size_t count = 0;
  for (; count < spheres.size() && (count < kept || sum < volume); ++count)
    sum += 4.0 / 3.0 * std::numbers::pi * std::pow(static_cast<double>(spheres[count].radius), 3);
  spheres.resize(count);
}

std::vector<SurfaceAnchor> anchors_of(const std::vector<PackedSphere>& spheres, const SurfaceSearch& surface,
                                      core::ThreadPool& pool) {
  std::vector<SurfaceAnchor> anchors(spheres.size());
  pool.for_blocks(spheres.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3d centre = spheres[i].centre.cast<double>();
      const Vector3d point = surface.nearest(centre).point;
      anchors[i] = {point.cast<float>(), (point - centre).normalized().cast<float>()};
    }
  });
  return anchors;
}

core::Status place_edges(const Mesh& mesh, const ClosedMesh& body, const SurfaceSearch& surface,
                         const PackingOptions& options, double smallest, VoidSearch& voids, PackingReport& report,
                         core::ThreadPool& pool) {
  const std::vector<Vector3d> corners = hull_corners(body.vertices, body.triangles);
  const EdgeResult result = place_edge_spheres(voids, surface, corners, options.edge_fidelity, smallest,
                                               static_cast<std::size_t>(options.max_spheres), pool);
  report.edge_spheres = result.placed;
  if (result.too_thin) {
    return refuse(mesh, "near " + text_of(*result.too_thin) + " it is thinner than the smallest radius of " +
                            core::rounded_text(smallest) + " m; allow a larger edge_fidelity or smaller spheres");
  }
  if (result.unserved > 0) {
    return core::resource_exhausted(
        "mesh '" + mesh.name() + "': with " + std::to_string(options.max_spheres) + " spheres, " +
        std::to_string(result.unserved) + " corners of its hull are further than the edge_fidelity of " +
        core::rounded_text(options.edge_fidelity) + " m from the packing; allow more spheres or a larger distance");
  }
  return core::ok_status();
}

double largest_gap(const ClosedMesh& body, const std::vector<PackedSphere>& spheres, core::ThreadPool& pool) {
  const std::vector<Vector3d> corners = hull_corners(body.vertices, body.triangles);
  return pool.reduce_blocks(
      corners.size(), 16, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double largest = 0.0;
        for (std::size_t i = begin; i < end; ++i) largest = std::max(largest, hull_gap(corners[i], spheres).high);
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

}  // namespace

std::string PackingReport::text() const {
  std::ostringstream out;
  out << std::setprecision(3) << "spheres fill " << 100.0 * share() << " % of " << 1e6 * body_volume << " cm^3";
  if (edge_spheres > 0) out << ", " << edge_spheres << " of them at edges (gap " << 1e3 * edge_gap << " mm)";
  if (closed_holes > 0) out << ", " << closed_holes << " holes with " << open_edges << " open edges were covered";
  return out.str();
}

core::Result<PackedMesh> pack_spheres(const Mesh& mesh, const PackingOptions& options, core::ThreadPool& pool) {
  PRESCENE_RETURN_IF_ERROR(check(mesh, options));
  PackedMesh packed;
  PackingReport& report = packed.report;
  PRESCENE_TRY(const ClosedMesh body, closed(mesh, options.close_holes, report));
  const SurfaceSearch surface(body.vertices, body.triangles);
  const double smallest =
      options.smallest_radius > 0.0 ? options.smallest_radius : kSmallestShare * surface.box().diagonal().norm();
  VoidSearch voids(surface, smallest, best_downhill(surface, smallest, options, report.body_volume, pool), pool);
  const auto most = static_cast<std::size_t>(options.max_spheres);
  const auto grow_to = [&](std::size_t count) {
    while (voids.spheres().size() < count && voids.volume() < options.volume_share * report.body_volume &&
           voids.grow(count - voids.spheres().size())) {
    }
  };
  const bool edges = options.edge_fidelity > 0.0;
  grow_to(edges ? (most + 1) / 2 : most);
  if (voids.spheres().empty()) {
    return refuse(mesh,
                  "no sphere with a radius of " + core::rounded_text(smallest) +
                      " m fits into it; it has no thickness, lies too far from its origin for single precision, or "
                      "smallest_radius is too large");
  }
  if (edges) PRESCENE_RETURN_IF_ERROR(place_edges(mesh, body, surface, options, smallest, voids, report, pool));
  const std::size_t kept = edges ? voids.spheres().size() : 0;
  grow_to(most + most / kSpareShare);
  std::vector<PackedSphere> spheres = voids.spheres();
  std::stable_sort(spheres.begin() + static_cast<std::ptrdiff_t>(kept), spheres.end(),
                   [](const PackedSphere& a, const PackedSphere& b) { return a.radius > b.radius; });
  if (spheres.size() > most) spheres.resize(most);
  drop_beyond(options.volume_share * report.body_volume, kept, spheres);
  if (edges) report.edge_gap = largest_gap(body, spheres, pool);
  std::vector<SurfaceAnchor> anchors = anchors_of(spheres, surface, pool);
  PRESCENE_TRY(packed.packing, SpherePacking::make(std::move(spheres), std::move(anchors), mesh.name()));
  report.packed_volume = packed.packing->volume();
  return packed;
}

}  // namespace prescene::collision
