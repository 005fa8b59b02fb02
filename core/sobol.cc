// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/sobol.h"

#include <array>
#include <bit>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/core/sobol_directions.h"

namespace prescene::core {
namespace {

// Rows of a random lower triangular matrix over GF(2) with ones on its diagonal; row 0 makes the highest bit. Such a
// matrix maps each elementary interval onto one of the same size, so it keeps every net property.
std::array<std::uint32_t, 32> random_lower_triangular(RandomStream& stream) {
  std::array<std::uint32_t, 32> rows{};
  for (unsigned i = 0; i < 32; ++i) {
    const std::uint32_t diagonal = 1U << (31 - i);
    const std::uint32_t above = ~(diagonal | (diagonal - 1));
    rows[i] = diagonal | (stream.next_u32() & above);
  }
  return rows;
}

std::uint32_t product(const std::array<std::uint32_t, 32>& rows, std::uint32_t column) {
  std::uint32_t result = 0;
  for (unsigned i = 0; i < 32; ++i) {
    result |= static_cast<std::uint32_t>(std::popcount(rows[i] & column) & 1) << (31 - i);
  }
  return result;
}

}  // namespace

static_assert(SobolNet::kMaxDimensions <= kSobolTableDimensions);

SobolNet::SobolNet(int dimensions, std::uint64_t seed) : dimensions_(dimensions) {
  PRESCENE_CHECK(dimensions >= 1 && dimensions <= kMaxDimensions);
  directions_.reserve(static_cast<std::size_t>(dimensions) * 32);
  shifts_.reserve(static_cast<std::size_t>(dimensions));
  const RandomStream scramble(seed, Purpose::kSobolScramble);
  for (int d = 0; d < dimensions; ++d) {
    RandomStream stream = scramble.at(0, static_cast<std::uint32_t>(d));
    const auto matrix = random_lower_triangular(stream);
    for (const std::uint32_t column : sobol_directions(d)) directions_.push_back(product(matrix, column));
    shifts_.push_back(stream.next_u32());
  }
}

void SobolNet::point(std::uint64_t index, std::span<double> point) const {
  PRESCENE_CHECK(point.size() == static_cast<std::size_t>(dimensions_));
  PRESCENE_CHECK(index <= 0xffffffffULL);
  const std::uint32_t* columns = directions_.data();
  for (std::size_t d = 0; d < point.size(); ++d, columns += 32) {
    std::uint32_t x = shifts_[d];
    for (auto bits = static_cast<std::uint32_t>(index); bits != 0; bits &= bits - 1) {
      x ^= columns[std::countr_zero(bits)];
    }
    point[d] = (static_cast<double>(x) + 0.5) * 0x1p-32;
  }
}

}  // namespace prescene::core
