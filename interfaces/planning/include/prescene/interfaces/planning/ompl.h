// SPDX-License-Identifier: Apache-2.0
// Collision checks for the Open Motion Planning Library: a StateValidityChecker and a MotionValidator over a
// MotionChecker. Of headers only: a program that includes this one finds and links OMPL itself (1.5 and later).
// docs/reference/collision.md has a program. For a body, the space is ompl::base::SE3StateSpace; for an arm,
// arm_space(). Both check from any number of threads at once.
#pragma once

#include <ompl/base/MotionValidator.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/planning/arm.h"
#include "prescene/interfaces/planning/motion_checker.h"

namespace prescene::interfaces {

/// The space of an arm's configurations, with the joints' ranges as bounds and their names as dimensions.
inline std::shared_ptr<ompl::base::RealVectorStateSpace> arm_space(const Arm& arm) {
  const auto dimension = static_cast<unsigned int>(arm.dimension());
  auto space = std::make_shared<ompl::base::RealVectorStateSpace>(dimension);
  ompl::base::RealVectorBounds bounds(dimension);
  for (unsigned int i = 0; i < dimension; ++i) {
    bounds.setLow(i, arm.joints()[i].lower);
    bounds.setHigh(i, arm.joints()[i].upper);
    space->setDimensionName(i, arm.joints()[i].name);
  }
  space->setBounds(bounds);
  return space;
}

/// What the two checkers of a space share. OMPL's own counts of motions (getValidMotionCount) stay 0, because they are
/// not made for several threads: these are.
class OmplCollisions {
 public:
  struct Counts {
    std::atomic<std::uint64_t> states{0};             ///< Asked about by themselves.
    std::atomic<std::uint64_t> motions{0};            ///< Asked about.
    std::atomic<std::uint64_t> blocked_motions{0};    ///< Of these.
    std::atomic<std::uint64_t> undecided_motions{0};  ///< Of the blocked: MotionCheckOptions::step_limit was reached.
  };

  /// Fails with kInvalidInput when the checker's mover is not what the space's states say where it is.
  static core::Result<std::shared_ptr<OmplCollisions>> make(const ompl::base::StateSpace& space,
                                                            std::shared_ptr<const MotionChecker> checker) {
    if (checker == nullptr) return core::invalid_input("no checker: make one with MotionChecker::make");
    const bool is_body = dynamic_cast<const RigidBody*>(&checker->mover()) != nullptr;
    if (is_body && space.getType() != ompl::base::STATE_SPACE_SE3)
      return core::invalid_input(space.getName() + ": a rigid body moves in an SE3StateSpace: give one");
    if (!is_body && (space.getType() != ompl::base::STATE_SPACE_REAL_VECTOR ||
                     space.getDimension() != checker->mover().dimension()))
      return core::invalid_input(space.getName() + ": this mover needs a RealVectorStateSpace of " +
                                 std::to_string(checker->mover().dimension()) + " dimensions: take arm_space()");
    return std::shared_ptr<OmplCollisions>(new OmplCollisions(std::move(checker), is_body));
  }

  const MotionChecker& checker() const { return *checker_; }
  Counts& counts() { return counts_; }

  bool is_free(const ompl::base::State* state) {
    const Lease lease(*this);
    ++counts_.states;
    read(state, lease->first);
    return checker_->is_free(lease->first, lease->scratch);
  }
  double clearance(const ompl::base::State* state) {
    const Lease lease(*this);
    read(state, lease->first);
    return checker_->clearance(lease->first, lease->scratch);
  }
  MotionCheck check(const ompl::base::State* from, const ompl::base::State* to, MotionChecker::Order order) {
    const Lease lease(*this);
    read(from, lease->first);
    read(to, lease->second);
    const MotionCheck answer = checker_->check(lease->first, lease->second, lease->scratch, order);
    counts_.undecided_motions += answer.outcome == MotionCheck::kStepLimit;
    return answer;
  }

 private:
  /// What one check works in.
  struct Memory {
    std::vector<double> first, second;
    PlanningScratch scratch;
  };
  /// Takes a memory that no other thread has, and gives it back.
  class Lease {
   public:
    explicit Lease(OmplCollisions& owner) : owner_(owner) {
      const std::lock_guard lock(owner_.mutex_);
      if (!owner_.free_.empty()) {
        memory_ = std::move(owner_.free_.back());
        owner_.free_.pop_back();
      } else {
        owner_.free_.reserve(++owner_.made_);  // To give one back never allocates, and so does not throw.
        memory_ = std::make_unique<Memory>();
        memory_->first.resize(owner_.checker_->mover().dimension());
        memory_->second.resize(owner_.checker_->mover().dimension());
      }
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    ~Lease() {
      const std::lock_guard lock(owner_.mutex_);
      owner_.free_.push_back(std::move(memory_));
    }
    Memory* operator->() const { return memory_.get(); }

   private:
    OmplCollisions& owner_;
    std::unique_ptr<Memory> memory_;
  };

  OmplCollisions(std::shared_ptr<const MotionChecker> checker, bool is_body)
      : checker_(std::move(checker)), is_body_(is_body) {}

  void read(const ompl::base::State* state, std::span<double> q) const {
    if (is_body_) {
      const auto* pose = state->as<ompl::base::SE3StateSpace::StateType>();
      const auto& turn = pose->rotation();
      const double numbers[] = {pose->getX(), pose->getY(), pose->getZ(), turn.x, turn.y, turn.z, turn.w};
      std::copy(std::begin(numbers), std::end(numbers), q.begin());
    } else {
      const double* values = state->as<ompl::base::RealVectorStateSpace::StateType>()->values;
      std::copy(values, values + q.size(), q.begin());
    }
  }

  std::shared_ptr<const MotionChecker> checker_;
  bool is_body_;
  Counts counts_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Memory>> free_;
  std::size_t made_ = 0;  // At least as many as there are memories.
};

/// A state is valid when it is within the space's bounds and free of collisions.
class CollisionStateChecker final : public ompl::base::StateValidityChecker {
 public:
  CollisionStateChecker(const ompl::base::SpaceInformationPtr& si, std::shared_ptr<OmplCollisions> collisions)
      : StateValidityChecker(si), collisions_(std::move(collisions)) {
    specs_.clearanceComputationType = ompl::base::StateValidityCheckerSpecs::EXACT;
  }
  bool isValid(const ompl::base::State* state) const override {
    return si_->satisfiesBounds(state) && collisions_->is_free(state);
  }
  /// As MotionChecker::clearance, m.
  double clearance(const ompl::base::State* state) const override { return collisions_->clearance(state); }

 private:
  std::shared_ptr<OmplCollisions> collisions_;
};

/// A motion is valid when its end is, and no pose of it collides; nothing is sampled.
class CollisionMotionValidator final : public ompl::base::MotionValidator {
 public:
  CollisionMotionValidator(const ompl::base::SpaceInformationPtr& si, std::shared_ptr<OmplCollisions> collisions)
      : MotionValidator(si), collisions_(std::move(collisions)) {}

  bool checkMotion(const ompl::base::State* from, const ompl::base::State* to) const override {
    return counted(si_->isValid(to) &&
                   collisions_->check(from, to, MotionChecker::Order::kAny).outcome == MotionCheck::kFree);
  }
  bool checkMotion(const ompl::base::State* from, const ompl::base::State* to,
                   std::pair<ompl::base::State*, double>& last_valid) const override {
    const MotionCheck answer = collisions_->check(from, to, MotionChecker::Order::kEarliest);
    if (answer.outcome == MotionCheck::kFree && si_->isValid(to)) return counted(true);
    last_valid.second = last_valid_time(from, to, answer.free_until);
    if (last_valid.first != nullptr) si_->getStateSpace()->interpolate(from, to, last_valid.second, last_valid.first);
    return counted(false);
  }

 private:
  bool counted(bool is_valid) const {
    ++collisions_->counts().motions;
    collisions_->counts().blocked_motions += is_valid ? 0 : 1;
    return is_valid;
  }
  /// Just before `until`; further back where rounding makes the state there collide.
  double last_valid_time(const ompl::base::State* from, const ompl::base::State* to, double until) const {
    ompl::base::State* state = si_->allocState();
    double found = 0.0;
    for (double back = 1e-4; back < until; back *= 8.0) {
      si_->getStateSpace()->interpolate(from, to, until - back, state);
      if (!si_->isValid(state)) continue;
      found = until - back;
      break;
    }
    si_->freeState(state);
    return found;
  }

  std::shared_ptr<OmplCollisions> collisions_;
};

/// Sets both checkers of a space; call si->setup() after it. Returns what they share; fails as OmplCollisions::make.
inline core::Result<std::shared_ptr<OmplCollisions>> use_collisions(const ompl::base::SpaceInformationPtr& si,
                                                                    std::shared_ptr<const MotionChecker> checker) {
  PRESCENE_TRY(std::shared_ptr<OmplCollisions> collisions,
               OmplCollisions::make(*si->getStateSpace(), std::move(checker)));
  si->setStateValidityChecker(std::make_shared<CollisionStateChecker>(si, collisions));
  si->setMotionValidator(std::make_shared<CollisionMotionValidator>(si, collisions));
  return collisions;
}

}  // namespace prescene::interfaces
