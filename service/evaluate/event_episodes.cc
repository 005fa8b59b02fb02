// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/event_episodes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/core/check.h"
#include "scene_writer.h"

namespace prescene::service {
namespace {

using belief::EventKind;
using geometry::Vector3d;

constexpr double kBegin = 1.0, kEnd = 2.4;  // s; the window

/// A table, `count` things on it in a row, the camera before them.
struct Setting {
  std::vector<Thing> things;
  std::vector<Vector3d> places;
};

Setting put_things(SceneWriter& w, std::uint64_t seed, std::size_t count, double y_middle = 0.0) {
  table(w);
  Setting setting;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = "thing_" + std::to_string(i);
    setting.things.push_back(everyday_thing(w, name, seed + 2 * i + seed / 6));
    const double x = 0.2 * (static_cast<double>(i) - 0.5 * static_cast<double>(count - 1));
    // One declaration each: the order in which arguments are evaluated is the compiler's choice.
    const double off_y = w.between(-0.04, 0.04), off_x = w.between(-0.02, 0.02);
    setting.places.emplace_back(x + off_x, y_middle + off_y, setting.things.back().height);
    w.object(name, name, setting.places.back(), {0, 0, w.between(-90, 90)});
  }
  w.camera_at({0.0, y_middle, 0.06});
  // A quarter of the pixels of a usual camera: the likelihood takes 80 across of either.
  w.camera = "  width: 320\n  height: 240\n" + w.camera;
  return setting;
}

/// A push of a thing from outside, `length` (m) beyond where it touches.
void push(SceneWriter& w, const Vector3d& place, const Thing& thing, double height, double direction, double length,
          double speed, EventEpisode& episode) {
  const Vector3d along(std::cos(direction), std::sin(direction), 0.0);
  const Vector3d across(-along.y(), along.x(), 0.0);
  Vector3d middle = place + w.between(-0.2, 0.2) * thing.reach * across;
  middle.z() = height;
  const double before = thing.reach + 0.02;
  const Vector3d from = middle - before * along, to = middle + (length - 0.6 * thing.reach) * along;
  const double duration = (to - from).norm() / speed;
  // It touches a little after it begins.
  const double begins = std::max(0.05, episode.time - 0.02 / speed);
  w.action(begins, "push: {from: " + list(from) + ", to: " + list(to) + ", duration: " + number(duration) + "}");
  episode.direction = direction;
  episode.reports_robot = false;
}

}  // namespace

const std::vector<std::string>& event_episode_kinds() {
  static const std::vector<std::string> kKinds = {"nothing",    "pushed",      "pushed_over", "pushed_off",
                                                  "bumped",     "bumped_over", "slipped",     "moved",
                                                  "taken_away", "put_in",      "exchanged"};
  return kKinds;
}

EventEpisode make_event_episode(const std::string& kind, std::uint64_t seed) {
  const auto& kinds = event_episode_kinds();
  const auto at = std::find(kinds.begin(), kinds.end(), kind);
  PRESCENE_CHECK(at != kinds.end());
  SceneWriter w(
      core::RandomStream(seed, core::Purpose::kEvaluation, 1, static_cast<std::uint32_t>(at - kinds.begin())));
  EventEpisode episode;
  episode.kind = kind;
  episode.from = kBegin;
  episode.to = kEnd;
  episode.time = w.between(kBegin + 0.15, kBegin + 0.6);
  const auto finish = [&] {
    episode.world = w.text(kind, kEnd + 0.05, true);
    episode.known = w.text(kind, kEnd + 0.05, episode.reports_robot);
    return episode;
  };
  const double direction = w.between(-std::numbers::pi, std::numbers::pi);
  const auto which = static_cast<std::size_t>(seed % 3);
  if (kind == "slipped") {
    table(w);
    const Thing thing = everyday_thing(w, "thing_0", seed);
    const double height = w.between(0.06, 0.14), y = w.between(-0.05, 0.05);
    const Vector3d p(w.between(-0.05, 0.05), y, height + thing.height);
    // A hand with the fingers a little apart, so that nothing is held by accident.
    w.hand("gripper", kGripper, {{p + Vector3d(0, 0, thing.height + thing.top + 0.06), Vector3d::Zero()}}, {0.0});
    w.object("thing_0", "thing_0", p, {0, 0, w.between(-60, 60)}, ", held_by: gripper");
    w.camera_at(p + Vector3d(0, 0, 0.05));
    w.camera = "  width: 320\n  height: 240\n" + w.camera;
    episode.truth = EventKind::kSlipped;
    episode.object = "thing_0";
    geometry::Twist added;
    for (int i = 0; i < 3; ++i) added.linear[i] = 0.04 * w.draws.normal(), added.angular[i] = 0.4 * w.draws.normal();
    episode.changes = {{episode.time, "thing_0", {}, added}};
    return finish();
  }
  if (kind == "exchanged") {
    table(w);
    const std::string shape =
        "cylinder: {radius: 0.034, length: 0.11}, density: 500, friction: 0.5, learn_colors: true, "
        "symmetry: {axis: z, continuous: true, flip: true}";
    w.model("red_can", shape + ", color: '#c03020'");
    w.model("blue_can", shape + ", color: '#2040c0'");
    const double red_y = w.between(-0.05, 0.05), red_x = w.between(-0.14, -0.08);
    const double blue_y = w.between(-0.05, 0.05), blue_x = w.between(0.08, 0.14);
    const Vector3d red(red_x, red_y, 0.055), blue(blue_x, blue_y, 0.055);
    w.object("red", "red_can", red, Vector3d::Zero());
    w.object("blue", "blue_can", blue, Vector3d::Zero());
    w.camera_at({0.0, 0.0, 0.06});
    w.camera = "  width: 320\n  height: 240\n" + w.camera;
    episode.truth = EventKind::kExchanged;
    episode.object = "red";
    episode.changes = {{episode.time, "red", geometry::Pose::from_translation(blue), {}},
                       {episode.time, "blue", geometry::Pose::from_translation(red), {}}};
    return finish();
  }
  if (kind == "put_in") {
    Setting setting = put_things(w, seed, 2);
    const Thing comes = everyday_thing(w, "comes", seed + 3);
    w.objects += "  comes: {model: comes, pose: {position: {uniform: {from: [-0.3, -0.25, " + number(comes.height) +
                 "], to: [0.3, 0.25, " + number(comes.height) + "]}}}}\n";
    geometry::Pose X_WO =
        geometry::Pose::from_translation({w.between(-0.1, 0.1), -0.16 + w.between(-0.03, 0.03), comes.height + 0.001});
    X_WO.rotation = geometry::exp_rotation({0.0, 0.0, w.between(-1.0, 1.0)});
    episode.truth = EventKind::kPutIn;
    episode.object = "comes";
    episode.changes = {{0.0, "comes", {}, {}}, {episode.time, "comes", X_WO, {}}};
    return finish();
  }
  if (kind == "pushed_over" || kind == "bumped_over") {
    table(w);
    const double h = w.about(0.19, 0.1);
    w.model("thing_0",
            "box: " + list({0.055, 0.07, h}) +
                ", density: 500, friction: {normal: [0.5, 0.08], min: 0.1}, symmetry: cuboid, color: '#3060c0'");
    const Thing tower{"thing_0", 0.5 * h, 0.5 * std::hypot(0.055, 0.07)};
    const Thing other = everyday_thing(w, "thing_1", seed + 1);
    const double y = w.between(-0.05, 0.05), x = w.between(-0.06, 0.0);
    const Vector3d place(x, y, 0.5 * h);
    w.object("thing_0", "thing_0", place, {0, 0, w.between(-90, 90)});
    w.object("thing_1", "thing_1", {0.30, 0.16, other.height}, {0, 0, w.between(-60, 60)});
    w.camera_at({0.05, 0.0, 0.07});
    w.camera = "  width: 320\n  height: 240\n" + w.camera;
    episode.object = "thing_0";
    if (kind == "pushed_over") {
      episode.truth = EventKind::kPushed;
      const double speed = w.between(0.15, 0.4), length = w.between(0.07, 0.12), height = w.between(0.75, 0.92) * h;
      push(w, place, tower, height, direction, length, speed, episode);
    } else {
      episode.truth = EventKind::kBumped;
      episode.direction = direction;
      const Vector3d v = w.between(0.7, 1.2) * Vector3d(std::cos(direction), std::sin(direction), 0.0);
      // Touched above its middle by `arm`: it turns about an axis across the blow, by inertia of a box.
      const double arm = w.between(0.2, 0.4) * h;
      const double inertia = (0.0625 * 0.0625 + h * h) / 12.0;
      const Vector3d rate = Vector3d::UnitZ().cross(v) * arm / inertia;
      episode.changes = {{episode.time, "thing_0", {}, geometry::Twist{rate, v}}};
    }
    return finish();
  }
  const Setting setting = put_things(w, seed, 3, kind == "pushed_off" ? -0.30 : 0.0);
  const Thing& thing = setting.things[which];
  const Vector3d& place = setting.places[which];
  const double top = thing.height > 0.0 ? 2.0 * thing.height : 0.2;
  if (kind == "nothing") return finish();
  episode.object = thing.name;
  if (kind == "pushed") {
    episode.truth = EventKind::kPushed;
    const double speed = w.between(0.12, 0.4), length = w.between(0.05, 0.12), height = w.between(0.15, 0.35) * top;
    push(w, place, thing, height, direction, length, speed, episode);
  } else if (kind == "pushed_off") {
    episode.truth = EventKind::kPushed;
    const double speed = w.between(0.3, 0.5), length = w.between(0.18, 0.25);
    const double off = -0.5 * std::numbers::pi + w.between(-0.3, 0.3), height = w.between(0.15, 0.35) * top;
    push(w, place, thing, height, off, length, speed, episode);
  } else if (kind == "bumped") {
    episode.truth = EventKind::kBumped;
    episode.direction = direction;
    const Vector3d v = w.between(0.5, 1.0) * Vector3d(std::cos(direction), std::sin(direction), 0.0);
    Vector3d shifted = v;
    const Vector3d rate(0.0, 0.0, w.between(-2.0, 2.0));
    // The velocity of the frame's origin; the blow is about the height of the centre of mass.
    if (thing.height == 0.0) shifted -= rate.cross(Vector3d(0.0, 0.0, 0.5 * top));
    episode.changes = {{episode.time, thing.name, {}, geometry::Twist{rate, shifted}}};
  } else if (kind == "taken_away") {
    episode.truth = EventKind::kTakenAway;
    episode.changes = {{episode.time, thing.name, {}, {}}};
  } else {
    episode.truth = EventKind::kMoved;
    const double x = place.x() + w.between(-0.05, 0.05);
    const double side = w.between(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    const double y = place.y() + side * w.between(0.12, 0.2);
    geometry::Pose X_WO = geometry::Pose::from_translation({x, y, thing.height + 0.001});
    X_WO.rotation = geometry::exp_rotation({0.0, 0.0, w.between(-1.5, 1.5)});
    episode.changes = {{episode.time, thing.name, {}, {}}, {episode.time + w.between(0.2, 0.5), thing.name, X_WO, {}}};
  }
  return finish();
}

}  // namespace prescene::service
