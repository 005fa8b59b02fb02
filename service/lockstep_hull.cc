// SPDX-License-Identifier: Apache-2.0
#include "lockstep_hull.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/similarity.h"
#include "prescene/simulation/simplified_polytope.h"

namespace prescene::service {
namespace {

using belief::MeshUse;

// Of the box's diagonal. A ball of 64 vertices stays behind by more, a bottle by about half of it.
constexpr double kWorthARemark = 0.01;

/// The steppers round edges by this much at least, m; more in scenes of large things (simulation/similarity.h).
double edge_rounding(const belief::Scene& scene) {
  return simulation::similarity_of(scene).length * simulation::MechanicsOptions{}.edge_rounding;
}

belief::Scene alone(const belief::ObjectModel& model) {
  belief::Scene scene;
  scene.models = {model};
  scene.objects.emplace_back();
  return scene;
}

/// As the stepper makes it (simulation/lockstep/convex_parts.cc).
core::Result<simulation::RoundedPolytope> stepper_hull(const simulation::ConvexPolytope& hull, double rounding) {
  return simulation::rounded(hull, simulation::rounded_edge(rounding, hull.inner_radius()), {});
}

/// m: the largest of the hulls that the mesh collides as. 0 for other uses, for what `decompose` makes, which has few
/// vertices and takes seconds, and for what no stepper takes.
double left_behind(const belief::MeshShape& shape, double rounding, simulation::ShapeStore& shapes) {
  if (!shape.mesh || (shape.use != MeshUse::kConvexHull && shape.use != MeshUse::kConvexParts)) return 0.0;
  const auto hulls = shapes.convex_parts(shape.mesh, shape.use, {});
  if (!hulls) return 0.0;
  double largest = 0.0;
  for (const simulation::ConvexPolytope& hull : **hulls) {
    const auto rounded = stepper_hull(hull, rounding);
    if (rounded) largest = std::max(largest, rounded->error);
  }
  return largest;
}

/// Looks at the bodies of a file, one after the other.
class HullRemarks {
 public:
  HullRemarks(std::string path, double rounding, interfaces::FileReport& report)
      : path_(std::move(path)), rounding_(rounding), report_(report) {}

  template <class Body>
  void look_at(const std::string& key, const Body& body) {
    double error = 0.0, share = 0.0;
    for (const belief::CollisionShape& shape : body.collision) {
      const auto* mesh = std::get_if<belief::MeshShape>(&shape);
      if (mesh == nullptr) continue;
      const double behind = left_behind(*mesh, std::max(rounding_, body.contact.edge_radius), shapes_);
      if (behind <= error) continue;
      error = behind;
      share = error / geometry::facts_of(mesh->mesh).box.diagonal().norm();
    }
    if (share <= kWorthARemark) return;
    report_.remarks.push_back(
        {path_, 0, 0, key,
         "in lockstep its convex hull is simplified to at most 64 vertices and stays up to " +
             core::fixed_text(1e3 * error, 2) + " mm behind, " + core::fixed_text(100.0 * share, 1) +
             " % of the mesh's diagonal",
         "if that matters, describe it as a sphere, cylinder, capsule or cone, or choose '--stepper bullet', which "
         "takes hulls of up to 1500 vertices as they are"});
  }

 private:
  std::string path_;
  double rounding_;
  interfaces::FileReport& report_;
  simulation::ShapeStore shapes_;
};

}  // namespace

core::Result<LockstepHull> lockstep_hull(const geometry::TriangleMesh& hull) {
  const auto mesh = std::make_shared<geometry::TriangleMesh>(hull);
  belief::ObjectModel model;
  model.collision = {belief::MeshShape{mesh, geometry::Pose::identity(), MeshUse::kConvexHull}};
  simulation::ShapeStore shapes;
  PRESCENE_TRY(const auto hulls, shapes.convex_parts(mesh, MeshUse::kConvexHull, {}));
  PRESCENE_TRY(const simulation::RoundedPolytope rounded, stepper_hull(hulls->front(), edge_rounding(alone(model))));
  LockstepHull found{hull.vertices.size(), hull.vertices.size(), rounded.error};
  if (found.error > 0.0) found.kept = rounded.core.vertices.size();
  return found;
}

void remark_on_simplified_hulls(const belief::Scene& scene, const std::string& path, interfaces::FileReport& report) {
  HullRemarks remarks(path, edge_rounding(scene), report);
  for (const belief::ObjectModel& model : scene.models) remarks.look_at("models." + model.name, model);
  for (const belief::Support& support : scene.supports) remarks.look_at("supports." + support.name, support);
  for (const belief::KinematicBody& body : scene.robot) remarks.look_at("robot." + body.name, body);
}

void remark_on_simplified_hulls(const belief::ObjectModel& model, const std::string& path,
                                interfaces::FileReport& report) {
  HullRemarks(path, edge_rounding(alone(model)), report).look_at("model", model);
}

}  // namespace prescene::service
