// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/action.h"

#include <array>

namespace prescene::belief {

std::string kind_of(const Action& action) {
  static constexpr std::array kKinds{"release", "place", "push", "pour",       "grasp", "transport",
                                     "bump",    "tilt",  "pull", "move_joint", "insert"};
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
    std::string operator()(const Bump& bump) const { return bump.object; }
    std::string operator()(const Tilt& tilt) const { return tilt.object; }
    std::string operator()(const Pull& pull) const { return pull.object; }
    std::string operator()(const MoveJoint&) const { return {}; }
    std::string operator()(const Insert& insert) const { return insert.object; }
  };
  return std::visit(Visitor{}, action.what);
}

bool is_of_held(const Action& action) {
  return lets_go(action) || std::holds_alternative<Transport>(action.what) ||
         std::holds_alternative<Pour>(action.what) || std::holds_alternative<Tilt>(action.what);
}

bool lets_go(const Action& action) {
  return std::holds_alternative<Release>(action.what) || std::holds_alternative<Place>(action.what) ||
         std::holds_alternative<Insert>(action.what);
}

}  // namespace prescene::belief
