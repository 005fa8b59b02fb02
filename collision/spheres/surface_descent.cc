// SPDX-License-Identifier: Apache-2.0
#include "surface_descent.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>

#include "surface_search.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

/// A node's frame N and the boxes of its children there, in double precision.
class NodeFrame {
 public:
  explicit NodeFrame(const TriangleTreeNode& node) : node_(node) {
    for (int k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      R_NM_.row(k) = Vector3f(node.axes_x[axis], node.axes_y[axis], node.axes_z[axis]).cast<double>();
      origin_[k] = static_cast<double>(node.origin[axis]);
      step_[k] = 2.0 * static_cast<double>(half_step(node.half_extent[axis]));
    }
  }
  Vector3d place(const Vector3d& p_M) const { return R_NM_ * (p_M - origin_); }
  Vector3d turn(const Vector3d& v_M) const { return R_NM_ * v_M; }
  Eigen::AlignedBox3d child(std::size_t i) const {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) {
      box.min()[k] = (node_.low[k][i] - 1.0) * step_[k];
      box.max()[k] = (node_.high[k][i] - 1.0) * step_[k];
    }
    return box;
  }
  /// What the rounding of the axes may do to distances of points that far from the node, m.
  double slack(double distance) const { return 1e-6 * (distance + static_cast<double>(node_.diagonal)); }

 private:
  const TriangleTreeNode& node_;
  Eigen::Matrix3d R_NM_;
  Vector3d origin_;
  Vector3d step_;
};

Vector3d corner_of(const TriangleBlock& block, std::size_t corner, std::size_t triangle) {
  return {static_cast<double>(block.corners[corner][0][triangle]),
          static_cast<double>(block.corners[corner][1][triangle]),
          static_cast<double>(block.corners[corner][2][triangle])};
}

bool is_leaf(const TriangleTreeNode& node, std::size_t child) { return (node.leaf_mask() >> child & 1U) != 0; }
std::uint32_t below(const TriangleTreeNode& node, std::size_t child) {
  const std::uint32_t before = node.leaf_mask() & ((1U << child) - 1U);
  const auto leaves = static_cast<std::uint32_t>(std::popcount(before));
  return is_leaf(node, child) ? node.first_leaf() + leaves
                              : node.first_child() + static_cast<std::uint32_t>(child) - leaves;
}

void look_below(const TriangleTree& tree, std::uint32_t index, const SweptSphere& sphere, double* first) {
  const TriangleTreeNode& node = tree.nodes()[index];
  const NodeFrame frame(node);
  const Vector3d from = frame.place(sphere.from);
  const Vector3d to = frame.place(sphere.to);
  const SweptSphere in_node(from, to, sphere.radius + frame.slack(std::max(from.norm(), to.norm())));
  std::array<double, 16> times{};
  std::array<std::size_t, 16> order{};
  std::size_t count = 0;
  for (std::size_t child = 0; child < node.child_count(); ++child) {
    times[child] = in_node.enters(frame.child(child));
    if (times[child] >= *first) continue;
    std::size_t at = count++;
    for (; at > 0 && times[order[at - 1]] > times[child]; --at) order[at] = order[at - 1];
    order[at] = child;
  }
  for (std::size_t i = 0; i < count && times[order[i]] < *first; ++i) {
    const std::uint32_t next = below(node, order[i]);
    if (!is_leaf(node, order[i])) {
      look_below(tree, next, sphere, first);
      continue;
    }
    const TriangleBlock& block = tree.blocks()[next];
    for (std::size_t k = 0; k < 4 && tree.references()[next][k] != kNoTriangle; ++k) {
      *first = std::min(*first,
                        sphere.meets_triangle(corner_of(block, 0, k), corner_of(block, 1, k), corner_of(block, 2, k)));
    }
  }
}

struct DescentReach {
  const Vector3d& direction;
  const Vector3d& centre;
  double radius;
  double most = -std::numeric_limits<double>::infinity();
};

void look_below(const TriangleTree& tree, std::uint32_t index, DescentReach* reach) {
  const TriangleTreeNode& node = tree.nodes()[index];
  const NodeFrame frame(node);
  const Vector3d centre = frame.place(reach->centre);
  const Vector3d direction = frame.turn(reach->direction);
  const double slack = frame.slack(centre.norm());
  const double of_centre = reach->direction.dot(reach->centre);
  for (std::size_t child = 0; child < node.child_count(); ++child) {
    const Eigen::AlignedBox3d box = frame.child(child);
    const double most =
        of_centre + direction.dot(box.center() - centre) + 0.5 * direction.cwiseAbs().dot(box.sizes()) + slack;
    if (most <= reach->most || box.exteriorDistance(centre) > reach->radius + slack) continue;
    const std::uint32_t next = below(node, child);
    if (!is_leaf(node, child)) {
      look_below(tree, next, reach);
      continue;
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const TriangleBlock& block = tree.blocks()[next];
      const Vector3d a = corner_of(block, 0, k);
      const Vector3d b = corner_of(block, 1, k);
      const Vector3d c = corner_of(block, 2, k);
      const double of_this = std::max({reach->direction.dot(a), reach->direction.dot(b), reach->direction.dot(c)});
      if (of_this > reach->most &&
          (nearest_on_triangle(reach->centre, a, b, c) - reach->centre).norm() <= reach->radius)
        reach->most = of_this;
    }
  }
}

/// Triangles about a place that lie in the plane across a normal. Where they are only joined at edges that two of them
/// share and facing the same way, and nothing else comes to the plane, a walk on them ends nowhere.
struct FlatPart {
  const Vector3d& place;
  const Vector3d& normal;
  double radius;
  double slack;
  int facing = 0;

  bool allows(const std::array<Vector3d, 3>& corners, std::uint8_t rims) {
    if ((nearest_on_triangle(place, corners[0], corners[1], corners[2]) - place).norm() > radius + slack) return true;
    std::array<double, 3> heights{};
    for (std::size_t k = 0; k < 3; ++k) heights[k] = normal.dot(corners[k] - place);
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    if (*low > slack || *high < -slack) return true;
    if (*low < -slack || *high > slack) return false;
    const double area = normal.dot((corners[1] - corners[0]).cross(corners[2] - corners[0]));
    const int side = area > 0.0 ? 1 : (area < 0.0 ? -1 : 0);
    if (side == 0 || side == -facing) return false;
    facing = side;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& from = corners[k];
      const Vector3d& to = corners[(k + 1) % 3];
      if ((rims >> k & 1U) != 0 && (nearest_on_triangle(place, from, to, to) - place).norm() <= radius + slack)
        return false;
    }
    return true;
  }
};

bool look_below(const TriangleTree& tree, std::uint32_t index, std::span<const std::uint8_t> rims, FlatPart* part) {
  const TriangleTreeNode& node = tree.nodes()[index];
  const NodeFrame frame(node);
  const Vector3d place = frame.place(part->place);
  const double reach = part->radius + part->slack + frame.slack(place.norm());
  for (std::size_t child = 0; child < node.child_count(); ++child) {
    if (frame.child(child).exteriorDistance(place) > reach) continue;
    const std::uint32_t next = below(node, child);
    if (!is_leaf(node, child)) {
      if (!look_below(tree, next, rims, part)) return false;
      continue;
    }
    const TriangleBlock& block = tree.blocks()[next];
    const TriangleReferences& references = tree.references()[next];
    for (std::size_t k = 0; k < 4 && references[k] != kNoTriangle; ++k) {
      if (!part->allows({corner_of(block, 0, k), corner_of(block, 1, k), corner_of(block, 2, k)}, rims[references[k]]))
        return false;
    }
  }
  return true;
}

}  // namespace

std::vector<std::uint8_t> find_rims(const Mesh& mesh) {
  struct Edge {
    std::uint32_t low;
    std::uint32_t high;
    bool forward;
    std::uint8_t place;
    std::uint32_t triangle;
  };
  std::vector<Edge> edges;
  edges.reserve(std::size_t{3} * mesh.triangle_count());
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const TriangleIndices& t = mesh.triangles()[i];
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k];
      const std::uint32_t to = t[(k + 1U) % 3U];
      edges.push_back({std::min(from, to), std::max(from, to), from < to, k, i});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return std::tuple(x.low, x.high, x.triangle, x.place) < std::tuple(y.low, y.high, y.triangle, y.place);
  });
  std::vector<std::uint8_t> rims(mesh.triangle_count(), 0);
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    const bool joined = end == i + 2 && edges[i].forward != edges[i + 1].forward;
    for (; i < end; ++i) {
      if (!joined) rims[edges[i].triangle] |= static_cast<std::uint8_t>(1U << edges[i].place);
    }
  }
  return rims;
}

bool is_flat_about(const TriangleTree& tree, std::span<const std::uint8_t> rims, const Vector3d& place,
                   const Vector3d& normal, double radius, double slack) {
  FlatPart part{place, normal, radius, slack};
  return look_below(tree, 0, rims, &part) && part.facing != 0;
}

double first_contact(const TriangleTree& tree, const SweptSphere& sphere) {
  double first = SweptSphere::kNever;
  look_below(tree, 0, sphere, &first);
  return first;
}

double reach_along(const TriangleTree& tree, const Vector3d& direction, const Vector3d& centre, double radius) {
  DescentReach reach{direction, centre, radius};
  look_below(tree, 0, &reach);
  return reach.most;
}

}  // namespace prescene::collision
