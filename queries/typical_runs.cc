// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/typical_runs.h"

#include <algorithm>
#include <cmath>

#include "prescene/belief/body_names.h"
#include "prescene/core/check.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kMostLookedAt = 512;
constexpr double kTipped = 0.5236;  // rad: beyond 30 degrees an object no longer stands as it stood
constexpr double kFallen = 0.05;    // m

/// Bodies that carry the object at the end, by name.
std::string resting_place(const belief::Scene& scene, const belief::Trajectory& run, int object) {
  std::string names;
  const double end = run.final().time;
  for (int other = 0;; ++other) {
    const std::string name = belief::body_name(scene, other);
    if (other >= static_cast<int>(scene.objects.size() + scene.supports.size() + scene.robot.size())) break;
    const bool carries = std::any_of(run.contacts.begin(), run.contacts.end(), [&](const belief::ContactInterval& c) {
      return c.end >= end && belief::supports(c, other, object);
    });
    if (carries) names += (names.empty() ? "" : " and ") + name;
  }
  return names;
}

}  // namespace

std::optional<std::size_t> medoid(std::span<const belief::Pose> poses, double radius) {
  if (poses.empty()) return std::nullopt;
  const std::size_t stride = (poses.size() + kMostLookedAt - 1) / kMostLookedAt;
  std::size_t best = 0;
  double best_sum = 1e300;
  for (std::size_t i = 0; i < poses.size(); i += stride) {
    double sum = 0.0;
    for (std::size_t j = 0; j < poses.size() && sum < best_sum; j += stride) {
      sum += (poses[i].translation - poses[j].translation).norm() +
             radius * geometry::angle_between(poses[i].rotation, poses[j].rotation);
    }
    if (sum < best_sum) {
      best = i;
      best_sum = sum;
    }
  }
  return best;
}

std::string event_text(const belief::Scene& scene, const belief::Trajectory& run, int object, double max_move,
                       double max_turn) {
  PRESCENE_CHECK(!run.states.empty());
  const auto index = static_cast<std::size_t>(object);
  const belief::Pose& from = run.start().objects[index].X_WO;
  const belief::Pose& to = run.final().objects[index].X_WO;
  double moved = 0.0, turned = 0.0;
  for (const belief::WorldState& state : run.states) {
    const belief::Pose& X_WO = state.objects[index].X_WO;
    moved = std::max(moved, (X_WO.translation - from.translation).norm());
    turned = std::max(turned, geometry::angle_between(X_WO.rotation, from.rotation));
  }
  if (moved <= max_move && turned <= max_turn) return "stays";

  const geometry::Vector3d up_O = from.rotation.conjugate() * geometry::Vector3d::UnitZ();
  const bool tipped = (to.rotation * up_O).z() < std::cos(kTipped);
  const geometry::Vector3d way = to.translation - from.translation;
  const double radius = radius_of(scene.model_of(scene.objects[index]));
  std::string text;
  if (way.z() < -std::max(kFallen, radius))
    text = "falls";
  else if (tipped && way.head<2>().norm() > 3.0 * radius)
    text = "rolls";
  else if (tipped)
    text = "tips over";
  else if (way.z() < -kFallen)
    text = "falls";
  else if (moved > max_move)
    text = "slides";
  else
    text = "turns";
  if (text != "falls" && text != "tips over") return text;
  if (run.end == belief::TrajectoryEnd::kLeftTheWorld) return text + " and leaves the scene";
  const std::string place = resting_place(scene, run, object);
  return place.empty() ? text : text + " and comes to rest on " + place;
}

double radius_of(const belief::ObjectModel& model) {
  const geometry::TriangleMesh mesh = model.visual ? *model.visual : belief::collision_mesh(model);
  return geometry::radius_about(mesh, geometry::Vector3d::Zero());
}

}  // namespace prescene::queries
