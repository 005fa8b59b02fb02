// SPDX-License-Identifier: Apache-2.0
// The trees whose files are fuzzed: kinds and settings of them over one small mesh.
#pragma once

#include <memory>
#include <vector>

#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/check.h"

namespace prescene::tests {

inline constexpr std::size_t kTreeKinds = 8;

inline std::shared_ptr<const collision::Mesh> tree_kinds_mesh() {
  // A strip of triangles wound up, and one triangle that has no area.
  constexpr int kVertices = 30;
  std::vector<collision::Vector3f> vertices;
  std::vector<collision::TriangleIndices> triangles = {{0, 0, 1}};
  for (int i = 0; i < kVertices; ++i) {
    const auto t = static_cast<float>(i);
    vertices.emplace_back(0.01F * static_cast<float>(i * 7 % 11), 0.02F * static_cast<float>(i * 3 % 5), 0.01F * t);
  }
  for (std::uint32_t i = 0; i + 2 < kVertices; ++i) triangles.push_back({i, i + 1, i + 2});
  auto made = collision::Mesh::make(std::move(vertices), std::move(triangles), "strip");
  PRESCENE_CHECK(made.ok());
  return *made;
}

/// Calls visit.operator()<Tree>(options) for one of them.
template <class Visit>
void visit_tree_kind(std::size_t kind, const Visit& visit) {
  using namespace collision;  // NOLINT(google-build-using-namespace)
  switch (kind % kTreeKinds) {
    case 0:
      return visit.template operator()<TriangleTree>(TriangleTreeOptions{});
    case 1:
      return visit.template operator()<DopTree>(DopTreeOptions{.k = 6, .leaf_items = 2});
    case 2:
      return visit.template operator()<SimdopTree>(SimdopOptions{.k = 6, .branching = 4});
    case 3:
      return visit.template operator()<SimdopTree>(
          SimdopOptions{.k = 14, .branching = 2, .leaf_items = 1, .precision = PlanePrecision::kSingle});
    case 4:
      return visit.template operator()<BvhLiteTree>(BvhLiteOptions{.k = 6, .bits = 4});
    case 5:
      return visit.template operator()<BvhLiteTree>(
          BvhLiteOptions{.k = 18, .bits = 8, .branching = 2, .leaf_items = 3});
    case 6:
      return visit.template operator()<Boxtree>(BoxtreeOptions{});
    default:
      return visit.template operator()<Boxtree>(BoxtreeOptions{.leaf_items = 3});
  }
}

inline std::vector<std::uint8_t> file_bytes(const collision::TriangleTree& tree) { return tree.bytes(); }
template <class Tree>
std::vector<std::uint8_t> file_bytes(const Tree& tree) {
  return tree.file_bytes();
}

}  // namespace prescene::tests
