// SPDX-License-Identifier: Apache-2.0
// Names of kinds that a user picks from.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "prescene/core/spelling.h"
#include "prescene/core/status.h"

namespace prescene::service {

/// kInvalidInput that lists `known` if one of `wanted` is not in it. `what`: "sequence".
inline core::Status check_kinds(const std::vector<std::string>& wanted, const std::vector<std::string>& known,
                                const std::string& what) {
  for (const std::string& kind : wanted)
    if (std::find(known.begin(), known.end(), kind) == known.end())
      return core::invalid_input("'" + kind + "' is not a kind of " + what + ": use one of " + core::comma_list(known));
  return core::ok_status();
}

}  // namespace prescene::service
