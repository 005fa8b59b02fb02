// SPDX-License-Identifier: Apache-2.0
// A coder of RVL for tests, written from its description: 3-bit digits first, words last.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace prescene::tests {

/// Digits of the numbers, packed into words.
inline std::vector<std::uint8_t> rvl_words(std::span<const std::uint32_t> numbers) {
  std::vector<std::uint8_t> digits;
  for (std::uint32_t number : numbers) {
    do {
      const auto digit = static_cast<std::uint8_t>(number & 7U);
      number >>= 3U;
      digits.push_back(static_cast<std::uint8_t>(digit | (number != 0 ? 8U : 0U)));
    } while (number != 0);
  }
  while (digits.size() % 8 != 0) digits.push_back(0);
  std::vector<std::uint8_t> bytes;
  for (std::size_t word = 0; word < digits.size(); word += 8)
    for (std::size_t pair = 4; pair > 0; --pair)
      bytes.push_back(static_cast<std::uint8_t>(digits[word + 2 * pair - 2] << 4U | digits[word + 2 * pair - 1]));
  return bytes;
}

inline std::vector<std::uint8_t> rvl_words(std::initializer_list<std::uint32_t> numbers) {
  return rvl_words(std::span(numbers.begin(), numbers.size()));
}

inline std::vector<std::uint8_t> rvl_code(std::span<const std::uint16_t> pixels) {
  std::vector<std::uint32_t> numbers;
  std::int32_t before = 0;
  for (std::size_t i = 0; i < pixels.size();) {
    std::uint32_t empty = 0;
    for (; i < pixels.size() && pixels[i] == 0; ++i) ++empty;
    std::uint32_t filled = 0;
    while (i + filled < pixels.size() && pixels[i + filled] != 0) ++filled;
    numbers.push_back(empty);
    numbers.push_back(filled);
    for (std::uint32_t k = 0; k < filled; ++k, ++i) {
      const std::int32_t difference = pixels[i] - before;
      before = pixels[i];
      numbers.push_back(static_cast<std::uint32_t>(difference >= 0 ? 2 * difference : -2 * difference - 1));
    }
  }
  return rvl_words(numbers);
}

}  // namespace prescene::tests
