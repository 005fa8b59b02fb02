// SPDX-License-Identifier: Apache-2.0
// The parts of validate(Scene) that have sources of their own, and what they check of names and numbers alike.
#pragma once

#include <string>

#include "prescene/belief/scene.h"
#include "prescene/core/status.h"

namespace prescene::belief {

/// action_validation.cc; but for its time, which is to be checked with that of the others.
core::Status check_action(const Scene& scene, const Action& action);
/// outcome_validation.cc: all that the scene lists, alone and in groups.
core::Status check_outcomes(const Scene& scene);

/// "outcome 'standing'".
std::string quoted(const char* what, const std::string& name);
/// At most 1e6.
core::Status check_finite_positive(double value, const char* what);
core::Status check_object_name(const Scene& scene, const std::string& name);

}  // namespace prescene::belief
