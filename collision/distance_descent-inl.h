// SPDX-License-Identifier: Apache-2.0
// Descent of two TriangleTrees towards what is nearest: lower bounds of the distances of the children of two nodes, one
// against sixteen, and the pairs that wait. Included once for each instruction set.
//
// Two boxes are at least as far apart as one of them is from a box about the other in its own frame, with faces along
// that frame's axes: the norm of the gaps along three axes. That holds in the frames of both, and along any other axis:
// the best one is from the nearest points known so far of one body to those of the other.
//
// Lengths are in units of the query, a power of two of metres, so that their squares neither overflow nor vanish.
#include "pair_traversal-inl.h"
#include "prescene/collision/query_scratch.h"

#if defined(PRESCENE_COLLISION_DISTANCE_DESCENT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_DISTANCE_DESCENT_INL_H_
#undef PRESCENE_COLLISION_DISTANCE_DESCENT_INL_H_
#else
#define PRESCENE_COLLISION_DISTANCE_DESCENT_INL_H_
#endif

#include <array>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// What all pairs of nodes of a query share.
struct DistanceFrame {
  QueryFrame query;
  float scale;  ///< Units per metre.
  /// Rows of R_CA and R_CB, a little shorter than one, and p_CB, m: frame C, whose first axis points from A to B.
  float axes_of_a[3][3];
  float axes_of_b[3][3];
  float origin_of_b[3];
};

/// `to_b`: from the nearest point known of A to that of B, in A; as long as it likes, but not zero.
inline void set_contact_frame(const Transform& X_AB, const Vector3f& to_b, DistanceFrame* frame) {
  constexpr float kShorter = 1.0F - 1e-6F;
  const Vector3f n = to_b * (kShorter / to_b.norm());
  const Vector3f u = Vector3f(n.unitOrthogonal() * kShorter);
  const Vector3f v = n.cross(u);
  const auto& r = X_AB.rotation;
  const auto& t = X_AB.translation;
  int row = 0;
  for (const Vector3f& axis : {n, u, v}) {
    for (std::size_t k = 0; k < 3; ++k) {
      frame->axes_of_a[row][k] = axis[static_cast<int>(k)];
      frame->axes_of_b[row][k] = axis.x() * r[k] + axis.y() * r[3 + k] + axis.z() * r[6 + k];
    }
    frame->origin_of_b[row] = axis.x() * t[0] + axis.y() * t[1] + axis.z() * t[2];
    ++row;
  }
}

inline DistanceFrame make_distance_frame(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB) {
  DistanceFrame frame;
  frame.query = make_query_frame(a, b, X_AB);
  const float extent = a.radius() + b.radius() + std::abs(X_AB.translation[0]) + std::abs(X_AB.translation[1]) +
                       std::abs(X_AB.translation[2]);
  frame.scale = std::ldexp(1.0F, -std::ilogb(std::max(extent, 1e-36F)));
  const auto middle = [](const TriangleTreeNode& node) {
    Vector3f p(node.origin);
    for (int k = 0; k < 3; ++k) p += Vector3f(node.axes_x[k], node.axes_y[k], node.axes_z[k]) * node.half_extent[k];
    return p;
  };
  const Vector3f apart = (X_AB * middle(b.nodes()[0]) - middle(a.nodes()[0])) * frame.scale;
  set_contact_frame(X_AB, apart.norm() > 1e-6F ? apart : Vector3f(Vector3f::UnitX()), &frame);
  return frame;
}

/// Boxes of the children of one node of a pair, and their ends along the first axis of C: those towards the other body.
struct NearBoxes : ChildBoxes {
  HWY_ALIGN float end[16];
};

/// A node of a pair, of which the other node knows what it needs.
struct NearNode {
  HWY_ALIGN float half[4];      ///< Half extents of the node's box, which has a corner at the origin.
  HWY_ALIGN float position[4];  ///< Of the node in the other's frame.
  HWY_ALIGN float along[4];     ///< The first axis of C in the node's frame.
  float start;                  ///< The node's origin along it; that of A's node is zero.
  float sign;                   ///< +1 where the upper end is towards the other body.
};

/// Places the children of `node` in its own frame and in the other's, whose rows are R, and tells which may be within
/// `limit` (squared) of the other node's box.
HWY_INLINE std::uint32_t place_near_children(const TriangleTreeNode& node, const NearNode& near,
                                             const float* const (&R)[3], const float* other_half, float slack,
                                             float scale, float limit, NearBoxes* boxes) {
  const Floats16 d;
  const hn::RebindToSigned<Floats16> di;
  const hn::Rebind<std::uint8_t, Floats16> d8;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 centre[3];
    V16 half[3];
    for (int k = 0; k < 3; ++k) {
      const auto low = hn::PromoteTo(di, hn::LoadU(d8, node.low[k] + lane));
      const auto high = hn::PromoteTo(di, hn::LoadU(d8, node.high[k] + lane));
      const V16 step = hn::Set(d, half_step(node.half_extent[k]) * scale);
      centre[k] = hn::Mul(hn::ConvertTo(d, hn::Sub(hn::Add(low, high), hn::Set(di, 2))), step);
      half[k] = hn::Mul(hn::ConvertTo(d, hn::Sub(high, low)), step);
      hn::Store(centre[k], d, boxes->centre[k] + lane);
      hn::Store(half[k], d, boxes->half[k] + lane);
    }
    const auto centre_along = [&](const float* axis, float from) HWY_ATTR {
      const V16 x = hn::MulAdd(centre[0], hn::Set(d, axis[0]), hn::Set(d, from));
      return hn::MulAdd(centre[2], hn::Set(d, axis[2]), hn::MulAdd(centre[1], hn::Set(d, axis[1]), x));
    };
    const auto half_along = [&](const float* axis) HWY_ATTR {
      const V16 x = hn::MulAdd(half[0], hn::Set(d, std::abs(axis[0])), hn::Set(d, slack));
      const V16 xy = hn::MulAdd(half[1], hn::Set(d, std::abs(axis[1])), x);
      return hn::MulAdd(half[2], hn::Set(d, std::abs(axis[2])), xy);
    };
    V16 square = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      const V16 c = centre_along(R[k], near.position[k]);
      const V16 h = half_along(R[k]);
      hn::Store(c, d, boxes->other_centre[k] + lane);
      hn::Store(h, d, boxes->other_half[k] + lane);
      const V16 apart = hn::Max(gap(d, c, h, other_half[k], other_half[k]), hn::Zero(d));
      square = hn::MulAdd(apart, apart, square);
    }
    hn::Store(hn::MulAdd(half_along(near.along), hn::Set(d, near.sign), centre_along(near.along, near.start)), d,
              boxes->end + lane);
    bits |= bits_of_mask(d, hn::Le(square, hn::Set(d, limit))) << lane;
  }
  return bits;
}

/// For box `row` of p and the boxes of q: the square of a lower bound of their distance where that is positive,
/// elsewhere minus how far they overlap along the axis where that is least. `sign` is +1 where q is of B. Returns which
/// are at most `limit`.
HWY_INLINE std::uint32_t bound_near(const NearBoxes& p, std::uint32_t row, const NearBoxes& q, float sign, float limit,
                                    float* keys) {
  const Floats16 d;
  const V16 zero = hn::Zero(d);
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 worst = hn::Mul(hn::Sub(hn::Load(d, q.end + lane), hn::Set(d, p.end[row])), hn::Set(d, sign));
    const V16 along = hn::Max(worst, zero);
    V16 in_q = zero;
    V16 in_p = zero;
    for (int k = 0; k < 3; ++k) {
      const V16 g = gap(d, hn::Load(d, q.centre[k] + lane), hn::Load(d, q.half[k] + lane), p.other_centre[k][row],
                        p.other_half[k][row]);
      const V16 h = gap(d, hn::Load(d, q.other_centre[k] + lane), hn::Load(d, q.other_half[k] + lane), p.centre[k][row],
                        p.half[k][row]);
      worst = hn::Max(worst, hn::Max(g, h));
      const V16 some_g = hn::Max(g, zero);
      const V16 some_h = hn::Max(h, zero);
      in_q = hn::MulAdd(some_g, some_g, in_q);
      in_p = hn::MulAdd(some_h, some_h, in_p);
    }
    const V16 square = hn::Max(hn::Mul(along, along), hn::Max(in_q, in_p));
    const V16 key = hn::IfThenElse(hn::Gt(worst, zero), square, worst);
    hn::Store(key, d, keys + lane);
    bits |= bits_of_mask(d, hn::Le(key, hn::Set(d, limit))) << lane;
  }
  return bits;
}

/// The children of a pair of nodes, side by side. Rows are the side, p, with fewer children left; q is the other.
struct NearChildren {
  NearBoxes boxes_a;
  NearBoxes boxes_b;
  const TriangleTreeNode* nodes_a;
  const TriangleTreeNode* nodes_b;
  NodePair pair;
  bool rows_are_a;
  std::uint32_t in_p;
  std::uint32_t in_q;

  const NearBoxes& p() const { return rows_are_a ? boxes_a : boxes_b; }
  const NearBoxes& q() const { return rows_are_a ? boxes_b : boxes_a; }
  const TriangleTreeNode& node_p() const { return rows_are_a ? nodes_a[pair.a] : nodes_b[pair.b]; }
  const TriangleTreeNode& node_q() const { return rows_are_a ? nodes_b[pair.b] : nodes_a[pair.a]; }
  const TriangleTreeNode* nodes_p() const { return rows_are_a ? nodes_a : nodes_b; }
  const TriangleTreeNode* nodes_q() const { return rows_are_a ? nodes_b : nodes_a; }
  float sign() const { return rows_are_a ? 1.0F : -1.0F; }
  NodePair of_rows(std::uint32_t below_p, std::uint32_t below_q, std::uint32_t of_p, std::uint32_t of_q) const {
    const auto some_p = static_cast<std::uint16_t>(of_p);
    const auto some_q = static_cast<std::uint16_t>(of_q);
    return rows_are_a ? NodePair{below_p, below_q, some_p, some_q} : NodePair{below_q, below_p, some_q, some_p};
  }
  std::uint32_t parent_of_p() const { return rows_are_a ? pair.a : pair.b; }
  std::uint32_t parent_of_q() const { return rows_are_a ? pair.b : pair.a; }
};

/// Returns whether any children may be within `limit` (squared).
HWY_INLINE bool place_near_pair(const DistanceFrame& frame, const NodePair& pair, const TriangleTreeNode* nodes_a,
                                const TriangleTreeNode* nodes_b, float limit, NearChildren* children,
                                QueryCounts* counts) {
  const TriangleTreeNode& a = nodes_a[pair.a];
  const TriangleTreeNode& b = nodes_b[pair.b];
  const Nodes of_a = {&a, &a, &a, &a};
  const Nodes of_b = {&b, &b, &b, &b};
  PairFrames frames;
  make_pair_frames(OneBlock(), frame.query, of_a, of_b, 1, &frames);
  if (counts != nullptr) {
    ++counts->node_pairs;
    counts->volume_tests += 32;
  }
  NearNode near_a;
  NearNode near_b;
  const OneBlock d;
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    const auto scale = hn::Set(d, frame.scale);
    hn::Store(hn::Mul(hn::LoadU(d, a.half_extent + lane), scale), d, near_a.half + lane);
    hn::Store(hn::Mul(hn::LoadU(d, b.half_extent + lane), scale), d, near_b.half + lane);
    hn::Store(hn::Mul(hn::Load(d, frames.p_ba + lane), scale), d, near_a.position + lane);
    hn::Store(hn::Mul(hn::Load(d, frames.p_ab + lane), scale), d, near_b.position + lane);
    const auto along = [&](const float* x, const float* y, const float* z, const float* n) HWY_ATTR {
      const auto sum =
          hn::MulAdd(hn::LoadU(d, y + lane), hn::Set(d, n[1]), hn::Mul(hn::LoadU(d, x + lane), hn::Set(d, n[0])));
      return hn::MulAdd(hn::LoadU(d, z + lane), hn::Set(d, n[2]), sum);
    };
    hn::Store(along(a.axes_x, a.axes_y, a.axes_z, frame.axes_of_a[0]), d, near_a.along + lane);
    hn::Store(along(b.axes_x, b.axes_y, b.axes_z, frame.axes_of_b[0]), d, near_b.along + lane);
  }
  const float* n = near_a.along;
  near_a.start = 0.0F;
  near_a.sign = 1.0F;
  near_b.start = near_b.position[0] * n[0] + near_b.position[1] * n[1] + near_b.position[2] * n[2];
  near_b.sign = -1.0F;
  const float slack = frame.scale * (frame.query.slack + kLocalSlack * (a.diagonal + b.diagonal));
  const float* const R_ab[3] = {frames.R_ba[0], frames.R_ba[1],
                                frames.R_ba[2]};  // Rows of one are columns of the other.
  const float* const R_ba[3] = {frames.R_ab[0], frames.R_ab[1], frames.R_ab[2]};
  const std::uint32_t in_a = pair.a_children & place_near_children(a, near_a, R_ba, near_b.half, slack, frame.scale,
                                                                   limit, &children->boxes_a);
  if (in_a == 0) return false;
  const std::uint32_t in_b = pair.b_children & place_near_children(b, near_b, R_ab, near_a.half, slack, frame.scale,
                                                                   limit, &children->boxes_b);
  if (in_b == 0) return false;
  children->nodes_a = nodes_a;
  children->nodes_b = nodes_b;
  children->pair = pair;
  children->rows_are_a = std::popcount(in_a) <= std::popcount(in_b);
  children->in_p = children->rows_are_a ? in_a : in_b;
  children->in_q = children->rows_are_a ? in_b : in_a;
  if (counts != nullptr)
    counts->volume_tests +=
        static_cast<std::uint64_t>(std::popcount(in_a)) * static_cast<std::uint64_t>(std::popcount(in_b));
  return true;
}

/// The pair of children with the least key, if one is within `limit`.
HWY_INLINE bool nearest_children(const NearChildren& children, float limit, NodePair* nearest) {
  HWY_ALIGN float keys[16];
  std::uint32_t best_p = 16;
  std::uint32_t best_q = 16;
  for (std::uint32_t rows = children.in_p; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<std::uint32_t>(std::countr_zero(rows));
    std::uint32_t hits = bound_near(children.p(), row, children.q(), children.sign(), limit, keys) & children.in_q;
    for (; hits != 0; hits &= hits - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(hits));
      if (best_p < 16 && keys[i] >= limit) continue;
      limit = keys[i];
      best_p = row;
      best_q = i;
    }
  }
  if (best_p == 16) return false;
  const TriangleTreeNode& node_p = children.node_p();
  const TriangleTreeNode& node_q = children.node_q();
  const bool p_is_leaf = (node_p.leaf_mask() >> best_p & 1U) != 0;
  const bool q_is_leaf = (node_q.leaf_mask() >> best_q & 1U) != 0;
  if (p_is_leaf && q_is_leaf) {
    *nearest = children.of_rows(child_block(node_p, best_p), child_block(node_q, best_q), 0, 0);
    return true;
  }
  // A leaf stays a child of its parent.
  const std::uint32_t below_p = p_is_leaf ? children.parent_of_p() : child_node(node_p, best_p);
  const std::uint32_t below_q = q_is_leaf ? children.parent_of_q() : child_node(node_q, best_q);
  *nearest = children.of_rows(below_p, below_q, p_is_leaf ? 1U << best_p : children.nodes_p()[below_p].child_mask(),
                              q_is_leaf ? 1U << best_q : children.nodes_q()[below_q].child_mask());
  return true;
}

/// Calls push(NodePair, key) for pairs of children that may be within `limit`; for two leaves with their blocks and no
/// children.
template <class Push>
HWY_INLINE void for_near_children(const NearChildren& children, float limit, const Push& push) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const TriangleTreeNode& node_p = children.node_p();
  const TriangleTreeNode& node_q = children.node_q();
  HWY_ALIGN float keys[16];
  std::uint16_t leaves_of_p[16] = {};  // Near child i of q, which is a node.
  float key_of_leaves[16];
  std::uint32_t q_with_leaves = 0;
  for (std::uint32_t rows = children.in_p; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<std::uint32_t>(std::countr_zero(rows));
    std::uint32_t hits = bound_near(children.p(), row, children.q(), children.sign(), limit, keys) & children.in_q;
    if (hits == 0) continue;
    const bool p_is_leaf = (node_p.leaf_mask() >> row & 1U) != 0;
    const std::uint32_t below_p = p_is_leaf ? child_block(node_p, row) : child_node(node_p, row);
    const std::uint32_t all_p = p_is_leaf ? 0 : children.nodes_p()[below_p].child_mask();
    std::uint32_t leaves_of_q = 0;
    float key_of_q = kInfinity;
    for (; hits != 0; hits &= hits - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(hits));
      const bool q_is_leaf = (node_q.leaf_mask() >> i & 1U) != 0;
      if (p_is_leaf && q_is_leaf) {
        push(children.of_rows(below_p, child_block(node_q, i), 0, 0), keys[i]);
      } else if (p_is_leaf) {
        key_of_leaves[i] = leaves_of_p[i] == 0 ? keys[i] : std::min(key_of_leaves[i], keys[i]);
        leaves_of_p[i] |= static_cast<std::uint16_t>(1U << row);
        q_with_leaves |= 1U << i;
      } else if (q_is_leaf) {
        leaves_of_q |= 1U << i;
        key_of_q = std::min(key_of_q, keys[i]);
      } else {
        const std::uint32_t below_q = child_node(node_q, i);
        push(children.of_rows(below_p, below_q, all_p, children.nodes_q()[below_q].child_mask()), keys[i]);
      }
    }
    if (leaves_of_q != 0) push(children.of_rows(below_p, children.parent_of_q(), all_p, leaves_of_q), key_of_q);
  }
  for (; q_with_leaves != 0; q_with_leaves &= q_with_leaves - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(q_with_leaves));
    const std::uint32_t below_q = child_node(node_q, i);
    push(children.of_rows(children.parent_of_p(), below_q, leaves_of_p[i], children.nodes_q()[below_q].child_mask()),
         key_of_leaves[i]);
  }
}

/// Pairs that wait, nearest first up to a 32nd of the square of the distance at the start: as good as a heap, and
/// several times cheaper. Those that overlap come first of all.
class NearQueue {
 public:
  /// `reach`: the largest key that will matter.
  NearQueue(float reach, std::vector<NearPair>* pairs) : lists_per_key_(kLists / reach), pairs_(*pairs) {
    pairs_.clear();
    first_.fill(kNone);
  }

  void push(const NodePair& pair, float key) {
    const std::size_t list = list_of(key);
    if (free_ == kNone) {
      pairs_.push_back({pair, key, first_[list]});
      first_[list] = static_cast<std::uint32_t>(pairs_.size() - 1);
    } else {
      const std::uint32_t at = free_;
      free_ = pairs_[at].next;
      pairs_[at] = {pair, key, first_[list]};
      first_[list] = at;
    }
    nearest_ = std::min(nearest_, list);
  }

  /// False when nothing is within `limit` any more.
  bool pop(float limit, NodePair* pair) {
    const std::size_t last = list_of(limit);
    for (; nearest_ <= last; ++nearest_) {
      while (first_[nearest_] != kNone) {
        const std::uint32_t at = first_[nearest_];
        first_[nearest_] = pairs_[at].next;
        pairs_[at].next = free_;
        free_ = at;
        *pair = pairs_[at].pair;
        if (pairs_[at].key <= limit) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t kLists = 32;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::size_t list_of(float key) const {
    if (!(key > 0.0F)) return 0;
    return 1 + static_cast<std::size_t>(std::min(static_cast<float>(kLists - 1), key * lists_per_key_));
  }

  float lists_per_key_;
  std::vector<NearPair>& pairs_;
  std::array<std::uint32_t, kLists + 1> first_;
  std::uint32_t free_ = kNone;
  std::size_t nearest_ = 0;
};

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
