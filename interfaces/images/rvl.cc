// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/rvl.h"

#include <algorithm>
#include <cstddef>
#include <string>

namespace prescene::interfaces {
namespace {

constexpr std::size_t kWordBytes = 4;
constexpr int kDigitsOfWord = 8;

/// Numbers of 3-bit digits, the least significant first; the fourth bit says that more follow.
class NumberReader {
 public:
  explicit NumberReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// False once, after the end of the words or for a number of more than 32 bits.
  bool read(std::uint32_t* number) {
    constexpr int kMostDigits = 11;
    std::uint64_t value = 0;
    for (int i = 0; i < kMostDigits; ++i) {
      std::uint32_t digit = 0;
      if (!read_digit(&digit)) return false;
      value |= std::uint64_t{digit & 7U} << (3 * i);
      if ((digit & 8U) != 0) continue;
      if (value > UINT32_MAX) return false;
      *number = static_cast<std::uint32_t>(value);
      return true;
    }
    return false;
  }

  /// Bytes of words that were not begun.
  std::size_t bytes_left() const { return bytes_.size() - at_; }

 private:
  bool read_digit(std::uint32_t* digit) {
    if (left_ == 0) {
      if (bytes_.size() - at_ < kWordBytes) return false;
      word_ = 0;
      for (std::size_t i = 0; i < kWordBytes; ++i) word_ |= std::uint32_t{bytes_[at_ + i]} << (8 * i);
      at_ += kWordBytes;
      left_ = kDigitsOfWord;
    }
    *digit = word_ >> 28U;
    word_ <<= 4U;
    --left_;
    return true;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint32_t word_ = 0;
  int left_ = 0;
};

/// 0, 1, 2, 3, ... stand for 0, -1, 1, -2, ...
std::int64_t unfolded(std::uint32_t number) {
  return (number & 1U) != 0 ? -static_cast<std::int64_t>(number >> 1U) - 1 : static_cast<std::int64_t>(number >> 1U);
}

}  // namespace

core::Result<geometry::Image<std::uint16_t>> decode_rvl(std::span<const std::uint8_t> bytes, ImageSize size,
                                                        const ImageLimits& limits) {
  const std::string size_words = std::to_string(size.width) + " x " + std::to_string(size.height) + " pixels";
  if (size.width <= 0 || size.height <= 0)
    return core::invalid_input("says it has " + size_words + "; send nothing instead of an empty image");
  if (size.width > limits.max_side || size.height > limits.max_side ||
      std::int64_t{size.width} * size.height > limits.max_pixels)
    return core::resource_exhausted("has " + size_words + "; the limits are " + std::to_string(limits.max_side) +
                                    " a side and " + std::to_string(limits.max_pixels) + " in all");
  geometry::Image<std::uint16_t> image(size.width, size.height, 0);
  NumberReader numbers(bytes);
  const auto cut = [&](std::size_t at) {
    return core::data_loss("the RVL code ends, or breaks off, at pixel " + std::to_string(at) + " of " +
                           std::to_string(image.size()) + "; send it whole");
  };
  std::int64_t value = 0;  // of the last pixel that was not 0
  for (std::size_t at = 0; at < image.size();) {
    std::uint32_t empty = 0;
    std::uint32_t filled = 0;
    if (!numbers.read(&empty) || !numbers.read(&filled)) return cut(at);
    if (empty > image.size() - at || filled > image.size() - at - empty)
      return core::data_loss("the RVL code describes more pixels than the " + std::to_string(image.size()) +
                             " of the image; correct the size that is sent with it");
    at += empty;
    for (const std::size_t end = at + filled; at < end; ++at) {
      std::uint32_t difference = 0;
      if (!numbers.read(&difference)) return cut(at);
      // Modulo 2^16, as some coders keep values in 16 bits.
      value = static_cast<std::uint16_t>(value + unfolded(difference));
      image.data()[at] = static_cast<std::uint16_t>(value);
    }
  }
  if (numbers.bytes_left() > 0)
    return core::data_loss(std::to_string(numbers.bytes_left()) + " bytes are left over after the RVL code of " +
                           size_words + "; correct the size that is sent with it");
  return image;
}

}  // namespace prescene::interfaces
