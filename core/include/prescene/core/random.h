// SPDX-License-Identifier: Apache-2.0
// Counter-based random streams: the same (seed, purpose, step, particle) gives the same numbers on any thread, in any
// order of work. Functions take a RandomStream; nothing draws from an ambient generator.
//
//   RandomStream stream(seed, Purpose::kResample);
//   RandomStream mine = stream.at(step, particle);
//   double x = mine.normal();
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace prescene::core {

/// What a stream is for; two purposes under one seed are independent. Values are part of the replay promise:
/// append, never renumber.
enum class Purpose : std::uint32_t {
  kTest = 0,
  kStartBelief = 1,
  kProcessNoise = 2,
  kProposal = 3,
  kResample = 4,
  kDetection = 5,
  kRecovery = 6,
  kSensorNoise = 7,
  kSobolScramble = 8,
  kScenario = 9,
  kAction = 10,
  kEvaluation = 11,
  kParameters = 12,
  kSurface = 13,
  kAudit = 14,
  kNearbyStart = 15,
  kLearning = 16,
};

/// The Philox4x32-10 bijection itself [Salmon et al. 2011]: the four words of a counter under a key.
std::array<std::uint32_t, 4> philox_words(const std::array<std::uint32_t, 4>& counter,
                                          const std::array<std::uint32_t, 2>& key);

/// A stream of Philox4x32-10 draws [Salmon et al. 2011], keyed by (seed, purpose), counted by (step, particle, draw).
/// A value type: copying it forks the position. Period 2^34 32-bit draws per (step, particle).
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, Purpose purpose, std::uint64_t step = 0, std::uint32_t particle = 0);

  /// The stream of the same seed and purpose at another step and particle, from its first draw.
  RandomStream at(std::uint64_t step, std::uint32_t particle = 0) const;
  /// The stream of the same seed, step and particle for another purpose, from its first draw.
  RandomStream for_purpose(Purpose purpose) const;

  std::uint64_t seed() const { return seed_; }

  std::uint32_t next_u32();
  std::uint64_t next_u64();
  /// Uniform in the open interval (0, 1): one of the 2^52 odd multiples of 2^-53.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform integer in [0, bound), unbiased; bound > 0.
  std::uint64_t uniform_below(std::uint64_t bound);
  /// Standard normal by the inverse of its distribution function (one draw each, so counts stay predictable).
  double normal();
  double normal(double mean, double standard_deviation) { return mean + standard_deviation * normal(); }

  /// Fisher-Yates.
  template <class T>
  void shuffle(std::span<T> values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[uniform_below(i)]);
  }

 private:
  std::uint64_t seed_;
  std::array<std::uint32_t, 2> key_;
  std::uint64_t step_;
  std::uint32_t particle_;
  std::uint32_t block_ = 0;
  std::uint32_t used_ = 4;
  std::array<std::uint32_t, 4> words_{};
};

/// Inverse of the standard normal distribution function, relative error below 1e-15 [Wichura 1988, AS 241]; infinite at
/// 0 and 1, NaN outside of [0, 1].
double inverse_normal_cdf(double p);
/// Standard normal distribution function.
double normal_cdf(double x);

}  // namespace prescene::core
