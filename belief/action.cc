// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/action.h"

#include <array>

namespace prescene::belief {

std::string kind_of(const Action& action) {
  static constexpr std::array kKinds{"release", "place", "push", "pour", "grasp", "transport"};
  static_assert(kKinds.size() == std::variant_size_v<decltype(Action::what)>);
  return kKinds[action.what.index()];
}

std::string object_of(const Action& action) {
  struct Visitor {
    std::string operator()(const Release& release) const { return release.object; }
    std::string operator()(const Place& place) const { return place.object; }
    std::string operator()(const Push&) const { return {}; }
    std::string operator()(const Pour& pour) const { return pour.container; }
    std::string operator()(const Grasp& grasp) const { return grasp.object; }
    std::string operator()(const Transport& transport) const { return transport.object; }
  };
  return std::visit(Visitor{}, action.what);
}

}  // namespace prescene::belief
