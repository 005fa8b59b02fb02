// SPDX-License-Identifier: Apache-2.0
// Arrays for Python: views of memory of ours, which they keep, and small ones that are made anew. All are read-only.
#pragma once

#include <pybind11/numpy.h>
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "prescene/geometry/pose.h"

namespace prescene::python {

/// A view, without a copy, of `data`, which lives as long as `owner`. Strides are in bytes.
pybind11::array view_of(const pybind11::dtype& type, std::vector<pybind11::ssize_t> shape,
                        std::vector<pybind11::ssize_t> strides, const void* data,
                        const std::shared_ptr<const void>& owner);
/// A copy of a small matrix, row by row.
pybind11::array copy_of(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
/// The same of a vector, of one dimension.
pybind11::array vector_copy(const Eigen::Ref<const Eigen::VectorXd>& vector);
/// The homogeneous matrix, (4, 4).
pybind11::array matrix_of(const geometry::Pose& pose);
/// (n, 4, 4)
pybind11::array matrices_of(const std::vector<geometry::Pose>& poses);
/// (angular x, y, z, linear x, y, z)
pybind11::array numbers_of(const geometry::Twist& twist);

void make_read_only(pybind11::array& array);

}  // namespace prescene::python
