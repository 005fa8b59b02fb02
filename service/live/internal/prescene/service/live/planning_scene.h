// SPDX-License-Identifier: Apache-2.0
// The believed objects as MoveIt's planning scene takes them: messages of moveit_msgs/CollisionObject that say what is
// to be added, moved and removed so that a planning scene becomes as the belief is.
//
//   PlanningScene planning({.supports = true});
//   planning.prepare(*belief->scene);
//   planning.tell(summary, *belief->scene, "world", {readers, readers_so_far}, send);
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
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
  /// Messages that are sent in a step; the others follow in the next ones. MoveIt's reader may keep only the newest
  /// message, so that a burst would lose all others.
  std::size_t most_at_once = 1;
  /// One message is repeated so often, as readers may have lost it: ns of the stamps of frames.
  core::TimeNs repeat_ns = 1'000'000'000;
};

struct PlanningReaders {
  int now = 0;
  std::uint64_t so_far = 0;  ///< Including those that left.
};

/// Not thread-safe.
class PlanningScene {
 public:
  /// Publishes a message; whether that succeeded.
  using Send = std::function<bool(const interfaces::RosCollisionObject&)>;

  explicit PlanningScene(const PlanningSceneSettings& settings = {}) : settings_(settings) {}

  /// Makes the shapes of the scene's models, and of its supports if they are sent. Large meshes take seconds, which
  /// tell() would otherwise take in the first step that shows them.
  void prepare(const belief::Scene& scene);

  /// Sends what changed; nothing while there are no readers. When another reader comes, all is added anew, which
  /// changes nothing for those that had it. Ids are "prescene/NAME". What could not be sent is due in the next step
  /// again.
  ///
  /// Removals go first, then additions, then moves. Things of one kind take turns. Once per `repeat_ns`, a removal is
  /// repeated that was sent once, or else the next of the things that are there is added again.
  ///
  /// Objects that are lost or forgotten are removed. One that a hand holds is left as it is, for its client to attach
  /// it, and is added anew when it is released. If it is lost in between, it is not added when it is found in the hand.
  /// A held object is added once when it is new or when another reader comes.
  void tell(const BeliefSummary& summary, const belief::Scene& scene, const std::string& world_frame,
            const PlanningReaders& readers, const Send& send);

 private:
  struct Shape {
    std::vector<belief::CollisionShape> shapes;
    interfaces::RosCollisionObject object;  // as collision_object_of() makes it
  };
  using ShapePtr = std::shared_ptr<const Shape>;
  struct Known {
    geometry::Pose X_W;           // as it was sent last
    ShapePtr shape;               // what it was added with
    bool is_in_world = true;      // false: it was removed when it was lost in a hand
    bool is_held = false;         // when it was last believed to be somewhere
    bool adds_anew = false;       // once no hand holds it
    bool has_new_reader = false;  // which does not have it, held or not
  };
  struct Placed;
  struct Turn;
  enum Kind { kRemoval, kAddition, kMove, kKinds };

  ShapePtr shape_of(const std::string& key, const std::vector<belief::CollisionShape>& shapes,
                    const belief::Scene& scene);
  std::vector<Placed> placed_in(const BeliefSummary& summary, const belief::Scene& scene);
  bool repeats_one(const Turn& turn);
  bool adds(const Turn& turn, const Placed& thing);
  bool moves(const Turn& turn, const Placed& thing);
  bool removes(const Turn& turn, const std::string& id);

  PlanningSceneSettings settings_;
  std::uint64_t readers_so_far_ = 0;
  std::map<std::string, std::shared_ptr<Shape>> shapes_;  // by "model NAME" or "support NAME"
  std::map<std::string, Known> known_;                    // by id
  std::array<std::string, kKinds> last_;                  // the id of the last message of each kind
  std::map<std::string, core::TimeNs> removed_;           // ids whose removal is to be repeated, and when it was sent
  std::string last_repeated_;
  std::optional<core::TimeNs> repeated_ns_;
};

/// The shapes of a thing as MoveIt has them: primitives where there are such, meshes of at most so many triangles
/// otherwise, with an operation of kAdd and without header, id and pose.
interfaces::RosCollisionObject collision_object_of(const std::vector<belief::CollisionShape>& shapes,
                                                   int most_triangles);

}  // namespace prescene::service
