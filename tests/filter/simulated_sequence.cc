// SPDX-License-Identifier: Apache-2.0
#include "simulated_sequence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/core/check.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter_tests {
namespace {

rendering::RenderScene world_at(const SimulatedSequence& sequence, double time) {
  static MeshCache meshes;
  belief::WorldState state = belief::mean_start(*sequence.scene);
  for (std::size_t i = 0; i < state.objects.size(); ++i) state.objects[i].X_WO = sequence.objects[i](time);
  BeliefView view = render_scene(*sequence.scene, state, {}, MeshDetail::kDisplay, meshes);
  for (const Occluder& occluder : sequence.occluders)
    view.scene.instances.push_back({rendering::make_render_mesh(occluder.mesh), occluder.X_WM(time),
                                    rendering::SurfaceMaterial::opaque({120, 90, 70})});
  return view.scene;
}

rendering::RenderedView rendered(const rendering::RenderScene& scene, const SimulatedSequence& sequence,
                                 rendering::Renderer& renderer) {
  rendering::RenderedView view;
  rendering::RenderOptions options;
  options.normals = true;
  options.color = rendering::has_looks(scene);
  const core::Status status = renderer.render(scene, sequence.camera, sequence.X_WC, options, &view);
  PRESCENE_CHECK_MSG(status.ok(), status.message());
  return view;
}

Motion in_between(const Pose& X_WC, const Motion& target, double clearance, double begin, double end) {
  return [=](double time) {
    const Vector3d p_CT = X_WC.inverse() * target(time).translation;
    // From the side within 0.2 s, and out again.
    double aside = 0.0;
    if (time < begin) aside = std::min(1.0, (begin - time) / 0.2);
    if (time > end) aside = std::min(1.0, (time - end) / 0.2);
    Vector3d p_CM = p_CT * (p_CT.z() - clearance) / p_CT.z();
    p_CM.x() += aside * 1.2;
    return X_WC * Pose::from_translation(p_CM);
  };
}

}  // namespace

belief::Observation SimulatedSequence::observe(int frame, rendering::Renderer& renderer) const {
  const double time = time_of(frame);
  const rendering::RenderScene world = world_at(*this, time);
  const rendering::RenderedView view = rendered(world, *this, renderer);
  auto depth = std::make_shared<geometry::DepthImage>();
  auto color = std::make_shared<geometry::ColorImage>();
  const rendering::SimulatedCamera simulated(rendering::SensorModel(), {});
  const core::RandomStream stream(seed, core::Purpose::kSensorNoise);
  simulated.sample(world, view, nullptr, camera, X_WC, stream, static_cast<std::uint64_t>(frame), depth.get(),
                   color.get());
  belief::Observation observation;
  observation.stamp_ns = 1'000'000'000 + static_cast<core::TimeNs>(std::llround(1e9 * time));
  observation.frame = {depth, color, camera};
  observation.X_WC = X_WC;
  for (const belief::KinematicBody& body : scene->robot) observation.robot[body.name] = belief::pose_at(body, time);
  return observation;
}

double SimulatedSequence::visible_share(int object, int frame, rendering::Renderer& renderer) const {
  const rendering::RenderScene world = world_at(*this, time_of(frame));
  const rendering::RenderedView all = rendered(world, *this, renderer);
  rendering::RenderScene alone;
  alone.instances.push_back(world.instances[static_cast<std::size_t>(object)]);
  const rendering::RenderedView single = rendered(alone, *this, renderer);
  int covered = 0, seen = 0;
  for (std::size_t i = 0; i < single.labels.size(); ++i) {
    covered += single.labels.data()[i] != 0;
    seen += all.labels.data()[i] == object + 1;
  }
  return covered > 0 ? static_cast<double>(seen) / covered : 0.0;
}

belief::Support table() {
  belief::Support support;
  support.name = "table";
  support.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{Vector3d(1.0, 1.0, 0.04)}, Pose::from_translation({0.0, 0.0, -0.02})});
  support.visual = std::make_shared<const geometry::TriangleMesh>(geometry::transformed(
      geometry::make_mesh(geometry::BoxShape{Vector3d(1.0, 1.0, 0.04)}), Pose::from_translation({0.0, 0.0, -0.02})));
  return support;
}

geometry::PinholeCamera test_camera() { return {320, 240, 290.0, 290.0, 159.5, 119.5}; }

Pose test_camera_pose() {
  const double down = 50.0 * std::numbers::pi / 180.0;
  const Vector3d z(std::cos(down), 0.0, -std::sin(down));  // looks along +x and down
  const Vector3d x(0.0, -1.0, 0.0);
  geometry::Matrix3d R_WC;
  R_WC << x, z.cross(x), z;
  Pose X_WC;
  X_WC.rotation = geometry::Quaterniond(R_WC);
  X_WC.translation = Vector3d(0.0, 0.0, 0.05) - 0.9 * z;
  return X_WC;
}

belief::ObjectModel mesh_model(const std::string& name, geometry::TriangleMesh mesh) {
  belief::ObjectModel model;
  model.name = name;
  auto shared = std::make_shared<const geometry::TriangleMesh>(std::move(mesh));
  model.collision.push_back(belief::MeshShape{shared, Pose::identity(), belief::MeshUse::kConvexHull});
  model.visual = shared;
  model.mass = belief::FixedScalar{0.5};
  auto derived = belief::with_derived_properties(std::move(model));
  PRESCENE_CHECK_MSG(derived.ok(), derived.status().message());
  return *std::move(derived);
}

belief::ObjectModel box_model(const std::string& name, const Vector3d& size) {
  return mesh_model(name, geometry::make_mesh(geometry::BoxShape{size}));
}
belief::ObjectModel can_model(const std::string& name, double radius, double height) {
  return mesh_model(name, geometry::make_mesh(geometry::Cylinder{radius, height}));
}
belief::ObjectModel carton_model(const std::string& name) {
  return mesh_model(name, geometry::make_gable_carton(0.07, 0.07, 0.16, 0.22));
}

std::shared_ptr<const belief::Scene> table_scene(std::vector<belief::ObjectModel> models, const std::vector<Pose>& X_WO,
                                                 double shift, double turn) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "test";
  scene->supports.push_back(table());
  for (std::size_t i = 0; i < models.size(); ++i) {
    belief::SceneObject object;
    object.name = models[i].name;
    object.model = static_cast<int>(i);
    belief::NormalPose pose;
    pose.mean = X_WO[i];
    pose.covariance.diagonal() << Vector3d::Constant(turn * turn), Vector3d::Constant(shift * shift);
    object.pose = pose;
    scene->objects.push_back(object);
  }
  scene->models = std::move(models);
  return scene;
}

std::shared_ptr<const belief::Scene> open_scene(std::vector<belief::ObjectModel> models) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "open";
  scene->supports.push_back(table());
  for (std::size_t i = 0; i < models.size(); ++i) {
    belief::SceneObject object;
    object.name = models[i].name;
    object.model = static_cast<int>(i);
    belief::BoxPose anywhere;
    anywhere.position.x = belief::UniformScalar{-0.5, 0.5};
    anywhere.position.y = belief::UniformScalar{-0.5, 0.5};
    anywhere.position.z = belief::UniformScalar{0.0, 0.3};
    anywhere.any_rotation = true;
    object.pose = anywhere;
    scene->objects.push_back(object);
  }
  scene->models = std::move(models);
  return scene;
}

Motion fixed(const Pose& X_W) {
  return [X_W](double) { return X_W; };
}

Motion wandering(const Pose& X_W, double speed, double rate, std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  // Three sines an axis; amplitudes such that each carries a third of the mean square velocity.
  struct Wave {
    double omega, phase;
  };
  std::array<std::array<Wave, 3>, 6> waves;
  for (auto& axis : waves)
    for (Wave& wave : axis) wave = {stream.uniform(1.0, 4.0), stream.uniform(0.0, 2.0 * std::numbers::pi)};
  return [=](double time) {
    geometry::Vector6d d;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const double total = axis < 3 ? rate : speed;
      double sum = 0.0;
      for (const Wave& wave : waves[axis])
        sum += total * std::sqrt(2.0 / 9.0) / wave.omega *
               (std::sin(wave.omega * time + wave.phase) - std::sin(wave.phase));
      d[static_cast<Eigen::Index>(axis)] = sum;
    }
    Pose moved = X_W;
    moved.translation += d.tail<3>();
    moved.rotation = (geometry::exp_rotation(d.head<3>()) * X_W.rotation).normalized();
    return moved;
  };
}

Occluder plate(const Pose& X_WC, const Motion& target, double clearance, double width, double height, double begin,
               double end) {
  return {geometry::make_mesh(geometry::BoxShape{Vector3d(width, height, 0.005)}),
          in_between(X_WC, target, clearance, begin, end)};
}

Occluder blob(const Pose& X_WC, const Motion& target, double clearance, const Vector3d& radii, double begin,
              double end) {
  geometry::TriangleMesh mesh = geometry::make_mesh(geometry::Sphere{1.0});
  for (Vector3d& vertex : mesh.vertices) vertex = vertex.cwiseProduct(radii);
  return {std::move(mesh), in_between(X_WC, target, clearance, begin, end)};
}

}  // namespace prescene::filter_tests
