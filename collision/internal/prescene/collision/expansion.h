// SPDX-License-Identifier: Apache-2.0
// Exact sums and products: a number is kept as a sum of doubles that do not overlap, smallest first, without zeros
// [Shewchuk 1997]. Exact as long as no product overflows and no term falls below 2^-1022; sums and products of up to
// three single-precision numbers are multiples of 2^-447.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "prescene/core/check.h"

namespace prescene::collision {

/// head + tail is the exact result and head the rounded one.
struct TwoTerms {
  double head;
  double tail;
};

inline TwoTerms exact_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// Dekker's product: a fused multiply-add would do it in two operations, but not on every machine.
inline TwoTerms exact_product(double a, double b) {
  constexpr double kSplitter = 134217729.0;  // 2^27 + 1
  const double a_high = kSplitter * a - (kSplitter * a - a);
  const double b_high = kSplitter * b - (kSplitter * b - b);
  const double a_low = a - a_high;
  const double b_low = b - b_high;
  const double product = a * b;
  return {product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

template <std::size_t kCapacity>
class Expansion {
 public:
  Expansion() = default;
  static Expansion difference(double a, double b) {
    Expansion result;
    result.add(a);
    result.add(-b);
    return result;
  }

  std::span<const double> terms() const { return {terms_.data(), size_}; }
  int sign() const { return size_ == 0 ? 0 : (terms_[size_ - 1] > 0.0 ? 1 : -1); }

  void add(double value) {
    std::size_t kept = 0;
    double rest = value;
    for (std::size_t i = 0; i < size_; ++i) {
      const TwoTerms two = exact_sum(rest, terms_[i]);
      rest = two.head;
      if (two.tail != 0.0) terms_[kept++] = two.tail;
    }
    if (rest != 0.0) {
      PRESCENE_DCHECK(kept < kCapacity);
      terms_[kept++] = rest;
    }
    size_ = kept;
  }
  /// Adds sign * a * b, where the sign is 1 or -1.
  void add_product(std::span<const double> a, std::span<const double> b, double sign = 1.0) {
    for (const double x : a) {
      for (const double y : b) {
        const TwoTerms two = exact_product(sign * x, y);
        add(two.tail);
        add(two.head);
      }
    }
  }

 private:
  std::array<double, kCapacity> terms_{};
  std::size_t size_ = 0;
};

}  // namespace prescene::collision
