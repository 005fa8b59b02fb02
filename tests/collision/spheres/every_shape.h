// SPDX-License-Identifier: Apache-2.0
// One static shape of each kind, about a tenth of a metre large and near the origin.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "prescene/collision/spheres/static_shape.h"
#include "prescene/core/parallel.h"

namespace prescene::collision {

inline core::ThreadPool& shape_pool() {
  static core::ThreadPool threads(2);
  return threads;
}

inline std::vector<std::unique_ptr<StaticShape>> every_shape() {
  std::vector<std::unique_ptr<StaticShape>> all;
  all.push_back(std::make_unique<HalfSpace>(*HalfSpace::make({0.1, 0.2, 1}, 0.01)));
  all.push_back(std::make_unique<PrimitiveShape>(*PrimitiveShape::make(geometry::Cone{0.05, 0.1})));
  all.push_back(std::make_unique<PrimitiveShape>(*PrimitiveShape::make(geometry::BoxShape{{0.1, 0.05, 0.08}})));
  geometry::TriangleMesh bin = geometry::make_open_bin({0.1, 0.1, 0.05}, 0.004);
  all.push_back(std::make_unique<TriangleSurface>(
      *TriangleSurface::make(*Mesh::make(bin, "bin"), SurfaceSide::kSolid, shape_pool())));
  bin.triangles.pop_back();
  all.push_back(std::make_unique<TriangleSurface>(
      *TriangleSurface::make(*Mesh::make(bin, "bin"), SurfaceSide::kBoth, shape_pool())));
  HeightField::Grid grid{6, 5, 0.05, 0.06, {}};
  for (int i = 0; i < 30; ++i) grid.heights.push_back(0.01F * static_cast<float>(i % 4));
  all.push_back(std::make_unique<HeightField>(*HeightField::make(std::move(grid), "field")));
  return all;
}

}  // namespace prescene::collision
