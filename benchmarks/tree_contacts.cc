// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/tree_contacts.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/processor_time.h"
#include "benchmarks/statistics.h"
#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "tests/peers/bullet_world.h"
#include "tests/support/hollow_meshes.h"

namespace prescene::benchmarks {
namespace {

using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;

constexpr double kStep = 1.0 / 240.0;
constexpr int kSteps = 480;

Quaterniond about(const Vector3d& axis, double angle) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

struct Body {
  geometry::TriangleMesh mesh;
  double mass;
  Pose start;
};
struct Drop {
  const char* name;
  std::vector<Body> bodies;
};

// Two seconds of each: mostly at rest or sliding to it.
std::vector<Drop> drops() {
  return {{"mug on a floor", {{tests::mug(), 0.3, {about({1.0, 0.4, 0.2}, 1.2), {0.0, 0.0, 0.08}}}}},
          {"bowl on a floor", {{tests::bowl(0.06, 0.05, 0.003), 0.3, {about({1.0, 0.3, 0.0}, 0.6), {0.0, 0.0, 0.03}}}}},
          {"bowl in a bowl",
           {{tests::bowl(0.06, 0.05, 0.003), 0.3, {Quaterniond::Identity(), {0.0, 0.0, 0.001}}},
            {tests::bowl(0.06, 0.05, 0.003), 0.3, {about({1.0, 0.3, 0.0}, 0.3), {0.005, 0.002, 0.04}}}}},
          {"spoon in a mug",
           {{tests::mug(), 0.3, {Quaterniond::Identity(), {0.0, 0.0, 0.001}}},
            {tests::spoon(), 0.04, {about({0.0, 1.0, 0.0}, 0.2), {-0.02, 0.0, 0.03}}}}},
          {"bin in a bin",
           {{geometry::make_open_bin({0.2, 0.15, 0.1}, 0.003), 0.4, {Quaterniond::Identity(), {0.0, 0.0, 0.001}}},
            {geometry::make_open_bin({0.15, 0.1, 0.08}, 0.003),
             0.3,
             {about({0.2, 0.1, 1.0}, 0.1), {0.003, 0.004, 0.02}}}}}};
}

belief::Scene scene_of(const Drop& drop, belief::MeshUse use) {
  belief::Scene scene;
  scene.name = drop.name;
  belief::Support floor;
  floor.name = "floor";
  floor.collision = {belief::PrimitiveShape{geometry::BoxShape{{4.0, 4.0, 0.1}}, Pose{}}};
  floor.X_WS = Pose::from_translation({0.0, 0.0, -0.05});
  floor.contact.friction = belief::FixedScalar{1.0};
  scene.supports.push_back(floor);
  for (const Body& body : drop.bodies) {
    belief::ObjectModel model;
    model.name = "thing" + std::to_string(scene.models.size());
    model.collision = {belief::MeshShape{std::make_shared<const geometry::TriangleMesh>(body.mesh), Pose{}, use}};
    model.mass = belief::FixedScalar{body.mass};
    const auto derived = belief::with_derived_properties(model);
    PRESCENE_CHECK(derived.ok());
    belief::SceneObject object;
    object.name = model.name;
    object.model = static_cast<int>(scene.models.size());
    scene.models.push_back(*derived);
    scene.objects.push_back(object);
  }
  return scene;
}

/// us a step, in our simulator; `build` gets the time that the shapes took, s.
double our_step(const Drop& drop, belief::MeshUse use, int repeats, double* build) {
  const belief::Scene scene = scene_of(drop, use);
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  const double begun = processor_seconds();
  const auto simulator = simulation::make_bullet_simulator(scene, shapes);
  PRESCENE_CHECK(simulator.ok());
  *build = processor_seconds() - begun;
  const auto instance = (*simulator)->make_instance({}, core::RandomStream(1, core::Purpose::kEvaluation));
  belief::WorldState start = belief::mean_start(scene);
  for (std::size_t i = 0; i < drop.bodies.size(); ++i) start.objects[i].X_WO = drop.bodies[i].start;
  std::vector<double> times;
  for (int r = 0; r < repeats; ++r) {
    instance->set_state(start);
    const double from = processor_seconds();
    for (int i = 0; i < kSteps; ++i) instance->step();
    times.push_back(1e6 * (processor_seconds() - from) / kSteps);
  }
  return median(times);
}

double bullet_step(const Drop& drop, bool gimpact, int repeats) {
  std::vector<tests::BulletBody> bodies(1);
  bodies[0].box = {4.0, 4.0, 0.1};
  bodies[0].start = Pose::from_translation({0.0, 0.0, -0.05});
  for (const Body& body : drop.bodies) {
    tests::BulletBody given;
    given.gimpact = gimpact;
    if (gimpact) {
      given.parts = {body.mesh};
    } else {
      const auto parts = simulation::hacd_decomposer()(body.mesh, {});
      PRESCENE_CHECK(parts.ok());
      given.parts = *parts;
    }
    const auto solid = geometry::mass_properties(body.mesh, 1000.0);
    PRESCENE_CHECK(solid.ok());
    given.mass = geometry::with_mass(*solid, body.mass);
    given.start = body.start;
    bodies.push_back(given);
  }
  tests::BulletWorld world(bodies);
  std::vector<double> times;
  for (int r = 0; r < repeats; ++r) {
    world.reset();
    const double from = processor_seconds();
    for (int i = 0; i < kSteps; ++i) world.step(kStep);
    times.push_back(1e6 * (processor_seconds() - from) / kSteps);
  }
  return median(times);
}

}  // namespace

Table measure_tree_contacts(int repeats, Report* report) {
  Table table{"tree_contacts",
              {"scene", "spheres us", "convex parts us", "Bullet, convex parts us", "Bullet, GImpact us",
               "spheres made s", "parts made s"},
              {}};
  double ratio = 0.0;
  double to_gimpact = 0.0;
  double least = 1e9;
  const std::vector<Drop> all = drops();
  for (const Drop& drop : all) {
    double build_spheres = 0.0, build_parts = 0.0;
    const double spheres = our_step(drop, belief::MeshUse::kSpheres, repeats, &build_spheres);
    const double parts = our_step(drop, belief::MeshUse::kDecompose, repeats, &build_parts);
    const double bullet = bullet_step(drop, false, repeats);
    const double gimpact = bullet_step(drop, true, 1);
    ratio += std::log(bullet / spheres) / static_cast<double>(all.size());
    to_gimpact += std::log(gimpact / spheres) / static_cast<double>(all.size());
    least = std::min(least, bullet / spheres);
    table.rows.push_back({drop.name, spheres, parts, bullet, gimpact, build_spheres, build_parts});
  }
  const auto n = static_cast<std::int64_t>(all.size());
  report->add({.work = "tree-contact step vs Bullet's convex decomposition",
               .must = at_least(1.0),
               .aim = at_least(2.0),
               .reached = std::exp(ratio),
               .unit = "x",
               .n = n,
               .baseline = "Bullet as shipped, a compound of the same decomposition's hulls, the same bodies and step",
               .why = "geometric mean over scenes; the least is " + std::to_string(least).substr(0, 5)});
  report->add({.work = "tree-contact step vs Bullet's GImpact",
               .must = std::nullopt,
               .aim = std::nullopt,
               .reached = std::exp(to_gimpact),
               .unit = "x",
               .n = n,
               .baseline = "Bullet as shipped",
               .why = "geometric mean over scenes"});
  return table;
}

}  // namespace prescene::benchmarks
