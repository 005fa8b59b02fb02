// SPDX-License-Identifier: Apache-2.0
#include "lane_engine.h"

#include <algorithm>
#include <cmath>

namespace prescene::simulation {
namespace {

using geometry::Quaterniond;

// Speeds beyond this (m/s, rad/s) are a simulation that blew up.
constexpr double kLargestSpeed = 1e4;

template <std::size_t N>
Vector3d vector_at(const Rows<N>& rows, int slot) {
  return {static_cast<double>(rows[0][slot]), static_cast<double>(rows[1][slot]), static_cast<double>(rows[2][slot])};
}

void set_vector(const Rows<3>& rows, int slot, const Vector3d& value) {
  for (std::size_t i = 0; i < 3; ++i) rows[i][slot] = static_cast<Real>(value[static_cast<Eigen::Index>(i)]);
}

void set_rotation(const Rows<4>& rows, int slot, const Quaterniond& q) {
  rows[0][slot] = static_cast<Real>(q.w());
  rows[1][slot] = static_cast<Real>(q.x());
  rows[2][slot] = static_cast<Real>(q.y());
  rows[3][slot] = static_cast<Real>(q.z());
}

}  // namespace

LaneEngine::LaneEngine(std::shared_ptr<const CompiledLockstep> scene, int slots)
    : scene_(std::move(scene)), state_(slots), scratch_(state_.slots()) {
  const auto most = static_cast<std::size_t>(state_.slots());
  const std::size_t fixed = scene_->lanes.fixed.size();
  pairs_.planes.reserve(most * fixed);
  pairs_.boxes.reserve(most * fixed);
  pairs_.hulls.resize(fixed);
  for (std::size_t f = 0; f < fixed; ++f) {
    if (scene_->lanes.fixed[f].shape.kind == CoreKind::kHull) pairs_.hulls[f].reserve(most);
  }
  touching_.reserve(most);
  flying_.reserve(most);
  starts_.resize(kMaxContacts + 2);
}

void LaneEngine::reset(int slot, const belief::ObjectState& start) {
  const Quaterniond R_WO = start.X_WO.rotation.normalized();
  const Quaterniond R_WP = (R_WO * scene_->R_OP).normalized();
  const Vector3d arm = R_WO * start.physical.center_of_mass;
  const auto& origin = scene_->lanes.origin;
  set_vector(state_.p, slot, start.X_WO.translation + arm - Vector3d(origin[0], origin[1], origin[2]));
  set_rotation(state_.q, slot, R_WP);
  set_vector(state_.v, slot, start.V_WO.linear + start.V_WO.angular.cross(arm));
  set_vector(state_.w, slot, start.V_WO.angular);
  set_vector(state_.com, slot, scene_->R_OP.conjugate() * start.physical.center_of_mass);
  state_.friction[slot] = static_cast<Real>(start.physical.friction);
  state_.impact_friction[slot] = static_cast<Real>(start.physical.impact_friction);
  state_.restitution[slot] = static_cast<Real>(start.physical.restitution);
  state_.warm_count[static_cast<std::size_t>(slot)] = 0;
  state_.contact_count[static_cast<std::size_t>(slot)] = 0;
}

Vector3d LaneEngine::center_of_mass(int slot) const { return vector_at(state_.p, slot); }

Quaterniond LaneEngine::rotation(int slot) const {
  return Quaterniond(static_cast<double>(state_.q[0][slot]), static_cast<double>(state_.q[1][slot]),
                     static_cast<double>(state_.q[2][slot]), static_cast<double>(state_.q[3][slot]))
      .normalized();
}

void LaneEngine::read(int slot, belief::ObjectState& object) const {
  const auto& origin = scene_->lanes.origin;
  object.X_WO.rotation = (rotation(slot) * scene_->R_OP.conjugate()).normalized();
  const Vector3d arm = object.X_WO.rotation * object.physical.center_of_mass;
  object.X_WO.translation = center_of_mass(slot) + Vector3d(origin[0], origin[1], origin[2]) - arm;
  object.V_WO.angular = vector_at(state_.w, slot);
  object.V_WO.linear = vector_at(state_.v, slot) - object.V_WO.angular.cross(arm);
}

void LaneEngine::move(int from, int to) {
  SlotState saved;
  save(from, saved);
  restore(to, saved);
  for (std::size_t i = 0; i < 3; ++i) state_.com[i][to] = state_.com[i][from];
  state_.friction[to] = state_.friction[from];
  state_.impact_friction[to] = state_.impact_friction[from];
  state_.restitution[to] = state_.restitution[from];
}

void LaneEngine::save(int slot, SlotState& saved) const {
  for (std::size_t i = 0; i < 3; ++i) {
    saved.p[i] = state_.p[i][slot];
    saved.v[i] = state_.v[i][slot];
    saved.w[i] = state_.w[i][slot];
  }
  for (std::size_t i = 0; i < 4; ++i) saved.q[i] = state_.q[i][slot];
  saved.warm_count = state_.warm_count[static_cast<std::size_t>(slot)];
  std::copy_n(const_cast<LaneState&>(state_).warm(slot), saved.warm_count, saved.warm);
}

void LaneEngine::restore(int slot, const SlotState& saved) {
  for (std::size_t i = 0; i < 3; ++i) {
    state_.p[i][slot] = saved.p[i];
    state_.v[i][slot] = saved.v[i];
    state_.w[i][slot] = saved.w[i];
  }
  for (std::size_t i = 0; i < 4; ++i) state_.q[i][slot] = saved.q[i];
  state_.warm_count[static_cast<std::size_t>(slot)] = saved.warm_count;
  std::copy_n(saved.warm, saved.warm_count, state_.warm(slot));
}

void LaneEngine::find_contacts(std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  const auto count = static_cast<int>(wanted.size());
  fly(lanes, count, state_);
  std::fill_n(state_.contact_count.begin(), count, 0);
  for (int part = 0; part < static_cast<int>(lanes.parts.size()); ++part) {
    pairs_.planes.clear();
    pairs_.boxes.clear();
    for (auto& hull : pairs_.hulls) hull.clear();
    find_pairs(lanes, part, wanted, state_, pairs_);
    touch_planes(lanes, part, pairs_.planes, state_);
    touch_boxes(lanes, part, pairs_.boxes, state_);
    for (const auto& hull : pairs_.hulls) touch_hull(lanes, part, hull, state_);
  }
}

void LaneEngine::advance(std::span<const std::uint8_t> wanted) {
  const auto count = static_cast<int>(wanted.size());
  touching_.clear();
  flying_.clear();
  // By the number of contacts, most first, so that slots that share a vector have about as many.
  std::fill(starts_.begin(), starts_.end(), 0);
  std::size_t touching = 0;
  for (int slot = 0; slot < count; ++slot) {
    if (!wanted[static_cast<std::size_t>(slot)]) continue;
    const int contacts = state_.contact_count[static_cast<std::size_t>(slot)];
    if (contacts == 0) {
      state_.warm_count[static_cast<std::size_t>(slot)] = 0;
      flying_.push_back(slot);
    } else {
      ++starts_[static_cast<std::size_t>(kMaxContacts - contacts) + 1];
      ++touching;
    }
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  touching_.resize(touching);
  for (int slot = 0; slot < count; ++slot) {
    if (!wanted[static_cast<std::size_t>(slot)]) continue;
    const int contacts = state_.contact_count[static_cast<std::size_t>(slot)];
    if (contacts == 0) continue;
    touching_[static_cast<std::size_t>(starts_[static_cast<std::size_t>(kMaxContacts - contacts)]++)] = slot;
  }
  solve(scene_->lanes, touching_, state_, scratch_);
  land(flying_, state_);
  measure(scene_->lanes, count, state_);
}

bool LaneEngine::diverged(int slot) const {
  const Real q = state_.q[0][slot] + state_.q[1][slot] + state_.q[2][slot] + state_.q[3][slot];
  return !(std::isfinite(state_.distance2[slot]) && std::isfinite(q) &&
           static_cast<double>(state_.speed2[slot]) < kLargestSpeed * kLargestSpeed);
}

void LaneEngine::stop(int slot) {
  for (std::size_t i = 0; i < 3; ++i) state_.v[i][slot] = state_.w[i][slot] = Real(0);
}

void LaneEngine::nudge(int slot, const Vector3d& axis_W, double angle) {
  set_rotation(state_.q, slot, (geometry::exp_rotation(angle * axis_W) * rotation(slot)).normalized());
  stop(slot);
}

}  // namespace prescene::simulation
