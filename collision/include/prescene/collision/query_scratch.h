// SPDX-License-Identifier: Apache-2.0
// What queries on trees share: memory that is kept from query to query, and counts of the work done.
#pragma once

#include <cstdint>
#include <vector>

namespace prescene::collision {

/// Work done by a query; counters are added to, never reset. A vector operation on n pairs counts n; padding lanes are
/// not counted as triangles, so the numbers compare between trees. In `volume_tests`, the default tree counts its first
/// test of a pair of nodes, in bytes, as 32.
struct QueryCounts {
  /// Pairs of nodes whose children were tested against each other; of rays, nodes whose children were.
  std::uint64_t node_pairs = 0;
  std::uint64_t volume_tests = 0;    ///< Pairs of bounding volumes; of rays, volumes.
  std::uint64_t triangle_tests = 0;  ///< Pairs of triangles of the meshes; of rays, triangles.
  std::uint64_t exact_tests = 0;     ///< Pairs of triangles that single precision could not decide.
};

/// Two nodes whose children are to be tested against each other, and which of their children.
struct NodePair {
  std::uint32_t a;
  std::uint32_t b;
  std::uint16_t a_children;
  std::uint16_t b_children;
};

/// The same for those of several configurations whose bits are set.
struct SharedNodePair {
  NodePair pair;
  std::uint32_t configurations;
};

/// A node or a leaf that is to be tested against rays.
struct RayStep {
  static constexpr std::uint32_t kLeafBit = 1U << 31U;

  float near;                ///< Where the first of them comes to its box, m.
  std::uint32_t below_word;  ///< The node, or, with kLeafBit, the leaf's block.
  std::uint32_t rays;        ///< Which of a packet.

  bool is_leaf() const { return (below_word & kLeafBit) != 0; }
  std::uint32_t below() const { return below_word & ~kLeafBit; }
};

/// Two parts of bodies that move, which do not touch before a time.
struct MovingPair {
  float time;
  bool are_leaves;  ///< Then the pair is two blocks.
  NodePair pair;
};

/// Two nodes, or two leaves' blocks (then without children), that wait to be visited; see distance_descent-inl.h.
struct NearPair {
  NodePair pair;
  float key;           ///< Grows with the distance that they have at least.
  std::uint32_t next;  ///< In a list.
};

/// Memory that a query works in. One a thread; after the first queries nothing is allocated any more.
class QueryScratch {
 public:
  std::vector<NodePair>& node_pairs() { return node_pairs_; }
  std::vector<SharedNodePair>& shared_node_pairs() { return shared_node_pairs_; }
  std::vector<RayStep>& ray_steps() { return ray_steps_; }
  std::vector<MovingPair>& moving_pairs() { return moving_pairs_; }
  std::vector<NearPair>& near_pairs() { return near_pairs_; }

 private:
  std::vector<NodePair> node_pairs_;
  std::vector<SharedNodePair> shared_node_pairs_;
  std::vector<RayStep> ray_steps_;
  std::vector<MovingPair> moving_pairs_;
  std::vector<NearPair> near_pairs_;
};

}  // namespace prescene::collision
