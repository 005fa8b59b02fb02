// SPDX-License-Identifier: Apache-2.0
// What lies still lies flush. A pose is known to some millimetres and degrees; drawn from that, a box would start in
// the air or tilted, and fall. That it was seen to lie still says more: it touches what is below it, and rests on a
// face.
#pragma once

#include <optional>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/geometry/resting_poses.h"

namespace prescene::queries {

class Seating {
 public:
  /// `scene` as prior_of() makes it of the belief: its objects are the belief's, in their order.
  Seating(const belief::Belief& belief, const belief::Scene& scene);
  /// Whether any object lies still.
  bool any() const { return any_; }
  /// Puts the objects that lie still onto what is below them, without velocity: turned by the least angle that brings a
  /// face of theirs onto it, and moved across it. What is further from it than kMostTilt or kMostGap is left as it is.
  void apply(belief::WorldState& state) const;

  static constexpr double kMostTilt = 0.35;  ///< rad
  static constexpr double kMostGap = 0.03;   ///< m

 private:
  struct Body {
    bool lies_still = false;
    geometry::TriangleMesh mesh;                 ///< Of its collision shapes, in O.
    double reach = 0.0;                          ///< m from O, of all of the mesh.
    std::vector<geometry::RestingPose> resting;  ///< Empty = it has no face to lie on.
    geometry::Vector3d p_OoOcm = geometry::Vector3d::Zero();
  };
  struct Ground {
    geometry::Vector3d point_W, normal_W;
  };
  std::optional<Ground> below(const geometry::Vector3d& p_W, std::size_t object, const belief::WorldState& state) const;

  std::vector<Body> bodies_;
  std::vector<geometry::TriangleMesh> supports_;  // in W
  geometry::Vector3d up_W_ = geometry::Vector3d::UnitZ();
  bool any_ = false;
};

}  // namespace prescene::queries
