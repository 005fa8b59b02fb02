// SPDX-License-Identifier: Apache-2.0
#include "array_output.h"

#include <utility>

namespace py = pybind11;

namespace prescene::python {
namespace {

void write_rows(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double* to) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) *to++ = matrix(row, column);
}

}  // namespace

void make_read_only(py::array& array) { array.attr("flags").attr("writeable") = false; }

py::array view_of(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                  const void* data, const std::shared_ptr<const void>& owner) {
  auto kept = std::make_unique<std::shared_ptr<const void>>(owner);
  const py::capsule base(kept.get(), [](void* given) { delete static_cast<std::shared_ptr<const void>*>(given); });
  static_cast<void>(kept.release());  // the capsule's from here on
  py::array array(type, std::move(shape), std::move(strides), data, base);
  make_read_only(array);
  return array;
}

py::array copy_of(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  py::array_t<double> array({matrix.rows(), matrix.cols()});
  write_rows(matrix, array.mutable_data());
  make_read_only(array);
  return array;
}

py::array vector_copy(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  py::array_t<double> array(vector.size());
  write_rows(vector, array.mutable_data());
  make_read_only(array);
  return array;
}

py::array matrix_of(const geometry::Pose& pose) { return copy_of(pose.matrix()); }

py::array matrices_of(const std::vector<geometry::Pose>& poses) {
  py::array_t<double> array({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  double* to = array.mutable_data();
  for (const geometry::Pose& pose : poses) {
    write_rows(pose.matrix(), to);
    to += 16;
  }
  make_read_only(array);
  return array;
}

py::array numbers_of(const geometry::Twist& twist) {
  geometry::Vector6d numbers;
  numbers << twist.angular, twist.linear;
  return vector_copy(numbers);
}

}  // namespace prescene::python
