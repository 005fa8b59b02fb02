// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/action.h"

#include <array>

namespace prescene::belief {

std::string kind_of(const Action& action) {
  static constexpr std::array kKinds{"release", "place", "push", "pour", "grasp", "transport"};
  static_assert(kKinds.size() == std::variant_size_v<decltype(Action::what)>);
  return kKinds[action.what.index()];
}

}  // namespace prescene::belief
