// SPDX-License-Identifier: Apache-2.0
// Runs of a scene in which everything lies still but for what an event sets in motion. What lies apart from that object
// is left out; where something that moves comes near what was left out, the instance is run again with that and what
// touches it, and so on. One thing alone on a table is simulated several times faster than among others.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"
#include "prescene/simulation/simulator.h"

namespace prescene::queries {

/// A call of simulation::run_own_actions but for its simulator. Actions are pushes only.
struct OwnRuns {
  std::span<const belief::WorldState> starts;
  std::span<const std::vector<belief::Action>> actions;
  const simulation::RunRequest* request = nullptr;
  core::RandomStream stream;
  core::ThreadPool* pool = nullptr;
  const core::Cancellation* cancellation = nullptr;
};

class LocalRuns {
 public:
  /// `shapes` of the scene's objects, in O. `likeliest` is about where they lie. All must outlive it, the simulator of
  /// the whole scene too.
  LocalRuns(const belief::Scene& scene, std::span<const geometry::TriangleMesh> shapes,
            const belief::WorldState& likeliest, const simulation::Simulator& whole,
            const simulation::SimulatorFactory& make_simulator);

  /// As run_own_actions of the whole scene; all but `object` must be without velocity in the starts. Returns how many
  /// instances were simulated. Errors of the factory.
  core::Result<int> run(std::size_t object, const OwnRuns& runs, std::span<belief::Trajectory> trajectories);

 private:
  struct Part {
    std::vector<std::size_t> kept, left_out;
    std::unique_ptr<simulation::Simulator> simulator;  // null = nothing is left out
  };
  /// Instances by what is simulated of them, ascending.
  using Open = std::map<std::vector<std::size_t>, std::vector<std::size_t>>;
  /// These with all that touch them, and what is held; ascending.
  std::vector<std::size_t> with_neighbours(std::vector<std::size_t> objects);
  std::vector<std::size_t> everything() const;
  core::Result<const Part*> part_of(const std::vector<std::size_t>& kept);
  /// Those that come near what was left out are put into `met` instead of `trajectories`. Returns how many were run.
  core::Result<int> run_part(const Part& part, const OwnRuns& runs, std::span<const std::size_t> instances, int round,
                             std::span<belief::Trajectory> trajectories, Open* met);
  geometry::Box box_of(std::size_t object, const belief::Pose& X_WO) const;
  /// m from its origin, of all of its shape.
  double reach_of(std::size_t object) const;
  /// What was left out and something that moves in the run comes near; ascending.
  std::vector<std::size_t> met_by(const Part& part, const belief::WorldState& start,
                                  const std::vector<belief::Action>& actions, const belief::Trajectory& local) const;
  /// With what was left out where it lay.
  void complete(const Part& part, const belief::WorldState& start, belief::Trajectory& trajectory) const;

  const belief::Scene& scene_;
  std::span<const geometry::TriangleMesh> shapes_;
  const belief::WorldState& likeliest_;
  const simulation::Simulator& whole_;
  const simulation::SimulatorFactory& make_simulator_;
  std::vector<geometry::Box> boxes_;  // where they lie; empty = not known yet
  std::map<std::vector<std::size_t>, std::unique_ptr<Part>> parts_;
};

}  // namespace prescene::queries
