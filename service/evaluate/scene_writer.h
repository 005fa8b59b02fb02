// SPDX-License-Identifier: Apache-2.0
// Scene files that are made at random: sections, everyday things, a gripper.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/geometry/pose.h"

namespace prescene::service {

inline std::string number(double value) { return core::fixed_text(value, 4); }
inline std::string list(const geometry::Vector3d& v) {
  return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

/// Sections of a scene file, and the random numbers that it is made with.
class SceneWriter {
 public:
  explicit SceneWriter(core::RandomStream stream) : draws(stream) {}

  double about(double mean, double share) { return mean * draws.uniform(1.0 - share, 1.0 + share); }
  double between(double low, double high) { return draws.uniform(low, high); }

  void model(const std::string& name, const std::string& keys) { models += "  " + name + ": {" + keys + "}\n"; }
  void support(const std::string& name, const std::string& keys) { supports += "  " + name + ": {" + keys + "}\n"; }
  /// The tracker knows the pose to 5 mm and 3 degrees.
  void object(const std::string& name, const std::string& model_name, const geometry::Vector3d& p,
              const geometry::Vector3d& euler_deg, const std::string& more = "") {
    objects += "  " + name + ": {model: " + model_name + ", pose: {position: " + list(p) +
               ", rotation: {euler_deg: " + list(euler_deg) +
               "}, normal: {position: [0.005, 0.005, 0], rotation_deg: [0, 0, 3]}}" + more + "}\n";
  }
  void hand(const std::string& name, const std::string& shape,
            const std::vector<std::pair<geometry::Vector3d, geometry::Vector3d>>& poses,
            const std::vector<double>& times) {
    robot += "  " + name + ":\n    " + shape + "\n    friction: 0.8\n    color: [0.2, 0.2, 0.22]\n    timeline:\n";
    for (std::size_t i = 0; i < poses.size(); ++i)
      robot += "      - {time: " + number(times[i]) + ", position: " + list(poses[i].first) +
               ", rotation: {euler_deg: " + list(poses[i].second) + "}}\n";
  }
  void action(double time, const std::string& what) { actions += "  - {time: " + number(time) + ", " + what + "}\n"; }

  /// A camera at the near side of the table, 0.75 to 1 m from what it looks at.
  void camera_at(const geometry::Vector3d& target) {
    const double azimuth = between(-0.5, 0.5);
    const double elevation = between(0.5, 0.8);
    const double distance = between(0.75, 1.0);
    const geometry::Vector3d from =
        target + distance * geometry::Vector3d(std::cos(elevation) * std::sin(azimuth),
                                               -std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
    camera = "  fov_deg: 58\n  look: {from: " + list(from) + ", at: " + list(target) + "}\n";
  }

  std::string text(const std::string& name, double duration, bool with_robot) const {
    const auto section = [](const std::string& key, const std::string& content) {
      return content.empty() ? std::string() : key + ":\n" + content;
    };
    return "name: " + name + "\nduration: " + number(duration) + "\n" + section("models", models) +
           section("supports", supports) + section("robot", with_robot ? robot : "") + section("objects", objects) +
           section("camera", camera) + section("actions", with_robot ? actions : "");
  }

  core::RandomStream draws;
  std::string models, supports, robot, objects, camera, actions;
};

inline void table(SceneWriter& w) {
  w.support("floor", "ground: {size: 6}, pose: {position: [0, 0, -0.75]}, friction: 0.9");
  w.support("table", "box: [1.2, 0.8, 0.04], pose: {position: [0, 0, -0.02]}, friction: 0.9, color: [0.6, 0.45, 0.3]");
}

struct Thing {
  std::string name;
  double height = 0.0;  ///< m, of its frame's origin above what it stands on.
  double reach = 0.0;   ///< m, half of its horizontal extent.
  double top = 0.0;     ///< m, of its highest point above its frame's origin.
};

/// One of six everyday things as a model of that name.
inline Thing everyday_thing(SceneWriter& w, const std::string& name, std::uint64_t which) {
  const std::string contact = ", density: 500, friction: {normal: [0.45, 0.08], min: 0.1}";
  switch (which % 6) {
    case 0: {
      const double h = w.about(0.19, 0.1);
      w.model(name, "gable_carton: {base: [0.07, 0.07], shoulder_height: " + number(0.83 * h) +
                        ", height: " + number(h) + "}" + contact + ", symmetry: {axis: z, order: 2}, color: '#e8ecf4'");
      return {name, 0.5 * h, 0.05, 0.5 * h};
    }
    case 1: {
      const double r = w.about(0.034, 0.1), h = w.about(0.11, 0.1);
      w.model(name, "cylinder: {radius: " + number(r) + ", length: " + number(h) + "}" + contact +
                        ", symmetry: {axis: z, continuous: true, flip: true}, color: '#c03020'");
      return {name, 0.5 * h, r, 0.5 * h};
    }
    case 2: {
      const double height = w.about(0.14, 0.15), depth = w.about(0.06, 0.15);
      const geometry::Vector3d size(w.about(0.09, 0.15), depth, height);
      w.model(name, "box: " + list(size) + contact + ", symmetry: cuboid, color: '#3060c0'");
      return {name, 0.5 * size.z(), 0.5 * std::hypot(size.x(), size.y()), 0.5 * size.z()};
    }
    case 3: {
      const double r = w.about(0.038, 0.1), h = w.about(0.095, 0.1);
      w.model(name, "parts: [{lathe: {profile: [[" + number(0.9 * r) + ", " + number(-0.5 * h) + "], [" + number(r) +
                        ", " + number(0.5 * h) +
                        "]], segments: 32, use: convex_hull}}, {box: [0.022, 0.010, 0.012], position: [" +
                        number(r + 0.008) + ", 0, " + number(0.25 * h) +
                        "]}, {box: [0.022, 0.010, 0.012], position: [" + number(r + 0.008) + ", 0, " +
                        number(-0.2 * h) + "]}, {box: [0.010, 0.010, " + number(0.45 * h + 0.012) + "], position: [" +
                        number(r + 0.023) + ", 0, " + number(0.025 * h) + "]}]" + contact + ", color: '#40a060'");
      return {name, 0.5 * h, r + 0.028, 0.5 * h};
    }
    case 4: {
      const double height = w.about(0.04, 0.15), depth = w.about(0.10, 0.1);
      const geometry::Vector3d size(w.about(0.15, 0.1), depth, height);
      w.model(name, "box: " + list(size) + contact + ", symmetry: cuboid, color: '#d0b040'");
      return {name, 0.5 * size.z(), 0.5 * std::hypot(size.x(), size.y()), 0.5 * size.z()};
    }
    default: {
      const double h = w.about(0.20, 0.1);
      w.model(name, "lathe: {profile: [[0.030, 0], [0.032, " + number(0.6 * h) + "], [0.013, " + number(0.85 * h) +
                        "], [0.013, " + number(h) + "]], segments: 32, use: convex_hull}" + contact +
                        ", symmetry: {axis: z, continuous: true}, color: '#208080'");
      return {name, 0.0, 0.032, h};
    }
  }
}

/// A hand with two fingers that reach from 1 cm below its frame's origin to the palm, kPalmHeight above it.
inline constexpr double kPalmHeight = 0.05;  // m
inline constexpr const char* kGripper =
    "parts: [{box: [0.018, 0.022, 0.06], position: [0.055, 0, 0.02]}, {box: [0.018, 0.022, 0.06], position: [-0.055, "
    "0, "
    "0.02]}, {box: [0.14, 0.05, 0.04], position: [0, 0, 0.07]}, {cylinder: {radius: 0.03, length: 0.25}, position: [0, "
    "0, 0.21]}]";

}  // namespace prescene::service
