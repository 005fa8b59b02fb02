// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/crc32.h"

#include <zlib.h>

#include <array>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace prescene::interfaces {
namespace {

std::uint32_t crc32_by_zlib(std::span<const std::uint8_t> bytes, std::uint32_t start) {
  if (bytes.empty()) return start;  // zlib takes a null pointer for a wish to begin anew.
  return static_cast<std::uint32_t>(::crc32_z(start, bytes.data(), bytes.size()));
}

#if defined(__x86_64__)

// Folding by carry-less multiplication [Gopal et al. 2009]: 16 bytes that lie n bits before others may be replaced by
// their product with x^n modulo the polynomial, added to those others. What is left in the end is shorter, and has the
// same remainder. zlib takes that of the last 16 bytes.

constexpr std::size_t kRegister = 16;  // bytes
constexpr std::size_t kRegisters = 4;  // that are folded side by side, as one product takes some cycles
constexpr std::size_t kFewestFolded = 2 * kRegisters * kRegister;

/// x^n modulo the polynomial, in the bit order of the CRC and moved by the one bit that products of reflected numbers
/// lack.
constexpr long long power_of_x(int n) {
  std::uint32_t remainder = 0x80000000U;
  for (int i = 0; i < n; ++i) remainder = remainder >> 1 ^ ((remainder & 1U) != 0 ? 0xedb88320U : 0U);
  return static_cast<long long>(remainder) << 1;
}

/// The factors for both halves of a register that lies `distance` bytes before the one that it is added to.
template <std::size_t distance>
__attribute__((target("pclmul,sse4.1"))) inline __m128i fold(__m128i value, __m128i onto) {
  constexpr int kBits = 8 * static_cast<int>(distance);
  constexpr long long kFirst = power_of_x(kBits + 32), kSecond = power_of_x(kBits - 32);
  const __m128i factors = _mm_set_epi64x(kSecond, kFirst);
  const __m128i first = _mm_clmulepi64_si128(value, factors, 0x00);
  const __m128i second = _mm_clmulepi64_si128(value, factors, 0x11);
  return _mm_xor_si128(_mm_xor_si128(first, second), onto);
}

__attribute__((target("pclmul,sse4.1"))) inline __m128i load(const std::uint8_t* at) {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
}

/// Of at least kFewestFolded bytes.
__attribute__((target("pclmul,sse4.1"))) std::uint32_t crc32_by_folding(std::span<const std::uint8_t> bytes,
                                                                        std::uint32_t start) {
  const std::uint8_t* at = bytes.data();
  const std::uint8_t* const end = at + bytes.size();
  // The CRC of what came before is added to the first bits.
  __m128i a = _mm_xor_si128(load(at), _mm_cvtsi32_si128(static_cast<int>(~start)));
  __m128i b = load(at + kRegister), c = load(at + 2 * kRegister), d = load(at + 3 * kRegister);
  constexpr std::size_t kAll = kRegisters * kRegister;
  for (at += kAll; at + kAll <= end; at += kAll) {
    a = fold<kAll>(a, load(at));
    b = fold<kAll>(b, load(at + kRegister));
    c = fold<kAll>(c, load(at + 2 * kRegister));
    d = fold<kAll>(d, load(at + 3 * kRegister));
  }
  __m128i rest = fold<kRegister>(fold<kRegister>(fold<kRegister>(a, b), c), d);
  for (; at + kRegister <= end; at += kRegister) rest = fold<kRegister>(rest, load(at));
  std::array<std::uint8_t, kRegister> last{};
  _mm_storeu_si128(reinterpret_cast<__m128i*>(last.data()), rest);
  // From a remainder of zero, which zlib writes inverted.
  return crc32_by_zlib({at, end}, crc32_by_zlib(last, ~std::uint32_t{0}));
}

bool can_fold() {
  static const bool kCan = __builtin_cpu_supports("pclmul") != 0 && __builtin_cpu_supports("sse4.1") != 0;
  return kCan;
}

#endif

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t start) {
#if defined(__x86_64__)
  if (bytes.size() >= kFewestFolded && can_fold()) return crc32_by_folding(bytes, start);
#endif
  return crc32_by_zlib(bytes, start);
}

}  // namespace prescene::interfaces
