// SPDX-License-Identifier: Apache-2.0
#include "lane_state.h"

#include <algorithm>

namespace prescene::simulation {

LaneState::LaneState(int slots, const LockstepScene& scene)
    : slots_((slots + kLaneMultiple - 1) / kLaneMultiple * kLaneMultiple), room_(scene.room()) {
  const auto bodies = static_cast<int>(scene.bodies.size());
  constexpr std::size_t kRows = 3 * 3 + 4 + 3 + 4 + 2 * 3 + 2 + 3 * 3 + 4 + 9 + 2 + 3;
  const auto size = static_cast<std::size_t>(slots_ * bodies);
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
  for (Real** one : {&friction, &impact_friction, &restitution, &inverse_mass}) *one = row();
  rows(middle_v);
  rows(middle_w);
  for (Real** one : {&lag, &owed}) *one = row();
  rows(flown_p);
  rows(flown_v);
  rows(flown_w);
  rows(flown_q);
  rows(R);
  for (Real** one : {&travel, &share, &energy, &distance2, &speed2}) *one = row();
  // Slots that hold nothing are computed with the others.
  std::fill_n(q[0], size, Real(1));
  std::fill_n(share, size, Real(1));
  const auto of_objects = static_cast<std::size_t>(slots_ * scene.objects);
  contact_count.assign(of_objects, 0);
  warm_count.assign(of_objects, 0);
  dropped_count.assign(of_objects, 0);
  contacts_.resize(of_objects * static_cast<std::size_t>(room_));
  warm_.resize(of_objects * static_cast<std::size_t>(room_));
}

void ContactStage::flush(const std::int32_t* objects, LaneState& state) {
  for (std::size_t lane = 0; lane < counts_.size(); ++lane) {
    if (counts_[lane] == 0) continue;
    const std::int32_t object = objects[lane];
    int& count = state.contact_count[static_cast<std::size_t>(object)];
    const int room = std::min(counts_[lane], state.room() - count);
    std::copy_n(contacts_[lane].data(), room, state.contacts(object) + count);
    count += room;
    state.dropped_count[static_cast<std::size_t>(object)] += counts_[lane] - room + dropped_[lane];
    counts_[lane] = dropped_[lane] = 0;
  }
}

SolverScratch::SolverScratch(int slots, const LockstepScene& scene)
    : kept_each_(static_cast<std::size_t>(scene.objects * (6 + 6 * scene.room()))),
      kept_(static_cast<std::size_t>(slots) * kept_each_) {
  // Lanes differ in how many contacts each pair of bodies has, and each pair gets what the lane with most needs.
  const auto groups = static_cast<std::size_t>(scene.objects * (scene.objects + 1) / 2);
  const std::size_t rows = groups * static_cast<std::size_t>(scene.room());
  memory_.reset(
      static_cast<Real*>(::operator new[](rows* kFields* kLaneMultiple * sizeof(Real), std::align_val_t{64})));
  contacts_.resize(rows * kLaneMultiple);
  for (auto& list : unsettled_) list.reserve(static_cast<std::size_t>(slots));
}

}  // namespace prescene::simulation
