// SPDX-License-Identifier: Apache-2.0
// Whose colour a pixel at an object's edge has: the object's, or that of what is around it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "prescene/geometry/image.h"

namespace prescene::filter {

constexpr double kLogOdds = 1.1;  // nats a pixel; less than its reliability, as neighbours err together
constexpr int kParts = 4;         // of kLogOdds, in which scores are counted

/// How the colours of an object differ from those around it.
class EdgeColors {
 public:
  void add(const geometry::Rgb& color, bool of_object) {
    // Shared by the bins about it, as the noise of colours is of their size.
    std::array<int, 3> low;
    std::array<float, 3> above;
    for (std::size_t c = 0; c < 3; ++c) {
      const float at = std::clamp((static_cast<float>(color[c]) + 0.5F) / kWidth - 0.5F, 0.0F, kBins - 1.001F);
      low[c] = static_cast<int>(at);
      above[c] = at - static_cast<float>(low[c]);
    }
    for (int corner = 0; corner < 8; ++corner) {
      float share = 1.0F;
      std::array<int, 3> bin;
      for (std::size_t c = 0; c < 3; ++c) {
        const bool is_above = (corner >> c & 1) != 0;
        bin[c] = low[c] + (is_above ? 1 : 0);
        share *= is_above ? above[c] : 1.0F - above[c];
      }
      (of_object ? object_ : around_)[index(bin)] += share;
    }
    ++(of_object ? objects_ : arounds_);
  }

  /// False where too little was added to tell anything.
  bool finish() {
    if (objects_ < kFewest || arounds_ < kFewest) return false;
    for (std::size_t i = 0; i < scores_.size(); ++i) {
      const double odds = (object_[i] / static_cast<double>(objects_) + 1.0 / kFewest) /
                          (around_[i] / static_cast<double>(arounds_) + 1.0 / kFewest);
      scores_[i] = static_cast<std::int8_t>(
          std::lround(std::clamp(kParts * std::log(odds) / kLogOdds, -1.0 * kParts, 1.0 * kParts)));
    }
    return true;
  }

  /// In kParts of kLogOdds.
  int score(const geometry::Rgb& color) const {
    return scores_[index({color[0] / kWidth, color[1] / kWidth, color[2] / kWidth})];
  }

 private:
  static constexpr int kBins = 16;  // of a channel
  static constexpr int kWidth = 256 / kBins;
  static constexpr int kFewest = 24;  // pixels
  static std::size_t index(const std::array<int, 3>& bin) {
    return static_cast<std::size_t>((bin[0] * kBins + bin[1]) * kBins + bin[2]);
  }

  std::vector<float> object_ = std::vector<float>(kBins * kBins * kBins), around_ = object_;
  std::array<std::int8_t, static_cast<std::size_t>(kBins* kBins* kBins)> scores_{};
  int objects_ = 0, arounds_ = 0;
};

}  // namespace prescene::filter
