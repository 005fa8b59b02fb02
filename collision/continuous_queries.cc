// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/continuous_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "continuous_queries.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "leaf_pairs-inl.h"
#include "moving_boxes-inl.h"
#include "pair_traversal-inl.h"
#include "prescene/collision/triangle_distance-inl.h"
#include "prescene/collision/triangle_pair_distance.h"

// Once for all instruction sets.
#ifndef PRESCENE_COLLISION_CONTINUOUS_QUERIES_ONCE_
#define PRESCENE_COLLISION_CONTINUOUS_QUERIES_ONCE_
namespace prescene::collision {

using Eigen::Vector3d;

// What a rounding does at least, m.
inline constexpr auto kSmallestFloat = static_cast<double>(std::numeric_limits<float>::denorm_min());

/// B, or a triangle of it, at a time.
struct Placed {
  geometry::Pose X_AB;
  Transform rounded;
  MotionField field;
};

inline Placed place_at(const RigidMotion& motion, double time) {
  Placed placed{motion.pose(time), {}, motion.field(time)};
  placed.rounded = rounded_transform(placed.X_AB.rotation.toRotationMatrix(), placed.X_AB.translation);
  return placed;
}

/// The t at which r t + (a / 2) t^2 = gap, or a little before.
inline double closing_time_of(double gap, double r, double a) {
  if (!(gap > 0.0)) return 0.0;
  const double root = std::sqrt(r * r + 2.0 * a * gap);
  const double below = r + root + 1e-14 * (root + std::abs(r));
  return below > 0.0 ? 2.0 * gap * (1.0 - 1e-12) / below : std::numeric_limits<double>::infinity();
}

/// What is known of a query's answer while it is looked for.
struct ContactSearch {
  const TriangleTree* a;
  const TriangleTree* b;
  const RigidMotion* motion;
  double rounding;   ///< What single precision does to the distance of two triangles, m.
  double tolerance;  ///< m
  float scale;       ///< Lengths are about 1 when they are multiplied by this.
  std::uint64_t steps_left;
  FirstContact found;  ///< The earliest contact so far.
  double slack;        ///< So much before it, the bodies are within the tolerance.

  /// Whether what happens then changes nothing.
  bool is_too_late(double time) const {
    return found.outcome == MotionOutcome::kContact ? time >= found.time : time > found.time;
  }
};

/// Corners of triangles of B in A's frame, as all queries see them.
inline Triangle placed_triangle(const Placed& placed, const Triangle& triangle) {
  return {placed.rounded * triangle[0], placed.rounded * triangle[1], placed.rounded * triangle[2]};
}

// Triangles are followed so far at once, then others have their turn.
constexpr int kTriangleSteps = 6;

/// Follows two triangles from a time on. Returns a time before which they do not touch: infinity when that is not
/// before the earliest contact so far, or when they are that contact now.
inline double follow_triangles(const TrianglePair& pair, double time, ContactSearch* search) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Triangle a = search->a->mesh().corners(pair.a);
  const Triangle b = search->b->mesh().corners(pair.b);
  for (int i = 0; i < kTriangleSteps && search->steps_left > 0; ++i) {
    --search->steps_left;
    const Placed placed = place_at(*search->motion, time);
    const Triangle b_now = placed_triangle(placed, b);
    const TriangleDistance distance = triangle_pair_distance(a, b_now);
    const Vector3d apart = distance.p_B - distance.p_A;
    const double length = apart.norm();
    const Vector3d n = length > 0.0 ? Vector3d(apart / length) : Vector3d::Zero();
    // Along n as it came out, and in any direction.
    double gap = std::numeric_limits<double>::infinity();
    double rate = -std::numeric_limits<double>::infinity();
    double speed = 0.0;
    double swirl = 0.0;
    for (const Vector3f& corner_b : b_now) {
      const Vector3d p = corner_b.cast<double>();
      const Vector3d velocity = placed.field.velocity(p);
      for (const Vector3f& corner_a : a) gap = std::min(gap, n.dot(p - corner_a.cast<double>()));
      rate = std::max(rate, -n.dot(velocity));
      speed = std::max(speed, velocity.norm());
      swirl = std::max(swirl, placed.field.swirl(p).norm());
    }
    const double step =
        std::max(closing_time_of(gap - search->rounding, rate, n.cross(placed.field.spin).norm() * swirl),
                 closing_time_of(distance.distance - search->rounding, speed, placed.field.spin.norm() * swirl));
    if (search->is_too_late(time + step)) return kNever;
    if (distance.distance <= search->tolerance) {
      search->found = {MotionOutcome::kContact, time, distance.distance, distance.p_A, distance.p_B, n, pair, 0};
      search->slack = speed > 0.0 ? (search->tolerance - distance.distance) / speed : 0.0;
      return kNever;
    }
    time += step;
  }
  return time;
}

}  // namespace prescene::collision
#endif

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// So that the earliest time, and of equal ones a pair of leaves, is taken first.
struct Later {
  bool operator()(const MovingPair& p, const MovingPair& q) const {
    return p.time != q.time ? p.time > q.time : p.are_leaves < q.are_leaves;
  }
};

inline void push(std::vector<MovingPair>* heap, const MovingPair& pair) {
  heap->push_back(pair);
  std::push_heap(heap->begin(), heap->end(), Later());
}

/// A time `step` after `now`, or a little less.
inline float time_after(float now, float step) { return std::max(now, (now + step) * (1.0F - 2.0F / 16777216.0F)); }

/// Boxes of the children of two nodes at the time before which these do not touch, and how long these do not yet.
struct PairTimes {
  HWY_ALIGN float times[16][16];  ///< [child of a][child of b]
  std::uint32_t early[16] = {};   ///< Children of b that may touch child i of a before the earliest contact so far.
  float shortest = std::numeric_limits<float>::infinity();
  float speed;  ///< Most of a point of B's node, m a unit of time.
};

inline void make_pair_times(const MovingPair& from, const ContactSearch& search, float slack, PairTimes* out) {
  const TriangleTreeNode& a = search.a->nodes()[from.pair.a];
  const TriangleTreeNode& b = search.b->nodes()[from.pair.b];
  const Placed placed = place_at(*search.motion, static_cast<double>(from.time));
  QueryFrame query = make_query_frame(*search.a, *search.b, placed.rounded);
  query.slack = slack;
  Nodes nodes_a;
  Nodes nodes_b;
  std::fill(std::begin(nodes_a), std::end(nodes_a), &a);
  std::fill(std::begin(nodes_b), std::end(nodes_b), &b);
  PairFrames frames;
  make_pair_frames(hn::CappedTag<float, 4>(), query, nodes_a, nodes_b, 1, &frames);
  const Placement X_ab = {{frames.R_ba[0], frames.R_ba[1], frames.R_ba[2]}, frames.p_ab, frames.slack[0]};
  const Placement X_ba = {{frames.R_ab[0], frames.R_ab[1], frames.R_ab[2]}, frames.p_ba, frames.slack[0]};
  ChildBoxes boxes_a;
  ChildBoxes boxes_b;
  place_children(a, from.pair.a_children, X_ba, b.half_extent, &boxes_a);
  place_children(b, from.pair.b_children, X_ab, a.half_extent, &boxes_b);
  BoxRates rates;
  rates.scale = search.scale;
  out->speed = make_box_rates(placed.field, placed.X_AB, a, b, boxes_b, &rates);
  const auto limit = static_cast<float>((search.found.time - static_cast<double>(from.time)) * (1.0 + 1e-6));
  for (std::uint32_t rows = from.pair.a_children; rows != 0; rows &= rows - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
    out->early[i] = closing_times(boxes_a, i, boxes_b, rates, limit, out->times[i]) & from.pair.b_children;
    for (std::uint32_t bits = out->early[i]; bits != 0; bits &= bits - 1)
      out->shortest = std::min(out->shortest, out->times[i][std::countr_zero(bits)]);
  }
}

/// Takes up two nodes at the time before which they do not touch: they go on together while they are far apart for
/// their size, and are split then.
inline void take_up(const MovingPair& from, const ContactSearch& search, float slack, std::vector<MovingPair>* heap,
                    QueryCounts* counts) {
  const TriangleTreeNode& a = search.a->nodes()[from.pair.a];
  const TriangleTreeNode& b = search.b->nodes()[from.pair.b];
  PairTimes pairs;
  make_pair_times(from, search, slack, &pairs);
  if (counts != nullptr) {
    ++counts->node_pairs;
    counts->volume_tests += static_cast<std::uint64_t>(std::popcount(from.pair.a_children)) *
                            static_cast<std::uint64_t>(std::popcount(from.pair.b_children));
  }
  if (pairs.shortest == std::numeric_limits<float>::infinity()) return;
  if (pairs.shortest * pairs.speed > 0.25F * (a.diagonal + b.diagonal)) {
    push(heap, {time_after(from.time, pairs.shortest), false, from.pair});
    return;
  }
  const auto all = [](const TriangleTree& tree, std::uint32_t node) {
    return static_cast<std::uint16_t>(tree.nodes()[node].child_mask());
  };
  for (std::uint32_t rows = from.pair.a_children; rows != 0; rows &= rows - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(rows));
    const bool a_is_leaf = (a.leaf_mask() >> i & 1U) != 0;
    const std::uint32_t below_a = a_is_leaf ? child_block(a, i) : child_node(a, i);
    for (std::uint32_t bits = pairs.early[i]; bits != 0; bits &= bits - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(bits));
      const bool b_is_leaf = (b.leaf_mask() >> k & 1U) != 0;
      const std::uint32_t below_b = b_is_leaf ? child_block(b, k) : child_node(b, k);
      // A leaf beside a node stays with its parent, as the only child that counts.
      NodePair pair{below_a, below_b, 0, 0};
      if (a_is_leaf && !b_is_leaf) {
        pair = {from.pair.a, below_b, static_cast<std::uint16_t>(1U << i), all(*search.b, below_b)};
      } else if (!a_is_leaf && b_is_leaf) {
        pair = {below_a, from.pair.b, all(*search.a, below_a), static_cast<std::uint16_t>(1U << k)};
      } else if (!a_is_leaf) {
        pair = {below_a, below_b, all(*search.a, below_a), all(*search.b, below_b)};
      }
      push(heap, {time_after(from.time, pairs.times[i][k]), a_is_leaf && b_is_leaf, pair});
    }
  }
}

/// Follows those triangles of two blocks that may touch before the earliest contact so far.
inline void take_up_leaves(const MovingPair& from, ContactSearch* search, std::vector<MovingPair>* heap,
                           QueryCounts* counts) {
  const auto time = static_cast<double>(from.time);
  const Placed placed = place_at(*search->motion, time);
  const TriangleBlock& a = search->a->blocks()[from.pair.a];
  TriangleBlock b;
  place_block(placed.rounded, search->b->blocks()[from.pair.b], &b);
  HWY_ALIGN float distances[16];
  distance_of_4_against_4(&a.corners[0][0][0], &b.corners[0][0][0], std::numeric_limits<float>::infinity(), distances);
  double speed = 0.0;
  double bend = 0.0;
  Eigen::AlignedBox3d box;
  for (std::uint32_t i = 0; i < 4; ++i) {
    for (const Vector3f& corner : triangle_of(b, i)) {
      const Vector3d p = corner.cast<double>();
      speed = std::max(speed, placed.field.velocity(p).norm());
      bend = std::max(bend, placed.field.spin.norm() * placed.field.swirl(p).norm());
      box.extend(p);
    }
    for (const Vector3f& corner : triangle_of(a, i)) box.extend(corner.cast<double>());
  }
  const double error = static_cast<double>(kDistanceError) * box.sizes().maxCoeff() + search->rounding;
  if (counts != nullptr)
    counts->triangle_tests += std::uint64_t{triangles_in(search->a->references()[from.pair.a])} *
                              triangles_in(search->b->references()[from.pair.b]);
  double earliest = std::numeric_limits<double>::infinity();
  for (std::uint32_t pair = 0; pair < 16; ++pair) {
    const TrianglePair triangles{search->a->references()[from.pair.a][pair / 4],
                                 search->b->references()[from.pair.b][pair % 4]};
    if (triangles.a == kNoTriangle || triangles.b == kNoTriangle) continue;
    const double gap = static_cast<double>(distances[pair]) - error;
    if (search->is_too_late(time + closing_time_of(gap, speed, bend))) continue;
    earliest = std::min(earliest, follow_triangles(triangles, time, search));
  }
  if (search->is_too_late(earliest)) return;
  push(heap, {std::max(from.time, std::nextafter(static_cast<float>(earliest), 0.0F)), true, from.pair});
}

FirstContact first_contact_lanes(ContactSearch* search, double extent, QueryScratch* scratch, QueryCounts* counts) {
  const auto slack = static_cast<float>(36.0 / 16777216.0 * extent + 36.0 * kSmallestFloat);
  const std::uint64_t steps = search->steps_left;
  std::vector<MovingPair>& heap = scratch->moving_pairs();
  heap.clear();
  heap.push_back({0.0F,
                  false,
                  {0, 0, static_cast<std::uint16_t>(search->a->nodes()[0].child_mask()),
                   static_cast<std::uint16_t>(search->b->nodes()[0].child_mask())}});
  double safe = 0.0;
  bool gave_up = false;
  while (!heap.empty()) {
    const MovingPair next = heap.front();
    safe = static_cast<double>(next.time);
    if (search->found.outcome == MotionOutcome::kContact && safe >= search->found.time - search->slack) break;
    gave_up = search->steps_left == 0;
    if (gave_up) break;
    --search->steps_left;
    std::pop_heap(heap.begin(), heap.end(), Later());
    heap.pop_back();
    if (next.are_leaves) {
      take_up_leaves(next, search, &heap, counts);
    } else {
      take_up(next, *search, slack, &heap, counts);
    }
  }
  FirstContact answer = search->found;
  if (gave_up) {
    answer = {};
    answer.outcome = MotionOutcome::kStepLimit;
    answer.time = safe;
  } else if (answer.outcome == MotionOutcome::kContact && !heap.empty() && safe < answer.time) {
    // Others may touch a little before; the bodies are within the tolerance there.
    const Placed placed = place_at(*search->motion, safe);
    const TriangleDistance distance =
        triangle_pair_distance(search->a->mesh().corners(answer.triangles.a),
                               placed_triangle(placed, search->b->mesh().corners(answer.triangles.b)));
    const Vector3d apart = distance.p_B - distance.p_A;
    answer.time = safe;
    answer.distance = distance.distance;
    answer.p_A = distance.p_A;
    answer.p_B = distance.p_B;
    if (distance.distance > 0.0) answer.normal = apart.normalized();
  }
  answer.steps = steps - search->steps_left;
  return answer;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(first_contact_lanes);

namespace {

FirstContact contact_at_start(const TriangleTree& a, const TriangleTree& b, const Placed& start,
                              const TrianglePair& pair) {
  const TriangleDistance touching =
      triangle_pair_distance(a.mesh().corners(pair.a), placed_triangle(start, b.mesh().corners(pair.b)));
  return {MotionOutcome::kContact, 0.0, 0.0, touching.p_A, touching.p_B, Vector3d::Zero(), pair, 1};
}

}  // namespace

FirstContact first_contact(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion,
                           const FirstContactOptions& options, QueryScratch& scratch, QueryCounts* counts) {
  // Of a mesh's size.
  constexpr double kDefaultTolerance = 1e-4;
  constexpr double kRounding = 16.0 / 16777216.0;
  const Placed start = place_at(motion, 0.0);
  if (const auto pair = first_pair(a, b, start.rounded, scratch, counts)) return contact_at_start(a, b, start, *pair);
  // No coordinate, of what B is on its way, is beyond this.
  const Vector3d origin = start.X_AB.translation;
  const double extent = static_cast<double>(a.radius()) + static_cast<double>(b.radius()) + origin.lpNorm<1>() +
                        start.field.steady.lpNorm<1>() + std::sqrt(3.0) * start.field.swirl(origin).norm();
  const float scale = std::ldexp(1.0F, extent > 0.0 ? std::clamp(-std::ilogb(extent), -126, 126) : 0);
  ContactSearch search{
      &a, &b, &motion, kRounding * extent + 16.0 * kSmallestFloat, options.tolerance, scale, options.step_limit,
      {}, 0.0};
  if (!(search.tolerance > 0.0))
    search.tolerance = kDefaultTolerance * static_cast<double>(std::min(a.mesh().size(), b.mesh().size()));
  search.tolerance = std::max(search.tolerance, 4.0 * search.rounding);
  return HWY_DYNAMIC_DISPATCH(first_contact_lanes)(&search, extent, &scratch, counts);
}

}  // namespace prescene::collision
#endif
