// SPDX-License-Identifier: Apache-2.0
// Actual belief: X*_t ~ P(X_t | U_0:t-1, Z_0:t, C_0:t), as it stands in the snapshot.
#include "where.h"

namespace prescene::queries {
namespace {

core::Status no_such(const std::string& name, const std::string& known) {
  return core::not_found("there is no object '" + name +
                         "': " + (known.empty() ? "there are none at all" : "those known are " + known));
}

bool is_asked(const belief::WhereQuery& query, const std::string& name) {
  return !query.object || *query.object == name;
}

/// Those of the object that is asked for.
std::vector<belief::JointEstimate> joints_of(const belief::Scene& scene, std::vector<belief::JointEstimate> all,
                                             const belief::WhereQuery& query) {
  std::erase_if(all, [&](const belief::JointEstimate& estimate) {
    const belief::Joint& joint = scene.joints[static_cast<std::size_t>(*belief::find_joint(scene, estimate.joint))];
    return !is_asked(query, joint.child) && !is_asked(query, joint.parent);
  });
  return all;
}

}  // namespace

core::Result<belief::WhereAnswer> where(const belief::Belief& belief, const belief::WhereQuery& query) {
  belief::WhereAnswer answer;
  std::string known;
  for (const belief::ObjectBelief& object : belief.objects) {
    known += (known.empty() ? "" : ", ") + object.name;
    if (!is_asked(query, object.name) || object.particles.empty()) continue;
    const belief::ObjectModel& model = belief::model_of(belief, object);
    answer.items.push_back({object.name, model.name, belief::estimate(belief, object), object.state, object.existence,
                            belief::parameter_estimates(model, object.physics), object.physics.lessons,
                            object.physics.learned_ns, belief::alternative_poses(belief, object)});
  }
  if (query.object && answer.items.empty()) return no_such(*query.object, known);
  if (belief.scene) answer.joints = joints_of(*belief.scene, belief::joint_estimates(belief), query);
  return answer;
}

core::Result<belief::WhereAnswer> where(const belief::Scene& scene, const belief::WhereQuery& query) {
  belief::WhereAnswer answer;
  std::string known;
  for (const belief::SceneObject& object : scene.objects) {
    known += (known.empty() ? "" : ", ") + object.name;
    if (!is_asked(query, object.name)) continue;
    belief::ObjectEstimate estimate;
    estimate.mean = estimate.mode = belief::mean(object.pose);
    estimate.covariance = belief::covariance(object.pose);
    estimate.twist = belief::mean(object.twist);
    estimate.motion = object.held_by ? belief::MotionMode::kHeld : belief::MotionMode::kMoving;
    // Nothing has been seen: the priors are all that there is.
    answer.items.push_back({object.name, scene.model_of(object).name, estimate, belief::TrackState::kUnseen, 1.0,
                            belief::parameter_estimates(scene.model_of(object), {})});
  }
  if (query.object && answer.items.empty()) return no_such(*query.object, known);
  answer.joints = joints_of(scene, belief::joint_estimates(scene), query);
  return answer;
}

}  // namespace prescene::queries
