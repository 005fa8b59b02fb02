// SPDX-License-Identifier: Apache-2.0
// What frames say of a pose, in plain English.
#pragma once

#include <string>

#include "prescene/queries/why.h"

namespace prescene::queries {

/// A paragraph about a comparison of the answer, which has its views and tempering. `symmetry`: of the object's model;
/// `begin_ns`: the stamp that its seconds count from.
std::string text_of(const WhyComparison& comparison, const WhyAnswer& answer, const geometry::SymmetryGroup& symmetry,
                    core::TimeNs begin_ns);
/// How much of the object the frames show, and what hides the rest.
std::string seen_text(const WhyAnswer& answer);

}  // namespace prescene::queries
