// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/filter_worlds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "benchmarks/statistics.h"
#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/core/order_statistics.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/level_camera.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/rendering/simd/simd_likelihood.h"
#include "tests/filter/counting_likelihood.h"
#include "tests/filter/pushed_box.h"

namespace prescene::benchmarks {
namespace {

using belief::Pose;
using geometry::Vector3d;

constexpr int kFrames = 50;
constexpr double kFrameTime = 1.0 / 30.0;
constexpr double kSettle = 0.6;           // s, before the first frame
constexpr double kRightShift = 0.02;      // m
constexpr double kRightTurn = 0.2618;     // rad
constexpr double kChiSquared90 = 6.2514;  // three degrees of freedom

belief::ObjectModel model_of_shapes(const std::string& name, std::vector<belief::CollisionShape> shapes, double mass) {
  belief::ObjectModel model;
  model.name = name;
  model.collision = std::move(shapes);
  model.contact.friction = belief::NormalScalar{0.5, 0.1, 0.1, 1.0};
  model.mass = belief::NormalScalar{mass, 0.15 * mass, 0.3 * mass, 3.0 * mass};
  auto derived = belief::with_derived_properties(std::move(model));
  PRESCENE_CHECK_MSG(derived.ok(), derived.status().message());
  return *std::move(derived);
}

belief::CollisionShape box_shape(const Vector3d& size, const Vector3d& p = Vector3d::Zero()) {
  return belief::PrimitiveShape{geometry::BoxShape{size}, Pose::from_translation(p)};
}

belief::ObjectModel box(const std::string& name, const Vector3d& size, double density = 500.0) {
  belief::ObjectModel model = model_of_shapes(name, {box_shape(size)}, density * size.prod());
  model.symmetry = geometry::SymmetryGroup::cuboid();
  return model;
}

/// An open box, its floor's underside at z = 0.
belief::ObjectModel cup(const std::string& name, const Vector3d& inner, double wall) {
  const double x = 0.5 * (inner.x() + wall), y = 0.5 * (inner.y() + wall), z = wall + 0.5 * inner.z();
  belief::ObjectModel model =
      model_of_shapes(name,
                      {box_shape({inner.x() + 2 * wall, inner.y() + 2 * wall, wall}, {0, 0, 0.5 * wall}),
                       box_shape({wall, inner.y() + 2 * wall, inner.z()}, {x, 0, z}),
                       box_shape({wall, inner.y() + 2 * wall, inner.z()}, {-x, 0, z}),
                       box_shape({inner.x() + 2 * wall, wall, inner.z()}, {0, y, z}),
                       box_shape({inner.x() + 2 * wall, wall, inner.z()}, {0, -y, z})},
                      0.25);
  model.symmetry = geometry::SymmetryGroup::cyclic(Vector3d::UnitZ(), 2);
  return model;
}

/// A scene, and what moves in it by itself.
struct Contacts {
  belief::Scene scene;
  std::vector<Pose> starts;
  Pose X_WC;
};

void add(Contacts& contacts, belief::ObjectModel model, const Pose& X_WO) {
  belief::SceneObject object;
  object.name = model.name;
  object.model = static_cast<int>(contacts.scene.models.size());
  contacts.scene.models.push_back(std::move(model));
  contacts.scene.objects.push_back(object);
  contacts.starts.push_back(X_WO);
}

/// Waits at `from`, and goes to `to` within the sequence.
void add_pusher(Contacts& contacts, const Vector3d& from, const Vector3d& to, double begin, double end) {
  belief::KinematicBody pusher;
  pusher.name = "pusher";
  pusher.collision.push_back(box_shape({0.02, 0.04, 0.04}));
  pusher.timeline = {{0.0, Pose::from_translation(from)},
                     {kSettle + begin, Pose::from_translation(from)},
                     {kSettle + end, Pose::from_translation(to)}};
  contacts.scene.robot.push_back(pusher);
}

Contacts contacts_of(const std::string& kind, std::uint64_t seed) {
  core::RandomStream draws(seed, core::Purpose::kScenario);
  const auto between = [&](double low, double high) { return draws.uniform(low, high); };
  // One declaration each, here and below: the order in which arguments are evaluated is the compiler's choice.
  using Range = std::array<double, 2>;
  const auto sizes = [&](const Range& along_x, const Range& along_y, const Range& along_z) {
    const double z = between(along_z[0], along_z[1]), y = between(along_y[0], along_y[1]);
    return Vector3d(between(along_x[0], along_x[1]), y, z);
  };
  Contacts contacts;
  contacts.scene.name = kind;
  belief::Support table;
  table.name = "table";
  table.collision.push_back(box_shape({1.2, 1.2, 0.04}, {0, 0, -0.02}));
  table.contact.friction = belief::FixedScalar{0.8};
  contacts.scene.supports.push_back(table);
  const double speed = between(0.12, 0.3), begin = between(0.2, 0.4), end = begin + between(0.7, 1.0);
  const double azimuth = between(-0.7, 0.7), elevation = between(0.5, 0.85);
  const Vector3d look(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                      -std::sin(elevation));
  const auto turned = [](double angle, const Vector3d& p) {
    return Pose{geometry::exp_rotation(Vector3d(0.0, 0.0, angle)), p};
  };
  if (kind == "stack") {
    const Vector3d lower = sizes({0.10, 0.13}, {0.10, 0.13}, {0.06, 0.09});
    const Vector3d upper = sizes({0.05, 0.08}, {0.06, 0.09}, {0.07, 0.12});
    add(contacts, box("lower", lower), turned(between(-0.3, 0.3), {0, 0, 0.5 * lower.z()}));
    const double x = between(-0.015, 0.015), y = between(-0.015, 0.015), turn = between(-0.8, 0.8);
    add(contacts, box("upper", upper), turned(turn, {x, y, lower.z() + 0.5 * upper.z()}));
    const Vector3d from(between(-0.02, 0.02), -0.14, 0.5 * lower.z());
    add_pusher(contacts, from, from + Vector3d(0, speed * (end - begin), 0), begin, end);
  } else if (kind == "leaning") {
    const Vector3d block = sizes({0.06, 0.09}, {0.06, 0.09}, {0.09, 0.12});
    const Vector3d book = sizes({0.13, 0.16}, {0.02, 0.03}, {0.12, 0.15});
    const double lean = between(0.25, 0.4);
    add(contacts, box("block", block, 800.0), turned(0.0, {0, 0, 0.5 * block.z()}));
    // Its upper edge leans on the block's far side: from there on it slides or stays while all settles.
    const double middle = 0.5 * block.y() + 0.5 * book.z() * std::sin(lean) + 0.5 * book.y() * std::cos(lean) + 0.001;
    const double height = 0.5 * book.z() * std::cos(lean) + 0.5 * book.y() * std::sin(lean);
    add(contacts, box("book", book),
        {geometry::exp_rotation(Vector3d(lean, 0.0, 0.0)), {between(-0.02, 0.02), middle, height}});
    const double side = between(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    const Vector3d from(side * (0.5 * block.x() + 0.04), 0, 0.04);
    add_pusher(contacts, from, from - Vector3d(side * speed * (end - begin), 0, 0), begin, end);
  } else {
    const Vector3d inner = sizes({0.07, 0.09}, {0.07, 0.09}, {0.06, 0.09});
    const Vector3d thing = sizes({0.03, 0.045}, {0.03, 0.045}, {0.05, 0.10});
    add(contacts, cup("cup", inner, 0.006), turned(between(-0.3, 0.3), Vector3d::Zero()));
    const double x = between(-0.008, 0.008), y = between(-0.008, 0.008), turn = between(-0.8, 0.8);
    add(contacts, box("thing", thing), turned(turn, {x, y, 0.007 + 0.5 * thing.z()}));
    const Vector3d from(between(-0.015, 0.015), -0.12, 0.04);
    add_pusher(contacts, from, from + Vector3d(0, speed * (end - begin), 0), begin, end);
  }
  contacts.X_WC = {geometry::Quaterniond(geometry::level_camera(look)),
                   Vector3d(0, 0.05, 0.06) - between(0.7, 0.9) * look};
  return contacts;
}

/// What happens, a state a frame, after all has settled.
std::vector<belief::WorldState> truth_of(const Contacts& contacts, std::uint64_t seed, core::ThreadPool& threads) {
  belief::WorldState start = belief::mean_start(contacts.scene);
  core::RandomStream draws(seed, core::Purpose::kParameters);
  for (std::size_t i = 0; i < start.objects.size(); ++i) {
    start.objects[i].X_WO = contacts.starts[i];
    auto& physical = start.objects[i].physical;
    physical.friction = physical.impact_friction = std::clamp(0.5 + 0.1 * draws.normal(), 0.2, 0.9);
    physical.mass *= draws.uniform(0.8, 1.25);
  }
  simulation::RunRequest request;
  request.stop.duration = kSettle + kFrames * kFrameTime;
  request.stop.stop_at_rest = false;
  request.sample_interval = kFrameTime;
  const auto simulator = filter_tests::push_simulators()(contacts.scene, 0.5);
  PRESCENE_CHECK_MSG(simulator.ok(), simulator.status().message());
  std::vector<belief::Trajectory> runs(1);
  (*simulator)->run(std::span(&start, 1), request, core::RandomStream(seed, core::Purpose::kTest), 0, threads, runs);
  const std::vector<belief::WorldState>& states = runs[0].states;
  std::vector<belief::WorldState> frames;
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto at = static_cast<std::size_t>(std::lround(kSettle / kFrameTime)) + static_cast<std::size_t>(frame);
    frames.push_back(states[std::min(at, states.size() - 1)]);
  }
  return frames;
}

/// As the suite of simulated situations sees: noisier than the tracker thinks.
rendering::SimulatedCamera noisy_camera() {
  rendering::SensorModelOptions sensor;
  sensor.sigma_per_depth_squared *= 1.2;
  sensor.incidence_knee = 0.5;
  rendering::SimulatedCameraOptions camera;
  camera.fixed_pattern_share = 0.35;
  camera.correlated_share = 0.45;
  camera.correlation_px = 10.0;
  camera.edge_outlier = {0.30, 0.22, 0.10, 0.02};
  camera.interior_outlier = 0.015;
  camera.quantisation_per_depth_squared = 0.0018;
  return {rendering::SensorModel(sensor), camera};
}

void count(const belief::Belief& belief, const belief::WorldState& truth, WorldsFigures& figures) {
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const belief::ObjectBelief& object = belief.objects[i];
    const belief::ObjectEstimate estimate = belief::estimate(belief, object);
    const geometry::SymmetryGroup& symmetry = belief::model_of(belief, object).symmetry;
    const Pose X_WO = geometry::closest_equivalent(estimate.mean, truth.objects[i].X_WO, symmetry);
    const Vector3d off = X_WO.translation - truth.objects[i].X_WO.translation;
    const double turn = geometry::symmetric_angle(estimate.mean, truth.objects[i].X_WO, symmetry);
    const bool right = off.norm() <= kRightShift && turn <= kRightTurn;
    ++figures.all;
    figures.sure += estimate.confidence >= 0.99;
    figures.sure_right += estimate.confidence >= 0.99 && right;
    figures.squared_miss += std::pow(estimate.confidence - (right ? 1.0 : 0.0), 2);
    if (object.state != belief::TrackState::kTracked) continue;
    ++figures.tracked;
    figures.wrong += !right;
    figures.errors.push_back(off.norm());
    figures.turns.push_back(turn);
    const geometry::Matrix3d covariance =
        geometry::Matrix3d(estimate.covariance.bottomRightCorner<3, 3>()) + 1e-10 * geometry::Matrix3d::Identity();
    figures.in_region += off.dot(geometry::solve_symmetric_3(covariance, off)) <= kChiSquared90;
  }
}

}  // namespace

void WorldsFigures::add(const WorldsFigures& more) {
  frames += more.frames;
  tracked += more.tracked;
  wrong += more.wrong;
  all += more.all;
  in_region += more.in_region;
  sure += more.sure;
  sure_right += more.sure_right;
  squared_miss += more.squared_miss;
  errors.insert(errors.end(), more.errors.begin(), more.errors.end());
  turns.insert(turns.end(), more.turns.begin(), more.turns.end());
  evaluations += more.evaluations;
  cpu_seconds += more.cpu_seconds;
  joint_islands += more.joint_islands;
}

const std::vector<std::string>& contact_kinds() {
  static const std::vector<std::string> kKinds = {"stack", "leaning", "in_cup"};
  return kKinds;
}

WorldsFigures track_contacts(const std::string& kind, std::uint64_t seed, bool joint, int particles,
                             core::ThreadPool& threads) {
  const Contacts contacts = contacts_of(kind, seed);
  const std::vector<belief::WorldState> truth = truth_of(contacts, seed, threads);
  auto scene = std::make_shared<belief::Scene>(contacts.scene);
  core::RandomStream draws(seed, core::Purpose::kStartBelief, 1);
  for (std::size_t i = 0; i < scene->objects.size(); ++i) {
    belief::NormalPose pose;
    geometry::Vector6d d;
    for (int k = 0; k < 6; ++k) d[k] = (k < 3 ? 0.05 : 0.005) * draws.normal();
    pose.mean = geometry::box_plus(truth[0].objects[i].X_WO, d);
    pose.covariance.diagonal() << Vector3d::Constant(0.05 * 0.05), Vector3d::Constant(0.005 * 0.005);
    scene->objects[i].pose = pose;
  }
  const auto renderer = rendering::make_reference_renderer();
  const auto batch = rendering::make_simd_likelihood_batch();
  const filter_tests::CountingLikelihood likelihood(*batch);
  filter::FilterSettings settings;
  settings.worlds.joint = joint;
  settings.initialise.particles = particles;
  filter::ParticleFilter filter(likelihood, *renderer, threads, settings, filter_tests::push_simulators());
  const rendering::SimulatedCamera camera = noisy_camera();
  const geometry::PinholeCamera intrinsics{320, 240, 290.0, 290.0, 159.5, 119.5};
  filter::MeshCache meshes;
  belief::Belief belief = filter.start(scene, seed);
  WorldsFigures figures;
  for (int frame = 0; frame < kFrames; ++frame) {
    const double time = frame * kFrameTime;
    const std::vector<Pose> X_WG = {belief::pose_at(scene->robot[0], kSettle + time)};
    const filter::BeliefView view = filter::render_scene(*scene, truth[static_cast<std::size_t>(frame)], X_WG,
                                                         filter::MeshDetail::kDisplay, meshes);
    rendering::RenderedView rendered;
    rendering::RenderOptions options;
    options.normals = true;
    const core::Status drawn = renderer->render(view.scene, intrinsics, contacts.X_WC, options, &rendered);
    PRESCENE_CHECK_MSG(drawn.ok(), drawn.message());
    auto depth = std::make_shared<geometry::DepthImage>();
    auto color = std::make_shared<geometry::ColorImage>();
    camera.sample(view.scene, rendered, nullptr, intrinsics, contacts.X_WC,
                  core::RandomStream(seed, core::Purpose::kSensorNoise), static_cast<std::uint64_t>(frame), depth.get(),
                  color.get());
    belief::Observation observation;
    observation.stamp_ns = 1'000'000'000 + static_cast<core::TimeNs>(std::llround(1e9 * time));
    observation.frame = {depth, color, intrinsics};
    observation.X_WC = contacts.X_WC;
    observation.robot["pusher"] = X_WG[0];
    const double begin = core::process_cpu_seconds();
    filter::StepResult result = filter.step(belief, observation, {});
    figures.cpu_seconds += core::process_cpu_seconds() - begin;
    figures.evaluations += likelihood.poses.exchange(0);
    figures.joint_islands += result.counters.joint_islands;
    belief = std::move(result.belief);
    ++figures.frames;
    if (frame >= 3) count(belief, truth[static_cast<std::size_t>(frame)], figures);
  }
  return figures;
}

Table worlds_table(std::uint64_t seed, int sequences, core::ThreadPool& threads) {
  Table table{
      "worlds",
      {"kind", "particles are", "particles", "frames", "tracked", "wrong", "median error, mm", "90 % of errors, mm",
       "median turn, deg", "truth in the 90 % region", "confidence 0.99", "right of those",
       "mean squared miss of confidence", "evaluations a frame", "processor time a frame, ms"},
      {}};
  constexpr int kParticles = 16;
  constexpr double kDegrees = 57.29577951308232;
  for (const std::string& kind : contact_kinds()) {
    double of_joint = 0.0, of_independent = 0.0;
    for (int row = 0; row < 3; ++row) {
      const bool joint = row == 0;
      const int particles =
          row < 2 ? kParticles : static_cast<int>(std::lround(kParticles * of_joint / std::max(1.0, of_independent)));
      WorldsFigures figures;
      for (int k = 0; k < sequences; ++k)
        figures.add(track_contacts(kind, seed + static_cast<std::uint64_t>(k), joint, particles, threads));
      const auto share = [](int part, int whole) {
        return whole > 0 ? static_cast<double>(part) / whole : std::nan("");
      };
      const double evaluations = figures.evaluations / figures.frames;
      (joint ? of_joint : of_independent) = evaluations;
      table.rows.push_back({kind, std::string(joint ? "worlds" : "independent"), std::int64_t{particles},
                            std::int64_t{figures.frames}, std::int64_t{figures.tracked}, std::int64_t{figures.wrong},
                            1e3 * core::quantile(figures.errors, 0.5), 1e3 * core::quantile(figures.errors, 0.9),
                            kDegrees * core::quantile(figures.turns, 0.5), share(figures.in_region, figures.tracked),
                            std::int64_t{figures.sure}, share(figures.sure_right, figures.sure),
                            figures.squared_miss / figures.all, evaluations,
                            1e3 * figures.cpu_seconds / figures.frames});
    }
  }
  return table;
}

}  // namespace prescene::benchmarks
