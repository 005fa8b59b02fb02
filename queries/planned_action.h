// SPDX-License-Identifier: Apache-2.0
// An action some parameters of which are free, in a scene: what instances of it start from and do for given values, and
// what is in the way.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/achieve.h"
#include "prescene/belief/action_schema.h"
#include "prescene/core/parallel.h"
#include "prior.h"

namespace prescene::queries {

struct FreeParameter {
  belief::ActionParameter schema;
  double low = 0.0, high = 0.0;

  /// An angle that is searched over all of the circle.
  bool periodic() const { return schema.is_angle() && high - low >= 360.0 - 1e-9; }
  double value_of(double unit) const { return low + (high - low) * unit; }
};

class PlannedAction {
 public:
  virtual ~PlannedAction() = default;

  const std::vector<FreeParameter>& free() const { return free_; }
  const std::string& object() const { return object_; }
  const std::string& support() const { return support_; }
  /// What is simulated: the prior's scene as it is when the action begins. Its outcomes are not those that are asked.
  const std::shared_ptr<const belief::Scene>& scene() const { return scene_; }
  /// In sentences: what one should know of how the action is simulated.
  const std::vector<std::string>& remarks() const { return remarks_; }
  /// Things that are not simulated while the action's consequences are: nothing can be told of touching them.
  const std::vector<std::string>& absent() const { return absent_; }

  /// Uniform numbers that the action's own errors take, apart from what simulators draw in actions.
  virtual int noise_dimensions() const = 0;
  /// Makes the start of the prior one of the action and returns what is then done. `values` are those of free(),
  /// noise.size() == noise_dimensions(). The actions of all values are of the same kinds.
  virtual std::vector<belief::Action> begin(std::span<const double> values, std::span<const double> noise,
                                            belief::WorldState& start) const = 0;
  /// What is in the way, in words; nothing: it can be done.
  virtual std::optional<std::string> obstacle(std::span<const double> values) = 0;
  /// Where the object is let go if nothing is uncertain; of place.
  virtual std::optional<belief::Pose> goal(std::span<const double> /*values*/) const { return std::nullopt; }
  /// As a prediction takes it.
  virtual belief::Action exact(std::span<const double> values) const = 0;

 protected:
  PlannedAction(const Prior& prior, const belief::AchieveQuery& query) : prior_(prior), query_(query) {}

  /// Of a parameter of the schema: its free value, else its fixed one.
  double value(const std::string& name, std::span<const double> values) const;

  const Prior& prior_;
  const belief::AchieveQuery& query_;
  std::vector<FreeParameter> free_;
  std::vector<belief::ParameterValue> fixed_;  // of all others, in the order of the schema
  std::string object_, support_;
  std::shared_ptr<const belief::Scene> scene_;
  std::vector<std::string> remarks_, absent_;

  friend core::Result<std::unique_ptr<PlannedAction>> plan_action(const Prior&, const belief::AchieveQuery&,
                                                                  const belief::Outcome&, core::ThreadPool&);
};

/// `wanted` is complete. `prior` and `query` must outlive the plan. Fails where a name is unknown, a range lies beyond
/// the schema's bounds, the object is not held, or nothing is free.
core::Result<std::unique_ptr<PlannedAction>> plan_action(const Prior& prior, const belief::AchieveQuery& query,
                                                         const belief::Outcome& wanted, core::ThreadPool& pool);

/// Where parameters are without a range of the question or the schema: name, value, range.
struct SceneValue {
  std::string name;
  double value = 0.0, low = 0.0, high = 0.0;
};
/// The kinds of actions. `index` is that of the object in the prior's scene.
core::Result<std::unique_ptr<PlannedAction>> plan_place(const Prior& prior, const belief::AchieveQuery& query,
                                                        const belief::Outcome& wanted, std::size_t index,
                                                        core::ThreadPool& pool, std::vector<SceneValue>& scene_values);
core::Result<std::unique_ptr<PlannedAction>> plan_push(const Prior& prior, const belief::AchieveQuery& query,
                                                       std::size_t index, core::ThreadPool& pool,
                                                       std::vector<SceneValue>& scene_values);
core::Result<std::unique_ptr<PlannedAction>> plan_bump(const Prior& prior, const belief::AchieveQuery& query,
                                                       std::size_t index, std::vector<SceneValue>& scene_values);
core::Result<std::unique_ptr<PlannedAction>> plan_release(const Prior& prior, const belief::AchieveQuery& query,
                                                          std::size_t index, std::vector<SceneValue>& scene_values);

/// The scene's own release of the object.
const belief::Action* own_release(const belief::Scene& scene, const std::string& object);
/// Of an axis-aligned direction: lowest and highest z of a mesh turned by a rotation, m.
std::pair<double, double> heights_of(const geometry::TriangleMesh& mesh, const geometry::Quaterniond& rotation);

}  // namespace prescene::queries
