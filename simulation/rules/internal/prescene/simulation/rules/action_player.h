// SPDX-License-Identifier: Apache-2.0
// What actions and timelines make kinematic bodies do: where held objects, hands and pushers are at a time, and when an
// object comes free. And what they do to free objects: blows, and the forces of hands that are not stronger than they
// are said to be (action_loads.cc).
#pragma once

#include <limits>
#include <span>
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

  /// An object as it is now, as far as hands feel it.
  struct Body {
    Pose X_WO;
    Vector3d p_WCm, v_WCm, w_WO;  ///< Centre of mass, its velocity, and the spin.
    double mass = 1.0;
    double friction = 0.0;  ///< Of its surface.
  };
  /// What is done to a free object in this step: impulses on its centre of mass (N s) and about it (N m s).
  struct Load {
    int object = 0;
    Vector3d impulse = Vector3d::Zero();
    Vector3d turn = Vector3d::Zero();
    bool blow = false;            ///< At once, at the step's beginning; else evenly over the step, as gravity.
    bool keeps_attitude = false;  ///< It turns with `spin` (rad/s): that of the hand's pads.
    Vector3d spin = Vector3d::Zero();
  };
  /// Something slides in a grip.
  bool slides() const;
  /// Whether load() has something to do in this step; after advance().
  bool has_loads(double time) const;
  /// After advance() of the same time: appends the loads of this step, and to `released` what begins to slide in a
  /// grip. An object that sticks again is kinematic from now on. `bodies` has all objects.
  void load(double time, double dt, std::span<const Body> bodies, std::vector<Released>& released,
            std::vector<Load>& loads);

  bool kinematic(int object) const {
    const Hold& hold = objects_[static_cast<std::size_t>(object)];
    return hold.control != Control::kFree && !hold.loose;
  }
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
    Pose X_felt;  // of what is inserted: where it is, and the hand that gives way with it
    // Of grips: `loose` while the object does not move with the hand, `lost` once it is out of the fingers.
    double limit = std::numeric_limits<double>::infinity();  // N, of friction
    double pad_length = 0.0;
    bool own_friction = true;  // the limit is to be multiplied by that of the surfaces
    bool loose = false, lost = false;
    bool shifted = false;  // by X_PO
    Pose X_PO;             // where it is, from where the hand would have it
    bool grips() const { return limit < std::numeric_limits<double>::infinity(); }
    /// The hand may have something to do with it in a step.
    bool acts() const { return control != Control::kFree && grips() && !lost; }
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
    int hand = -1;                       // that a release lets back off
    bool begun = false;                  // of what drives a body: what follows is set
    Vector3d from_W = Vector3d::Zero();  // the point that is pulled
    double from = 0.0;                   // the joint's position
  };
  struct Pusher {
    Vector3d from, to;
    double begin, duration, radius;  // begin from start_
  };

  void execute(std::size_t index, double time, double dt, const std::vector<Pose>& poses,
               std::vector<Released>& released);
  /// The hand carries nothing any more, and stays there.
  void stop(int robot, const Pose& X_WG);
  void finish_carry(int object, double time, double dt, const Pose& X_now, std::vector<Released>& released);
  static bool is_carried(const Hold& hold) {
    return hold.control == Control::kCarried || hold.control == Control::kPoured;
  }
  /// What is under way with it moves it. Else its hand moves something else by now, and it goes along with the hand.
  bool goes_its_way(int object) const;
  Pose carried_pose(const Hold& hold, double time) const;
  /// Where the hand that carries it has it.
  Pose carrying_pose(const Hold& hold, double time) const;
  /// Where the hand would have it.
  Pose planned_pose(int object, double time) const;
  Twist leaving(int object, double time, double dt, const Pose& X_now) const;
  // Loads: action_loads.cc.
  struct Loading {
    double time, dt;
    std::span<const Body> bodies;
    std::vector<Released>& released;
    std::vector<Load>& loads;
  };
  void bump(std::size_t action, const Loading& now, std::vector<Vector3d>& blows) const;
  void grip(int object, const Vector3d& blow, const Loading& now);
  void pull(std::size_t action, const Loading& now);
  void move_joint(std::size_t action, const Loading& now);
  void insert(std::size_t action, const Loading& now);
  geometry::Matrix3d inverse_inertia(int object, const Body& body) const;
  /// How a hand draws a point along a direction.
  struct Drawing {
    double behind = 0.0;      // m, of where the hand is at the step's end
    double base_speed = 0.0;  // m/s, of what it is measured against
    double fastest = 0.0;     // m/s, at which it catches up
    double most = 0.0;        // N s
    bool draws_only = false;  // never pushes back
  };
  void draw_at(int object, const Vector3d& point_W, const Vector3d& along, const Drawing& drawing,
               const Loading& now) const;
  bool under_way(std::size_t action, double time) const;
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
  std::vector<std::size_t> bumps_;   // of this step
  std::vector<std::size_t> drives_;  // pulls, move_joints and inserts
  bool grips_ = false;               // some grasp is by a grip
};

}  // namespace prescene::simulation
