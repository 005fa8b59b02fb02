// SPDX-License-Identifier: Apache-2.0
// Hashes of values for determinism checks, caches and step traces: stable over runs, platforms of equal endianness and
// versions of the standard library. Not cryptographic.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace prescene::core {

/// Incremental 64-bit hash over bytes (FNV-1a with a final mix).
class Hasher {
 public:
  Hasher& bytes(const void* data, std::size_t size);
  Hasher& text(std::string_view value);  ///< Length and content.
  /// The value's bits; -0.0 and 0.0 differ, as the promise is about bits.
  template <class T>
  requires(std::integral<T> || std::floating_point<T> || std::is_enum_v<T>) Hasher& value(T v) {
    return bytes(&v, sizeof v);
  }
  std::uint64_t digest() const;

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

/// 16 lower-case hexadecimal digits.
std::string hash_text(std::uint64_t digest);

}  // namespace prescene::core
