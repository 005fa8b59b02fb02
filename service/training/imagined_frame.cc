// SPDX-License-Identifier: Apache-2.0
#include "imagined_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "learn_model.h"
#include "prescene/belief/body_names.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/level_camera.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/simulation/simulator.h"

namespace prescene::service {
namespace {

using belief::PrimitiveShape;
using geometry::BoxShape;
using geometry::Pose;
using geometry::Vector3d;

constexpr double kHalfTurn = std::numbers::pi;
constexpr double kPuttingReach = 0.38;  // m about the focus, in which things are put
constexpr double kGap = 0.004;          // m between things that are put down
constexpr double kSettling = 2.0;       // s of simulated time
constexpr double kExpectedShare = 0.4;  // of an object's pixels that must be visible to expect it ...
constexpr double kExpectedPixels = 1000.0 / (640.0 * 480.0);  // ... and of the image's
constexpr geometry::PinholeCamera kCamera = {640, 480, 570.0, 570.0, 319.5, 239.5};

/// The world while it is imagined: U, z up. Objects of models first, then things that nobody knows of.
class Imagination {
 public:
  Imagination(const belief::Scene& given, const std::vector<std::vector<filter::LearnedRest>>& rests,
              core::RandomStream& draws)
      : given_(given), rests_(rests), draws_(draws) {
    world_.name = "imagined";
    world_.models = given.models;
    world_.depth_noise = given.depth_noise;
    X_UW_.rotation = geometry::rotation_between(belief::up_of(given), Vector3d::UnitZ());
  }

  /// Where things are put, and what carries them.
  void furnish() {
    own_supports_ = !given_.supports.empty() && draws_.uniform() < 0.6;
    if (own_supports_) {
      for (belief::Support support : given_.supports) {
        support.X_WS = X_UW_ * support.X_WS;
        world_.supports.push_back(std::move(support));
      }
    } else {
      const int blocks = 1 + static_cast<int>(draws_.uniform_below(3));
      for (int i = 0; i < blocks; ++i) {
        // One declaration each: the order in which arguments are evaluated is the compiler's choice.
        const double height = draws_.uniform(0.1, 0.75), depth = draws_.uniform(0.3, 0.6);
        const Vector3d size(draws_.uniform(0.3, 0.8), depth, height);
        const Vector3d at(0.7 * (i - 0.5 * (blocks - 1)), draws_.uniform(-0.15, 0.15), 0.5 * size.z());
        add_box("block_" + std::to_string(i + 1), size, at, draws_.uniform(-0.3, 0.3));
      }
      if (draws_.uniform() < 0.65) add_box("floor", {6.0, 6.0, 0.1}, {0.0, 0.0, -0.05}, 0.0);
      if (draws_.uniform() < 0.25) add_box("wall", {6.0, 0.1, 3.0}, {0.0, draws_.uniform(0.5, 0.8), 1.5}, 0.0);
    }
    const auto places = std::count_if(world_.supports.begin(), world_.supports.end(),
                                      [](const auto& support) { return support.name != "wall"; });
    focus_ = top_of(world_.supports[draws_.uniform_below(static_cast<std::uint64_t>(std::max<long>(1, places)))]);
  }

  void place_camera() {
    const geometry::PinholeCamera intrinsics = given_.camera ? given_.camera->intrinsics : kCamera;
    belief::SceneCamera camera;
    camera.intrinsics = intrinsics;
    if (given_.camera && own_supports_ && draws_.uniform() < 0.5) {
      camera.X_WC = X_UW_ * given_.camera->X_WC;
      camera.X_WC.translation += 0.08 * geometry::normal_vector(draws_);
      camera.X_WC.rotation =
          (camera.X_WC.rotation * geometry::exp_rotation(0.1 * geometry::normal_vector(draws_))).normalized();
    } else {
      const double elevation = draws_.uniform(18.0, 65.0) * kHalfTurn / 180.0,
                   azimuth = draws_.uniform(-0.9, 0.9) - 0.5 * kHalfTurn;
      const double distance = draws_.uniform(0.65, 1.45);
      const double target_y = draws_.uniform(-0.12, 0.12), target_x = draws_.uniform(-0.12, 0.12);
      const Vector3d target = focus_ + Vector3d(target_x, target_y, 0.05);
      const Vector3d towards(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                             std::sin(elevation));
      camera.X_WC = {geometry::Quaterniond(geometry::level_camera(-towards)).normalized(), target + distance * towards};
    }
    world_.camera = camera;
  }

  void put_things() {
    std::vector<int> models;
    for (std::size_t i = 0; i < given_.models.size(); ++i) models.push_back(static_cast<int>(i));
    draws_.shuffle(std::span<int>(models));
    const auto wanted = static_cast<std::size_t>(1 + draws_.uniform_below(8));
    for (std::size_t i = 0; i < wanted; ++i) {
      // Most models once; where a scene has few, they come again.
      if (i >= models.size() && draws_.uniform() < 0.4) break;
      put(models[i % models.size()], false);
    }
    known_ = world_.objects.size();
    const auto unknown = draws_.uniform_below(5);
    for (std::uint64_t i = 0; i < unknown; ++i) {
      const bool in_front = known_ > 0 && draws_.uniform() < 0.5;
      put(add_unknown_model(), in_front);
    }
  }

  core::Status settle(Backends& backends, const core::RandomStream& stream) {
    state_ = belief::mean_start(world_);
    if (world_.objects.empty()) return core::ok_status();
    PRESCENE_TRY(const auto simulator, backends.make_simulator(world_));
    simulation::RunRequest request;
    request.stop.duration = kSettling;
    std::vector<belief::Trajectory> runs(1);
    simulator->run(std::span(&state_, 1), request, stream, 0, backends.pool(), runs);
    state_ = runs.front().final();
    return core::ok_status();
  }

  /// What the camera sees, its noise, and what of it the search gets.
  core::Result<ImaginedFrame> see(filter::MeshCache& meshes, rendering::Renderer& renderer) {
    const filter::BeliefView shown = filter::render_scene(world_, state_, {}, filter::MeshDetail::kDisplay, meshes);
    const geometry::PinholeCamera& camera = world_.camera->intrinsics;
    const Pose& X_UC = world_.camera->X_WC;
    rendering::RenderOptions options;
    options.normals = true;
    rendering::RenderedView view;
    PRESCENE_RETURN_IF_ERROR(renderer.render(shown.scene, camera, X_UC, options, &view));
    ImaginedFrame frame;
    const Pose X_WU = X_UW_.inverse();
    for (std::size_t i = 0; i < known_; ++i) {
      ImaginedObject object;
      object.model = world_.objects[i].model;
      object.X_WO = X_WU * state_.objects[i].X_WO;
      PRESCENE_TRY(object.expected, is_expected(shown, view, i, renderer));
      frame.truth.push_back(object);
    }
    auto depth = std::make_shared<geometry::DepthImage>();
    noisy_camera().sample(shown.scene, view, nullptr, camera, X_UC,
                          core::RandomStream(draws_.next_u64(), core::Purpose::kSensorNoise), 0, depth.get(), nullptr);
    frame.observation.stamp_ns = 1'000'000'000;
    frame.observation.frame.camera = camera;
    frame.observation.frame.depth = std::move(depth);
    frame.observation.X_WC = X_WU * X_UC;
    frame.scene = known_scene(X_WU);
    return frame;
  }

 private:
  void add_box(const std::string& name, const Vector3d& size, const Vector3d& at, double turn) {
    belief::Support support;
    support.name = name;
    support.collision.push_back(PrimitiveShape{BoxShape{size}, Pose::identity()});
    support.X_WS = {geometry::exp_rotation(turn * Vector3d::UnitZ()), at};
    world_.supports.push_back(std::move(support));
  }

  /// A point on the top of a support's bounding box, within the part of it that is near its middle.
  Vector3d top_of(const belief::Support& support) {
    geometry::Box box;
    for (const Vector3d& vertex : belief::collision_mesh(support.collision).vertices) box.extend(support.X_WS * vertex);
    const Vector3d half = 0.5 * box.sizes();
    const double x = std::max(0.0, std::min(half.x() - 0.15, 0.4)), y = std::max(0.0, std::min(half.y() - 0.15, 0.4));
    return {box.center().x() + draws_.uniform(-x, x), box.center().y() + draws_.uniform(-y, y), box.max().z()};
  }

  Vector3d near_focus() {
    const double y = draws_.uniform(-1.0, 1.0), x = draws_.uniform(-1.0, 1.0);
    return focus_ + kPuttingReach * Vector3d(x, y, 0.0);
  }

  int add_unknown_model() {
    const double kind = draws_.uniform();
    const double height = draws_.uniform(0.03, 0.2), depth = draws_.uniform(0.03, 0.16);
    geometry::Primitive shape = BoxShape{Vector3d(draws_.uniform(0.03, 0.16), depth, height)};
    if (kind > 0.6) shape = geometry::Cylinder{draws_.uniform(0.02, 0.06), draws_.uniform(0.04, 0.2)};
    if (kind > 0.85) shape = geometry::Sphere{draws_.uniform(0.025, 0.06)};
    if (kind > 0.93) shape = geometry::Cone{draws_.uniform(0.03, 0.06), draws_.uniform(0.06, 0.16)};
    belief::ObjectModel model;
    model.name = "unknown_" + std::to_string(world_.models.size());
    model.collision.push_back(PrimitiveShape{shape, Pose::identity()});
    // A primitive has a volume, so its properties can be derived.
    if (auto derived = belief::with_derived_properties(model)) model = *std::move(derived);
    world_.models.push_back(std::move(model));
    return static_cast<int>(world_.models.size()) - 1;
  }

  /// Most things are put down as they lie, some are let fall; where another thing is in the way, above it. `in_front`:
  /// between the camera and one of the objects.
  void put(int model, bool in_front) {
    const belief::ObjectModel& thing = world_.models[static_cast<std::size_t>(model)];
    const std::vector<filter::LearnedRest> rests =
        static_cast<std::size_t>(model) < rests_.size() ? rests_[static_cast<std::size_t>(model)] : rests_of(thing);
    const bool falls = draws_.uniform() < 0.15;
    Pose X_UO;
    X_UO.rotation = falls ? geometry::uniform_rotation(draws_) : draw_rest(rests, draws_);
    const geometry::TriangleMesh mesh = thing.visual ? *thing.visual : belief::collision_mesh(thing);
    geometry::Box box;
    for (const Vector3d& vertex : mesh.vertices) box.extend(X_UO.rotation * vertex);
    Vector3d at = near_focus();
    if (draws_.uniform() < 0.25) {
      at = top_of(world_.supports[draws_.uniform_below(world_.supports.size())]);
      if (at.z() > world_.camera->X_WC.translation.z()) at = focus_;
    }
    if (in_front) {
      const Placed& hidden = placed_[draws_.uniform_below(known_)];
      Vector3d towards = world_.camera->X_WC.translation - hidden.at;
      towards.z() = 0.0;
      const double off_y = draws_.normal(), off_x = draws_.normal(), along = draws_.uniform(0.05, 0.2);
      at = hidden.at + along * towards.normalized() + 0.05 * Vector3d(off_x, off_y, 0.0);
      at.z() = hidden.ground;
    }
    const double radius = 0.5 * std::hypot(box.sizes().x(), box.sizes().y());
    const double ground = at.z();
    const bool stacks = draws_.uniform() < 0.25;
    for (int attempt = 0; attempt < 20 && !stacks && !in_front && touches(at, radius); ++attempt) {
      at = near_focus();
      at.z() = ground;
    }
    for (const Placed& other : placed_)
      if ((other.at - at).head<2>().norm() < other.radius + radius) at.z() = std::max(at.z(), other.top);
    const double height = kGap + (falls ? draws_.uniform(0.02, 0.12) : 0.0);
    X_UO.translation = at + Vector3d(-box.center().x(), -box.center().y(), height - box.min().z());
    placed_.push_back({at, radius, at.z() + height + box.sizes().z(), ground});
    belief::SceneObject object;
    object.name = "object_" + std::to_string(world_.objects.size() + 1);
    object.model = model;
    object.pose = belief::FixedPose{X_UO};
    world_.objects.push_back(std::move(object));
  }

  bool touches(const Vector3d& at, double radius) const {
    return std::any_of(placed_.begin(), placed_.end(), [&](const auto& other) {
      return (other.at - at).template head<2>().norm() < other.radius + radius;
    });
  }

  core::Result<bool> is_expected(const filter::BeliefView& shown, const rendering::RenderedView& view,
                                 std::size_t object, rendering::Renderer& renderer) const {
    const auto label = static_cast<std::uint16_t>(object + 1);
    const auto pixels = std::count(view.labels.data(), view.labels.data() + view.labels.size(), label);
    const auto& labels = view.labels;
    if (static_cast<double>(pixels) < kExpectedPixels * labels.width() * labels.height()) return false;
    rendering::RenderScene alone;
    alone.instances.push_back(shown.scene.instances[object]);
    rendering::RenderedView unhidden;
    PRESCENE_RETURN_IF_ERROR(renderer.render(alone, world_.camera->intrinsics, world_.camera->X_WC, {}, &unhidden));
    const auto all = std::count(unhidden.labels.data(), unhidden.labels.data() + unhidden.labels.size(), 1);
    return static_cast<double>(pixels) >= kExpectedShare * static_cast<double>(all);
  }

  /// Cameras of one kind differ, and what is said of them is not exact.
  rendering::SimulatedCamera noisy_camera() {
    rendering::SensorModelOptions sensor = filter::with_settings({}, given_.depth_noise);
    sensor.sigma_per_depth_squared *= std::exp(draws_.uniform(-0.35, 0.35));
    const double missing = std::exp(draws_.uniform(-0.5, 0.3));
    for (double& share : sensor.outline_missing) share = std::min(0.9, missing * share);
    rendering::SimulatedCameraOptions camera;
    camera.fixed_pattern_share = draws_.uniform(0.1, 0.45);
    camera.correlated_share = draws_.uniform(0.2, 0.5);
    camera.correlation_px = draws_.uniform(6.0, 14.0);
    const double edges = std::exp(draws_.uniform(-0.5, 0.4));
    for (double& share : camera.edge_outlier) share = std::min(0.6, edges * share);
    return {rendering::SensorModel(sensor), camera};
  }

  std::shared_ptr<const belief::Scene> known_scene(const Pose& X_WU) {
    auto known = std::make_shared<belief::Scene>();
    known->name = "imagined";
    known->models = given_.models;
    known->gravity_W = given_.gravity_W.norm() > 1e-9 ? given_.gravity_W : Vector3d(X_WU.rotation * world_.gravity_W);
    known->depth_noise = given_.depth_noise;
    // All supports, none or some of them; what is the user's own is mostly named.
    const double listed = draws_.uniform() < (own_supports_ ? 0.8 : 0.33) ? 1.0 : draws_.uniform() < 0.5 ? 0.0 : 0.5;
    for (belief::Support support : world_.supports) {
      if (support.name == "wall" || draws_.uniform() >= listed) continue;
      support.X_WS = X_WU * support.X_WS;
      known->supports.push_back(std::move(support));
    }
    std::vector<int> wanted;
    for (std::size_t i = 0; i < known_; ++i) wanted.push_back(world_.objects[i].model);
    const auto absent = draws_.uniform_below(3);
    for (std::uint64_t i = 0; i < absent; ++i)
      wanted.push_back(static_cast<int>(draws_.uniform_below(given_.models.size())));
    belief::BoxPose anywhere;
    anywhere.position = {belief::UniformScalar{-50.0, 50.0}, belief::UniformScalar{-50.0, 50.0},
                         belief::UniformScalar{-50.0, 50.0}};
    anywhere.any_rotation = true;
    for (const int model : wanted) {
      belief::SceneObject object;
      object.name = "object_" + std::to_string(known->objects.size() + 1);
      object.model = model;
      object.pose = anywhere;
      known->objects.push_back(std::move(object));
    }
    return known;
  }

  struct Placed {
    Vector3d at = Vector3d::Zero();
    double radius = 0.0, top = 0.0, ground = 0.0;
  };

  const belief::Scene& given_;
  const std::vector<std::vector<filter::LearnedRest>>& rests_;
  core::RandomStream& draws_;
  belief::Scene world_;
  Pose X_UW_;
  bool own_supports_ = false;
  Vector3d focus_ = Vector3d::Zero();
  std::size_t known_ = 0;
  std::vector<Placed> placed_;
  belief::WorldState state_;
};

}  // namespace

core::Result<ImaginedFrame> imagine_frame(const belief::Scene& given,
                                          const std::vector<std::vector<filter::LearnedRest>>& rests,
                                          Backends& backends, rendering::Renderer& renderer, core::RandomStream draws) {
  Imagination imagination(given, rests, draws);
  imagination.furnish();
  imagination.place_camera();
  imagination.put_things();
  PRESCENE_RETURN_IF_ERROR(imagination.settle(backends, core::RandomStream(draws.next_u64(), core::Purpose::kAction)));
  return imagination.see(backends.meshes(), renderer);
}

}  // namespace prescene::service
