// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/ros_messages/sha256.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace prescene::tests {
namespace {

/// The first 32 fractional bits of a root of the n-th prime; exact, as long double has 64 bits.
std::array<std::uint32_t, 64> fractional_roots(bool cube) {
  std::array<std::uint32_t, 64> out{};
  int prime = 2;
  for (auto& word : out) {
    const long double root =
        cube ? std::cbrt(static_cast<long double>(prime)) : std::sqrt(static_cast<long double>(prime));
    word = static_cast<std::uint32_t>((root - std::floor(root)) * 4294967296.0L);
    const auto is_prime = [](int n) {
      for (int d = 2; d * d <= n; ++d) {
        if (n % d == 0) return false;
      }
      return true;
    };
    do ++prime;
    while (!is_prime(prime));
  }
  return out;
}

}  // namespace

std::string sha256(std::string_view text) {
  const std::array<std::uint32_t, 64> k = fractional_roots(true);
  std::array<std::uint32_t, 8> h{};
  for (std::size_t i = 0; i < 8; ++i) h[i] = fractional_roots(false)[i];

  std::string padded(text);
  padded += '\x80';
  padded.append((120 - padded.size() % 64) % 64, '\0');
  for (int shift = 56; shift >= 0; shift -= 8) {
    padded += static_cast<char>(static_cast<std::uint64_t>(text.size()) * 8 >> shift & 0xff);
  }

  for (std::size_t block = 0; block < padded.size(); block += 64) {
    std::array<std::uint32_t, 64> w{};
    for (std::size_t i = 0; i < 64; ++i)
      w[i / 4 % 16] = w[i / 4 % 16] << 8 | static_cast<unsigned char>(padded[block + i]);
    for (std::size_t i = 16; i < 64; ++i) {
      const std::uint32_t s0 = std::rotr(w[i - 15], 7) ^ std::rotr(w[i - 15], 18) ^ w[i - 15] >> 3;
      const std::uint32_t s1 = std::rotr(w[i - 2], 17) ^ std::rotr(w[i - 2], 19) ^ w[i - 2] >> 10;
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    auto [a, b, c, d, e, f, g, last] = h;
    for (std::size_t i = 0; i < 64; ++i) {
      const std::uint32_t t1 =
          last + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) + ((e & f) ^ (~e & g)) + k[i] + w[i];
      const std::uint32_t t2 = (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      last = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
    }
    const std::array<std::uint32_t, 8> add = {a, b, c, d, e, f, g, last};
    for (std::size_t i = 0; i < 8; ++i) h[i] += add[i];
  }

  std::string out;
  for (const std::uint32_t word : h) {
    std::array<char, 9> hex{};
    std::snprintf(hex.data(), hex.size(), "%08x", word);
    out += hex.data();
  }
  return out;
}

}  // namespace prescene::tests
