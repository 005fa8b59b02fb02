// SPDX-License-Identifier: Apache-2.0
// What actions and timelines make kinematic bodies do: where held objects, hands and pushers are at a time, and when an
// object comes free.
#pragma once

#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/random.h"
#include "prescene/simulation/rules/action_draws.h"
#include "prescene/simulation/rules/byte_stream.h"

namespace prescene::simulation {

using geometry::Pose;
using geometry::Twist;
using geometry::Vector3d;

/// One instance's actions and how far they are.
class ActionPlayer {
 public:
  /// `scene` must outlive it.
  explicit ActionPlayer(const belief::Scene& scene) : scene_(&scene) {}

  /// Starts over: actions' times count from start.time; `stream` is what their errors are drawn from.
  void reset(const std::vector<belief::Action>& actions, const belief::WorldState& start, core::RandomStream stream);

  /// Executes what is due by `time` (s since the scene's start). `poses` are the objects' poses now.
  /// Objects that come free are appended to `released` with the velocity they leave with.
  struct Released {
    int object = 0;
    Twist V_WO;
  };
  void advance(double time, double dt, const std::vector<Pose>& poses, std::vector<Released>& released);

  bool kinematic(int object) const { return objects_[static_cast<std::size_t>(object)].control != Control::kFree; }
  /// X_WO of a kinematic object; X_WG of a robot body; position of a pusher.
  Pose object_pose(int object, double time) const;
  Pose robot_pose(int robot, double time) const;
  int pusher_count() const { return static_cast<int>(pushers_.size()); }
  double pusher_radius(int pusher) const { return pushers_[static_cast<std::size_t>(pusher)].radius; }
  bool pusher_present(int pusher, double time) const;
  Vector3d pusher_position(int pusher, double time) const;
  /// No action is due or under way, and no timeline has a waypoint to come.
  bool finished(double time) const;
  /// From when on finished() holds, s.
  double finish_time() const;
  /// When something is to be done by advance() next, s; infinite when nothing is.
  double next_due() const;
  /// Everything that was to come has been done, so that no kinematic body moves from `time` on.
  bool over(double time) const;

  void save(ByteWriter& out) const;
  void restore(ByteReader& in);

 private:
  enum class Control : int { kFree, kHeld, kCarried, kPoured };
  /// Of one object.
  struct Hold {
    Control control = Control::kFree;
    int hand = -1;    // robot body that goes along, or -1
    Pose X_GO;        // in the hand, while there is one; else in W
    int action = -1;  // the carry or pour under way
    double begin = 0.0;
    Pose X_from;  // X_WO at its start
  };
  /// Of one robot body.
  struct Hand {
    int carries = -1;    // object whose carry moves this hand
    bool stays = false;  // where the last carry ended, no longer on its timeline
    Pose X_WG_stay;
  };
  /// Of one action.
  struct Step {
    bool done = false;
    int hand = -1;  // that a release lets back off
  };
  struct Pusher {
    Vector3d from, to;
    double begin, duration, radius;  // begin from start_
  };

  void execute(std::size_t index, double time, double dt, const std::vector<Pose>& poses,
               std::vector<Released>& released);
  void finish_carry(int object, std::vector<Released>& released);
  Pose carried_pose(const Hold& hold, double time) const;
  double begin_of(std::size_t action) const { return start_ + actions_[action].time; }
  Pose timeline_pose(int robot, double time) const;

  const belief::Scene* scene_;
  double start_ = 0.0;
  std::vector<belief::Action> actions_;  // times from start_
  std::vector<DrawnAction> drawn_;       // by action
  std::vector<Pusher> pushers_;
  std::vector<Hold> objects_;
  std::vector<Hand> hands_;
  std::vector<Step> steps_;
};

}  // namespace prescene::simulation
