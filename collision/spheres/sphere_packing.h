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

}  // namespace prescene::collision
