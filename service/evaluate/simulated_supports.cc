// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/simulated_supports.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "prescene/core/random.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "room_things.h"
#include "simulated_room.h"
#include "suite_camera.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::Pose;
using geometry::Vector3d;

constexpr double kHalfTurn = std::numbers::pi;
constexpr double kGap = 0.003;            // m, least distance between things
constexpr double kExpectedShare = 0.4;    // of an object's pixels that must be visible ...
constexpr int kExpectedPixels = 1000;     // ... and how many, of a 640 x 480 image
constexpr double kExpectedMargin = 20.0;  // pixels between its centre and the image's edge
constexpr int kTries = 60;                // places tried for one thing

// Things differ in colour, in turn, so that the picture shows where they end.
constexpr std::array<geometry::Rgb, 7> kColors = {
    {{200, 60, 50}, {230, 225, 210}, {40, 80, 160}, {90, 70, 50}, {70, 140, 70}, {235, 190, 60}, {30, 30, 35}}};

struct Placed {
  ThingKind kind;
  Pose X_WO;
  Outline outline;
  double low = 0.0, high = 0.0;
  std::string stands_on;
};

/// Whether two convex outlines come nearer to each other than kGap (along the axes that separate convex polygons).
bool touch(const Outline& a, const Outline& b) {
  const auto apart = [](const Outline& edges, const Outline& first, const Outline& second) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Vector2d edge = (edges[(i + 1) % edges.size()] - edges[i]).normalized();
      const Vector2d normal(edge.y(), -edge.x());
      double low_a = std::numeric_limits<double>::infinity(), high_a = -low_a, low_b = low_a, high_b = -low_a;
      for (const Vector2d& p : first) low_a = std::min(low_a, normal.dot(p)), high_a = std::max(high_a, normal.dot(p));
      for (const Vector2d& p : second) low_b = std::min(low_b, normal.dot(p)), high_b = std::max(high_b, normal.dot(p));
      if (high_a + kGap < low_b || high_b + kGap < low_a) return true;
    }
    return false;
  };
  return !apart(a, a, b) && !apart(b, a, b);
}

bool is_in_view(const geometry::PinholeCamera& camera, const Vector3d& p_CQ) {
  if (!(p_CQ.z() > 0.0)) return false;
  const Vector2d pixel = camera.project(p_CQ);
  return pixel.x() >= kExpectedMargin && pixel.x() <= camera.width - 1 - kExpectedMargin &&
         pixel.y() >= kExpectedMargin && pixel.y() <= camera.height - 1 - kExpectedMargin;
}

class Layout {
 public:
  Layout(const Room& room, const geometry::PinholeCamera& camera, const Pose& X_WC)
      : room_(room), camera_(camera), X_CW_(X_WC.inverse()) {}
  const std::vector<Placed>& things() const { return things_; }

  /// Puts the thing at a random free place in view of a random support, or in every sixth case on something with a flat
  /// top.
  bool put(const ThingKind& kind, core::RandomStream& draws) {
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const RoomPlace place = draws.uniform() < 1.0 / 6.0 ? top_of_a_thing(draws) : any_place(draws);
      const double y = draws.uniform(-place.half.y(), place.half.y());
      const Vector2d at(draws.uniform(-place.half.x(), place.half.x()), y);
      const bool on_thing = place.name.rfind("on ", 0) == 0;
      if (put_at(kind, place, at, on_thing, draws)) return true;
    }
    return false;
  }

  /// Puts the thing between the camera and one that is there already.
  bool put_before(const ThingKind& kind, const Vector3d& p_WC, core::RandomStream& draws) {
    if (things_.empty()) return false;
    const Placed& hidden = things_[draws.uniform_below(things_.size())];
    for (const Furniture& one : room_.furniture)
      for (const RoomPlace& place : one.places) {
        if (place.name != hidden.stands_on) continue;
        const Vector2d towards = (p_WC - hidden.X_WO.translation).head<2>().normalized();
        const Vector2d aside(-towards.y(), towards.x());
        for (int attempt = 0; attempt < kTries; ++attempt) {
          const double beside = draws.uniform(-0.06, 0.06), before = draws.uniform(0.05, 0.2);
          const Vector2d at_W = hidden.X_WO.translation.head<2>() + before * towards + beside * aside;
          const Vector3d at = place.X_WP.inverse() * Vector3d(at_W.x(), at_W.y(), place.X_WP.translation.z());
          if (put_at(kind, place, at.head<2>(), false, draws)) return true;
        }
      }
    return false;
  }

 private:
  RoomPlace any_place(core::RandomStream& draws) const {
    std::vector<const RoomPlace*> places;
    for (const Furniture& one : room_.furniture)
      for (const RoomPlace& place : one.places) places.push_back(&place);
    return *places[draws.uniform_below(places.size())];
  }

  RoomPlace top_of_a_thing(core::RandomStream& draws) const {
    std::vector<const Placed*> flat;
    for (const Placed& thing : things_)
      if (thing.kind.flat_top) flat.push_back(&thing);
    if (flat.empty()) return any_place(draws);
    const Placed& thing = *flat[draws.uniform_below(flat.size())];
    return {"on " + thing.kind.name,
            Pose::from_translation({thing.X_WO.translation.x(), thing.X_WO.translation.y(), thing.high}),
            {0.015, 0.015}};
  }

  bool put_at(const ThingKind& kind, const RoomPlace& place, const Vector2d& at, bool overhanging,
              core::RandomStream& draws) {
    Placed placed;
    placed.kind = kind;
    placed.stands_on = place.name;
    const geometry::Quaterniond& lies = kind.lying[draws.uniform_below(kind.lying.size())];
    const double turn = draws.uniform(-kHalfTurn, kHalfTurn);
    placed.X_WO.rotation = (geometry::exp_rotation(turn * Vector3d::UnitZ()) * lies).normalized();
    geometry::Box box;
    for (const Vector3d& vertex : kind.mesh.vertices) box.extend(placed.X_WO * vertex);
    if (box.sizes().z() > place.headroom) return false;
    const Vector3d foot = place.X_WP * Vector3d(at.x(), at.y(), 0.0);
    placed.X_WO.translation = foot - Vector3d(box.center().x(), box.center().y(), box.min().z());
    placed.low = foot.z();
    placed.high = foot.z() + box.sizes().z();
    placed.outline = outline_of(kind.mesh, placed.X_WO);
    if (!is_in_view(camera_, X_CW_ * placed.X_WO.translation)) return false;
    const Pose X_PW = place.X_WP.inverse();
    for (const Vector2d& p : placed.outline) {
      const Vector3d p_P = X_PW * Vector3d(p.x(), p.y(), foot.z());
      if (!overhanging && (std::abs(p_P.x()) > place.half.x() || std::abs(p_P.y()) > place.half.y())) return false;
    }
    for (const Placed& other : things_)
      if (placed.low < other.high - 1e-6 && other.low < placed.high - 1e-6 && touch(placed.outline, other.outline))
        return false;
    for (const Furniture& one : room_.furniture) {
      const bool own =
          std::any_of(one.places.begin(), one.places.end(), [&](const RoomPlace& p) { return p.name == place.name; });
      if (!own && !one.outline.empty() && placed.low < one.places.back().X_WP.translation.z() &&
          touch(placed.outline, one.outline))
        return false;
    }
    things_.push_back(std::move(placed));
    return true;
  }

  const Room& room_;
  geometry::PinholeCamera camera_;
  Pose X_CW_;
  std::vector<Placed> things_;
};

/// Figures that are not the filter's: a better camera in the middle of a surface, a worse one at edges.
rendering::SimulatedCamera other_camera() {
  rendering::SensorModelOptions sensor;
  sensor.sigma_per_depth_squared = 0.0030;
  sensor.incidence_knee = 0.5;
  sensor.outline_missing = {0.45, 0.30, 0.15, 0.06};
  rendering::SimulatedCameraOptions camera;
  camera.fixed_pattern_share = 0.4;
  camera.correlated_share = 0.4;
  camera.correlation_px = 8.0;
  camera.edge_outlier = {0.30, 0.20, 0.06, 0.01};
  return {rendering::SensorModel(sensor), camera};
}

int pixels_of(const geometry::LabelImage& labels, std::size_t instance) {
  return static_cast<int>(
      std::count(labels.data(), labels.data() + labels.size(), static_cast<std::uint16_t>(1 + instance)));
}

}  // namespace

core::Result<belief::Scene> room_models() {
  belief::Scene scene;
  scene.name = "rooms";
  for (const ThingKind& kind : known_things()) {
    PRESCENE_TRY(belief::ObjectModel model, model_of(kind));
    scene.models.push_back(std::move(model));
  }
  return scene;
}

core::Result<SupportsFrame> simulate_supports(std::uint64_t number, rendering::Renderer& renderer) {
  const core::RandomStream stream(number, core::Purpose::kScenario);
  core::RandomStream draws = stream;
  const Room room = furnish(draws);
  const double elevation = draws.uniform(25.0, 55.0) * kHalfTurn / 180.0;
  const double azimuth = draws.uniform(-0.7, 0.7) - 0.5 * kHalfTurn;  // the row's front faces -y
  const double distance = draws.uniform(0.95, 1.45);
  const double target_y = draws.uniform(-0.1, 0.1), target_x = draws.uniform(-0.1, 0.1);
  const Vector3d target(target_x, target_y, room.middle_height + 0.05);
  const Vector3d p_WC = target + distance * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  SupportsFrame frame;
  frame.observation.stamp_ns = 1'000'000'000;
  frame.observation.frame.camera = {640, 480, 570.0, 570.0, 319.5, 239.5};
  frame.observation.X_WC = looking_at(p_WC, target);
  const geometry::PinholeCamera& camera = frame.observation.frame.camera;
  const Pose& X_WC = frame.observation.X_WC;
  Layout layout(room, camera, X_WC);
  std::vector<ThingKind> kinds = known_things();
  const int wanted = 3 + static_cast<int>(draws.uniform_below(6));
  std::vector<std::size_t> objects, others;  // indices of things
  for (int i = 0; i < wanted; ++i) {
    const auto chosen = static_cast<std::ptrdiff_t>(draws.uniform_below(kinds.size()));
    if (layout.put(kinds[static_cast<std::size_t>(chosen)], draws)) objects.push_back(layout.things().size() - 1);
    kinds.erase(kinds.begin() + chosen);
  }
  const int unknown = 1 + static_cast<int>(draws.uniform_below(3));
  for (int i = 0; i < unknown; ++i) {
    const ThingKind kind = unknown_thing(draws);
    const bool before = draws.uniform() < 0.6;
    if (before ? layout.put_before(kind, p_WC, draws) : layout.put(kind, draws))
      others.push_back(layout.things().size() - 1);
  }

  frame.supports = room.supports;
  frame.has_floor = room.has_floor;
  frame.listed = static_cast<ListedSupports>(number % 3);
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "supports_" + std::to_string(number);
  belief::BoxPose anywhere;
  anywhere.position = {belief::UniformScalar{-1.2, 1.2}, belief::UniformScalar{-1.2, 1.2},
                       belief::UniformScalar{0.0, 1.2}};
  anywhere.any_rotation = true;
  rendering::RenderScene drawn;
  for (const std::size_t i : objects) {
    const Placed& thing = layout.things()[i];
    PRESCENE_TRY(belief::ObjectModel model, model_of(thing.kind));
    belief::SceneObject object;
    object.name = thing.kind.name;
    object.model = static_cast<int>(scene->models.size());
    object.pose = anywhere;
    scene->models.push_back(std::move(model));
    scene->objects.push_back(std::move(object));
    drawn.instances.push_back({rendering::make_render_mesh(thing.kind.mesh), thing.X_WO, {}});
    frame.truth.push_back({thing.X_WO, thing.stands_on});
  }
  for (const std::size_t i : others) {
    const Placed& thing = layout.things()[i];
    drawn.instances.push_back({rendering::make_render_mesh(thing.kind.mesh), thing.X_WO, {}});
  }
  for (const Furniture& one : room.furniture) {
    drawn.instances.push_back(
        {rendering::make_render_mesh(belief::collision_mesh(one.support.collision)), one.support.X_WS, {}});
    const bool listed = draws.uniform() < 0.5;
    if (frame.listed == ListedSupports::kAll || (frame.listed == ListedSupports::kSome && listed))
      scene->supports.push_back(one.support);
  }
  if (room.wall) drawn.instances.push_back({rendering::make_render_mesh(*room.wall), Pose::identity(), {}});
  for (std::size_t i = 0; i < drawn.instances.size(); ++i)
    drawn.instances[i].material = rendering::SurfaceMaterial::opaque(kColors[i % kColors.size()]);

  rendering::RenderOptions options;
  options.normals = true;
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer.render(drawn, camera, X_WC, options, &view));
  for (std::size_t i = 0; i < objects.size(); ++i) {
    rendering::RenderScene alone;
    alone.instances.push_back(drawn.instances[i]);
    rendering::RenderedView unhidden;
    PRESCENE_RETURN_IF_ERROR(renderer.render(alone, camera, X_WC, {}, &unhidden));
    TrueObject& truth = frame.truth[i];
    truth.visible_pixels = pixels_of(view.labels, i);
    truth.visible_share = truth.visible_pixels / static_cast<double>(std::max(1, pixels_of(unhidden.labels, 0)));
    const Vector3d p_CQ = X_WC.inverse() * (truth.X_WO * drawn.instances[i].mesh->centre.cast<double>());
    truth.expected =
        truth.visible_share >= kExpectedShare && truth.visible_pixels >= kExpectedPixels && is_in_view(camera, p_CQ);
  }
  auto depth = std::make_shared<geometry::DepthImage>();
  auto color = std::make_shared<geometry::ColorImage>();
  other_camera().sample(drawn, view, nullptr, camera, X_WC, stream.for_purpose(core::Purpose::kSensorNoise), number,
                        depth.get(), color.get());
  frame.observation.frame.depth = std::move(depth);
  frame.observation.frame.color = std::move(color);
  frame.scene = std::move(scene);
  return frame;
}

}  // namespace prescene::service
