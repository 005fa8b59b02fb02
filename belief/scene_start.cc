// SPDX-License-Identifier: Apache-2.0
// Drawing the start of a scene. The coordinates of a point are dealt out block by block, a block being one distribution
// of one object; the order of the blocks is the order of how wide they usually are.
#include <algorithm>
#include <functional>
#include <numeric>

#include "prescene/belief/physical_belief.h"
#include "prescene/belief/scene.h"
#include "prescene/core/check.h"

namespace prescene::belief {
namespace {

// Objects, the most uncertain position first.
std::vector<std::size_t> objects_by_spread(const Scene& scene) {
  std::vector<double> spread;
  for (const SceneObject& object : scene.objects)
    spread.push_back(covariance(object.pose).bottomRightCorner<3, 3>().trace());
  std::vector<std::size_t> order(scene.objects.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return spread[a] > spread[b]; });
  return order;
}

// Deals out consecutive coordinates.
class Dealer {
 public:
  explicit Dealer(std::span<const double> uniforms) : rest_(uniforms) {}
  template <class Distribution>
  auto draw_from(const Distribution& distribution) {
    const auto count = static_cast<std::size_t>(dimensions(distribution));
    PRESCENE_CHECK(count <= rest_.size());
    const auto mine = rest_.first(count);
    rest_ = rest_.subspan(count);
    return draw(distribution, mine);
  }
  bool done() const { return rest_.empty(); }

 private:
  std::span<const double> rest_;
};

/// What hangs on an object was drawn about that object's mean: it goes with it to where it was drawn.
void move_with_parents(const Scene& scene, WorldState& state) {
  for (const int j : joint_order(scene)) {
    const Joint& joint = scene.joints[static_cast<std::size_t>(j)];
    const std::optional<int> parent = find_object(scene, joint.parent);
    if (!parent) continue;
    const auto p = static_cast<std::size_t>(*parent);
    const Pose X_WP_mean = mean(scene.objects[p].pose);
    if (state.objects[p].X_WO == X_WP_mean) continue;
    Pose& X_WC = state.objects[static_cast<std::size_t>(*find_object(scene, joint.child))].X_WO;
    X_WC = geometry::normalized(state.objects[p].X_WO * (X_WP_mean.inverse() * X_WC));
  }
  obey_joints(scene, state);
}

MotionMode start_mode(const SceneObject& object) { return object.held_by ? MotionMode::kHeld : MotionMode::kMoving; }

}  // namespace

int start_dimensions(const Scene& scene) {
  int sum = 0;
  for (const SceneObject& object : scene.objects) {
    const ObjectModel& model = scene.model_of(object);
    sum += dimensions(object.pose) + dimensions(object.twist) + dimensions(model.contact.friction) +
           dimensions(model.contact.restitution) + dimensions(model.mass) + dimensions(model.center_of_mass);
    if (model.contact.impact_friction) sum += dimensions(*model.contact.impact_friction);
  }
  for (const Joint& joint : scene.joints) sum += dimensions(joint.friction) + dimensions(joint.damping);
  return sum;
}

WorldState draw_start(const Scene& scene, std::span<const double> uniforms) {
  WorldState state;
  state.objects.resize(scene.objects.size());
  const std::vector<std::size_t> order = objects_by_spread(scene);
  Dealer dealer(uniforms);
  const auto for_each = [&](const std::function<void(const SceneObject&, const ObjectModel&, ObjectState&)>& deal) {
    for (const std::size_t i : order) deal(scene.objects[i], scene.model_of(scene.objects[i]), state.objects[i]);
  };
  for_each([&](const SceneObject& object, const ObjectModel&, ObjectState& to) {
    to.X_WO = dealer.draw_from(object.pose);
    to.mode = start_mode(object);
  });
  for_each([&](const SceneObject& object, const ObjectModel&, ObjectState& to) {
    to.V_WO = dealer.draw_from(object.twist);
  });
  for_each([&](const SceneObject&, const ObjectModel& model, ObjectState& to) {
    to.physical.friction = dealer.draw_from(model.contact.friction);
  });
  for_each([&](const SceneObject&, const ObjectModel& model, ObjectState& to) {
    to.physical.restitution = dealer.draw_from(model.contact.restitution);
  });
  for_each([&](const SceneObject&, const ObjectModel& model, ObjectState& to) {
    to.physical.mass = dealer.draw_from(model.mass);
  });
  for_each([&](const SceneObject&, const ObjectModel& model, ObjectState& to) {
    to.physical.center_of_mass = dealer.draw_from(model.center_of_mass);
  });
  for_each([&](const SceneObject&, const ObjectModel& model, ObjectState& to) {
    to.physical.impact_friction =
        model.contact.impact_friction ? dealer.draw_from(*model.contact.impact_friction) : to.physical.friction;
  });
  for (const Joint& joint : scene.joints) {
    JointParameters& to = state.joints.emplace_back();
    to.type = joint.type;
    to.friction = dealer.draw_from(joint.friction);
    to.damping = dealer.draw_from(joint.damping);
  }
  PRESCENE_CHECK(dealer.done());
  move_with_parents(scene, state);
  return state;
}

WorldState mean_start(const Scene& scene) {
  WorldState state;
  for (const SceneObject& object : scene.objects) {
    const ObjectModel& model = scene.model_of(object);
    ObjectState to;
    to.X_WO = mean(object.pose);
    to.V_WO = mean(object.twist);
    to.mode = start_mode(object);
    to.physical = mean_physical(model);
    state.objects.push_back(to);
  }
  for (const Joint& joint : scene.joints)
    state.joints.push_back({joint.type, mean(joint.friction), mean(joint.damping)});
  obey_joints(scene, state);
  return state;
}

}  // namespace prescene::belief
