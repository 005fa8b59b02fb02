// SPDX-License-Identifier: Apache-2.0
// Whether a device computes as the processor does. What it should is promised by OpenGL but for the direction of
// rounding, and compilers have been wrong: so it is tried.
#pragma once

#include "prescene/core/status.h"

namespace prescene::rendering {

/// kUnsupported when sums of products, quotients, snapped places or powers of two of random numbers have other
/// bits than here. Needs the context to be current.
core::Status probe_arithmetic(int division_error);

}  // namespace prescene::rendering
