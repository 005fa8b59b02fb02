// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/mechanics_hash.h"

#include "prescene/core/hash.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::simulation {
namespace {

class MechanicsHasher {
 public:
  template <class T>
  void value(T v) {
    hasher_.value(v);
  }
  void text(const std::string& v) { hasher_.text(v); }
  template <class Matrix>
  void matrix(const Matrix& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) value(m.data()[i]);
  }
  void pose(const geometry::Pose& X) {
    matrix(X.rotation.coeffs());
    matrix(X.translation);
  }

  void operator()(const geometry::Sphere& s) { value(s.radius); }
  void operator()(const geometry::BoxShape& s) { matrix(s.size); }
  template <class Round>
  void operator()(const Round& s) {  // cylinder, capsule, cone
    value(s.radius);
    value(s.length);
  }
  void shapes(const std::vector<belief::CollisionShape>& all) {
    value(all.size());
    for (const belief::CollisionShape& shape : all) {
      value(shape.index());
      if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
        value(primitive->primitive.index());
        std::visit(*this, primitive->primitive);
        pose(primitive->X_OS);
        continue;
      }
      const auto& mesh = std::get<belief::MeshShape>(shape);
      if (mesh.mesh) value(geometry::facts_of(mesh.mesh).content);
      pose(mesh.X_OS);
      value(mesh.use);
      value(mesh.spheres.count);
      value(mesh.spheres.edge_fidelity);
    }
  }
  void contact(const belief::ContactProperties& contact) {
    value(belief::mean(contact.friction));
    value(contact.impact_friction ? belief::mean(*contact.impact_friction) : -1.0);
    value(belief::mean(contact.restitution));
    value(contact.rolling_friction);
    value(contact.edge_radius);
  }

  void options(const MechanicsOptions& options) {
    value(options.step);
    value(options.solver_iterations);
    value(options.overlap_recovery);
    value(options.restitution_speed);
    value(options.impact_speed);
    value(options.edge_rounding);
    value(options.touching_distance);
    value(options.contact_merge_time);
    value(options.rest.energy);
    value(options.rest.time);
    value(options.decomposition.concavity);
    value(options.decomposition.min_parts);
    value(options.decomposition.max_part_vertices);
  }

  void operator()(const belief::Release& release) {
    text(release.object);
    matrix(release.retreat);
    value(release.retreat_duration);
  }
  void operator()(const belief::Place& place) {
    text(place.object);
    value(place.duration);
  }
  void operator()(const belief::Push& push) {
    matrix(push.from);
    matrix(push.to);
    value(push.duration);
    value(push.radius);
  }
  void operator()(const belief::Pour& pour) {
    text(pour.container);
    matrix(pour.axis_W);
    value(pour.angle);
    value(pour.duration);
  }
  void operator()(const belief::Grasp& grasp) {
    text(grasp.object);
    text(grasp.hand);
    if (grasp.grip) value(grasp.grip->pad_length);
  }
  void operator()(const belief::Bump& bump) {
    text(bump.object);
    point(bump.point_O);
  }
  void operator()(const belief::Tilt& tilt) {
    text(tilt.object);
    matrix(tilt.axis_W);
    value(tilt.angle);
    matrix(tilt.pivot_O);
    value(tilt.duration);
  }
  void operator()(const belief::Pull& pull) {
    text(pull.object);
    matrix(pull.by);
    value(pull.duration);
    point(pull.point_O);
  }
  void operator()(const belief::MoveJoint& move) {
    text(move.joint);
    value(move.to);
    value(move.duration);
    point(move.handle_C);
  }
  void operator()(const belief::Insert& insert) {
    text(insert.object);
    matrix(insert.axis_W);
    value(insert.distance);
    value(insert.duration);
  }
  void point(const std::optional<geometry::Vector3d>& p) {
    value(p.has_value());
    if (p) matrix(*p);
  }
  void operator()(const belief::Transport& transport) {
    text(transport.object);
    value(transport.duration);
  }

  std::uint64_t digest() const { return hasher_.digest(); }

 private:
  core::Hasher hasher_;
};

}  // namespace

std::uint64_t mechanics_hash(const belief::Scene& scene, const MechanicsOptions& options) {
  MechanicsHasher hasher;
  hasher.options(options);
  hasher.matrix(scene.gravity_W);
  hasher.value(scene.objects.size());
  for (const belief::SceneObject& object : scene.objects) {
    const belief::ObjectModel& model = scene.model_of(object);
    hasher.text(object.name);
    hasher.text(object.held_by.value_or(""));
    hasher.shapes(model.collision);
    hasher.matrix(model.unit_inertia);
    hasher.value(model.contact.rolling_friction);
    hasher.value(model.contact.edge_radius);
  }
  hasher.value(scene.supports.size());
  for (const belief::Support& support : scene.supports) {
    hasher.shapes(support.collision);
    hasher.pose(support.X_WS);
    hasher.contact(support.contact);
  }
  hasher.value(scene.robot.size());
  for (const belief::KinematicBody& body : scene.robot) {
    hasher.text(body.name);
    hasher.shapes(body.collision);
    hasher.contact(body.contact);
    hasher.value(body.timeline.size());
    for (const belief::KinematicBody::Waypoint& waypoint : body.timeline) {
      hasher.value(waypoint.time);
      hasher.pose(waypoint.X_WG);
    }
  }
  for (const belief::Joint& joint : scene.joints) {
    hasher.text(joint.parent);
    hasher.text(joint.child);
    hasher.value(joint.type);
    hasher.matrix(joint.axis_P);
    hasher.matrix(joint.anchor_P);
    hasher.pose(joint.X_PC0);
    hasher.value(joint.low);
    hasher.value(joint.high);
  }
  return hasher.digest();
}

std::uint64_t mechanics_hash(const std::vector<belief::Action>& actions, const core::RandomStream& stream) {
  MechanicsHasher hasher;
  const std::vector<DrawnAction> drawn = draw_actions(actions, stream);
  for (std::size_t i = 0; i < actions.size(); ++i) {
    hasher.value(actions[i].time);
    hasher.value(actions[i].what.index());
    std::visit([&](const auto& what) { hasher(what); }, actions[i].what);
    hasher.pose(drawn[i].goal);
    hasher.matrix(drawn[i].disturbance.angular);
    hasher.matrix(drawn[i].disturbance.linear);
    hasher.value(drawn[i].sideways);
    hasher.matrix(drawn[i].impulse);
    hasher.value(drawn[i].force);
    hasher.value(drawn[i].torque);
    hasher.value(drawn[i].friction.value_or(-1.0));
  }
  return hasher.digest();
}

}  // namespace prescene::simulation
