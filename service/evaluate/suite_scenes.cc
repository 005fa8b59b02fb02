// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/suite_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "prescene/core/check.h"
#include "scene_writer.h"

namespace prescene::service {
namespace {

using geometry::Vector3d;
using Writer = SceneWriter;

/// Poses of a hand over time.
struct Path {
  std::vector<std::pair<Vector3d, Vector3d>> poses;  // positions, and turns as euler_deg
  std::vector<double> times;
};

/// Lets a path go on from `p`, where it is at `begin`, through the air above it until `end`, at up to 0.3 m/s and 30
/// degrees a second about each axis.
void wander(Writer& w, const Vector3d& p, double begin, double end, Path& path) {
  const Vector3d home = p + Vector3d(0.0, 0.0, 0.12);
  Vector3d at = p, euler = Vector3d::Zero();
  for (double t = begin; t < end;) {
    const double step = w.between(0.5, 0.8);
    // One declaration each: the order in which arguments are evaluated is the compiler's choice.
    const double z = w.between(-0.06, 0.10), y = w.between(-0.12, 0.12), x = w.between(-0.15, 0.15);
    const Vector3d goal = home + Vector3d(x, y, z);
    Vector3d move = goal - at;
    move *= std::min(1.0, 0.3 * step / move.norm());
    at += move;
    for (int i = 0; i < 3; ++i) euler[i] = std::clamp(euler[i] + w.between(-30.0, 30.0) * step, -35.0, 35.0);
    t += step;
    path.poses.emplace_back(at, euler);
    path.times.push_back(t);
  }
}

/// A gripper that stays at `p` until `begin` and wanders until `end`.
void carry(Writer& w, const std::string& hand, const Vector3d& p, double begin, double end) {
  Path path{{{p, Vector3d::Zero()}}, {begin}};
  wander(w, p, begin, end, path);
  w.hand(hand, kGripper, path.poses, path.times);
}

SuiteScene in_hand(Writer& w, std::uint64_t seed) {
  table(w);
  const Thing thing = everyday_thing(w, "thing", seed);
  const double y = w.between(-0.05, 0.05), x = w.between(-0.05, 0.05);
  const Vector3d p(x, y, 0.10);
  // Between the fingers, below the palm.
  const double grip = std::max(0.03, thing.top - (kPalmHeight - 0.005));
  carry(w, "gripper", p + Vector3d(0, 0, thing.height + grip), 0.3, 3.0);
  w.object("thing", "thing", p + Vector3d(0, 0, thing.height), {0, 0, w.between(-60, 60)}, ", held_by: gripper");
  w.camera_at(p + Vector3d(0, 0, 0.15));
  return {w.text("in_hand", 3.0, true), w.text("in_hand", 3.0, true), {}, true};
}

SuiteScene behind_box(Writer& w, std::uint64_t seed) {
  table(w);
  w.support("screen", "box: [0.24, 0.06, 0.24], pose: {position: [0.08, -0.05, 0.12]}, color: [0.4, 0.4, 0.45]");
  const Thing thing = everyday_thing(w, "thing", seed % 2 == 0 ? 4 : 2);
  const double y = w.between(0.10, 0.14);
  w.object("thing", "thing", {-0.22, y, thing.height}, {0, 0, w.between(-20, 20)});
  w.action(0.3, "push: {from: [" + number(-0.22 - thing.reach - 0.03) + ", " + number(y) + ", 0.02], to: [" +
                    number(w.between(0.0, 0.06) - thing.reach) + ", " + number(y + 0.01) + ", 0.02], duration: 1.3}");
  w.camera = "  fov_deg: 58\n  look: {from: [0.05, -0.8, 0.33], at: [0.0, 0.0, 0.08]}\n";
  return {w.text("behind_box", 3.0, true), w.text("behind_box", 3.0, true), {}, true};
}

SuiteScene drawer(Writer& w, std::uint64_t) {
  table(w);
  w.support("cabinet",
            "parts: [{box: [0.36, 0.30, 0.02], position: [0, 0, 0.17]}, {box: [0.02, 0.30, 0.16], position: [-0.17, 0, "
            "0.08]}, {box: [0.02, 0.30, 0.16], position: [0.17, 0, 0.08]}], pose: {position: [0, 0.2, 0]}");
  const double out = w.between(0.9, 1.3), back = out + w.between(0.9, 1.2);
  w.hand("drawer", "open_bin: {inner: [0.26, 0.22, 0.06], wall: 0.008}",
         {{{0, -0.06, 0.012}, Vector3d::Zero()},
          {{0, -0.06, 0.012}, Vector3d::Zero()},
          {{0, 0.2, 0.012}, Vector3d::Zero()},
          {{0, 0.2, 0.012}, Vector3d::Zero()},
          {{0, -0.06, 0.012}, Vector3d::Zero()}},
         {0.0, out - 0.8, out, back - 0.3, back + 0.6});
  const double side = w.about(0.05, 0.15);
  w.model("block", "box: " + list({side, 1.3 * side, 0.9 * side}) +
                       ", density: 500, friction: 0.5, symmetry: cuboid, color: '#d04040'");
  const double turn = w.between(-40, 40), x = w.between(-0.08, 0.08), y = w.between(-0.10, 0.0);
  w.object("block", "block", {x, y, 0.021 + 0.45 * side}, {0, 0, turn});
  w.camera_at({0.0, -0.02, 0.05});
  return {w.text("drawer", 3.4, true), w.text("drawer", 3.4, true), {}, true};
}

SuiteScene tipped(Writer& w, std::uint64_t seed) {
  table(w);
  const double h = w.about(0.19, 0.1);
  w.model("tower", "box: " + list({0.055, 0.075, h}) +
                       ", density: 500, friction: {normal: [0.5, 0.08], min: 0.1}, symmetry: cuboid, color: '#3060c0'");
  const Thing other = everyday_thing(w, "other", seed + 1);
  w.object("tower", "tower", {-0.05, 0.0, 0.5 * h}, {0, 0, w.between(-15, 15)});
  w.object("other", "other", {0.30, 0.16, other.height}, {0, 0, w.between(-60, 60)});
  const double lasts = w.between(1.2, 1.8), to_y = w.between(-0.01, 0.01);
  w.action(0.3, "push: {from: [-0.16, 0, " + number(0.8 * h) + "], to: [0.08, " + number(to_y) + ", " +
                    number(0.8 * h) + "], duration: " + number(lasts) + "}");
  w.camera_at({0.05, 0.0, 0.07});
  return {w.text("tipped", 2.6, true), w.text("tipped", 2.6, true), {}, true};
}

SuiteScene twins(Writer& w, std::uint64_t) {
  table(w);
  const std::string shape =
      "cylinder: {radius: 0.034, length: 0.11}, density: 500, friction: 0.5, learn_colors: true, "
      "symmetry: {axis: z, continuous: true, flip: true}";
  w.model("red_can", shape + ", color: '#c03020'");
  w.model("blue_can", shape + ", color: '#2040c0'");
  const double red_y = w.between(-0.03, 0.03), red_x = w.between(-0.12, -0.08);
  const double blue_y = w.between(-0.03, 0.03), blue_x = w.between(0.08, 0.12);
  const Vector3d red(red_x, red_y, 0.055), blue(blue_x, blue_y, 0.055);
  w.object("red", "red_can", red, Vector3d::Zero());
  w.object("blue", "blue_can", blue, Vector3d::Zero());
  w.camera = "  fov_deg: 58\n  look: {from: [0.0, -0.8, 0.45], at: [0.0, 0.0, 0.05]}\n";
  const std::string known = w.text("twins", 3.0, false);
  // A board that nobody knows of passes in front; behind it the cans change places.
  w.hand("board", "box: [0.46, 0.01, 0.32]",
         {{{-0.9, -0.3, 0.18}, Vector3d::Zero()},
          {{-0.9, -0.3, 0.18}, Vector3d::Zero()},
          {{0.0, -0.3, 0.18}, Vector3d::Zero()},
          {{0.0, -0.3, 0.18}, Vector3d::Zero()},
          {{0.9, -0.3, 0.18}, Vector3d::Zero()}},
         {0.0, 0.7, 1.3, 1.5, 2.1});
  return {w.text("twins", 3.0, true),
          known,
          {{1.4, "red", geometry::Pose::from_translation(blue)}, {1.4, "blue", geometry::Pose::from_translation(red)}},
          false};
}

SuiteScene taken_away(Writer& w, std::uint64_t seed) {
  table(w);
  for (std::uint64_t i = 0; i < 3; ++i) {
    const std::string name = "thing_" + std::to_string(i);
    const Thing thing = everyday_thing(w, name, seed + 2 * i);
    const double turn = w.between(-90, 90), off_x = w.between(-0.02, 0.02), y = w.between(-0.08, 0.08);
    w.object(name, name, {-0.18 + 0.18 * static_cast<double>(i) + off_x, y, thing.height}, {0, 0, turn});
  }
  w.camera_at({0.0, 0.0, 0.06});
  return {w.text("taken_away", 2.5, true),
          w.text("taken_away", 2.5, true),
          {{w.between(0.6, 1.0), "thing_" + std::to_string(seed % 3), std::nullopt}},
          true};
}

SuiteScene put_in(Writer& w, std::uint64_t seed) {
  table(w);
  const Thing there = everyday_thing(w, "there", seed);
  const Thing comes = everyday_thing(w, "comes", seed + 3);
  const double turn = w.between(-90, 90), y = w.between(-0.06, 0.06);
  w.object("there", "there", {-0.12, y, there.height}, {0, 0, turn});
  w.objects += "  comes: {model: comes, pose: {position: {uniform: {from: [-0.3, -0.2, " + number(comes.height) +
               "], to: [0.3, 0.2, " + number(comes.height) + "]}}}}\n";
  w.camera_at({0.0, 0.0, 0.06});
  geometry::Pose X_WO =
      geometry::Pose::from_translation({w.between(0.06, 0.18), w.between(-0.08, 0.08), comes.height + 0.002});
  X_WO.rotation = geometry::exp_rotation({0.0, 0.0, w.between(-1.0, 1.0)});
  return {w.text("put_in", 2.5, true),
          w.text("put_in", 2.5, true),
          {{0.0, "comes", std::nullopt}, {w.between(0.6, 1.0), "comes", X_WO}},
          true};
}

SuiteScene clutter(Writer& w, std::uint64_t seed) {
  table(w);
  for (std::uint64_t i = 0; i < 12; ++i) {
    const std::string name = "thing_" + std::to_string(i);
    const Thing thing = everyday_thing(w, name, seed + i);
    const double column = static_cast<double>(i % 4), row = static_cast<double>(i / 4);
    const double turn = w.between(-90, 90), off_x = w.between(-0.012, 0.012), off_y = w.between(-0.012, 0.012);
    w.object(name, name, {-0.30 + 0.20 * column + off_x, -0.18 + 0.20 * row + off_y, thing.height}, {0, 0, turn});
  }
  w.action(0.4, "push: {from: [-0.45, -0.18, 0.05], to: [-0.24, -0.16, 0.05], duration: 1.2}");
  w.camera = "  fov_deg: 58\n  look: {from: [" + number(w.between(-0.1, 0.1)) + ", -0.95, 0.75], at: [0, 0, 0.03]}\n";
  return {w.text("clutter", 2.0, true), w.text("clutter", 2.0, true), {}, true};
}

SuiteScene unknown_hand(Writer& w, std::uint64_t seed) {
  table(w);
  const Thing mug = everyday_thing(w, "mug", 3);
  const Thing other = everyday_thing(w, "other", seed + 1);
  const double y = w.between(-0.05, 0.05), x = w.between(-0.08, 0.0);
  const Vector3d p(x, y, mug.height);
  w.object("mug", "mug", p, {0, 0, w.between(-90, 90)});
  w.object("other", "other", {0.24, 0.16, other.height}, {0, 0, w.between(-60, 60)});
  w.camera_at(p + Vector3d(0, 0, 0.12));
  const std::string known = w.text("unknown_hand", 3.4, false);
  // It comes from above, takes the mug and carries it about.
  const Vector3d grip = p + Vector3d(0, 0, mug.height + 0.01);
  Path path{{{grip + Vector3d(0.3, 0.1, 0.3), Vector3d::Zero()}, {grip, Vector3d::Zero()}, {grip, Vector3d::Zero()}},
            {0.2, 1.0, 1.1}};
  wander(w, grip, 1.1, 3.4, path);
  w.hand("hand", kGripper, path.poses, path.times);
  w.action(1.05, "grasp: {object: mug, hand: hand}");
  return {w.text("unknown_hand", 3.4, true), known, {}, false};
}

SuiteScene thin(Writer& w, std::uint64_t) {
  table(w);
  const double length = w.about(0.135, 0.1), radius = w.about(0.009, 0.1);
  w.model("marker", "cylinder: {radius: " + number(radius) + ", length: " + number(length) +
                        "}, density: 700, friction: 0.4, symmetry: {axis: z, continuous: true, flip: true}, color: "
                        "'#202020'");
  w.model("scissors",
          "parts: [{box: [0.018, 0.17, 0.010], rotation: {euler_deg: [0, 0, 12]}}, {box: [0.018, 0.17, 0.010], "
          "rotation: {euler_deg: [0, 0, -12]}}, {box: [0.05, 0.045, 0.010], position: [0.026, -0.09, 0]}, {box: [0.05, "
          "0.045, 0.010], position: [-0.026, -0.09, 0]}], density: 2500, friction: 0.4, symmetry: {axis: y, order: 2}, "
          "color: '#c04080'");
  const double y = w.between(-0.05, 0.05), x = w.between(-0.15, -0.1);
  const Vector3d p(x, y, 0.12);
  carry(w, "gripper", p + Vector3d(0, 0, 0.03), 0.3, 3.0);
  w.object("marker", "marker", p, {0, 90, w.between(-30, 30)}, ", held_by: gripper");
  const double turn = w.between(-60, 60), scissors_y = w.between(-0.04, 0.04);
  w.object("scissors", "scissors", {0.16, scissors_y, 0.005}, {0, 0, turn});
  w.action(0.6, "push: {from: [0.33, 0.02, 0.012], to: [0.14, 0.0, 0.012], duration: 1.6, radius: 0.01}");
  w.camera_at({0.0, 0.0, 0.10});
  return {w.text("thin", 3.0, true), w.text("thin", 3.0, true), {}, true};
}

SuiteScene bottle(Writer& w, std::uint64_t seed) {
  table(w);
  const double h = w.about(0.21, 0.1);
  w.model("bottle", "lathe: {profile: [[0.033, 0], [0.035, " + number(0.6 * h) + "], [0.014, " + number(0.85 * h) +
                        "], [0.014, " + number(h) +
                        "]], segments: 32, use: convex_hull}, density: 400, friction: 0.4, symmetry: {axis: z, "
                        "continuous: true}, surface: transparent, color: '#a0c0d0'");
  const Thing other = everyday_thing(w, "other", seed + 2);
  const double y = w.between(-0.05, 0.05), x = w.between(-0.05, 0.05);
  const Vector3d p(x, y, 0.08);
  carry(w, "gripper", p + Vector3d(0, 0, h), 0.3, 3.0);
  w.object("bottle", "bottle", p, {0, 0, 0}, ", held_by: gripper");
  w.object("other", "other", {0.26, 0.14, other.height}, {0, 0, w.between(-60, 60)});
  w.camera_at(p + Vector3d(0, 0, 0.15));
  return {w.text("bottle", 3.0, true), w.text("bottle", 3.0, true), {}, true};
}

using Maker = SuiteScene (*)(Writer& w, std::uint64_t seed);
constexpr std::pair<const char*, Maker> kMakers[] = {
    {"in_hand", in_hand}, {"behind_box", behind_box}, {"drawer", drawer},
    {"tipped", tipped},   {"twins", twins},           {"taken_away", taken_away},
    {"put_in", put_in},   {"clutter", clutter},       {"unknown_hand", unknown_hand},
    {"thin", thin},       {"bottle", bottle}};

}  // namespace

const std::vector<std::string>& suite_kinds() {
  static const std::vector<std::string> kKinds = [] {
    std::vector<std::string> names;
    for (const auto& [name, make] : kMakers) names.emplace_back(name);
    return names;
  }();
  return kKinds;
}

SuiteScene make_suite_scene(const std::string& kind, std::uint64_t seed) {
  for (std::uint32_t i = 0; i < std::size(kMakers); ++i) {
    if (kind != kMakers[i].first) continue;
    Writer w(core::RandomStream(seed, core::Purpose::kEvaluation, 0, i));
    return kMakers[i].second(w, seed);
  }
  PRESCENE_CHECK(false);
  return {};
}

}  // namespace prescene::service
