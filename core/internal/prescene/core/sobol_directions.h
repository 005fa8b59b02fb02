// SPDX-License-Identifier: Apache-2.0
// The unscrambled direction numbers of the Sobol sequence of [Joe & Kuo 2008]. SobolNet is what draws points.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace prescene::core {

/// Dimensions 0 to kSobolTableDimensions - 1 have numbers.
inline constexpr int kSobolTableDimensions = 128;

/// What defines one dimension >= 1 of the sequence.
struct SobolPolynomial {
  int degree;                              ///< Of a primitive polynomial over GF(2).
  std::uint32_t inner_coefficients;        ///< Of x^(degree-1) (highest bit) to x^1; those of x^degree and 1 are 1.
  std::span<const std::uint16_t> initial;  ///< m_1, m_2, ... m_degree: odd, m_i < 2^i. Static lifetime.
};
/// dimension in [1, kSobolTableDimensions) (checked).
SobolPolynomial sobol_polynomial(int dimension);

/// Generating matrix of one dimension: element i is what bit i of the point's index adds (exclusive or), its highest
/// bit worth 1/2. dimension in [0, kSobolTableDimensions) (checked).
std::array<std::uint32_t, 32> sobol_directions(int dimension);

}  // namespace prescene::core
