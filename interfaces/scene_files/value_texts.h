// SPDX-License-Identifier: Apache-2.0
// Values as the readers of read_values.h read them: what is written is read back to the bit.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/distribution.h"
#include "prescene/belief/object_model.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::interfaces {

/// "[a, b, c]".
std::string flow_list(const std::vector<std::string>& items);
std::string value_text(const geometry::Vector3d& v);
std::string value_text(const geometry::Matrix3d& m);
std::string value_text(const belief::ScalarDistribution& distribution);
std::string value_text(const belief::Vector3Distribution& v);
std::string value_text(const geometry::Quaterniond& q);
/// In the shortest form.
std::string value_text(const geometry::SymmetryGroup& group);

}  // namespace prescene::interfaces
