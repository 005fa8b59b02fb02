// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/motion_checker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "prescene/collision/continuous_queries.h"
#include "prescene/core/text.h"

namespace prescene::interfaces {
namespace {

using geometry::Pose;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

core::Status check_options(const MotionCheckOptions& options) {
  if (!(options.margin >= 0.0 && options.margin <= 1.0))
    return core::invalid_input("margin: " + core::rounded_text(options.margin) +
                               " m is not in [0, 1]: give one that is");
  if (!(options.tolerance >= 1e-6 && options.tolerance <= 1.0))
    return core::invalid_input("tolerance: " + core::rounded_text(options.tolerance) +
                               " m is not in [1e-6, 1]: give one that is");
  if (options.step_limit < 1) return core::invalid_input("step_limit: give at least 1");
  return core::ok_status();
}

}  // namespace

core::Result<std::shared_ptr<const MotionChecker>> MotionChecker::make(std::shared_ptr<const Mover> mover,
                                                                       std::vector<Obstacle> obstacles,
                                                                       const MotionCheckOptions& options,
                                                                       std::span<const double> home) {
  PRESCENE_RETURN_IF_ERROR(check_options(options));
  if (mover == nullptr) return core::invalid_input("no mover: say what is planned for");
  if (!home.empty() && (home.size() != mover->dimension() || !mover->is_configuration(home)))
    return core::invalid_input("home: give " + std::to_string(mover->dimension()) +
                               " finite numbers, and a quaternion that is not zero where there is one");
  std::shared_ptr<MotionChecker> checker(new MotionChecker());
  for (const Obstacle& obstacle : obstacles) {
    const auto X_WO = collision::to_transform(obstacle.X_WO);
    if (!X_WO) return X_WO.status().at("obstacle '" + obstacle.name + "'");
    checker->only_triangles_ = checker->only_triangles_ && obstacle.shape.triangles();
  }
  checker->mover_ = std::move(mover);
  checker->obstacles_ = std::move(obstacles);
  checker->options_ = options;
  const auto& shapes = checker->mover_->shapes();
  for (std::uint32_t shape = 0; shape < shapes.size(); ++shape) {
    checker->only_triangles_ = checker->only_triangles_ && shapes[shape].shape.triangles();
    if (!checker->mover_->moves(shape)) continue;
    for (std::uint32_t other = 0; other < checker->obstacles_.size(); ++other)
      checker->pairs_.push_back({shape, other, false});
  }
  PlanningScratch scratch;
  if (!home.empty()) checker->place(home, scratch);
  for (const auto& [shape, other] : checker->mover_->own_pairs()) {
    const Pair pair{static_cast<std::uint32_t>(shape), static_cast<std::uint32_t>(other), true};
    if (!home.empty() && checker->meets(pair, scratch)) {
      checker->ignored_.emplace_back(shapes[shape].name, shapes[other].name);
    } else {
      checker->pairs_.push_back(pair);
    }
  }
  return std::shared_ptr<const MotionChecker>(std::move(checker));
}

void MotionChecker::place(std::span<const double> q, PlanningScratch& scratch) const {
  scratch.poses_.resize(mover_->shapes().size());
  mover_->place(q, scratch.poses_, &scratch.work_);
}

const PlanningShape& MotionChecker::other_shape(const Pair& pair) const {
  return pair.is_own ? mover_->shapes()[pair.other].shape : obstacles_[pair.other].shape;
}

Pose MotionChecker::other_to_shape(const Pair& pair, const PlanningScratch& scratch) const {
  const Pose& X_WO = pair.is_own ? scratch.poses_[pair.other] : obstacles_[pair.other].X_WO;
  return X_WO.inverse() * scratch.poses_[pair.shape];
}

double MotionChecker::gap(const Pair& pair, double below, PlanningScratch& scratch) const {
  return shape_gap(other_shape(pair), mover_->shapes()[pair.shape].shape, other_to_shape(pair, scratch), below,
                   scratch.shapes);
}

bool MotionChecker::meets(const Pair& pair, PlanningScratch& scratch) const {
  return shapes_meet(other_shape(pair), mover_->shapes()[pair.shape].shape, other_to_shape(pair, scratch),
                     options_.margin, scratch.shapes);
}

bool MotionChecker::is_free(std::span<const double> q, PlanningScratch& scratch) const {
  if (!mover_->is_configuration(q)) return false;
  place(q, scratch);
  return std::none_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) { return meets(pair, scratch); });
}

double MotionChecker::clearance(std::span<const double> q, PlanningScratch& scratch) const {
  if (!is_free(q, scratch)) return 0.0;
  double least = kInfinity;
  for (const Pair& pair : pairs_) least = std::min(least, gap(pair, least, scratch));
  return std::max(0.0, least - options_.margin);
}

MotionCheck MotionChecker::check(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch,
                                 Order order) const {
  if (!mover_->is_configuration(q0) || !mover_->is_configuration(q1)) return {MotionCheck::kBlocked, 0.0, 0};
  if (options_.margin == 0.0 && only_triangles_ && mover_->shapes().size() == 1) {
    if (const auto twist = mover_->steady_twist(q0, q1)) return first_contacts(q0, q1, *twist, scratch, order);
  }
  return bisect(q0, q1, scratch, order);
}

MotionCheck MotionChecker::first_contacts(std::span<const double> q0, std::span<const double> q1,
                                          const geometry::Twist& twist, PlanningScratch& scratch, Order order) const {
  MotionCheck result;
  place(q0, scratch);
  const double way = mover_->way(0, std::nullopt, q0, q1);
  const PlanningShape& body = mover_->shapes().front().shape;
  for (const Pair& pair : pairs_) {
    const Obstacle& obstacle = obstacles_[pair.other];
    const Pose X_OB = other_to_shape(pair, scratch);
    const Eigen::Vector3d p_OB = X_OB * Eigen::Vector3d(body.box().center());
    if (obstacle.shape.box().exteriorDistance(p_OB) > body.ball_radius() + way) continue;
    const auto R_OW = obstacle.X_WO.rotation.conjugate();
    const auto motion = collision::RigidMotion::thrown(X_OB, {R_OW * twist.angular, R_OW * twist.linear});
    if (!motion) return {MotionCheck::kBlocked, 0.0, result.steps};
    ++result.steps;
    const auto contact =
        collision::first_contact(*obstacle.shape.triangles(), *body.triangles(), *motion, {}, scratch.shapes.triangles);
    if (contact.outcome == collision::MotionOutcome::kNoContact) continue;
    // One just at the end is a contact, too.
    if (result.outcome != MotionCheck::kFree && contact.time >= result.free_until) continue;
    result.free_until = contact.time;
    result.outcome =
        contact.outcome == collision::MotionOutcome::kContact ? MotionCheck::kBlocked : MotionCheck::kStepLimit;
    if (order == Order::kAny) return {result.outcome, 0.0, result.steps};
  }
  return result;
}

MotionCheck MotionChecker::bisect(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch,
                                  Order order) const {
  MotionCheck result;
  const double margin = options_.margin;
  scratch.ways_.resize(pairs_.size());
  scratch.bounds_.clear();
  scratch.pieces_.clear();
  place(q0, scratch);
  ++result.steps;
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    const auto other = pair.is_own ? std::optional<std::size_t>(pair.other) : std::nullopt;
    double& way = scratch.ways_[i];
    way = mover_->way(pair.shape, other, q0, q1);
    if (pair.is_own) way += mover_->way(pair.other, pair.shape, q0, q1);
    const double gap_there = gap(pair, margin + way, scratch);
    if (gap_there <= margin) return {MotionCheck::kBlocked, 0.0, result.steps};
    if (gap_there < kInfinity) scratch.bounds_.push_back({i, gap_there, kInfinity});
  }
  place(q1, scratch);
  ++result.steps;
  std::size_t kept = 0;
  bool end_is_free = true;
  for (PlanningScratch::Bound bound : scratch.bounds_) {
    const double way = scratch.ways_[bound.pair];
    bound.at_end = gap(pairs_[bound.pair], margin + way, scratch);
    end_is_free = end_is_free && bound.at_end > margin;
    if (way < bound.at_begin + bound.at_end - 2.0 * margin) continue;
    scratch.bounds_[kept++] = bound;
  }
  scratch.bounds_.resize(kept);
  if (!end_is_free && order == Order::kAny) return {MotionCheck::kBlocked, 0.0, result.steps};
  if (kept == 0) return result;
  scratch.pieces_.push_back({0.0, 1.0, 0, kept});
  return cut_pieces(q0, q1, scratch, order, result);
}

/// The time before which the pairs of a piece stay clear, from how far they are apart at its beginning.
double MotionChecker::known_free(const PlanningScratch& scratch, const PlanningScratch::Piece& piece) const {
  double until = piece.end;
  for (std::size_t i = piece.first; i < piece.first + piece.count; ++i) {
    const PlanningScratch::Bound& bound = scratch.bounds_[i];
    const double way = scratch.ways_[bound.pair];
    if (way > 0.0) until = std::min(until, piece.begin + (bound.at_begin - options_.margin) / way);
  }
  return std::max(until, 0.0);
}

MotionCheck MotionChecker::cut_pieces(std::span<const double> q0, std::span<const double> q1, PlanningScratch& scratch,
                                      Order order, MotionCheck result) const {
  const double margin = options_.margin;
  auto& pieces = scratch.pieces_;
  auto& bounds = scratch.bounds_;
  auto& left = scratch.left_;
  auto& right = scratch.right_;
  const auto put_down = [&](double begin, double end, const std::vector<PlanningScratch::Bound>& of) {
    if (of.empty()) return;
    pieces.push_back({begin, end, bounds.size(), of.size()});
    bounds.insert(bounds.end(), of.begin(), of.end());
  };
  scratch.configuration_.resize(mover_->dimension());
  for (std::size_t next = 0; next < pieces.size();) {
    // From the start on: the last that was put down. Else the longest: the first.
    const PlanningScratch::Piece piece = order == Order::kEarliest ? pieces.back() : pieces[next];
    if (order == Order::kEarliest) {
      pieces.pop_back();
      bounds.resize(piece.first + piece.count);  // What was put down after it is done.
    } else {
      ++next;
    }
    const auto ended = [&](MotionCheck::Outcome outcome) -> MotionCheck {
      return {outcome, order == Order::kEarliest ? known_free(scratch, piece) : 0.0, result.steps};
    };
    if (result.steps >= options_.step_limit) return ended(MotionCheck::kStepLimit);
    const double middle = 0.5 * (piece.begin + piece.end);
    mover_->between(q0, q1, middle, scratch.configuration_);
    place(scratch.configuration_, scratch);
    ++result.steps;
    left.clear();
    right.clear();
    bool is_blocked = false, is_short = false;
    for (std::size_t i = piece.first; i < piece.first + piece.count; ++i) {
      const PlanningScratch::Bound bound = bounds[i];
      const double way = scratch.ways_[bound.pair] * (middle - piece.begin);
      const double there = gap(pairs_[bound.pair], margin + way, scratch);
      if (there == kInfinity) continue;
      const bool left_open = !(way < bound.at_begin + there - 2.0 * margin);
      const bool right_open = !(way < there + bound.at_end - 2.0 * margin);
      if (left_open) left.push_back({bound.pair, bound.at_begin, there});
      if (right_open) right.push_back({bound.pair, there, bound.at_end});
      is_blocked = is_blocked || there <= margin;
      is_short = is_short || ((left_open || right_open) && way <= options_.tolerance);
    }
    // What is short enough and not known to be free passes within the tolerance.
    if (is_short || (is_blocked && order == Order::kAny)) return ended(MotionCheck::kBlocked);
    if (order == Order::kEarliest) put_down(middle, piece.end, right);
    put_down(piece.begin, middle, left);
    if (order == Order::kAny) put_down(middle, piece.end, right);
  }
  return result;
}

}  // namespace prescene::interfaces
