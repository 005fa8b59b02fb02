// SPDX-License-Identifier: Apache-2.0
// What a hand does with what it holds: tilting, pouring, inserting, carrying.
#include <limits>

#include "own_action_plan.h"
#include "prescene/core/text.h"

namespace prescene::queries {
namespace {

using belief::Action;
using belief::Pose;
using geometry::Vector3d;

// Ranges about the scene's own place and height, m.
constexpr double kAside = 0.02, kAbove = 0.1;

/// Displaced by a turn about the origin of the object, and by a shift; it scatters as before.
belief::PoseDistribution displaced(belief::PoseDistribution own, const geometry::Quaterniond& turn,
                                   const Vector3d& shift) {
  struct Displace {
    const geometry::Quaterniond& turn;
    const Vector3d& shift;
    Pose of(Pose X) const {
      X.rotation = turn * X.rotation;
      X.translation += shift;
      return X;
    }
    void scalar(belief::ScalarDistribution& x, double by) const {
      struct Shift {
        double by;
        void operator()(belief::FixedScalar& s) const { s.value += by; }
        void operator()(belief::NormalScalar& s) const { s.mean += by, s.low += by, s.high += by; }
        void operator()(belief::UniformScalar& s) const { s.low += by, s.high += by; }
        void operator()(belief::SampledScalar& s) const {
          for (double& sample : s.samples) sample += by;
        }
      };
      std::visit(Shift{by}, x);
    }
    void operator()(belief::FixedPose& pose) const { pose.X_WO = of(pose.X_WO); }
    void operator()(belief::NormalPose& pose) const { pose.mean = of(pose.mean); }
    void operator()(belief::BoxPose& pose) const {
      pose.rotation = turn * pose.rotation;
      scalar(pose.position.x, shift.x());
      scalar(pose.position.y, shift.y());
      scalar(pose.position.z, shift.z());
    }
    void operator()(belief::SampledPose& pose) const {
      for (Pose& sample : pose.samples) sample = of(sample);
    }
  };
  std::visit(Displace{turn, shift}, own);
  return own;
}

/// The scene's carry that brings an object to where its own action begins.
struct Carry {
  std::size_t at = 0;  // among the scene's actions
  Pose X_WO;           // where it ends
  Pose X_since;        // what hands do with the object from then on, until its own action begins at X_since * X_WO

  Carry(const belief::Scene& scene, std::size_t action, const Pose& X_begin)
      : at(action),
        X_WO(belief::mean(std::get<belief::Transport>(scene.actions[action].what).X_WO)),
        X_since(X_begin * X_WO.inverse()) {}

  /// So that the own action begins at X_begin.
  void lead_to(const Pose& X_begin, std::vector<Action>& actions) const {
    auto& transport = std::get<belief::Transport>(actions[at].what);
    const Pose X_end = X_since.inverse() * X_begin;
    transport.X_WO = displaced(std::move(transport.X_WO), X_end.rotation * X_WO.rotation.conjugate(),
                               X_end.translation - X_WO.translation);
  }
};

class TiltPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::Tilt>(own_.what);
    scene_values.push_back({"angle_deg", own.angle / geometry::kDegree, -90.0, 90.0});
    add_direction("axis_deg", own.axis_W, scene_values);
    scene_values.push_back({"duration", own.duration, kLeastFactor * own.duration, kMostFactor * own.duration});
    return add_time(scene_values);
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& tilt = std::get<belief::Tilt>(action.what);
    choose_angle("angle_deg", values, tilt.angle);
    choose_axis(values, tilt.axis_W);
    choose("duration", values, tilt.duration);
    return action;
  }
};

class PourPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::Pour>(own_.what);
    const auto carry = carry_before();
    if (chosen("height") && !carry)
      return core::invalid_input("height: the scene carries '" + name_ +
                                 "' nowhere before it is poured out, so that there is no height to choose: give the "
                                 "scene a transport of it, or leave the height out");
    X_begin_ = begin_pose();
    if (carry) carry_.emplace(*scene_, *carry, X_begin_);
    const double z = X_begin_.translation.z();
    scene_values.push_back({"height", z, z - kAbove, z + kAbove});
    scene_values.push_back({"angle_deg", own.angle / geometry::kDegree, 0.0, 180.0});
    add_direction("axis_deg", own.axis_W, scene_values);
    add_size("duration", own.duration, scene_values);
    return add_time(scene_values);
  }
  void lead_up_to(std::span<const double> values, belief::WorldState&, std::vector<Action>& actions) const override {
    if (const auto X_goal = goal(values)) carry_->lead_to(*X_goal, actions);
  }
  std::optional<Pose> goal(std::span<const double> values) const override {
    if (!chosen("height")) return std::nullopt;
    Pose X_WO = X_begin_;
    X_WO.translation.z() = value("height", values);
    return X_WO;
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& pour = std::get<belief::Pour>(action.what);
    choose_angle("angle_deg", values, pour.angle);
    choose_axis(values, pour.axis_W);
    choose("duration", values, pour.duration);
    return action;
  }

 private:
  std::optional<Carry> carry_;
  Pose X_begin_;
};

class InsertPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::Insert>(own_.what);
    X_begin_ = begin_pose();
    if (const auto carry = carry_before()) carry_.emplace(*scene_, *carry, X_begin_);
    moves_ = chosen("x") || chosen("y") || chosen("yaw_deg");
    if (moves_ && !carry_ && !scene_->objects[index_].held_by)
      return core::invalid_input("x, y, yaw_deg: '" + name_ +
                                 "' is not held from the start and the scene carries it nowhere before it is inserted: "
                                 "give the scene a transport of it, or leave them out");
    if (moves_ && !carry_)
      remarks_.push_back("'" + name_ + "' is held at the place that is tried from the start; the body of " +
                         *scene_->objects[index_].held_by + " begins where the scene has it.");
    const Vector3d& p = X_begin_.translation;
    scene_values.push_back({"x", p.x(), p.x() - kAside, p.x() + kAside});
    scene_values.push_back({"y", p.y(), p.y() - kAside, p.y() + kAside});
    PRESCENE_RETURN_IF_ERROR(add_force("force", own.force, scene_values));
    PRESCENE_RETURN_IF_ERROR(add_force("torque", own.torque, scene_values));
    add_size("distance", own.distance, scene_values);
    add_size("duration", own.duration, scene_values);
    return add_time(scene_values);
  }
  void lead_up_to(std::span<const double> values, belief::WorldState& start,
                  std::vector<Action>& actions) const override {
    if (!moves_) return;
    const Pose X_goal = *goal(values);
    if (carry_) {
      carry_->lead_to(X_goal, actions);
      return;
    }
    // What is not known of how it lies in the hand stays as it is. The hand's own motion until then is undone and done.
    const Pose X_likeliest = prior_.likeliest.objects[index_].X_WO;
    const Pose X_motion = X_begin_ * X_likeliest.inverse();
    Pose& X_WO = start.objects[index_].X_WO;
    X_WO = geometry::normalized(X_motion.inverse() * X_goal * X_begin_.inverse() * X_motion * X_WO);
  }
  std::optional<Pose> goal(std::span<const double> values) const override {
    if (!moves_) return std::nullopt;
    Pose X_WO = X_begin_;
    choose("x", values, X_WO.translation.x());
    choose("y", values, X_WO.translation.y());
    double yaw = 0.0;
    choose_angle("yaw_deg", values, yaw);
    X_WO.rotation = (geometry::exp_rotation(yaw * Vector3d::UnitZ()) * X_begin_.rotation).normalized();
    return X_WO;
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    auto& insert = std::get<belief::Insert>(action.what);
    choose("force", values, insert.force);
    choose("torque", values, insert.torque);
    choose("distance", values, insert.distance);
    choose("duration", values, insert.duration);
    return action;
  }

 private:
  std::optional<Carry> carry_;
  Pose X_begin_;
  bool moves_ = false;
};

class TransportPlan final : public OwnActionPlan {
 public:
  using OwnActionPlan::OwnActionPlan;
  core::Status prepare(std::vector<SceneValue>& scene_values) override {
    const auto& own = std::get<belief::Transport>(own_.what);
    way_ = (belief::mean(own.X_WO).translation - begin_pose().translation).norm();
    if (!(way_ > 1e-6))
      return core::invalid_input("'" + name_ +
                                 "' is not carried anywhere by the scene's transport, so that its speed changes "
                                 "nothing: give the transport another pose");
    for (const Action& action : scene_->actions)
      if (action.time > own_.time && belief::object_of(action) == name_) next_ = std::min(next_, action.time);
    add_size("speed", way_ / own.duration, scene_values);
    return add_time(scene_values);
  }
  std::optional<std::string> obstacle(std::span<const double> values) override {
    const Action action = exact(values);
    if (action.time + std::get<belief::Transport>(action.what).duration <= next_ + 1e-9) return std::nullopt;
    return name_ + " is still on its way when the scene's next action with it begins";
  }
  Action exact(std::span<const double> values) const override {
    Action action = timed(values);
    if (chosen("speed")) std::get<belief::Transport>(action.what).duration = way_ / value("speed", values);
    return action;
  }

 private:
  double way_ = 0.0, next_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::unique_ptr<OwnActionPlan> make_tilt_plan(const OwnActionPlan::Own& own) { return std::make_unique<TiltPlan>(own); }
std::unique_ptr<OwnActionPlan> make_pour_plan(const OwnActionPlan::Own& own) { return std::make_unique<PourPlan>(own); }
std::unique_ptr<OwnActionPlan> make_insert_plan(const OwnActionPlan::Own& own) {
  return std::make_unique<InsertPlan>(own);
}
std::unique_ptr<OwnActionPlan> make_transport_plan(const OwnActionPlan::Own& own) {
  return std::make_unique<TransportPlan>(own);
}

}  // namespace prescene::queries
