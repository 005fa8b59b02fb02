// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_packing.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

constexpr std::size_t kMostSpheres = std::size_t{1} << 30U;
constexpr float kUnitTolerance = 1e-3F;

core::Status refuse_packing(std::string_view name, const std::string& what) {
  return core::invalid_input("sphere packing '" + std::string(name) + "': " + what);
}

core::Status check(const Array<PackedSphere>& spheres, const Array<SurfaceAnchor>& anchors, std::string_view name) {
  if (spheres.empty()) return refuse_packing(name, "it has no spheres; give at least one");
  if (spheres.size() > kMostSpheres)
    return refuse_packing(name, "it has " + std::to_string(spheres.size()) + " spheres; at most 2^30 are allowed");
  if (anchors.size() != spheres.size()) {
    return refuse_packing(name, std::to_string(anchors.size()) + " anchors for " + std::to_string(spheres.size()) +
                                    " spheres; give one each");
  }
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const auto& [centre, radius] = spheres[i];
    const std::string place = "sphere " + std::to_string(i);
    if (!centre.allFinite() || !std::isfinite(radius)) return refuse_packing(name, place + " is not finite; drop it");
    if (centre.cwiseAbs().maxCoeff() > kLargestCoordinate || radius > kLargestCoordinate)
      return refuse_packing(name, place + " lies beyond the limit of 1e9 m: check the unit");
    if (!(radius > 0.0F)) return refuse_packing(name, place + " has a radius that is not positive; drop it");
    if (!anchors[i].point.allFinite() || !(std::abs(anchors[i].normal.norm() - 1.0F) <= kUnitTolerance))
      return refuse_packing(name,
                            "the anchor of " + place + " is not finite or its normal not of unit length; mend it");
  }
  return core::ok_status();
}

}  // namespace

core::Result<std::shared_ptr<const SpherePacking>> SpherePacking::make(std::vector<PackedSphere> spheres,
                                                                       std::vector<SurfaceAnchor> anchors,
                                                                       std::string_view name) {
  return make(Array<PackedSphere>(std::move(spheres)), Array<SurfaceAnchor>(std::move(anchors)), name);
}

core::Result<std::shared_ptr<const SpherePacking>> SpherePacking::make(Array<PackedSphere> spheres,
                                                                       Array<SurfaceAnchor> anchors,
                                                                       std::string_view name) {
  PRESCENE_RETURN_IF_ERROR(check(spheres, anchors, name));
  std::shared_ptr<SpherePacking> packing(new SpherePacking());
  packing->name_ = name;
  core::Hasher hasher;
  hasher.value(spheres.size());
  hasher.bytes(spheres.data(), spheres.bytes());
  hasher.bytes(anchors.data(), anchors.bytes());
  packing->content_hash_ = hasher.digest();
  for (const PackedSphere& sphere : spheres)
    packing->volume_ += 4.0 / 3.0 * std::numbers::pi * std::pow(static_cast<double>(sphere.radius), 3);
  packing->spheres_ = std::move(spheres);
  packing->anchors_ = std::move(anchors);
  return std::shared_ptr<const SpherePacking>(std::move(packing));
}

}  // namespace prescene::collision
