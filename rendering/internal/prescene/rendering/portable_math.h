// SPDX-License-Identifier: Apache-2.0
// Powers and log made of additions, multiplications and divisions alone, so that likelihoods have the same bits on
// every processor (the system's library picks variants by processor).
#pragma once

#include <bit>
#include <cstdint>

namespace prescene::rendering {

/// 2^x in single precision for x from -126 to 127, relative error below 3e-7.
inline float portable_exp2(float x) {
  // The lowest bits of `shifted` are the whole number next to x; |r| <= 1/2.
  constexpr float kWhole = 12582912.0f;
  const float shifted = x + kWhole;
  const float r = x - (shifted - kWhole);
  // The fifth order with the least greatest relative error (9e-8), paired so that the processor can overlap.
  const float r2 = r * r;
  const float p =
      (1.0f + r * 0.69314698f) + r2 * ((0.24022242f + r * 0.055507337f) + r2 * (0.0096715127f + r * 0.0013264727f));
  return p * std::bit_cast<float>((std::bit_cast<std::uint32_t>(shifted) << 23) + 0x3f800000u);
}

/// exp(x) in double precision, relative error below 2e-15; 0 below -708, x at most 709.
inline double portable_exp(double x) {
  if (x < -708.0) return 0.0;
  if (x > 709.0) x = 709.0;
  const double scaled = x * 1.4426950408889634;
  const auto k = static_cast<std::int32_t>(scaled + (scaled < 0.0 ? -0.5 : 0.5));
  const double r = (x - k * 0.693145751953125) - k * 1.4286068203094172e-6;
  // Taylor to the thirteenth order: the next term is below 5e-18 at |r| = 0.35. Paired so that the processor can
  // overlap.
  const double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
  const double low = (1.0 + r) + r2 * (1.0 / 2 + r * (1.0 / 6));
  const double middle = (1.0 / 24 + r * (1.0 / 120)) + r2 * (1.0 / 720 + r * (1.0 / 5040));
  const double high = (1.0 / 40320 + r * (1.0 / 362880)) + r2 * (1.0 / 3628800 + r * (1.0 / 39916800));
  const double highest = 1.0 / 479001600 + r * (1.0 / 6227020800.0);
  const double p = (low + r4 * middle) + r8 * (high + r4 * highest);
  return p * std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

/// log(x) of a positive, finite, normal number; relative error below 1e-14 (absolute near x = 1).
inline double portable_log(double x) {
  // x = m 2^k with m in [sqrt(1/2), sqrt(2)); log m = 2 artanh((m - 1) / (m + 1)).
  auto bits = std::bit_cast<std::uint64_t>(x);
  auto k = static_cast<std::int32_t>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++k;
  }
  const double s = (m - 1.0) / (m + 1.0);
  const double s2 = s * s;
  double sum = 1.0 / 19.0;
  for (int n = 17; n >= 1; n -= 2) sum = sum * s2 + 1.0 / n;
  return 2.0 * s * sum + k * 0.6931471805599453;
}

}  // namespace prescene::rendering
