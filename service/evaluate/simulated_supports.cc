// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/simulated_supports.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "prescene/core/random.h"
#include "prescene/geometry/polygon.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "suite_camera.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::BoxShape;
using geometry::Pose;
using geometry::SymmetryGroup;
using geometry::TriangleMesh;
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

using Outline = std::vector<Vector2d>;

/// A thing to place, and the ways in which it can lie.
struct Kind {
  std::string name;
  TriangleMesh mesh;
  geometry::Primitive solid;  // stands for it in simulations
  std::vector<geometry::Quaterniond> lying;
  bool flat_top = false;  // something may stand on it
  SymmetryGroup symmetry{};
};

geometry::Quaterniond about(const Vector3d& axis, double angle) { return geometry::exp_rotation(angle * axis); }

std::vector<geometry::Quaterniond> upright_or_on_its_side() {
  return {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), 0.5 * kHalfTurn)};
}

std::vector<geometry::Quaterniond> on_any_face() {
  return {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), 0.5 * kHalfTurn),
          about(Vector3d::UnitY(), 0.5 * kHalfTurn)};
}

Kind box_kind(const std::string& name, const Vector3d& size) {
  return {name, geometry::make_mesh(BoxShape{size}), BoxShape{size}, on_any_face(), true, SymmetryGroup::cuboid()};
}

Kind can_kind(const std::string& name, double radius, double length) {
  const geometry::Cylinder cylinder{radius, length};
  return {name,     geometry::make_mesh(cylinder, 24),
          cylinder, upright_or_on_its_side(),
          false,    SymmetryGroup::continuous(Vector3d::UnitZ(), true)};
}

Kind mug_kind() {
  TriangleMesh mesh =
      geometry::make_lathe({{0.0, 0.0}, {0.040, 0.0}, {0.041, 0.09}, {0.037, 0.09}, {0.036, 0.005}, {0.0, 0.005}}, 24);
  const auto bar = [&](const Vector3d& size, const Vector3d& middle) {
    mesh = geometry::joined(mesh,
                            geometry::transformed(geometry::make_mesh(BoxShape{size}), Pose::from_translation(middle)));
  };
  bar({0.030, 0.012, 0.010}, {0.054, 0.0, 0.070});
  bar({0.030, 0.012, 0.010}, {0.054, 0.0, 0.025});
  bar({0.010, 0.012, 0.055}, {0.066, 0.0, 0.0475});
  return {"mug",
          mesh,
          geometry::Cylinder{0.041, 0.09},
          {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), kHalfTurn)},
          false};
}

std::vector<Kind> object_kinds() {
  return {
      box_kind("cereal", {0.06, 0.16, 0.21}),
      box_kind("tea_box", {0.07, 0.075, 0.13}),
      box_kind("brick", {0.10, 0.20, 0.065}),
      can_kind("can", 0.034, 0.102),
      can_kind("tin", 0.051, 0.139),
      {"bottle",
       geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.035, 0.13}, {0.014, 0.18}, {0.014, 0.21}, {0.0, 0.21}}, 24),
       geometry::Cylinder{0.035, 0.21}, upright_or_on_its_side(), false,
       SymmetryGroup::continuous(Vector3d::UnitZ(), false)},
      {"carton", geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23), BoxShape{{0.07, 0.07, 0.23}}, on_any_face(),
       false, SymmetryGroup::cyclic(Vector3d::UnitZ(), 2)},
      mug_kind(),
      {"bowl",
       geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.080, 0.055}, {0.076, 0.055}, {0.033, 0.005}, {0.0, 0.005}},
                            24),
       geometry::Cylinder{0.08, 0.055},
       {geometry::Quaterniond::Identity()},
       false,
       SymmetryGroup::continuous(Vector3d::UnitZ(), false)},
      {"ball",
       geometry::make_mesh(geometry::Sphere{0.045}, 24),
       geometry::Sphere{0.045},
       {geometry::Quaterniond::Identity()},
       false,
       SymmetryGroup::every_rotation()}};
}

/// Something nobody knows of: a box or a cylinder.
Kind unknown_kind(core::RandomStream& draws) {
  if (draws.uniform() < 0.6) {
    const double x = draws.uniform(0.04, 0.14), y = draws.uniform(0.04, 0.14), z = draws.uniform(0.04, 0.18);
    return box_kind("unknown box", {x, y, z});
  }
  const double radius = draws.uniform(0.02, 0.06), length = draws.uniform(0.05, 0.20);
  return can_kind("unknown can", radius, length);
}

/// A level rectangle that things can stand on.
struct Place {
  std::string name;
  Pose X_WP;  // at its middle, z up
  Vector2d half = Vector2d::Zero();
  double headroom = std::numeric_limits<double>::infinity();
};

struct Furniture {
  belief::Support support;
  std::vector<Place> places;
  Outline outline;  // on the ground; empty for the floor, which is under everything
};

struct Placed {
  Kind kind;
  Pose X_WO;
  Outline outline;
  double low = 0.0, high = 0.0;
  std::string stands_on;
};

Outline outline_of(const TriangleMesh& mesh, const Pose& X_WM) {
  Outline points;
  for (const Vector3d& vertex : mesh.vertices) points.push_back((X_WM * vertex).head<2>());
  return geometry::convex_polygon(std::move(points));
}

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

belief::PrimitiveShape part(const Vector3d& size, const Vector3d& middle) {
  return {BoxShape{size}, Pose::from_translation(middle)};
}

/// Furniture stands with the middle of its base at the support's origin.
Furniture block(const std::string& name, const Vector2d& size, double height) {
  Furniture made;
  made.support.name = name;
  made.support.collision.push_back(part({size.x(), size.y(), height}, {0.0, 0.0, 0.5 * height}));
  made.places.push_back({name, Pose::from_translation({0.0, 0.0, height}), 0.5 * size});
  return made;
}

Furniture table(const std::string& name, const Vector2d& size, double height) {
  constexpr double kTop = 0.03, kLeg = 0.04;
  Furniture made;
  made.support.name = name;
  made.support.collision.push_back(part({size.x(), size.y(), kTop}, {0.0, 0.0, height - 0.5 * kTop}));
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      made.support.collision.push_back(
          part({kLeg, kLeg, height - kTop},
               {0.5 * x * (size.x() - kLeg), 0.5 * y * (size.y() - kLeg), 0.5 * (height - kTop)}));
  made.places.push_back({name, Pose::from_translation({0.0, 0.0, height}), 0.5 * size});
  return made;
}

Furniture shelf(const std::string& name, const Vector2d& size, double low, double high) {
  constexpr double kBoard = 0.02;
  Furniture made;
  made.support.name = name;
  for (const double top : {low, high}) {
    made.support.collision.push_back(part({size.x(), size.y(), kBoard}, {0.0, 0.0, top - 0.5 * kBoard}));
    made.places.push_back({name + (top == low ? " (lower board)" : " (upper board)"),
                           Pose::from_translation({0.0, 0.0, top}), 0.5 * size - Vector2d(2.0 * kBoard, 0.0)});
  }
  made.places[0].headroom = high - kBoard - low - 0.01;
  for (const double x : {-1.0, 1.0})
    made.support.collision.push_back(
        part({kBoard, size.y(), high - kBoard}, {0.5 * x * (size.x() - kBoard), 0.0, 0.5 * (high - kBoard)}));
  return made;
}

/// The room: floor (perhaps), furniture in a row, a wall behind it (perhaps).
struct Room {
  std::vector<Furniture> furniture;
  std::optional<TriangleMesh> wall;
  bool has_floor = false;
  int supports = 0;
  double middle_height = 0.0;
};

Room furnish(core::RandomStream& draws) {
  Room room;
  const int wanted = 2 + static_cast<int>(draws.uniform_below(3));
  room.has_floor = draws.uniform() < 0.6;
  room.supports = room.has_floor ? 1 : 0;
  std::vector<Furniture> row;
  while (room.supports < wanted) {
    const Vector2d size(draws.uniform(0.35, 0.55), draws.uniform(0.30, 0.50));
    const double height = draws.uniform(0.12, 0.75);
    const double kind = draws.uniform();
    const std::string number = std::to_string(row.size() + 1);
    if (kind < 0.25 && room.supports + 2 <= wanted) {
      const double low = draws.uniform(0.10, 0.35);
      row.push_back(shelf("shelf_" + number, size, low, low + draws.uniform(0.34, 0.45)));
    } else if (kind < 0.6) {
      row.push_back(table("table_" + number, size, std::max(0.3, height)));
    } else {
      row.push_back(block("block_" + number, size, height));
    }
    room.supports += static_cast<int>(row.back().places.size());
  }
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double x = 0.65 * (static_cast<double>(i) - 0.5 * static_cast<double>(row.size() - 1));
    const Pose X_WS{about(Vector3d::UnitZ(), draws.uniform(-0.2, 0.2)), {x, draws.uniform(-0.12, 0.12), 0.0}};
    Furniture& one = row[i];
    one.support.X_WS = X_WS;
    one.outline = outline_of(belief::collision_mesh(one.support.collision), X_WS);
    for (Place& place : one.places) {
      place.X_WP = X_WS * place.X_WP;
      room.middle_height += place.X_WP.translation.z() / room.supports;
    }
    room.furniture.push_back(std::move(one));
  }
  if (room.has_floor) {
    Furniture floor;
    floor.support.name = "floor";
    floor.support.collision.push_back(part({6.0, 6.0, 0.1}, {0.0, 0.0, -0.05}));
    floor.places.push_back({"floor", Pose::from_translation({0.0, -0.35, 0.0}), {0.9, 0.6}});
    room.furniture.push_back(std::move(floor));
  }
  if (draws.uniform() < 0.3)
    room.wall = geometry::transformed(geometry::make_mesh(BoxShape{{6.0, 0.1, 4.0}}),
                                      Pose::from_translation({0.0, draws.uniform(0.45, 0.7), 1.0}));
  return room;
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
  bool put(const Kind& kind, core::RandomStream& draws) {
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const Place place = draws.uniform() < 1.0 / 6.0 ? top_of_a_thing(draws) : any_place(draws);
      const Vector2d at(draws.uniform(-place.half.x(), place.half.x()), draws.uniform(-place.half.y(), place.half.y()));
      const bool on_thing = place.name.rfind("on ", 0) == 0;
      if (put_at(kind, place, at, on_thing, draws)) return true;
    }
    return false;
  }

  /// Puts the thing between the camera and one that is there already.
  bool put_before(const Kind& kind, const Vector3d& p_WC, core::RandomStream& draws) {
    if (things_.empty()) return false;
    const Placed& hidden = things_[draws.uniform_below(things_.size())];
    for (const Furniture& one : room_.furniture)
      for (const Place& place : one.places) {
        if (place.name != hidden.stands_on) continue;
        const Vector2d towards = (p_WC - hidden.X_WO.translation).head<2>().normalized();
        const Vector2d aside(-towards.y(), towards.x());
        for (int attempt = 0; attempt < kTries; ++attempt) {
          const Vector2d at_W = hidden.X_WO.translation.head<2>() + draws.uniform(0.05, 0.2) * towards +
                                draws.uniform(-0.06, 0.06) * aside;
          const Vector3d at = place.X_WP.inverse() * Vector3d(at_W.x(), at_W.y(), place.X_WP.translation.z());
          if (put_at(kind, place, at.head<2>(), false, draws)) return true;
        }
      }
    return false;
  }

 private:
  Place any_place(core::RandomStream& draws) const {
    std::vector<const Place*> places;
    for (const Furniture& one : room_.furniture)
      for (const Place& place : one.places) places.push_back(&place);
    return *places[draws.uniform_below(places.size())];
  }

  Place top_of_a_thing(core::RandomStream& draws) const {
    std::vector<const Placed*> flat;
    for (const Placed& thing : things_)
      if (thing.kind.flat_top) flat.push_back(&thing);
    if (flat.empty()) return any_place(draws);
    const Placed& thing = *flat[draws.uniform_below(flat.size())];
    return {"on " + thing.kind.name,
            Pose::from_translation({thing.X_WO.translation.x(), thing.X_WO.translation.y(), thing.high}),
            {0.015, 0.015}};
  }

  bool put_at(const Kind& kind, const Place& place, const Vector2d& at, bool overhanging, core::RandomStream& draws) {
    Placed placed;
    placed.kind = kind;
    placed.stands_on = place.name;
    placed.X_WO.rotation = (about(Vector3d::UnitZ(), draws.uniform(-kHalfTurn, kHalfTurn)) *
                            kind.lying[draws.uniform_below(kind.lying.size())])
                               .normalized();
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
          std::any_of(one.places.begin(), one.places.end(), [&](const Place& p) { return p.name == place.name; });
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

core::Result<belief::ObjectModel> model_of(const Kind& kind) {
  belief::ObjectModel model;
  model.name = kind.name;
  model.collision.push_back(
      belief::PrimitiveShape{kind.solid, Pose::from_translation(geometry::bounding_box(kind.mesh).center())});
  model.visual = std::make_shared<const TriangleMesh>(kind.mesh);
  model.symmetry = kind.symmetry;
  return belief::with_derived_properties(std::move(model));
}

}  // namespace

core::Result<belief::Scene> room_models() {
  belief::Scene scene;
  scene.name = "rooms";
  for (const Kind& kind : object_kinds()) {
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
  const Vector3d target(draws.uniform(-0.1, 0.1), draws.uniform(-0.1, 0.1), room.middle_height + 0.05);
  const Vector3d p_WC = target + distance * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  SupportsFrame frame;
  frame.observation.stamp_ns = 1'000'000'000;
  frame.observation.frame.camera = {640, 480, 570.0, 570.0, 319.5, 239.5};
  frame.observation.X_WC = looking_at(p_WC, target);
  const geometry::PinholeCamera& camera = frame.observation.frame.camera;
  const Pose& X_WC = frame.observation.X_WC;
  Layout layout(room, camera, X_WC);
  std::vector<Kind> kinds = object_kinds();
  const int wanted = 3 + static_cast<int>(draws.uniform_below(6));
  std::vector<std::size_t> objects, others;  // indices of things
  for (int i = 0; i < wanted; ++i) {
    const auto chosen = static_cast<std::ptrdiff_t>(draws.uniform_below(kinds.size()));
    if (layout.put(kinds[static_cast<std::size_t>(chosen)], draws)) objects.push_back(layout.things().size() - 1);
    kinds.erase(kinds.begin() + chosen);
  }
  const int unknown = 1 + static_cast<int>(draws.uniform_below(3));
  for (int i = 0; i < unknown; ++i) {
    const Kind kind = unknown_kind(draws);
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
