// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/random.h"

#include <Random123/philox.h>

#include "prescene/core/check.h"

namespace prescene::core {

std::array<std::uint32_t, 4> philox_words(const std::array<std::uint32_t, 4>& counter,
                                          const std::array<std::uint32_t, 2>& key) {
  const r123::Philox4x32::ctr_type c = {{counter[0], counter[1], counter[2], counter[3]}};
  const r123::Philox4x32::key_type k = {{key[0], key[1]}};
  const r123::Philox4x32::ctr_type r = r123::Philox4x32()(c, k);
  return {r[0], r[1], r[2], r[3]};
}

namespace {

constexpr std::uint32_t low_word(std::uint64_t v) { return static_cast<std::uint32_t>(v); }
constexpr std::uint32_t high_word(std::uint64_t v) { return static_cast<std::uint32_t>(v >> 32); }

// Philox4x32 has a key of 64 bits: seed and purpose are hashed into it by Philox itself under a fixed key, so that
// neither neighbouring seeds nor neighbouring purposes give related keys.
std::array<std::uint32_t, 2> key_of(std::uint64_t seed, Purpose purpose) {
  constexpr std::array<std::uint32_t, 2> kFixedKey = {0x70726573, 0x63656e65};  // "prescene"
  const auto words = philox_words({low_word(seed), high_word(seed), static_cast<std::uint32_t>(purpose), 0}, kFixedKey);
  return {words[0], words[1]};
}

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, Purpose purpose, std::uint64_t step, std::uint32_t particle)
    : seed_(seed), key_(key_of(seed, purpose)), step_(step), particle_(particle) {}

RandomStream RandomStream::at(std::uint64_t step, std::uint32_t particle) const {
  RandomStream other(*this);
  other.step_ = step;
  other.particle_ = particle;
  other.block_ = 0;
  other.used_ = 4;
  return other;
}

RandomStream RandomStream::for_purpose(Purpose purpose) const { return {seed_, purpose, step_, particle_}; }

std::uint32_t RandomStream::next_u32() {
  if (used_ == 4) {
    words_ = philox_words({block_++, particle_, low_word(step_), high_word(step_)}, key_);
    used_ = 0;
  }
  return words_[used_++];
}

std::uint64_t RandomStream::next_u64() {
  const std::uint64_t low = next_u32();
  return low | (static_cast<std::uint64_t>(next_u32()) << 32);
}

double RandomStream::uniform() { return (static_cast<double>(next_u64() >> 12) + 0.5) * 0x1p-52; }

std::uint64_t RandomStream::uniform_below(std::uint64_t bound) {
  PRESCENE_CHECK(bound > 0);
  // [Lemire 2019], with the rejection that makes it unbiased.
  __extension__ using Wide = unsigned __int128;
  Wide product = static_cast<Wide>(next_u64()) * bound;
  if (static_cast<std::uint64_t>(product) < bound) {
    const std::uint64_t threshold = (0 - bound) % bound;
    while (static_cast<std::uint64_t>(product) < threshold) product = static_cast<Wide>(next_u64()) * bound;
  }
  return static_cast<std::uint64_t>(product >> 64);
}

double RandomStream::normal() { return inverse_normal_cdf(uniform()); }

}  // namespace prescene::core
