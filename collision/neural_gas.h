// SPDX-License-Identifier: Apache-2.0
// Batch neural gas on weighted points [Cottrell et al. 2006], the kernel of the clustering builders.
//
// In each round every prototype moves to the mean of all points, a point counting as exp(-rank / lambda) where rank is
// the number of prototypes closer to it, times its weight [Hammer et al. 2007]. lambda falls from half the number of
// prototypes to nearly zero. It is over when no prototype moves by more than 1e-5 of the points' box, or after 40
// rounds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace prescene::collision {

inline constexpr std::size_t kMostPrototypes = 16;

/// Coordinates of at most about 1, in whole blocks of 16; the last block is filled up with points of no weight.
struct WeightedPoints {
  explicit WeightedPoints(std::size_t count);
  void set(std::size_t i, const std::array<float, 3>& position, float weight);

  std::size_t count = 0;
  std::vector<float> x;
  std::vector<float> y;
  std::vector<float> z;
  std::vector<float> weight;
};

struct Prototypes {
  std::size_t count = 0;
  std::array<float, kMostPrototypes> x = {};
  std::array<float, kMostPrototypes> y = {};
  std::array<float, kMostPrototypes> z = {};
};

/// At most `count` prototypes, 2 to 16. The same bits on every machine.
Prototypes neural_gas(const WeightedPoints& points, std::size_t count);

/// The prototype that is closest to each point, the first of equally close ones.
void closest_prototypes(const WeightedPoints& points, const Prototypes& prototypes, std::span<std::uint8_t> closest);

}  // namespace prescene::collision
