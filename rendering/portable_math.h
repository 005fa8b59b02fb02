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

/// exp(x) in double precision, relative error below 1e-15; 0 below -708, x at most 709.
inline double portable_exp(double x) {
  if (x < -708.0) return 0.0;
  if (x > 709.0) x = 709.0;
  const double scaled = x * 1.4426950408889634;
  const auto k = static_cast<std::int32_t>(scaled + (scaled < 0.0 ? -0.5 : 0.5));
  const double r = (x - k * 0.693145751953125) - k * 1.4286068203094172e-6;
  // Taylor to the thirteenth order: the next term is below 5e-18 at |r| = 0.35.
  constexpr double kShares[] = {1.0 / 13, 1.0 / 12, 1.0 / 11, 1.0 / 10, 1.0 / 9, 1.0 / 8, 1.0 / 7,
                                1.0 / 6,  1.0 / 5,  1.0 / 4,  1.0 / 3,  1.0 / 2, 1.0};
  double p = 1.0;
  for (const double share : kShares) p = p * (r * share) + 1.0;
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
