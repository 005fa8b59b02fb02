// SPDX-License-Identifier: Apache-2.0
// Motion planning problems for OMPL's RRTConnect, and the ways in which their states and motions can be checked.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "prescene/interfaces/planning/motion_checker.h"

namespace prescene::benchmarks {

struct PlanningProblem {
  std::string name;
  std::shared_ptr<const interfaces::MotionChecker> checker;
  std::vector<double> start, goal;
};

/// A box through a window in a thin wall; a mesh through a thicket of meshes; an arm from below a thin plate to
/// beside it.
std::vector<PlanningProblem> planning_problems();

enum class Checking {
  kSampled,     ///< Our discrete query for each state, motions in steps of 1 % of the space, as OMPL does by itself.
  kSampledFcl,  ///< The same steps, asked of FCL.
  kContinuous,  ///< Our MotionValidator.
};

struct PlanningRun {
  bool found = false;
  double seconds = 0.0;      ///< Processor time until a path was found.
  double share = 0.0;        ///< Of the wall time of that, spent in checks of states and motions.
  std::int64_t states = 0;   ///< That were checked by themselves.
  std::int64_t motions = 0;  ///< That were checked whole.
  int bad_motions = 0;       ///< Of the path: those that collide after all, by the continuous query.
};

PlanningRun plan(const PlanningProblem& problem, Checking checking, std::uint32_t seed);

}  // namespace prescene::benchmarks
