// SPDX-License-Identifier: Apache-2.0
// What the bits of a result depend on besides sources, input and seed: docs/reference/determinism.md promises none
// elsewhere.
#pragma once

#include <string>

namespace prescene::tests {

/// Compiler and flags of this build, the versions of the libraries that calculate, and what this CPU's variants of
/// exp, log, sin, cos and their kin return (as a hash over many arguments). One line.
std::string platform();

}  // namespace prescene::tests
