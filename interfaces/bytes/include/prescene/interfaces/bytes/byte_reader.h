// SPDX-License-Identifier: Apache-2.0
// A cursor over bytes from outside: reads numbers of either byte order and never passes the end. After the first read
// that does not fit, everything reads as zero and ok() is false, so that a parser may check once a record.
//
//   PRESCENE_TRY(const auto bytes, read_file(path, 1 << 20));   // prescene/interfaces/bytes/file.h
//   ByteReader reader(bytes);                                   // bytes must outlive it
//   const auto count = reader.read<std::uint32_t>();
//   const auto name = reader.take(count);
//   if (!reader.ok()) return core::data_loss(path.string() + ": ends too early");
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace prescene::interfaces {

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes, std::endian order = std::endian::little)
      : bytes_(bytes), order_(order) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

  /// The next number; T is an integer or floating-point type.
  template <class T>
  T read() {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    const std::span<const std::uint8_t> raw = take(sizeof(T));
    if (raw.empty()) return value;
    std::uint8_t ordered[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      ordered[i] = raw[order_ == std::endian::native ? i : sizeof(T) - 1 - i];
    }
    std::memcpy(&value, ordered, sizeof(T));
    return value;
  }

  /// The next `count` bytes, or none and not ok().
  std::span<const std::uint8_t> take(std::size_t count) {
    if (!ok_ || count > remaining()) {
      ok_ = false;
      return {};
    }
    const std::span<const std::uint8_t> taken = bytes_.subspan(position_, count);
    position_ += count;
    return taken;
  }

  /// Skips to the next multiple of `alignment` counted from the first byte.
  void align(std::size_t alignment) {
    const std::size_t over = position_ % alignment;
    if (over != 0) take(alignment - over);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::endian order_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace prescene::interfaces
