// SPDX-License-Identifier: Apache-2.0
#include "contact_log.h"

#include <algorithm>
#include <tuple>

namespace prescene::simulation {

void ContactLog::note(const std::vector<Touch>& touches, double begin, double end, double merge_time) {
  for (const Touch& touch : touches) {
    const auto same = [&](const belief::ContactInterval& c) {
      return c.first == touch.first && c.second == touch.second;
    };
    auto found = std::find_if(open_.begin(), open_.end(), same);
    if (found != open_.end() && begin - found->end > merge_time) {
      closed_.push_back(*found);
      open_.erase(found);
      found = open_.end();
    }
    if (found == open_.end()) {
      belief::ContactInterval interval;
      interval.first = touch.first;
      interval.second = touch.second;
      interval.begin = begin;
      found = open_.insert(open_.end(), interval);
    }
    found->end = end;
    found->largest_impulse = std::max(found->largest_impulse, touch.impulse);
    found->normal_z = touch.normal_z;
  }
}

void ContactLog::finish(std::vector<belief::ContactInterval>& contacts) {
  contacts = closed_;
  contacts.insert(contacts.end(), open_.begin(), open_.end());
  std::sort(contacts.begin(), contacts.end(), [](const belief::ContactInterval& a, const belief::ContactInterval& b) {
    return std::tie(a.begin, a.first, a.second) < std::tie(b.begin, b.first, b.second);
  });
}

}  // namespace prescene::simulation
