// SPDX-License-Identifier: Apache-2.0
#include "array_input.h"

#include <cmath>

#include "status_errors.h"

namespace py = pybind11;

namespace prescene::python {
namespace {

constexpr std::size_t kMostRows = std::size_t{1} << 30;  // Of triangles a mesh takes no more.

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

std::string type_text(const py::handle& given) { return std::string(py::str(py::type::of(given).attr("__name__"))); }

/// What numpy makes of it, which is the thing itself where it is an array.
py::array array_of(const py::handle& given, const char* argument) {
  py::array array = py::array::ensure(py::reinterpret_borrow<py::object>(given));
  if (!array) throw py::type_error(std::string(argument) + ": an array of numbers is needed, not " + type_text(given));
  return array;
}

py::array real_array(const py::handle& given, const char* argument) {
  py::array array = array_of(given, argument);
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u')
    throw py::type_error(std::string(argument) + ": real numbers are needed, not an array of dtype " +
                         std::string(py::str(array.dtype())));
  if (py::isinstance<py::array_t<double, 0>>(array)) return array;
  py::array_t<double, py::array::forcecast> converted = py::array_t<double, py::array::forcecast>::ensure(array);
  if (!converted) throw py::error_already_set();
  return converted;
}

void check_rows(const py::array& array, const char* argument, py::ssize_t columns) {
  if (array.ndim() != 2 || array.shape(1) != columns)
    raise_input(std::string(argument) + ": an array of shape (n, " + std::to_string(columns) +
                ") is needed, this one has " + shape_text(array));
  if (static_cast<std::size_t>(array.shape(0)) > kMostRows)
    raise_input(std::string(argument) + ": " + std::to_string(array.shape(0)) + " rows are more than " +
                std::to_string(kMostRows));
}

Eigen::Matrix4d matrix_at(const py::array& array, py::ssize_t index) {
  const bool single = array.ndim() == 2;
  const char* data = static_cast<const char*>(array.data()) + (single ? 0 : index * array.strides(0));
  const py::ssize_t row_stride = array.strides(single ? 0 : 1);
  const py::ssize_t column_stride = array.strides(single ? 1 : 2);
  Eigen::Matrix4d matrix;
  for (py::ssize_t row = 0; row < 4; ++row)
    for (py::ssize_t column = 0; column < 4; ++column)
      std::memcpy(&matrix(row, column), data + row * row_stride + column * column_stride, sizeof(double));
  return matrix;
}

}  // namespace

Rows<double> number_rows(const py::handle& given, const char* argument, py::ssize_t columns) {
  const py::array array = real_array(given, argument);
  check_rows(array, argument, columns);
  return Rows<double>(array);
}

Rows<std::int64_t> index_rows(const py::handle& given, const char* argument, py::ssize_t columns) {
  py::array array = array_of(given, argument);
  const char kind = array.dtype().kind();
  if (kind != 'i' && kind != 'u')
    throw py::type_error(std::string(argument) + ": whole numbers are needed, not an array of dtype " +
                         std::string(py::str(array.dtype())));
  check_rows(array, argument, columns);
  if (!py::isinstance<py::array_t<std::int64_t, 0>>(array)) {
    array = py::array_t<std::int64_t, py::array::forcecast>::ensure(array);
    if (!array) throw py::error_already_set();
  }
  return Rows<std::int64_t>(array);
}

void check_finite(const Rows<double>& rows, const char* argument, std::size_t columns) {
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      if (std::isfinite(rows(row, column))) continue;
      raise_input(std::string(argument) + "[" + std::to_string(row) + ", " + std::to_string(column) +
                  "] is not finite: give numbers only");
    }
  }
}

PoseBatch pose_batch(const py::handle& given, const char* argument) {
  const py::array array = real_array(given, argument);
  const bool single = array.ndim() == 2;
  const bool fits = (single || array.ndim() == 3) && array.shape(array.ndim() - 1) == 4 &&
                    array.shape(array.ndim() - 2) == 4 &&
                    (single || static_cast<std::size_t>(array.shape(0)) <= kMostRows);
  if (!fits)
    raise_input(std::string(argument) + ": poses are matrices of shape (4, 4) or (n, 4, 4), this array has " +
                shape_text(array));
  PoseBatch batch;
  batch.is_single = single;
  const py::ssize_t count = single ? 1 : array.shape(0);
  batch.transforms.reserve(static_cast<std::size_t>(count));
  for (py::ssize_t i = 0; i < count; ++i) {
    const auto transform = collision::to_transform(matrix_at(array, i));
    if (!transform) raise(transform.status().at(argument + (single ? "" : "[" + std::to_string(i) + "]")));
    batch.transforms.push_back(*transform);
  }
  return batch;
}

}  // namespace prescene::python
