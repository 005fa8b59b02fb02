// SPDX-License-Identifier: Apache-2.0
// What plans of the scene's own actions share (own_action.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "own_action.h"
#include "prescene/geometry/angles.h"

namespace prescene::queries {

/// About a value: a normal distribution keeps how it scatters, all else becomes certain.
inline belief::ScalarDistribution about(const belief::ScalarDistribution& own, double value) {
  const auto* normal = std::get_if<belief::NormalScalar>(&own);
  if (normal == nullptr) return belief::FixedScalar{value};
  belief::NormalScalar shifted = *normal;
  shifted.mean = value;
  return shifted;
}

class OwnActionPlan : public PlannedAction {
 public:
  struct Own {
    const Prior& prior;
    const belief::AchieveQuery& query;
    std::size_t index = 0;  ///< Of the object in the prior's scene.
    belief::Action action = {};
    std::optional<std::size_t> at = {};  ///< Its place among the scene's actions; nothing: it is added to them.
  };
  explicit OwnActionPlan(const Own& own)
      : PlannedAction(own.prior, own.query), index_(own.index), own_(own.action), at_(own.at) {
    scene_ = prior_.scene;
    name_ = scene_->objects[index_].name;
  }
  /// What the parameters are in the scene, and that it has what those of the question are about.
  virtual core::Status prepare(std::vector<SceneValue>& scene_values) = 0;

  int noise_dimensions() const override { return belief::dimensions(query_.errors.delay); }
  std::vector<belief::Action> begin(std::span<const double> values, std::span<const double> noise,
                                    belief::WorldState& start) const override {
    std::vector<belief::Action> actions = scene_->actions;
    lead_up_to(values, start, actions);
    belief::Action action = exact(values);
    action.time += belief::draw(query_.errors.delay, noise);
    if (at_)
      actions[*at_] = std::move(action);
    else
      actions.push_back(std::move(action));
    return actions;
  }
  std::optional<std::string> obstacle(std::span<const double>) override { return std::nullopt; }

 protected:
  /// What has to change before the action begins.
  virtual void lead_up_to(std::span<const double>, belief::WorldState&, std::vector<belief::Action>&) const {}

  /// Free, or given in the question.
  bool chosen(const std::string& name) const {
    const auto named = [&](const auto& one) { return one.name == name || one.name + "_deg" == name; };
    return std::ranges::any_of(query_.fixed, named) || std::ranges::any_of(query_.free, [&](const auto& range) {
             return named(range) || (range.name == "position" && (name == "x" || name == "y"));
           });
  }
  void choose(const char* name, std::span<const double> values, double& what) const {
    if (chosen(name)) what = value(name, values);
  }
  void choose(const char* name, std::span<const double> values, belief::ScalarDistribution& what) const {
    if (chosen(name)) what = about(what, value(name, values));
  }
  void choose_angle(const char* name, std::span<const double> values, double& what) const {
    if (chosen(name)) what = geometry::kDegree * value(name, values);
  }
  void choose_axis(std::span<const double> values, geometry::Vector3d& axis_W) const {
    if (!chosen("axis_deg")) return;
    const double angle = geometry::kDegree * value("axis_deg", values);
    axis_W = {std::cos(angle), std::sin(angle), 0.0};
  }
  belief::Action timed(std::span<const double> values) const {
    belief::Action action = own_;
    choose("time", values, action.time);
    return action;
  }

  /// `time`: the action keeps its place among what the scene does with the object. Fails where the question has it
  /// elsewhere: nothing would hold the object yet, say, or its hand would be on its way.
  core::Status add_time(std::vector<SceneValue>& scene_values) const;
  // Ranges about what the scene does: forces, speeds and lengths by these factors.
  static constexpr double kLeastFactor = 0.25, kMostFactor = 4.0;
  static void add_size(const char* name, double own, std::vector<SceneValue>& scene_values) {
    scene_values.push_back({name, own, kLeastFactor * own, kMostFactor * own});
  }
  /// The same, within the ends of the scene's normal distribution: beyond them another force would be drawn than was
  /// chosen. Fails where the question has one there.
  core::Status add_force(const char* name, const belief::ScalarDistribution& own,
                         std::vector<SceneValue>& scene_values);
  static void add_direction(const char* name, const geometry::Vector3d& own, std::vector<SceneValue>& scene_values) {
    scene_values.push_back({name, std::atan2(own.y(), own.x()) / geometry::kDegree, -180.0, 180.0});
  }

  /// The last of the scene's carries before its own action.
  std::optional<std::size_t> carry_before() const {
    std::optional<std::size_t> last;
    for (std::size_t i = 0; i < (at_ ? *at_ : scene_->actions.size()); ++i) {
      const auto* transport = std::get_if<belief::Transport>(&scene_->actions[i].what);
      if (transport != nullptr && transport->object == name_) last = i;
    }
    return last;
  }
  /// From when until when the action may begin, s, and what the scene does at these ends; nothing: there is no end.
  struct Slot {
    double from = 0.0, until = std::numeric_limits<double>::infinity();
    const belief::Action* before = nullptr;
    const belief::Action* after = nullptr;
  };
  Slot slot() const;
  /// Where the object is, if nothing is uncertain, when its own action begins, and that carry, if there is one, is
  /// over.
  belief::Pose begin_pose() const;

  std::size_t index_;
  std::string name_;
  belief::Action own_;
  std::optional<std::size_t> at_;
};

std::unique_ptr<OwnActionPlan> make_tilt_plan(const OwnActionPlan::Own& own);
std::unique_ptr<OwnActionPlan> make_pour_plan(const OwnActionPlan::Own& own);
std::unique_ptr<OwnActionPlan> make_insert_plan(const OwnActionPlan::Own& own);
std::unique_ptr<OwnActionPlan> make_transport_plan(const OwnActionPlan::Own& own);

}  // namespace prescene::queries
