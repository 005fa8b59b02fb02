// SPDX-License-Identifier: Apache-2.0
// Arrays that Python gives: read where they are whatever their strides, where numpy has them as float64 already, and
// converted by numpy into a copy otherwise. Each error names the argument, and the index of the number.
#pragma once

#include <pybind11/numpy.h>
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "prescene/collision/transform.h"

namespace prescene::python {

/// An array of two dimensions and a given number of columns. Holds on to the array, whose memory stays where it is; the
/// rows may be read without the GIL.
template <class Number>
class Rows {
 public:
  Rows() = default;
  explicit Rows(const pybind11::array& array)
      : array_(array),
        data_(static_cast<const char*>(array.data())),
        count_(static_cast<std::size_t>(array.shape(0))),
        row_stride_(array.strides(0)),
        column_stride_(array.strides(1)) {}

  std::size_t size() const { return count_; }
  Number operator()(std::size_t row, std::size_t column) const {
    Number number;
    std::memcpy(
        &number,
        data_ + static_cast<std::ptrdiff_t>(row) * row_stride_ + static_cast<std::ptrdiff_t>(column) * column_stride_,
        sizeof number);  // also where it is not aligned
    return number;
  }

 private:
  pybind11::array array_;
  const char* data_ = nullptr;
  std::size_t count_ = 0;
  std::ptrdiff_t row_stride_ = 0;
  std::ptrdiff_t column_stride_ = 0;
};

/// Numbers of the shape (n, columns). prescene.InputError for another shape and for more than 2^30 rows, TypeError for
/// what is no array of real numbers.
Rows<double> number_rows(const pybind11::handle& given, const char* argument, pybind11::ssize_t columns);
/// The same of whole numbers; TypeError for arrays of floats.
Rows<std::int64_t> index_rows(const pybind11::handle& given, const char* argument, pybind11::ssize_t columns);
/// prescene.InputError that names the first number that is not finite, if there is one.
void check_finite(const Rows<double>& rows, const char* argument, std::size_t columns);

/// Poses X_AB as homogeneous matrices, rounded to single precision, in which collision queries take them.
struct PoseBatch {
  std::vector<collision::Transform> transforms;
  bool is_single = false;  ///< One of the shape (4, 4) was given, rather than (n, 4, 4).
};
/// prescene.InputError for another shape and for what is no pose (collision::to_transform), with its index.
PoseBatch pose_batch(const pybind11::handle& given, const char* argument);

}  // namespace prescene::python
