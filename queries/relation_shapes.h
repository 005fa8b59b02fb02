// SPDX-License-Identifier: Apache-2.0
// The surfaces of a scene's bodies, for what relations ask of them: what is in a hollow, what the camera sees, what is
// near a point, what stands upright.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/parallel.h"

namespace prescene::queries {

/// Bodies are numbered as contacts number them (prescene/belief/body_names.h): objects, supports, robot bodies.
class RelationShapes {
 public:
  /// Errors of the meshes, which name the body.
  static core::Result<RelationShapes> make(const belief::Scene& scene, core::ThreadPool& pool);

  /// Poses of all bodies: objects as in the state, robot bodies at the start of their timelines.
  std::vector<belief::Pose> poses(const belief::Scene& scene, const belief::WorldState& state) const;
  /// Height of the body's lowest point along `up_W`, m.
  double lowest(std::size_t body, const belief::Pose& X_WB, const geometry::Vector3d& up_W) const;
  /// Share of the surface of `inner` that is in the hollow of `outer`.
  double share_inside(std::size_t inner, std::size_t outer, const std::vector<belief::Pose>& X_WB,
                      collision::QueryScratch& scratch) const;
  /// Share of what the camera would see of the body alone that it sees among the others; 0 where that is nothing.
  double visible_share(std::size_t body, const geometry::PinholeCamera& camera, const belief::Pose& X_WC,
                       const std::vector<belief::Pose>& X_WB, collision::QueryScratch& scratch) const;
  /// Whether a point of the body is within the distance of a point of the world.
  bool is_within(std::size_t body, const belief::Pose& X_WB, const geometry::Vector3d& p_W, double distance) const;
  /// Angle between `up_W` and the axis that is up as the model was made, rad; nothing of a ball.
  std::optional<double> tilt(std::size_t object, const belief::Pose& X_WB, const geometry::Vector3d& up_W) const;

 private:
  struct Body {
    collision::TriangleTree tree;
    std::vector<geometry::SurfacePoint> points;
    geometry::Box box;
    geometry::Vector3d center = geometry::Vector3d::Zero();
    double radius = 0.0;  ///< Of a ball about `center` that holds it.
    bool solid = false;   ///< Its surface bounds a volume.
    std::optional<belief::Hollow> hollow;
    geometry::SymmetryGroup symmetry;
    geometry::Vector3d axis = geometry::Vector3d::UnitZ();
  };
  bool is_inside(const Body& outer, const geometry::Vector3d& p, collision::QueryScratch& scratch) const;

  std::vector<Body> bodies_;
  std::vector<geometry::Vector3d> directions_;
};

}  // namespace prescene::queries
