// SPDX-License-Identifier: Apache-2.0
// One simulated instance: the state of all bodies and one step of it. Everything that the next step depends on is here
// as plain numbers; Bullet's bodies are filled from them before each solve and read after it, so that saving, restoring
// and starting over leave nothing behind.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "body_motion.h"
#include "compiled_scene.h"
#include "contact_finder.h"
#include "contact_solver.h"
#include "prescene/core/progress.h"
#include "prescene/simulation/rules/action_player.h"
#include "sphere_contacts.h"

namespace prescene::simulation {

/// What a pair of bodies did to each other in a step. Numbered as belief::ContactInterval; first < second.
struct Touch {
  int first = 0;
  int second = 0;
  double impulse = 0.0;   ///< N s, sum of the normal impulses.
  double normal_z = 0.0;  ///< Along up_of(scene), of the mean normal from second to first.
};

class InstanceWorld {
 public:
  explicit InstanceWorld(std::shared_ptr<const CompiledScene> scene);

  /// Starts over from `start`; nothing of what was before remains.
  void reset(const belief::WorldState& start, const std::vector<belief::Action>& actions, core::RandomStream stream);
  /// False when cancelled within the step, which a heap of hundreds makes long: the world is then of no use before the
  /// next reset.
  bool step(const core::Cancellation* cancellation = nullptr);
  /// Takes up to `most` steps at once in which nothing can touch anything, as bounds on the ways of all objects say,
  /// and returns how many: 0 when something might. Leaves the same bits as that many calls of step(). Ends early where
  /// something becomes calm, and does not start where an object might get beyond `world_radius` (m).
  int fly(int most, double world_radius);

  double time() const;
  double dt() const { return scene_->options.step; }
  /// Into `state`, reusing its memory.
  void read(belief::WorldState& state) const;
  /// Touching pairs of the last step, ordered.
  const std::vector<Touch>& touches() const { return touches_; }
  /// How deep two things overlapped at the beginning of the last step if it was the first or let something go,
  /// else 0; m.
  double overlap() const { return overlap_; }
  /// Some number is not finite or some speed beyond 1e4.
  bool diverged() const;
  /// Freezes objects beyond this distance from the origin. Returns whether any object has left.
  bool freeze_beyond(double radius);
  bool all_frozen() const;

  int object_count() const { return scene_->object_count; }
  /// Moves by itself: neither held nor frozen.
  bool free(int object) const;
  /// Kinetic energy per mass of a free object, J/kg.
  double energy(int object) const;
  /// Steps in a row for which the object's energy was below the rest rule's.
  int calm_steps(int object) const { return objects_[static_cast<std::size_t>(object)].calm_steps; }
  bool actions_finished() const { return player_.over(time()); }
  const CompiledScene& scene() const { return *scene_; }

  /// Position of the centre of mass, W.
  Vector3d center_of_mass(int object) const { return objects_[static_cast<std::size_t>(object)].p_WCm; }
  /// Of the centre of mass, m/s.
  const Vector3d& velocity(int object) const { return objects_[static_cast<std::size_t>(object)].v_WCm; }
  Quaterniond rotation(int object) const { return objects_[static_cast<std::size_t>(object)].R_WO; }
  /// Turns an object about an axis through its centre of mass and stops it. Overlap that comes of it is pushed out by
  /// the steps that follow, without energy.
  void nudge(int object, const Vector3d& axis_W, double angle);
  /// Whether it hangs on something, or something on it.
  bool jointed(int object) const;
  /// The joint of which it is the child, else -1.
  int joint_of(int object) const;
  /// Turns the child of a hinge, and what hangs on it, about the axis, and stops it.
  void nudge_joint(int joint, double angle);
  /// m: of a child's centre of mass from its hinge's axis.
  double swing_radius(int joint) const;
  /// What an object stands on as it is now; a function of the state alone.
  struct Footing {
    std::span<const Vector3d> points;  ///< Where it touches others, W; valid until the next call or step.
    bool others = false;               ///< Some of them is an object, which may move.
    double height = 0.0;               ///< Of its centre of mass above the lowest point.
  };
  Footing footing(int object, const Vector3d& down);

  void save(ByteWriter& out) const;
  /// Reads to the end; false when these are not its bytes.
  bool restore(ByteReader& in);

 private:
  struct Object {
    Vector3d p_WCm = Vector3d::Zero();  // centre of mass
    Quaterniond R_WO = Quaterniond::Identity();
    Vector3d v_WCm = Vector3d::Zero();
    Vector3d w_WO = Vector3d::Zero();
    belief::PhysicalParameters physical;
    // Of what is borne: the velocities in the middle of the step before (docs/reference/simulation.md), from which the
    // next step goes on. What is not has no lag.
    Vector3d v_middle = Vector3d::Zero();
    Vector3d w_middle = Vector3d::Zero();
    double lag = 0.0;   // s: by how much they are older than the pose
    double owed = 0.0;  // s: for how long gravity has not acted in v_WCm yet
    int calm_steps = 0;
    bool held = false;
    bool frozen = false;
    // Of this step: what hands do to it, m/s^2 and rad/s^2.
    bool loaded = false;
    Vector3d acceleration = Vector3d::Zero();
    Vector3d spin_up = Vector3d::Zero();
  };
  struct Flight {
    Vector3d p_WCm, v_WCm, w_WO;
    Quaterniond R_WO;
  };
  /// Geometry and motion of any body during a step.
  struct Moving {
    Frame X_WO;
    Vector3d p_WCm = Vector3d::Zero();     // what velocities refer to
    Vector3d velocity = Vector3d::Zero();  // that contacts act on
    Vector3d spin = Vector3d::Zero();
    Vector3d velocity_before = Vector3d::Zero();  // without this step's gravity and hands
    Vector3d fall = Vector3d::Zero();  // what gravity adds to `velocity` until the end, with nothing in the way
    double pulled = 0.0;               // s: for how long gravity has acted in `velocity`
    bool struck = false;               // something hits it in this part of a step
    Vector3d spin_before = Vector3d::Zero();
    Vector3d spin_after = Vector3d::Zero();  // with nothing in the way
    Vector3d low, high;                      // bounding box swept over the step
    double travel = 0.0;                     // bound of any point's way in the step, m
    bool present = true;
    bool dynamic = false;
  };
  struct Warm {
    std::uint64_t key = 0;  // bodies and parts
    Vector3d position;      // in B's frame
    double impulse = 0.0;
    Vector3d friction_impulse;
  };
  /// Of one joint.
  struct Hinged {
    belief::JointParameters drawn;
    std::array<double, 6> impulse{};  // of the step before (SolverJoint)
  };
  /// Position and attitude of a joint's two bodies at the end of a step.
  struct JointEnds {
    Pose X_WP, X_WC;
  };
  /// What a step's contacts did to an object, beside its velocity.
  struct Impact {
    std::optional<double> time;  // when in the step the first contact closed
    bool supported = false;      // some contact held it all along
    bool bounced = false;
  };

  /// A box fixed in W.
  struct Bounds {
    Vector3d low = Vector3d::Zero();
    Vector3d high = Vector3d::Zero();
    bool overlaps(const Bounds& other) const {
      return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
    }
  };
  /// What bounds an object's way through the air; of one call of fly().
  struct Flyer {
    int object = 0;
    Vector3d low = Vector3d::Zero();  // of its parts as they stand now, from its centre of mass
    Vector3d high = Vector3d::Zero();
    double radius = 0.0;  // of its farthest point from its centre of mass
    double spin = 0.0;    // rad/s, never exceeded
    Bounds bounds;        // of all that it and its steps' reach meet within the horizon
  };

  int body_count() const { return static_cast<int>(scene_->bodies.size()) + player_.pusher_count(); }
  Pose object_pose(const Object& object) const;
  // What actions do: instance_actions.cc.
  void run_actions();
  void set_free(const std::vector<ActionPlayer::Released>& released);
  void load_objects();
  void place_kinematic();
  /// Gravity, and what a hand does to it.
  Vector3d pull_on(const Object& object) const {
    return object.loaded ? Vector3d(scene_->scene.gravity_W + object.acceleration) : scene_->scene.gravity_W;
  }
  void place_dynamic();
  /// Its velocity where a step begins.
  Vector3d begun(const Object& object) const { return object.v_WCm + object.owed * scene_->scene.gravity_W; }
  void keep_velocity(std::size_t object, const Spin& spin, bool borne, bool hit);
  void begin_anew(std::size_t body);
  void note_struck();
  /// After what is taken of a step now.
  Flight flight_of(const Object& object, const CompiledBody& body) const;
  bool list_flyers();
  bool clear_for(int steps, double world_radius);
  Bounds parts_box(int body, const Frame& X_WO) const;
  void sweep(int body);
  /// False when cancelled.
  bool find_contacts(const core::Cancellation* cancellation);
  void find_pair(int a, int b);
  void find_parts(const Part& part_a, const Moving& ma, const Part& part_b, const Moving& mb, double range);
  void add_contacts(int a, int b, std::uint32_t part_a, std::uint32_t part_b);
  void inherit(std::size_t first, std::uint64_t key, double reach);
  double free_change(const SolverContact& contact) const;
  double free_acceleration(const SolverContact& contact) const;
  bool solve(const core::Cancellation* cancellation);
  void integrate();
  // Joints: instance_joints.cc.
  bool joint_acts(const CompiledJoint& joint) const;
  void list_joints();
  /// Where a body is at the end of what is taken of a step, with the velocities that the solver found.
  Pose end_pose(int body) const;
  std::array<double, 5> joint_errors(const CompiledJoint& joint, const SolverJoint& rows, const Pose& X_WP,
                                     const Pose& X_WC) const;
  /// Sets the solver's targets so that the joints hold at the end of the step, too. False once they do.
  bool aim_joints();
  bool solve_with_joints(const core::Cancellation* cancellation);
  void fill_bodies();
  void integrate_jointed(int object);
  void turn_tree(int object, const Quaterniond& turn, const Vector3d& about_W);
  Frame parent_frame(const CompiledJoint& joint) const;
  // Split steps: instance_impacts.cc.
  bool take_parts(const core::Cancellation* cancellation);
  /// What is taken of a step now: this many of kStepParts.
  void set_part(int parts);
  double share() const { return part_ / dt(); }
  int splits_allowed() const;
  double rim_time(const SolverContact& contact) const;
  int parts_to_impact(int left) const;
  void shorten(int parts);
  void lead_kinematic(int parts);
  void keep_pressed();
  void give_back_pressed();
  void note_overlap();
  void note_touches();
  void note_calm();
  const CompiledBody& compiled(int body) const;

  std::shared_ptr<const CompiledScene> scene_;
  ActionPlayer player_;
  std::vector<Object> objects_;
  /// Per object and robot body: they overlapped when the object came free and do not touch until they have parted.
  std::vector<std::uint8_t> parting_;
  double start_time_ = 0.0;
  std::int64_t steps_ = 0;
  std::vector<Warm> warm_;
  std::vector<Hinged> hinged_;         // in the order of the scene's joints
  std::vector<std::uint8_t> jointed_;  // by object: some joint is its
  std::vector<Touch> touches_;
  double overlap_ = 0.0;  // not in snapshots: nothing depends on it

  // Scratch of a step.
  ContactFinder finder_;
  SphereContactFinder sphere_finder_;
  ContactSolver solver_;
  SolverSettings settings_;
  double part_ = 0.0;  // s, of a step: what is taken now
  std::vector<Moving> moving_;
  std::vector<Flight> flights_;
  std::vector<Flyer> flyers_;
  std::vector<Bounds> fixed_parts_;  // of the supports, with the margin at which contacts are made
  std::vector<ContactPoint> points_;
  std::vector<SolverContact> contacts_;
  std::vector<SolverJoint> joints_;           // that act in this step
  std::vector<std::size_t> joint_ids_;        // of these, among the scene's
  std::vector<std::array<double, 5>> begun_;  // their errors at the step's beginning
  std::vector<SolverContact> found_;          // contacts before they are solved with joints
  std::vector<SolverContact> pressed_;        // in the parts of this step that are over
  std::vector<std::uint64_t> contact_keys_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_;
  std::vector<btCollisionObject*> rigid_pointers_;
  std::vector<BodyResult> results_;
  std::vector<Impact> impacts_;
  std::vector<Vector3d> footprint_;
  std::vector<Pose> poses_;
  std::vector<ActionPlayer::Released> released_;
  std::vector<ActionPlayer::Body> felt_;
  std::vector<ActionPlayer::Load> loads_;
  bool any_loaded_ = false;
  std::vector<CompiledBody> pushers_;
};

}  // namespace prescene::simulation
