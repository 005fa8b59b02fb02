// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/planning take for granted.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "prescene/interfaces/planning/arm.h"
#include "prescene/interfaces/planning/motion_checker.h"
#include "prescene/interfaces/planning/mover.h"
#include "prescene/interfaces/planning/planning_shape.h"
#include "prescene/interfaces/planning/scene_obstacles.h"

namespace prescene::interfaces::given_interfaces_planning {

extern core::ThreadPool pool;
extern const belief::Scene scene;

namespace planning_shape_h {
extern const geometry::TriangleMesh mesh;
extern core::ThreadPool pool;
}  // namespace planning_shape_h

namespace mover_h {
extern const geometry::TriangleMesh mesh;
}

namespace arm_h {
extern const std::string text;
}

namespace motion_checker_h {
extern const std::shared_ptr<const Mover> mover;
extern const std::span<const double> q0, q1;
}  // namespace motion_checker_h

namespace scene_obstacles_h {
extern const std::shared_ptr<const Arm> arm;
}

}  // namespace prescene::interfaces::given_interfaces_planning
