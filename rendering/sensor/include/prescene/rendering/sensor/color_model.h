// SPDX-License-Identifier: Apache-2.0
// Colour of an object against that of everything else, as a ratio of two histograms over RGB.
//
//   ColorHistogram object, rest;
//   object.add(image, mask, 1); rest.add(image, mask, 0);
//   ColorModel model = make_color_model(object, rest, {});
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "prescene/geometry/image.h"

namespace prescene::rendering {

inline constexpr int kColorBins = 16;  ///< Each way; 16^3 in all.

/// Counts of colours in 16 x 16 x 16 bins.
class ColorHistogram {
 public:
  void add(const geometry::Rgb& color, double weight = 1.0) { counts_[bin(color)] += weight; }
  /// Adds the pixels whose mask has the given value; both images of one size.
  void add(geometry::ImageView<const geometry::Rgb> image, geometry::ImageView<const std::uint8_t> mask,
           std::uint8_t value);
  void add_to_bin(std::size_t bin, double weight) { counts_[bin] += weight; }
  double total() const;
  const std::vector<double>& counts() const { return counts_; }

  static std::size_t bin(const geometry::Rgb& color) {
    return (static_cast<std::size_t>(color[0] >> 4) * kColorBins + static_cast<std::size_t>(color[1] >> 4)) *
               kColorBins +
           static_cast<std::size_t>(color[2] >> 4);
  }

 private:
  std::vector<double> counts_ = std::vector<double>(kColorBins * kColorBins * kColorBins, 0.0);
};

struct ColorModelOptions {
  /// bins. Standard deviation of the Gaussian that both histograms are smoothed by. Range 0 to 8. Chosen.
  double smoothing_bins = 1.0;
  /// share. Of both distributions, this share is spread over all bins: a colour seen in neither says nothing. Range 0
  /// to 1. Chosen.
  double uniform_share = 0.02;
  /// factor. Ratios are clipped to [1 / this, this]. Range 1 to 10000. Chosen.
  double max_ratio = 20.0;
};

/// log p(c | object) - log p(c | not object) for each bin.
struct ColorModel {
  std::vector<float> log_ratio = std::vector<float>(kColorBins * kColorBins * kColorBins, 0.0f);

  float operator()(const geometry::Rgb& color) const { return log_ratio[ColorHistogram::bin(color)]; }
  friend bool operator==(const ColorModel&, const ColorModel&) = default;
};

/// From what the object's pixels and all others look like; an empty histogram counts as uniform.
ColorModel make_color_model(const ColorHistogram& object, const ColorHistogram& rest, const ColorModelOptions& options);

}  // namespace prescene::rendering
