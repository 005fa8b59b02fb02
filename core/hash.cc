// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/hash.h"

namespace prescene::core {

Hasher& Hasher::bytes(const void* data, std::size_t size) {
  constexpr std::uint64_t kFnvPrime = 0x100000001b3ULL;
  const auto* p = static_cast<const unsigned char*>(data);
  std::uint64_t state = state_;
  for (std::size_t i = 0; i < size; ++i) state = (state ^ p[i]) * kFnvPrime;
  state_ = state;
  return *this;
}

Hasher& Hasher::text(std::string_view value) {
  // The length first, so that ("ab", "c") and ("a", "bc") differ.
  this->value(static_cast<std::uint64_t>(value.size()));
  return bytes(value.data(), value.size());
}

std::uint64_t Hasher::digest() const {
  // The last byte reaches only the low bits of FNV-1a's state evenly; this bijective mix (the finaliser of MurmurHash3)
  // spreads it, so that any part of the digest can be used.
  std::uint64_t h = state_;
  h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdULL;
  h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return h ^ (h >> 33);
}

std::string hash_text(std::uint64_t digest) {
  std::string text(16, '0');
  for (std::size_t i = 16; i-- > 0; digest >>= 4) text[i] = "0123456789abcdef"[digest & 15];
  return text;
}

}  // namespace prescene::core
