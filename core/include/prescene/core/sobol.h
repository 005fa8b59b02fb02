// SPDX-License-Identifier: Apache-2.0
// Scrambled Sobol nets: point sets that fill the unit cube more evenly than random draws.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace prescene::core {

/// A Sobol sequence with direction numbers of [Joe & Kuo 2008], scrambled by a random linear matrix and a digital shift
/// [Matousek 1998]. Any aligned block of 2^k points is a (t, k, s) net; averages are unbiased over scrambles.
class SobolNet {
 public:
  static constexpr int kMaxDimensions = 128;

  /// dimensions in [1, kMaxDimensions] (checked). Points depend on (seed, dimensions' index) only: a net of more
  /// dimensions has the same first coordinates.
  SobolNet(int dimensions, std::uint64_t seed);

  int dimensions() const { return dimensions_; }
  /// Writes point `index` (< 2^32), each coordinate in the open interval (0, 1); point.size() == dimensions().
  void point(std::uint64_t index, std::span<double> point) const;

 private:
  int dimensions_;
  std::vector<std::uint32_t> directions_;  // 32 columns a dimension, scrambled
  std::vector<std::uint32_t> shifts_;
};

}  // namespace prescene::core
