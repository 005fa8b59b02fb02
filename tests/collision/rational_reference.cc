// SPDX-License-Identifier: Apache-2.0
#include "rational_reference.h"

#include <gmpxx.h>

#include <array>
#include <optional>
#include <utility>
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

using RationalVector = std::array<mpq_class, 3>;

RationalVector rational(const Vector3f& p) {
  return {mpq_class(static_cast<double>(p.x())), mpq_class(static_cast<double>(p.y())),
          mpq_class(static_cast<double>(p.z()))};
}

RationalVector minus(const RationalVector& p, const RationalVector& q) {
  return {mpq_class(p[0] - q[0]), mpq_class(p[1] - q[1]), mpq_class(p[2] - q[2])};
}

mpq_class dot(const RationalVector& p, const RationalVector& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; }

// Gauss and Jordan; nothing when singular.
std::optional<std::vector<mpq_class>> solve(std::vector<std::vector<mpq_class>> rows) {
  const std::size_t n = rows.size();
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t pivot = i;
    while (pivot < n && sgn(rows[pivot][i]) == 0) ++pivot;
    if (pivot == n) return std::nullopt;
    std::swap(rows[i], rows[pivot]);
    for (std::size_t row = 0; row < n; ++row) {
      if (row == i) continue;
      const mpq_class factor = rows[row][i] / rows[i][i];
      for (std::size_t column = i; column <= n; ++column) rows[row][column] -= factor * rows[i][column];
    }
  }
  std::vector<mpq_class> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = rows[i][n] / rows[i][i];
  return x;
}

// Corners of one face, edge or corner of a triangle.
using Feature = std::vector<RationalVector>;

std::vector<Feature> features(const Triangle& t) {
  std::vector<Feature> all;
  for (unsigned subset = 1; subset < 8; ++subset) {
    Feature feature;
    for (unsigned i = 0; i < 3; ++i) {
      if ((subset >> i & 1U) != 0) feature.push_back(rational(t[i]));
    }
    all.push_back(std::move(feature));
  }
  return all;
}

// Of the planes, lines or points through the features, when the nearest points are within both.
std::optional<mpq_class> squared_distance(const Feature& a, const Feature& b) {
  std::vector<RationalVector> directions;
  for (std::size_t i = 1; i < a.size(); ++i) directions.push_back(minus(a[i], a[0]));
  for (std::size_t i = 1; i < b.size(); ++i) directions.push_back(minus(b[0], b[i]));
  RationalVector rest = minus(b[0], a[0]);
  const std::size_t n = directions.size();
  std::vector<std::vector<mpq_class>> normal(n, std::vector<mpq_class>(n + 1));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) normal[i][k] = dot(directions[i], directions[k]);
    normal[i][n] = dot(directions[i], rest);
  }
  const auto x = solve(std::move(normal));
  if (!x) return std::nullopt;  // Flat: the nearest points are also on features of lower dimension.
  mpq_class in_a = 1;
  mpq_class in_b = 1;
  for (std::size_t i = 0; i < n; ++i) {
    if (sgn((*x)[i]) < 0) return std::nullopt;
    (i + 1 < a.size() ? in_a : in_b) -= (*x)[i];
    for (std::size_t axis = 0; axis < 3; ++axis) rest[axis] -= (*x)[i] * directions[i][axis];
  }
  if (sgn(in_a) < 0 || sgn(in_b) < 0) return std::nullopt;
  return dot(rest, rest);
}

}  // namespace

double rational_distance(const Triangle& a, const Triangle& b) {
  std::optional<mpq_class> best;
  for (const Feature& feature_a : features(a)) {
    for (const Feature& feature_b : features(b)) {
      const auto square = squared_distance(feature_a, feature_b);
      if (square && (!best || *square < *best)) best = square;
    }
  }
  return mpf_class(sqrt(mpf_class(*best, 512))).get_d();
}

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
