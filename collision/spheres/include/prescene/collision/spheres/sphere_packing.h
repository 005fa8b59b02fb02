// SPDX-License-Identifier: Apache-2.0
// Spheres that fill the inside of a body without overlapping each other: what an inner sphere tree is built over.
// Overlaps of two packings say how far two bodies are inside each other [Weller and Zachmann 2011].
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/collision/mesh.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

/// In the body's frame, m.
struct PackedSphere {
  Vector3f centre = Vector3f::Zero();
  float radius = 0.0F;

  friend bool operator==(const PackedSphere&, const PackedSphere&) = default;
};

/// The place on the body's surface that is nearest to a sphere's centre, in the body's frame.
struct SurfaceAnchor {
  Vector3f point = Vector3f::Zero();   ///< m.
  Vector3f normal = Vector3f::Zero();  ///< Outward, of unit length.

  friend bool operator==(const SurfaceAnchor&, const SurfaceAnchor&) = default;
};

/// Spheres and their anchors, index by index. Immutable.
class SpherePacking {
 public:
  /// Spheres made elsewhere. Fails with kInvalidInput, naming the packing and the index, when there are none, more than
  /// 2^30, not one anchor a sphere, or when a number is not finite, a coordinate beyond kLargestCoordinate, a radius
  /// not positive or a normal not of unit length within 1e-3. Whether they overlap is not looked at.
  static core::Result<std::shared_ptr<const SpherePacking>> make(std::vector<PackedSphere> spheres,
                                                                 std::vector<SurfaceAnchor> anchors,
                                                                 std::string_view name);

  /// The same from values that somebody else keeps, such as a mapped file.
  static core::Result<std::shared_ptr<const SpherePacking>> make(Array<PackedSphere> spheres,
                                                                 Array<SurfaceAnchor> anchors, std::string_view name);

  std::uint32_t size() const { return static_cast<std::uint32_t>(spheres_.size()); }
  const Array<PackedSphere>& spheres() const { return spheres_; }
  const Array<SurfaceAnchor>& anchors() const { return anchors_; }
  const std::string& name() const { return name_; }
  /// Sum of the spheres' volumes, m^3.
  double volume() const { return volume_; }
  /// Identity of the spheres and anchors, for caches; the name does not count.
  std::uint64_t content_hash() const { return content_hash_; }

 private:
  SpherePacking() = default;

  Array<PackedSphere> spheres_;
  Array<SurfaceAnchor> anchors_;
  std::string name_;
  double volume_ = 0.0;
  std::uint64_t content_hash_ = 0;
};

struct PackingOptions {
  int max_spheres = 5000;
  /// Packing ends when the spheres fill this share of the body's volume, in which parts that overlap count twice: (0,
  /// 1].
  double volume_share = 1.0;
  double smallest_radius = 0.0;  ///< m; 0: a hundred-thousandth of the body's size.
  /// m; 0: none. No point of the body's surface is further than this from the convex hull of the packing, and where
  /// the hull would be further from a corner there is a sphere with its centre within this distance of the corner, so
  /// that bodies rest and tip on edges as they should.
  double edge_fidelity = 0.0;
  bool close_holes = false;  ///< Cover the holes of an open mesh instead of refusing it.
  /// Where the few largest spheres lie decides how well all others fill what they leave. As many layouts of them (1 to
  /// 1000) are tried with 200 spheres, and the best is filled up.
  int layouts = 16;

  friend bool operator==(const PackingOptions&, const PackingOptions&) = default;
};

/// How well a packing fills a body.
struct PackingReport {
  double body_volume = 0.0;    ///< m^3, with covered holes.
  double packed_volume = 0.0;  ///< m^3.
  int edge_spheres = 0;        ///< Placed for the edge fidelity.
  double edge_gap = 0.0;       ///< m; largest distance of the surface from the packing's hull, when that was asked for.
  int closed_holes = 0;        ///< Loops of open edges that were covered.
  int open_edges = 0;          ///< Before.

  double share() const { return packed_volume / body_volume; }
  std::string text() const;  ///< One line for a person.
  friend bool operator==(const PackingReport&, const PackingReport&) = default;
};
struct PackedMesh {
  std::shared_ptr<const SpherePacking> packing;  ///< Large spheres first, but for those of the edges.
  PackingReport report;
};

/// Fills a closed mesh with spheres that neither overlap each other nor leave it, always about the largest that fits:
/// ProtoSphere's idea [Weller and Zachmann 2010] with an octree that finds the prototypes' places. The same bits for
/// any number of threads. Fails with kInvalidInput, naming the mesh, when it is open (with a place and the number of
/// open edges), turned inside out, too thin for a single sphere, or an option is out of range; with kResourceExhausted
/// when the edge fidelity needs more spheres than are allowed.
core::Result<PackedMesh> pack_spheres(const Mesh& mesh, const PackingOptions& options, core::ThreadPool& pool);

}  // namespace prescene::collision
