// SPDX-License-Identifier: Apache-2.0
// The believed objects as MoveIt's planning scene takes them: messages of moveit_msgs/CollisionObject that say what is
// to be added, moved and removed so that a planning scene becomes as the belief is.
//
//   PlanningScene planning({.supports = true});
//   for (const auto& message : planning.changes(summary, *belief->scene, "world", readers)) publish(message);
#pragma once

#include <map>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {

struct PlanningSceneSettings {
  bool supports = false;  ///< Supports, too; they keep their ids as objects do.
  /// An object is moved once it is farther than this from where it was sent last: m, and rad about any axis. Every move
  /// has MoveIt check its plans anew.
  double moved = 0.005;
  double turned = 0.035;
  /// Of meshes that stand for what is no box, sphere, cylinder or cone.
  int most_triangles = 1000;
  /// Messages that are given at once: a reader that keeps few of them loses none. What is left comes next time.
  std::size_t most_at_once = 8;
};

/// Not thread-safe.
class PlanningScene {
 public:
  explicit PlanningScene(const PlanningSceneSettings& settings = {}) : settings_(settings) {}

  /// What has to be sent now, to `readers` readers; nothing where there are none. Where there are more than before, all
  /// is added anew, which changes nothing for those that had it. Ids are "prescene/NAME".
  ///
  /// Objects that are lost or forgotten are removed. One that a hand holds is left as it is, for its client to attach
  /// it, and is added anew where it is released.
  std::vector<interfaces::RosCollisionObject> changes(const BeliefSummary& summary, const belief::Scene& scene,
                                                      const std::string& world_frame, int readers);

 private:
  struct Sent {
    geometry::Pose X_W;
    std::vector<belief::CollisionShape> shapes;  // what it was added with
    bool adds_anew = false;                      // a reader does not have it: it is new, or a hand held the object
  };
  PlanningSceneSettings settings_;
  int readers_ = 0;
  std::map<std::string, Sent> sent_;  // by id
};

/// The shapes of a thing as MoveIt has them: primitives where there are such, meshes of at most so many triangles
/// otherwise, with an operation of kAdd and without header, id and pose.
interfaces::RosCollisionObject collision_object_of(const std::vector<belief::CollisionShape>& shapes,
                                                   int most_triangles);

}  // namespace prescene::service
