// SPDX-License-Identifier: Apache-2.0
// Poses of one mesh relative to another for tests and benchmarks of collision queries: at a given distance, on the
// verge of contact, overlapping by a given volume, or scattered. After the sphere and the grid method of [Trenkel et
// al. 2007].
//
//   ContactConfigurations make(mesh_a, mesh_b, oracle, seed);
//   for (const Transform& X_AB : make.at_distance(0.01, 100, PlacementMethod::kSphere)) ...
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"
#include "prescene/core/random.h"
#include "prescene/geometry/pose.h"

namespace prescene::tests {

/// Who is asked while searching: any pair of trees.
struct PairOracle {
  std::function<bool(const collision::Transform& X_AB)> collide;
  std::function<double(const collision::Transform& X_AB)> distance;  ///< m; zero or less when they touch.
};

enum class PlacementMethod {
  /// B comes from outside along a ray to the centre of A, from a direction and in an orientation drawn uniformly, until
  /// the distance is reached.
  kSphere,
  /// B's centre starts in a cell of a grid over A and its surroundings (8 cells along the longest edge), in an
  /// orientation
  /// drawn uniformly: from outside it moves towards a cell nearer to A, from a contact outwards, until the distance is
  /// reached. Finds places in hollows that no ray from outside reaches.
  kGrid,
};

/// Everything follows from the two meshes, the oracle's answers and the seed.
class ContactConfigurations {
 public:
  ContactConfigurations(std::shared_ptr<const collision::Mesh> mesh_a, std::shared_ptr<const collision::Mesh> mesh_b,
                        PairOracle oracle, std::uint64_t seed);
  ~ContactConfigurations();

  /// Length that shares are of, m: the size (diagonal of the box) of the smaller object.
  double size() const { return size_; }

  /// `share` > 0 of size(), within a thousandth of it. `share` = 0 is touching: pairs on either side of a contact that
  /// is found along the ray by bisection, alternately just apart and just in contact by the oracle's answer, less than
  /// kTouchingGap of size() from each other. Fewer than `count` only when hardly any ray succeeds.
  std::vector<collision::Transform> at_distance(double share, int count, PlacementMethod method);
  static constexpr double kTouchingGap = 1e-6;

  /// Overlapping by `volume_share` (0 to 0.5) of the smaller solid's volume, within a tenth of it, measured on cells
  /// (overlap_volume.h). Fewer where the volumes have no such overlap on the ray, as when one fits into the other's
  /// hollow.
  std::vector<collision::Transform> penetrating(double volume_share, int count, PlacementMethod method);

  /// Uniform orientations, B's centre uniform where the boxes of the two can meet: some collide, most are near.
  std::vector<collision::Transform> scattered(int count);

  /// `X_AB` moved by a distance whose logarithm is uniform between 1e-8 and 1e-2 of size(), in a direction drawn
  /// uniformly.
  std::vector<collision::Transform> around(const collision::Transform& X_AB, int count);

  /// 16 poses within 1 % of size() and 1 degree of each other, about `X_AB` (turned about the centre of B's box).
  std::array<collision::Transform, 16> near(const collision::Transform& X_AB);

 private:
  struct Ray;
  struct Solids;

  collision::Transform placed(const Ray& ray, double t) const;
  Ray draw_ray(PlacementMethod method, double distance);
  std::optional<double> place_at_distance(const Ray& ray, double distance) const;
  std::optional<std::array<double, 2>> bracket_contact(const Ray& ray) const;

  std::shared_ptr<const collision::Mesh> mesh_a_, mesh_b_;
  PairOracle oracle_;
  core::RandomStream stream_;
  geometry::Box box_a_, box_b_;
  double size_ = 0.0;
  std::unique_ptr<Solids> solids_;  // made when first needed
};

}  // namespace prescene::tests
