// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/distance_queries.h"

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/triangle_pair_distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "distance.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "distance_descent-inl.h"
#include "distance_leaves-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

DistanceOptions without_nan(DistanceOptions options) {
  if (std::isnan(options.limit)) options.limit = std::numeric_limits<double>::infinity();
  return options;
}

class NearestSearch {
 public:
  /// `any_will_do`: the first pair within the limit ends the search.
  NearestSearch(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, const DistanceOptions& options,
                bool any_will_do, QueryScratch* scratch, QueryCounts* counts)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        options_(without_nan(options)),
        any_will_do_(any_will_do),
        scratch_(scratch),
        counts_(counts),
        frame_(make_distance_frame(a, b, X_AB)) {
    const double limit = options_.limit;
    // Where single precision does not tell whether a distance is within the limit.
    const double error = 4.0 * static_cast<double>(kDistanceError) *
                         (static_cast<double>(a.radius()) + static_cast<double>(b.radius()) + std::max(limit, 0.0));
    certain_ = std::isfinite(limit) ? static_cast<float>(limit - error) : std::numeric_limits<float>::max();
    set_best(std::isfinite(limit) ? static_cast<float>(limit + error) : std::numeric_limits<float>::max());
  }

  /// Whether anything is within the limit.
  bool run(Distance* answer) {
    if (!(options_.limit >= 0.0)) return false;
    if (!begin_at_seed()) descend();
    if (!found_) return false;
    if (!known_) set_known(disjoint_pair_distance(triangle_a(best_pair_), triangle_b(best_pair_)));
    *answer = answer_;
    return true;
  }

 private:
  static Vector3f in_single(const Eigen::Vector3d& p) { return p.cast<float>(); }

  Triangle triangle_a(const BlockPair& pair) const { return triangle_of(a_.blocks()[pair.block_a], pair.pair / 4); }
  Triangle triangle_b(const BlockPair& pair) const {
    return placed(triangle_of(b_.blocks()[pair.block_b], pair.pair % 4));
  }
  Triangle placed(const Triangle& triangle_B) const {
    return {X_AB_ * triangle_B[0], X_AB_ * triangle_B[1], X_AB_ * triangle_B[2]};
  }

  /// `best`: what pairs must be below to be of interest. How far apart boxes may be for that.
  void set_best(float best) {
    best_ = best;
    float reach = best;
    if (found_) {
      const double tolerance =
          std::max({0.0, options_.absolute_tolerance, options_.relative_tolerance * static_cast<double>(best)});
      reach = std::max(0.0F, static_cast<float>(static_cast<double>(best) - tolerance));
    }
    const float in_units = reach * frame_.scale;
    reach_ = in_units * in_units * (1.0F + 1e-6F);
  }

  void set_known(const TriangleDistance& d) {
    known_ = true;
    answer_.distance = d.distance;
    answer_.p_A = d.p_A;
    answer_.p_B = d.p_B;
    if (seeded_) return;
    answer_.triangles = {a_.references()[best_pair_.block_a][best_pair_.pair / 4],
                         b_.references()[best_pair_.block_b][best_pair_.pair % 4]};
  }

  /// Points the frame of contact along a vector from A to B, m.
  void point_along(const Vector3f& between) {
    const Vector3f in_units = between * frame_.scale;
    if (in_units.squaredNorm() > std::numeric_limits<float>::min()) set_contact_frame(X_AB_, in_units, &frame_);
  }

  /// A pair that is known in double precision. Returns whether it ends the search.
  bool keep_known(const TriangleDistance& d, const BlockPair* pair) {
    if (d.distance > options_.limit) return false;
    const float distance = std::max(static_cast<float>(d.distance), std::numeric_limits<float>::min());
    if (found_ && distance >= best_ && d.distance > 0.0) return false;
    found_ = true;
    seeded_ = pair == nullptr;
    if (pair != nullptr) best_pair_ = *pair;
    set_known(d);
    set_best(distance);
    point_along(in_single(d.p_B - d.p_A));
    return d.distance == 0.0 || any_will_do_;
  }

  /// Returns whether the search has ended.
  bool begin_at_seed() {
    const TrianglePair& seed = options_.seed;
    const Mesh& mesh_a = a_.mesh();
    const Mesh& mesh_b = b_.mesh();
    if (seed.a >= mesh_a.triangle_count() || seed.b >= mesh_b.triangle_count()) return false;
    answer_.triangles = seed;
    return keep_known(triangle_pair_distance(mesh_a.corners(seed.a), placed(mesh_b.corners(seed.b))), nullptr);
  }

  /// Not one that fills up a leaf.
  bool is_of_meshes(const BlockPair& pair) const {
    return a_.references()[pair.block_a][pair.pair / 4] != kNoTriangle &&
           b_.references()[pair.block_b][pair.pair % 4] != kNoTriangle;
  }

  /// Measures pairs that wait. Returns whether that ends the search.
  HWY_NOINLINE bool measure() {
    HWY_ALIGN float distances[16];
    HWY_ALIGN float between[3][16];
    const PairVerdict verdict = batch_.measure(best_, distances, between);
    const std::uint32_t count = std::min(batch_.count(), MeasureBatch::kFull);
    if (counts_ != nullptr) {
      for (std::uint32_t i = 0; i < count; ++i) counts_->triangle_tests += is_of_meshes(batch_.pair(i)) ? 1 : 0;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      // Zero for pairs that are not sure to be apart, and for a few that single precision cannot tell from it.
      if (distances[i] == 0.0F || (!found_ && distances[i] >= certain_ && distances[i] < best_)) {
        if (counts_ != nullptr && (verdict.hit >> i & 1U) == 0) ++counts_->exact_tests;
        const TriangleDistance d = triangle_pair_distance(triangle_a(batch_.pair(i)), triangle_b(batch_.pair(i)));
        const BlockPair pair = batch_.pair(i);
        if (keep_known(d, &pair)) return true;
      }
    }
    std::uint32_t nearest = 16;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (distances[i] == 0.0F || distances[i] >= best_ || (!found_ && distances[i] >= certain_)) continue;
      nearest = i;
      best_ = distances[i];
      found_ = true;
    }
    if (nearest < 16) {
      best_pair_ = batch_.pair(nearest);
      known_ = seeded_ = false;
      set_best(distances[nearest]);
      point_along({between[0][nearest], between[1][nearest], between[2][nearest]});
    }
    batch_.drop();
    return found_ && any_will_do_;
  }

  HWY_INLINE void add_leaves(std::uint32_t block_a, std::uint32_t block_b) {
    const TriangleBlock& a = a_.blocks()[block_a];
    const TriangleBlock& b = b_.blocks()[block_b];
    const std::uint32_t pairs = near_triangles(frame_, a, b, reach_);
    if (pairs == 0) return;
    TriangleBlock placed_b;
    place_block(X_AB_, b, &placed_b);
    batch_.add(block_a, block_b, pairs, a, placed_b);
  }

  /// Straight down to what looks nearest, for a first distance. Returns whether that ends the search.
  bool dive() {
    NodePair pair = roots(a_, b_);
    do {
      if (!place_near_pair(frame_, pair, a_.nodes().data(), b_.nodes().data(), reach_, &children_, counts_) ||
          !nearest_children(children_, reach_, &pair))
        return false;
    } while (pair.a_children != 0);
    add_leaves(pair.a, pair.b);
    return measure();
  }

  void descend() {
    if (!seeded_ && dive()) return;
    NearQueue queue(reach_, &scratch_->near_pairs());
    const auto push = [&queue](const NodePair& pair, float key) HWY_ATTR { queue.push(pair, key); };
    NodePair pair = roots(a_, b_);
    queue.push(pair, -1.0F);
    while (queue.pop(reach_, &pair)) {
      if (pair.a_children == 0) {
        add_leaves(pair.a, pair.b);
        if (batch_.count() >= MeasureBatch::kFull && measure()) return;
        continue;
      }
      if (place_near_pair(frame_, pair, a_.nodes().data(), b_.nodes().data(), reach_, &children_, counts_))
        for_near_children(children_, reach_, push);
    }
    if (batch_.count() != 0) measure();
  }

  const TriangleTree& a_;
  const TriangleTree& b_;
  const Transform& X_AB_;
  DistanceOptions options_;
  bool any_will_do_;
  QueryScratch* scratch_;
  QueryCounts* counts_;
  DistanceFrame frame_;
  float certain_;  ///< Below this, single precision is sure that a distance is within the limit, m.
  float best_;     ///< Only less than this is of interest, m.
  float reach_;    ///< Squared, in units: pairs of boxes further apart are not.
  bool found_ = false;
  bool seeded_ = false;  ///< What was found is the seed.
  bool known_ = false;   ///< In double precision: then the answer is complete.
  BlockPair best_pair_;
  Distance answer_;
  NearChildren children_;
  MeasureBatch batch_;
};

bool find_nearest(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, const DistanceOptions& options,
                  bool any_will_do, QueryScratch* scratch, QueryCounts* counts, Distance* answer) {
  return NearestSearch(a, b, X_AB, options, any_will_do, scratch, counts).run(answer);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(find_nearest);

std::optional<Distance> distance(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB,
                                 const DistanceOptions& options, QueryScratch& scratch, QueryCounts* counts) {
  Distance answer;
  if (!HWY_DYNAMIC_DISPATCH(find_nearest)(a, b, X_AB, options, false, &scratch, counts, &answer)) return std::nullopt;
  return answer;
}

bool within_distance(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, double margin,
                     QueryScratch& scratch, QueryCounts* counts) {
  if (!(margin >= 0.0)) return false;
  Distance answer;
  DistanceOptions options;
  options.limit = margin;
  return HWY_DYNAMIC_DISPATCH(find_nearest)(a, b, X_AB, options, true, &scratch, counts, &answer);
}

}  // namespace prescene::collision
#endif
