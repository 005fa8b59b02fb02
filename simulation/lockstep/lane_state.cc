// SPDX-License-Identifier: Apache-2.0
#include "lane_state.h"

#include <algorithm>

namespace prescene::simulation {

LaneState::LaneState(int slots) : slots_((slots + kLaneMultiple - 1) / kLaneMultiple * kLaneMultiple) {
  constexpr std::size_t kRows = 3 * 3 + 4 + 3 + 3 + 3 * 3 + 4 + 9 + 1 + 3;
  const auto size = static_cast<std::size_t>(slots_);
  memory_.reset(static_cast<Real*>(::operator new[](kRows* size * sizeof(Real), std::align_val_t{64})));
  std::fill_n(memory_.get(), kRows * size, Real(0));
  Real* next = memory_.get();
  const auto row = [&] {
    Real* const here = next;
    next += size;
    return here;
  };
  const auto rows = [&](auto& all) {
    for (Real*& one : all) one = row();
  };
  rows(p);
  rows(v);
  rows(w);
  rows(q);
  rows(com);
  for (Real** one : {&friction, &impact_friction, &restitution}) *one = row();
  rows(flown_p);
  rows(flown_v);
  rows(flown_w);
  rows(flown_q);
  rows(R);
  for (Real** one : {&travel, &energy, &distance2, &speed2}) *one = row();
  // Slots that hold nothing are computed with the others.
  std::fill_n(q[0], size, Real(1));
  contact_count.assign(size, 0);
  warm_count.assign(size, 0);
  contacts_.resize(size * kMaxContacts);
  warm_.resize(size * kMaxContacts);
}

void ContactStage::flush(const std::int32_t* slots, LaneState& state) {
  for (std::size_t lane = 0; lane < counts_.size(); ++lane) {
    if (counts_[lane] == 0) continue;
    const std::int32_t slot = slots[lane];
    int& count = state.contact_count[static_cast<std::size_t>(slot)];
    const int room = std::min(counts_[lane], kMaxContacts - count);
    std::copy_n(contacts_[lane].data(), room, state.contacts(slot) + count);
    count += room;
    counts_[lane] = 0;
  }
}

SolverScratch::SolverScratch(int slots)
    : memory_(static_cast<Real*>(::operator new[](
          static_cast<std::size_t>(kMaxContacts) * kFields * kLaneMultiple * sizeof(Real), std::align_val_t{64}))),
      kept_(static_cast<std::size_t>(slots) * kKept) {
  for (auto& list : unsettled_) list.reserve(static_cast<std::size_t>(slots));
}

}  // namespace prescene::simulation
