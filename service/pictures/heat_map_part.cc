// SPDX-License-Identifier: Apache-2.0
#include "heat_map_part.h"

#include <algorithm>

#include "prescene/interfaces/reports/overlay.h"
#include "prescene/service/pictures/ground_density.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::Vector3d;

constexpr double kLeastShown = 0.005;  // outcomes rarer than this are named, not drawn
constexpr double kShareShown = 0.98;

bool judges(const belief::Scene& scene, const std::string& group, const std::string& outcome,
            const std::string& object) {
  for (const belief::ExclusiveOutcomes& one : scene.exclusive_outcomes)
    if (one.name == group) return !one.outcomes.empty() && one.outcomes.front().object == object;
  return group.empty() && std::any_of(scene.outcomes.begin(), scene.outcomes.end(), [&](const belief::Outcome& one) {
           return one.name == outcome && one.object == object;
         });
}

/// A rectangle on the ground around where most ends are, over the whole map.
std::optional<GroundDensity::Rectangle> most_ends(const belief::FinalPoses& poses) {
  const belief::HeatMap& map = poses.heat_map;
  if (map.mass.empty()) return std::nullopt;
  const Vector2d low(map.x0, map.y0);
  const Vector2d high = low + map.cell * Vector2d(map.nx, map.ny);
  return GroundDensity(poses.components, low, high, map.cell).rectangle_of(kShareShown);
}

}  // namespace

const belief::Trajectory* HeatMapPart::likeliest_run() const {
  const belief::TypicalRun* best = nullptr;
  for (const Ending& ending : endings)
    if (ending.run && (!best || ending.run->share > best->share)) best = ending.run;
  return best ? &best->trajectory : nullptr;
}

HeatMapPart heat_map_part(const belief::Scene& scene, const belief::PredictAnswer& answer,
                          const belief::FinalPoses& poses) {
  HeatMapPart part;
  part.poses = &poses;
  part.object = static_cast<std::size_t>(belief::find_object(scene, poses.object).value_or(0));
  for (const belief::ObjectPath& path : answer.paths)
    if (path.object == poses.object) part.paths.push_back(&path);
  const auto first =
      std::find_if(answer.outcomes.begin(), answer.outcomes.end(), [&](const belief::OutcomeProbability& outcome) {
        return judges(scene, outcome.group, outcome.name, poses.object);
      });
  if (first != answer.outcomes.end()) part.group = first->group;
  for (auto outcome = answer.outcomes.begin(); outcome != answer.outcomes.end(); ++outcome) {
    if (!outcome->group.empty() && outcome->name == "other" && outcome->probability <= 0.0) continue;
    const bool mine =
        outcome == first || (first != answer.outcomes.end() && !part.group.empty() && outcome->group == part.group);
    if (!mine) {
      part.further.push_back(&*outcome);
      continue;
    }
    HeatMapPart::Ending& ending = part.endings.emplace_back();
    ending.name = outcome->name;
    ending.probability = &*outcome;
    ending.color = interfaces::series_color(part.endings.size());
    for (const belief::TypicalRun& run : answer.typical_runs)
      if (run.group == part.group && run.outcome == outcome->name && run.share >= kLeastShown) ending.run = &run;
  }
  double elsewhere = 0.0;
  for (const belief::PoseComponent& component : poses.components) {
    const bool drawn = std::any_of(part.endings.begin(), part.endings.end(), [&](const HeatMapPart::Ending& ending) {
      return ending.run && ending.name == component.outcome;
    });
    if (drawn) continue;
    elsewhere += component.weight;
    if (!part.otherwise) part.otherwise = component.mean;  // the heaviest comes first
  }
  if (elsewhere < kLeastShown) part.otherwise.reset();
  return part;
}

std::size_t begin_of(const belief::Trajectory& run, std::size_t object) {
  for (std::size_t i = run.states.size(); i-- > 0;)
    if (run.states[i].objects[object].mode == belief::MotionMode::kHeld) return i;
  return 0;
}

void ShownSpace::Box::add(const Vector3d& p) {
  low = low.cwiseMin(p);
  high = high.cwiseMax(p);
}

void ShownSpace::Box::add(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM) {
  for (const Vector3d& vertex : mesh.vertices) add(X_WM * vertex);
}

bool ShownSpace::Box::meets(const Box& other) const {
  return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
}

ShownSpace shown_space(const belief::Scene& scene, const HeatMapPart& part) {
  const geometry::TriangleMesh mesh = belief::collision_mesh(scene.model_of(scene.objects[part.object]));
  ShownSpace shown;
  const auto add_mesh = [&](const geometry::TriangleMesh& more, const geometry::Pose& X_WM) {
    shown.box.add(more, X_WM);
    for (const Vector3d& vertex : more.vertices) shown.points.push_back(X_WM * vertex);
  };
  if (const belief::Trajectory* run = part.likeliest_run())
    add_mesh(mesh, run->states[begin_of(*run, part.object)].objects[part.object].X_WO);
  for (const HeatMapPart::Ending& ending : part.endings)
    if (ending.run) add_mesh(mesh, ending.run->trajectory.final().objects[part.object].X_WO);
  if (part.otherwise) add_mesh(mesh, *part.otherwise);
  if (const std::optional<GroundDensity::Rectangle> heat = most_ends(*part.poses)) {
    const double ground = shown.box.low.z();
    for (const double x : {heat->low.x(), heat->high.x()}) {
      for (const double y : {heat->low.y(), heat->high.y()}) {
        shown.points.emplace_back(x, y, ground);
        shown.box.add(shown.points.back());
      }
    }
  }
  const double size = (shown.box.high - shown.box.low).norm();
  for (const belief::Support& support : scene.supports) {
    const geometry::TriangleMesh whole = belief::collision_mesh(support.collision);
    ShownSpace::Box all;
    all.add(whole, support.X_WS);
    if ((all.high - all.low).norm() <= 1.2 * size + 0.3 && all.meets(shown.box)) add_mesh(whole, support.X_WS);
  }
  // The other objects, where they end when it ends as it most likely does.
  if (const belief::Trajectory* run = part.likeliest_run()) {
    for (std::size_t o = 0; o < scene.objects.size(); ++o) {
      if (o == part.object) continue;
      const geometry::TriangleMesh other = belief::collision_mesh(scene.model_of(scene.objects[o]));
      const geometry::Pose& X_WO = run->final().objects[o].X_WO;
      ShownSpace::Box all;
      all.add(other, X_WO);
      if ((all.high - all.low).norm() <= 1.2 * size && all.meets(shown.box)) add_mesh(other, X_WO);
    }
  }
  const Vector3d room = 0.06 * (shown.box.high - shown.box.low).norm() * Vector3d(1.0, 1.0, 0.0);
  shown.box.low -= room;
  shown.box.high += room;
  return shown;
}

}  // namespace prescene::service
