// SPDX-License-Identifier: Apache-2.0
// What a heat map's picture shows of one object: its endings, and what of the scene has to be seen.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/geometry/image.h"

namespace prescene::service {

/// What of an answer is about one object. Points into the answer.
struct HeatMapPart {
  std::size_t object = 0;
  const belief::FinalPoses* poses = nullptr;
  std::string group;  ///< Whose outcomes distinguish its ends; empty: a single outcome, or none.
  struct Ending {
    std::string name;
    const belief::OutcomeProbability* probability = nullptr;
    const belief::TypicalRun* run = nullptr;  ///< Null: too rare to be drawn.
    geometry::Rgb color{};
  };
  std::vector<Ending> endings;
  /// Where most of what no drawn ending covers ends; nothing if that is hardly anything.
  std::optional<geometry::Pose> otherwise;
  /// The answer's other outcomes, of any object; an "other" that never happened is left out.
  std::vector<const belief::OutcomeProbability*> further;
  std::vector<const belief::ObjectPath*> paths;

  /// Whether its one outcome leaves it open what happens else.
  bool is_open() const { return group.empty() && endings.size() == 1; }
  /// Null where none is drawn.
  const belief::Trajectory* likeliest_run() const;
};
HeatMapPart heat_map_part(const belief::Scene& scene, const belief::PredictAnswer& answer,
                          const belief::FinalPoses& poses);

/// Where a run's free motion begins: the state in which the object is last held, else the first.
std::size_t begin_of(const belief::Trajectory& run, std::size_t object);

/// What the pictures have to show: where the object begins, where it ends in 98 % of the cases, and supports that are
/// not far larger.
struct ShownSpace {
  struct Box {
    geometry::Vector3d low = geometry::Vector3d::Constant(1e9), high = geometry::Vector3d::Constant(-1e9);
    void add(const geometry::Vector3d& p);
    void add(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM);
    bool meets(const Box& other) const;
  } box;
  std::vector<geometry::Vector3d> points;
};
ShownSpace shown_space(const belief::Scene& scene, const HeatMapPart& part);

}  // namespace prescene::service
