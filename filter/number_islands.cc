// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "frame_step.h"

namespace prescene::filter {

void number_islands(double gap, MeshCache& meshes, belief::Belief& belief) {
  struct Body {
    rendering::MeshHandle mesh;
    Pose X_WO;
    geometry::Box box;
  };
  std::vector<Body> bodies;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const belief::ObjectModel& model = model_of(belief, i);
    Body body{meshes.get(model.visual, model.collision, MeshDetail::kLikelihood),
              belief::heaviest(belief.objects[i].particles).X_WO,
              {}};
    for (const auto& vertex : body.mesh->vertices) body.box.extend(vertex.cast<double>());
    body.box.extend((body.box.max().array() + gap).matrix());
    body.box.extend((body.box.min().array() - gap).matrix());
    bodies.push_back(std::move(body));
  }
  // Near enough for what shares a set of particles: a vertex of one inside the other's box.
  const auto reaches_into = [](const Body& a, const Body& b) {
    const Pose X_BA = b.X_WO.inverse() * a.X_WO;
    return std::any_of(a.mesh->vertices.begin(), a.mesh->vertices.end(),
                       [&](const auto& vertex) { return b.box.contains(X_BA * vertex.template cast<double>()); });
  };
  for (std::size_t i = 0; i < belief.objects.size(); ++i) belief.objects[i].island = static_cast<int>(i);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    for (std::size_t j = i + 1; j < bodies.size(); ++j) {
      const double reach =
          static_cast<double>(bodies[i].mesh->radius) + static_cast<double>(bodies[j].mesh->radius) + gap;
      const Vector3d between = bodies[i].X_WO * bodies[i].mesh->centre.cast<double>() -
                               bodies[j].X_WO * bodies[j].mesh->centre.cast<double>();
      const bool jointed = !belief.scene->joints.empty() &&
                           belief::are_jointed(*belief.scene, belief.objects[i].name, belief.objects[j].name);
      if (!jointed && between.norm() > reach) continue;
      if (!jointed && !reaches_into(bodies[i], bodies[j]) && !reaches_into(bodies[j], bodies[i])) continue;
      const int a = belief.objects[i].island, b = belief.objects[j].island;
      for (belief::ObjectBelief& object : belief.objects)
        if (object.island == std::max(a, b)) object.island = std::min(a, b);
    }
}

}  // namespace prescene::filter
