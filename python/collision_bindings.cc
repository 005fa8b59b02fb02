// SPDX-License-Identifier: Apache-2.0
// Collision queries on meshes, each for arrays of poses, rays or points.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "array_input.h"
#include "array_output.h"
#include "interruptible.h"
#include "prescene/collision/batch_queries.h"
#include "prescene/collision/distance_queries.h"
#include "prescene/collision/penetration.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/ray_queries.h"
#include "status_errors.h"

#include "bound_scene.h"

namespace py = pybind11;

namespace prescene::python {
namespace {

using collision::Transform;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
// Done between two looks at the clock: some tens of microseconds.
constexpr std::size_t kRaysAtOnce = 256;
constexpr std::size_t kPosesAtOnce = 16;

struct BoundTree {
  std::shared_ptr<const collision::TriangleTree> tree;
  const collision::TriangleTree& operator*() const { return *tree; }
};

/// An array to be written row by row.
template <class Number>
struct Written {
  explicit Written(std::vector<py::ssize_t> shape) : array(std::move(shape)), data(array.mutable_data()) {}
  Written(std::size_t rows, py::ssize_t columns)
      : Written(std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows), columns}) {}
  explicit Written(std::size_t rows) : Written(std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows)}) {}
  py::array_t<Number> array;
  Number* data;
};

void write(const Eigen::Vector3d& vector, double* to) { std::copy_n(vector.data(), 3, to); }

py::object number_of(const py::array& array, bool single) { return single ? array[py::int_(0)] : array; }

std::int64_t index_of(std::uint32_t triangle) {
  return triangle == collision::kNoTriangle ? -1 : static_cast<std::int64_t>(triangle);
}

core::Result<std::vector<collision::TriangleIndices>> faces_of(const Rows<std::int64_t>& rows) {
  std::vector<collision::TriangleIndices> faces(rows.size());
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      const std::int64_t index = rows(row, column);
      if (index < 0 || index > std::numeric_limits<std::uint32_t>::max())
        return core::invalid_input("faces[" + std::to_string(row) + ", " + std::to_string(column) + "] is " +
                                   std::to_string(index) + ", which is no vertex: number them from 0");
      faces[row][column] = static_cast<std::uint32_t>(index);
    }
  }
  return faces;
}

BoundTree make_tree(const py::handle& vertices, const py::handle& faces, const std::string& name) {
  const Rows<double> vertex_rows = number_rows(vertices, "vertices", 3);
  const Rows<std::int64_t> face_rows = index_rows(faces, "faces", 3);
  core::Cancellation cancellation;
  using Tree = std::shared_ptr<const collision::TriangleTree>;
  auto tree = interruptibly(cancellation, [&]() -> core::Result<Tree> {
    std::vector<Eigen::Vector3f> points(vertex_rows.size());
    for (std::size_t row = 0; row < points.size(); ++row)
      for (int k = 0; k < 3; ++k) points[row][k] = static_cast<float>(vertex_rows(row, static_cast<std::size_t>(k)));
    PRESCENE_TRY(std::vector<collision::TriangleIndices> indices, faces_of(face_rows));
    PRESCENE_TRY(auto mesh, collision::Mesh::make(std::move(points), std::move(indices), name));
    core::ThreadPool pool;
    return Tree(std::make_shared<const collision::TriangleTree>(collision::TriangleTree::build(mesh, {}, pool)));
  });
  return {value_or_raise(std::move(tree))};
}

py::array kept_vertices(const BoundTree& bound) {
  const auto& vertices = (*bound).mesh().vertices();
  return view_of(py::dtype::of<float>(), {static_cast<py::ssize_t>(vertices.size()), 3},
                 {3 * sizeof(float), sizeof(float)}, vertices.data(), bound.tree);
}

py::array kept_faces(const BoundTree& bound) {
  const auto& triangles = (*bound).mesh().triangles();
  return view_of(py::dtype::of<std::uint32_t>(), {static_cast<py::ssize_t>(triangles.size()), 3},
                 {3 * sizeof(std::uint32_t), sizeof(std::uint32_t)}, triangles.data(), bound.tree);
}

py::object collides(const BoundTree& a, const BoundTree& b, const py::handle& X_AB) {
  const PoseBatch poses = pose_batch(X_AB, "X_AB");
  const std::size_t count = poses.transforms.size();
  Written<bool> touching(count);
  collision::QueryScratch scratch;
  in_blocks(count, kPosesAtOnce, [&](std::size_t begin, std::size_t end) {
    collision::collide(*a, *b, std::span<const Transform>(poses.transforms).subspan(begin, end - begin),
                       std::span<bool>(touching.data + begin, end - begin), scratch);
  });
  return number_of(touching.array, poses.is_single);
}

py::tuple closest_points(const BoundTree& a, const BoundTree& b, const py::handle& X_AB, double limit) {
  const PoseBatch poses = pose_batch(X_AB, "X_AB");
  const std::size_t count = poses.transforms.size();
  Written<double> distances(count);
  Written<double> on_a(count, 3);
  Written<double> on_b(count, 3);
  Written<std::int64_t> triangles(count, 2);
  collision::DistanceOptions options;
  options.limit = limit;
  collision::QueryScratch scratch;
  in_blocks(count, kPosesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto found = collision::distance(*a, *b, poses.transforms[i], options, scratch);
      distances.data[i] = found ? found->distance : kInfinity;
      write(found ? found->p_A : Eigen::Vector3d::Constant(kNoNumber), on_a.data + 3 * i);
      write(found ? found->p_B : Eigen::Vector3d::Constant(kNoNumber), on_b.data + 3 * i);
      triangles.data[2 * i] = found ? index_of(found->triangles.a) : -1;
      triangles.data[2 * i + 1] = found ? index_of(found->triangles.b) : -1;
    }
  });
  const bool single = poses.is_single;
  return py::make_tuple(number_of(distances.array, single), number_of(on_a.array, single),
                        number_of(on_b.array, single), number_of(triangles.array, single));
}

py::tuple penetrations(const BoundTree& a, const BoundTree& b, const py::handle& X_AB) {
  const PoseBatch poses = pose_batch(X_AB, "X_AB");
  const std::size_t count = poses.transforms.size();
  Written<double> depths(count);
  Written<double> least(count);
  Written<double> directions(count, 3);
  collision::PenetrationScratch scratch;
  in_blocks(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto found = collision::penetration(*a, *b, poses.transforms[i], {}, scratch);
      depths.data[i] = found ? found->depth : 0.0;
      least.data[i] = found ? found->least : 0.0;
      write(found ? found->direction : Eigen::Vector3d::Constant(kNoNumber), directions.data + 3 * i);
    }
  });
  const bool single = poses.is_single;
  return py::make_tuple(number_of(depths.array, single), number_of(least.array, single),
                        number_of(directions.array, single));
}

py::tuple cast_rays(const BoundTree& tree, const py::handle& origins, const py::handle& directions, double t_min,
                    double t_max) {
  const Rows<double> from = number_rows(origins, "origins", 3);
  const Rows<double> along = number_rows(directions, "directions", 3);
  const std::size_t count = std::max(from.size(), along.size());
  const bool fit = from.size() == along.size() || from.size() == 1 || along.size() == 1;
  if (!fit || from.size() == 0 || along.size() == 0) {
    if (!fit || from.size() != along.size())
      raise_input("there are " + std::to_string(from.size()) + " origins and " + std::to_string(along.size()) +
                  " directions: give as many, or one of either");
  }
  check_finite(from, "origins", 3);
  check_finite(along, "directions", 3);
  Written<double> t(count);
  Written<std::int64_t> triangles(count);
  Written<double> weights(count, 3);
  Written<bool> front(count);
  collision::QueryScratch scratch;
  std::vector<collision::Ray> rays(kRaysAtOnce);
  std::vector<std::optional<collision::RayHit>> hits(kRaysAtOnce);
  in_blocks(count, kRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    const std::size_t some = end - begin;
    for (std::size_t i = 0; i < some; ++i) {
      collision::Ray& ray = rays[i];
      const std::size_t origin = from.size() == 1 ? 0 : begin + i;
      const std::size_t direction = along.size() == 1 ? 0 : begin + i;
      for (int k = 0; k < 3; ++k) {
        ray.origin[k] = from(origin, static_cast<std::size_t>(k));
        ray.direction[k] = along(direction, static_cast<std::size_t>(k));
      }
      ray.t_min = t_min;
      ray.t_max = t_max;
    }
    collision::nearest_hits(*tree, std::span<const collision::Ray>(rays.data(), some),
                            std::span<std::optional<collision::RayHit>>(hits.data(), some), scratch);
    for (std::size_t i = 0; i < some; ++i) {
      const std::size_t at = begin + i;
      t.data[at] = hits[i] ? hits[i]->t : kInfinity;
      triangles.data[at] = hits[i] ? index_of(hits[i]->triangle) : -1;
      front.data[at] = hits[i] && hits[i]->front;
      for (std::size_t k = 0; k < 3; ++k) weights.data[3 * at + k] = hits[i] ? hits[i]->weights[k] : kNoNumber;
    }
  });
  return py::make_tuple(t.array, triangles.array, weights.array, front.array);
}

py::tuple nearest_points(const BoundTree& tree, const py::handle& points, double limit) {
  const Rows<double> rows = number_rows(points, "points", 3);
  check_finite(rows, "points", 3);
  Written<double> distances(rows.size());
  Written<double> nearest(rows.size(), 3);
  Written<std::int64_t> triangles(rows.size());
  in_blocks(rows.size(), kPosesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto found = collision::nearest_point(*tree, {rows(i, 0), rows(i, 1), rows(i, 2)}, limit);
      distances.data[i] = found ? found->distance : kInfinity;
      write(found ? found->point : Eigen::Vector3d::Constant(kNoNumber), nearest.data + 3 * i);
      triangles.data[i] = found ? index_of(found->triangle) : -1;
    }
  });
  return py::make_tuple(distances.array, nearest.array, triangles.array);
}

py::array winding_numbers(const BoundTree& tree, const py::handle& points) {
  const Rows<double> rows = number_rows(points, "points", 3);
  check_finite(rows, "points", 3);
  Written<std::int32_t> numbers(rows.size());
  in_blocks(rows.size(), kPosesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      numbers.data[i] = collision::winding_number(*tree, {rows(i, 0), rows(i, 1), rows(i, 2)});
  });
  return numbers.array;
}

}  // namespace

void bind_collision(py::module_& module) {
  py::class_<BoundTree>(module, "CollisionMesh")
      .def(py::init(&make_tree), py::arg("vertices"), py::arg("faces"), py::arg("name"))
      .def_property_readonly("vertices", &kept_vertices)
      .def_property_readonly("faces", &kept_faces)
      .def_property_readonly("name", [](const BoundTree& bound) { return python_text((*bound).mesh().name()); })
      .def_property_readonly("size", [](const BoundTree& bound) { return (*bound).mesh().size(); })
      .def_property_readonly("report",
                             [](const BoundTree& bound) { return python_text((*bound).mesh().report().text()); })
      .def("collides", &collides, py::arg("other"), py::arg("X_AB"))
      .def("closest_points", &closest_points, py::arg("other"), py::arg("X_AB"), py::arg("limit"))
      .def("penetrations", &penetrations, py::arg("other"), py::arg("X_AB"))
      .def("cast_rays", &cast_rays, py::arg("origins"), py::arg("directions"), py::arg("t_min"), py::arg("t_max"))
      .def("nearest_points", &nearest_points, py::arg("points"), py::arg("limit"))
      .def("winding_numbers", &winding_numbers, py::arg("points"));
}

}  // namespace prescene::python
