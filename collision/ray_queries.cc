// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/ray_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ray_queries.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include <hwy/cache_control.h>

#include "pair_traversal-inl.h"
#include "prescene/core/check.h"
#include "ray_boxes-inl.h"
#include "ray_leaves-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// One tree's arrays and what has been done with them.
struct RayQuery {
  const TriangleTreeNode* nodes;
  const TriangleBlock* blocks;
  const TriangleReferences* references;
  std::vector<RayStep>* steps;
  QueryCounts* counts;
  std::uint64_t node_count = 0;
};

HWY_INLINE void count_leaf(const RayQuery& query, std::uint32_t block) {
  if (query.counts != nullptr) query.counts->triangle_tests += triangles_in(query.references[block]);
}

struct OneRay {
  ShearedRay sheared;
  BoxRay box;
  NearestHit nearest;
};

/// Room for the children of one more node above `top`.
HWY_INLINE RayStep* make_room(std::vector<RayStep>* steps, std::size_t top) {
  if (steps->size() < top + 16) steps->resize(2 * steps->size() + 64);
  return steps->data();
}

/// Puts a step below those from `bottom` on that are nearer, so that the nearest is on top.
HWY_INLINE void insert(RayStep* steps, std::size_t bottom, std::size_t* top, const RayStep& step) {
  std::size_t at = (*top)++;
  for (; at > bottom && steps[at - 1].near < step.near; --at) steps[at] = steps[at - 1];
  steps[at] = step;
}

/// Asks for the memory of a child, which will be visited soon.
template <class T>
HWY_INLINE void prefetch(const T* what) {
  const auto* line = reinterpret_cast<const char*>(what);  // NOLINT(cppcoreguidelines-pro-type-reinterpret-cast)
  for (std::size_t at = 0; at < sizeof(T); at += 64) hwy::Prefetch(line + at);
}

HWY_INLINE RayStep child_step(const RayQuery& query, const TriangleTreeNode& node, std::uint32_t child, float near,
                              std::uint32_t rays) {
  if ((node.leaf_mask() >> child & 1U) != 0) {
    const std::uint32_t block = child_block(node, child);
    prefetch(query.blocks + block);
    prefetch(query.references + block);
    return {near, block | RayStep::kLeafBit, rays};
  }
  const std::uint32_t below = child_node(node, child);
  prefetch(query.nodes + below);
  return {near, below, rays};
}

/// Follows one ray below `root`; returns at the first hit where that is enough. Steps up to `bottom` are others'.
template <bool kAny>
HWY_INLINE bool follow(RayQuery* query, std::uint32_t root, std::size_t bottom, OneRay* ray) {
  RayStep* steps = make_room(query->steps, bottom);
  std::size_t top = bottom;
  steps[top++] = {ray->box.s_min, root, 1};
  float s_max = ray->nearest.triangle == kNoTriangle ? ray->box.s_max : at_most(ray->box, ray->nearest.s);
  while (top > bottom) {
    const RayStep step = steps[--top];
    if (step.near > s_max) continue;
    const std::uint32_t below = step.below();
    if (step.is_leaf()) {
      count_leaf(*query, below);
      if (!keep_nearest(ray->sheared, query->blocks[below], query->references[below], &ray->nearest)) continue;
      if constexpr (kAny) return true;
      s_max = at_most(ray->box, ray->nearest.s);
      continue;
    }
    const TriangleTreeNode& node = query->nodes[below];
    ++query->node_count;
    HWY_ALIGN float near[16];
    steps = make_room(query->steps, top);
    const std::size_t before = top;
    for (std::uint32_t hits = boxes_on_ray(node, ray->box, s_max, near); hits != 0; hits &= hits - 1) {
      const auto child = static_cast<std::uint32_t>(std::countr_zero(hits));
      insert(steps, before, &top, child_step(*query, node, child, near[child], 1));
    }
  }
  return ray->nearest.triangle != kNoTriangle;
}

// A packet is followed as such while more rays than this are together.
constexpr int kFewRays = 2;

struct Packet {
  OneRay rays[16];
  BoxRays boxes;
  std::uint32_t active;  ///< Rays that may hit something, or something nearer.
};

template <bool kAny>
HWY_INLINE void test_leaf(RayQuery* query, std::uint32_t block, std::uint32_t rays, Packet* packet) {
  for (; rays != 0; rays &= rays - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(rays));
    OneRay& ray = packet->rays[i];
    count_leaf(*query, block);
    if (!keep_nearest(ray.sheared, query->blocks[block], query->references[block], &ray.nearest)) continue;
    if constexpr (kAny) packet->active &= ~(1U << i);
    packet->boxes.s_max[i] = at_most(ray.box, ray.nearest.s);
  }
}

template <bool kAny>
HWY_INLINE void follow_packet(RayQuery* query, Packet* packet) {
  const Floats16 d;
  RayStep* steps = make_room(query->steps, 0);
  std::size_t top = 0;
  steps[top++] = {-std::numeric_limits<float>::infinity(), 0, packet->active};
  NodeRays at;
  while (top > 0) {
    const RayStep step = steps[--top];
    std::uint32_t reach = 0;
    for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d))
      reach |= bits_of_mask(d, hn::Ge(hn::Load(d, packet->boxes.s_max + lane), hn::Set(d, step.near))) << lane;
    const std::uint32_t rays = step.rays & packet->active & reach;
    const std::uint32_t below = step.below();
    if (step.is_leaf()) {
      test_leaf<kAny>(query, below, rays, packet);
      continue;
    }
    if (std::popcount(rays) <= kFewRays) {
      for (std::uint32_t rest = rays; rest != 0; rest &= rest - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(rest));
        const bool hit = follow<kAny>(query, below, top, &packet->rays[i]);
        if (hit) packet->boxes.s_max[i] = at_most(packet->rays[i].box, packet->rays[i].nearest.s);
        if (kAny && hit) packet->active &= ~(1U << i);
      }
      steps = query->steps->data();
      continue;
    }
    const TriangleTreeNode& node = query->nodes[below];
    ++query->node_count;
    make_node_rays(node, packet->boxes, &at);
    steps = make_room(query->steps, top);
    const std::size_t before = top;
    for (std::uint32_t child = 0; child < node.child_count(); ++child) {
      float near;
      const std::uint32_t hits = rays_on_box(node, child, packet->boxes, at, rays, &near);
      if (hits != 0) insert(steps, before, &top, child_step(*query, node, child, near, hits));
    }
  }
}

inline RayQuery make_query(const TriangleTree& tree, QueryScratch* scratch, QueryCounts* counts) {
  return {tree.nodes().data(), tree.blocks().data(), tree.references().data(), &scratch->ray_steps(), counts};
}

inline bool make_ray(const TriangleTree& tree, const Ray& given, OneRay* ray) {
  const std::optional<ShearedRay> sheared = shear(given);
  if (!sheared || !make_box_ray(*sheared, tree.radius(), &ray->box)) return false;
  ray->sheared = *sheared;
  ray->nearest = {sheared->s_max};
  return true;
}

inline void add_counts(const RayQuery& query) {
  if (query.counts == nullptr) return;
  query.counts->node_pairs += query.node_count;
  query.counts->volume_tests += 16 * query.node_count;
}

inline RayHit to_hit(const Ray& given, const OneRay& ray) {
  const NearestHit& n = ray.nearest;
  const double t = n.s / ray.sheared.metres;
  return {std::min(std::max(t, given.t_min), given.t_max),
          {n.areas[0] / n.sum, n.areas[1] / n.sum, n.areas[2] / n.sum},
          n.triangle,
          n.sum > 0.0};
}

bool nearest_hit_lanes(const TriangleTree& tree, const Ray& given, QueryScratch* scratch, QueryCounts* counts,
                       RayHit* hit) {
  OneRay ray;
  if (!make_ray(tree, given, &ray)) return false;
  RayQuery query = make_query(tree, scratch, counts);
  const bool found = follow<false>(&query, 0, 0, &ray);
  add_counts(query);
  if (found) *hit = to_hit(given, ray);
  return found;
}

bool any_hit_lanes(const TriangleTree& tree, const Ray& given, QueryScratch* scratch, QueryCounts* counts) {
  OneRay ray;
  if (!make_ray(tree, given, &ray)) return false;
  RayQuery query = make_query(tree, scratch, counts);
  const bool found = follow<true>(&query, 0, 0, &ray);
  add_counts(query);
  return found;
}

/// Up to 16 rays.
inline void make_packet(const TriangleTree& tree, std::span<const Ray> given, Packet* packet) {
  packet->active = 0;
  packet->boxes.slack = 0.0F;
  for (std::size_t i = 0; i < 16; ++i) {
    BoxRay none = {{0, 0, 0}, {1, 1, 1}, 0.0F, 1.0F, -1.0F, 0.0};
    const bool active = i < given.size() && make_ray(tree, given[i], &packet->rays[i]);
    if (!active) packet->rays[i].nearest = {0.0};
    const BoxRay& box = active ? packet->rays[i].box : none;
    if (active) packet->active |= 1U << i;
    for (int k = 0; k < 3; ++k) {
      packet->boxes.origin[k][i] = box.origin[k];
      packet->boxes.direction[k][i] = box.direction[k];
    }
    packet->boxes.s_min[i] = box.s_min;
    packet->boxes.s_max[i] = box.s_max;
    packet->boxes.slack = std::max(packet->boxes.slack, box.slack);
  }
}

void nearest_hits_lanes(const TriangleTree& tree, std::span<const Ray> rays, std::span<std::optional<RayHit>> hits,
                        QueryScratch* scratch, QueryCounts* counts) {
  RayQuery query = make_query(tree, scratch, counts);
  Packet packet;
  for (std::size_t first = 0; first < rays.size(); first += 16) {
    const std::span<const Ray> given = rays.subspan(first, std::min<std::size_t>(16, rays.size() - first));
    make_packet(tree, given, &packet);
    follow_packet<false>(&query, &packet);
    for (std::size_t i = 0; i < given.size(); ++i) {
      hits[first + i].reset();
      if (packet.rays[i].nearest.triangle != kNoTriangle) hits[first + i] = to_hit(given[i], packet.rays[i]);
    }
  }
  add_counts(query);
}

void any_hits_lanes(const TriangleTree& tree, std::span<const Ray> rays, std::span<bool> hits, QueryScratch* scratch,
                    QueryCounts* counts) {
  RayQuery query = make_query(tree, scratch, counts);
  Packet packet;
  for (std::size_t first = 0; first < rays.size(); first += 16) {
    const std::span<const Ray> given = rays.subspan(first, std::min<std::size_t>(16, rays.size() - first));
    make_packet(tree, given, &packet);
    follow_packet<true>(&query, &packet);
    for (std::size_t i = 0; i < given.size(); ++i) hits[first + i] = packet.rays[i].nearest.triangle != kNoTriangle;
  }
  add_counts(query);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(nearest_hit_lanes);
HWY_EXPORT(any_hit_lanes);
HWY_EXPORT(nearest_hits_lanes);
HWY_EXPORT(any_hits_lanes);

Ray in_frame(const Transform& X_AB, const Ray& ray_B) {
  Eigen::Matrix3d R_AB;
  Eigen::Vector3d p_AB;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col)
      R_AB(row, col) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(3 * row + col)]);
    p_AB[row] = static_cast<double>(X_AB.translation[static_cast<std::size_t>(row)]);
  }
  return {R_AB * ray_B.origin + p_AB, R_AB * ray_B.direction, ray_B.t_min, ray_B.t_max};
}

std::optional<RayHit> nearest_hit(const TriangleTree& tree, const Ray& ray, QueryScratch& scratch,
                                  QueryCounts* counts) {
  RayHit hit;
  if (!HWY_DYNAMIC_DISPATCH(nearest_hit_lanes)(tree, ray, &scratch, counts, &hit)) return std::nullopt;
  return hit;
}

bool any_hit(const TriangleTree& tree, const Ray& ray, QueryScratch& scratch, QueryCounts* counts) {
  return HWY_DYNAMIC_DISPATCH(any_hit_lanes)(tree, ray, &scratch, counts);
}

void nearest_hits(const TriangleTree& tree, std::span<const Ray> rays, std::span<std::optional<RayHit>> hits,
                  QueryScratch& scratch, QueryCounts* counts) {
  PRESCENE_CHECK(rays.size() == hits.size());
  HWY_DYNAMIC_DISPATCH(nearest_hits_lanes)(tree, rays, hits, &scratch, counts);
}

void any_hits(const TriangleTree& tree, std::span<const Ray> rays, std::span<bool> hits, QueryScratch& scratch,
              QueryCounts* counts) {
  PRESCENE_CHECK(rays.size() == hits.size());
  HWY_DYNAMIC_DISPATCH(any_hits_lanes)(tree, rays, hits, &scratch, counts);
}

}  // namespace prescene::collision
#endif
