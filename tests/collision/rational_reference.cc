// SPDX-License-Identifier: Apache-2.0
#include "rational_reference.h"

#include <gmpxx.h>

#include <optional>
#include <vector>

namespace prescene::collision {
namespace {

// Phase one of the simplex method: x >= 0 with rows * x = right sides, all right sides >= 0. The artificial variables
// are not kept as columns, as they never come back. The last row is the sum of the rows whose basis is artificial.
class Simplex {
 public:
  Simplex(std::size_t rows, std::size_t columns)
      : columns_(columns), table_(rows + 1, std::vector<mpq_class>(columns + 1)), basis_(rows) {}

  mpq_class& at(std::size_t row, std::size_t column) { return table_[row][column]; }
  mpq_class& right(std::size_t row) { return table_[row][columns_]; }

  bool feasible() {
    const std::size_t rows = basis_.size();
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t column = 0; column <= columns_; ++column) table_[rows][column] += table_[row][column];
    }
    while (const std::optional<std::size_t> column = entering()) pivot(leaving(*column), *column);
    return sgn(right(rows)) == 0;
  }

 private:
  std::optional<std::size_t> entering() const {
    for (std::size_t column = 0; column < columns_; ++column) {
      if (sgn(table_.back()[column]) > 0) return column;
    }
    return std::nullopt;
  }
  // Artificial variables go first, then the smallest index: no basis comes twice.
  std::size_t leaving(std::size_t column) const {
    std::optional<std::size_t> best;
    mpq_class best_ratio;
    for (std::size_t row = 0; row < basis_.size(); ++row) {
      if (sgn(table_[row][column]) <= 0) continue;
      const mpq_class ratio = table_[row][columns_] / table_[row][column];
      if (!best || ratio < best_ratio || (ratio == best_ratio && index(row) < index(*best))) {
        best = row;
        best_ratio = ratio;
      }
    }
    return *best;
  }
  std::size_t index(std::size_t row) const { return basis_[row] ? *basis_[row] + basis_.size() : row; }

  void pivot(std::size_t row, std::size_t column) {
    const bool was_artificial = !basis_[row].has_value();
    if (was_artificial) {  // It leaves the sum of the artificial ones.
      for (std::size_t c = 0; c <= columns_; ++c) table_.back()[c] -= table_[row][c];
    }
    const mpq_class scale = table_[row][column];
    for (mpq_class& value : table_[row]) value /= scale;
    for (std::size_t other = 0; other < table_.size(); ++other) {
      if (other == row || sgn(table_[other][column]) == 0) continue;
      const mpq_class factor = table_[other][column];
      for (std::size_t c = 0; c <= columns_; ++c) table_[other][c] -= factor * table_[row][c];
    }
    basis_[row] = column;
  }

  std::size_t columns_;
  std::vector<std::vector<mpq_class>> table_;
  std::vector<std::optional<std::size_t>> basis_;  // Nothing: the row's artificial variable.
};

}  // namespace

bool rational_hulls_meet(std::span<const Vector3f> a, std::span<const Vector3f> b) {
  Simplex programme(5, a.size() + b.size());
  for (int axis = 0; axis < 3; ++axis) {
    // Measured from a corner of a: the right sides are then zero.
    const mpq_class origin(static_cast<double>(a[0][axis]));
    const auto row = static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < a.size(); ++i)
      programme.at(row, i) = mpq_class(static_cast<double>(a[i][axis])) - origin;
    for (std::size_t i = 0; i < b.size(); ++i)
      programme.at(row, a.size() + i) = origin - mpq_class(static_cast<double>(b[i][axis]));
  }
  for (std::size_t i = 0; i < a.size(); ++i) programme.at(3, i) = 1;
  for (std::size_t i = 0; i < b.size(); ++i) programme.at(4, a.size() + i) = 1;
  programme.right(3) = 1;
  programme.right(4) = 1;
  return programme.feasible();
}

int rational_orientation(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  const auto entry = [&a](const Vector3f& p, int axis) {
    return mpq_class(mpq_class(static_cast<double>(p[axis])) - mpq_class(static_cast<double>(a[axis])));
  };
  mpq_class determinant = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int i = (axis + 1) % 3;
    const int j = (axis + 2) % 3;
    determinant += entry(b, axis) * (entry(c, i) * entry(d, j) - entry(c, j) * entry(d, i));
  }
  return sgn(determinant);
}

}  // namespace prescene::collision
