// SPDX-License-Identifier: Apache-2.0
// Contacts of bodies of spheres, for each instruction set.
#include "lane_spheres.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sphere_contacts.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "sphere_choice-inl.h"
#include "sphere_core-inl.h"
#include "sphere_pairs-inl.h"

#if HWY_ONCE
namespace prescene::simulation {

HWY_EXPORT(meet_core_lanes);
HWY_EXPORT(meet_spheres_lanes);
HWY_EXPORT(choose_contacts_lanes);

void meet_core(const SphereQuery& query, SphereScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(meet_core_lanes)(&query, &scratch);
}

void meet_spheres(const SphereQuery& query, SphereScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(meet_spheres_lanes)(&query, &scratch);
}

int choose_contacts(FoundContacts& found, ChosenContacts& chosen) {
  if (found.size() == 0) return 0;
  return HWY_DYNAMIC_DISPATCH(choose_contacts_lanes)(&found, &chosen);
}

}  // namespace prescene::simulation
#endif
