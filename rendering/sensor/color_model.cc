// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/color_model.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/rendering/portable_math.h"

namespace prescene::rendering {
namespace {

using Row = std::array<double, kColorBins>;

/// Spreads each bin's count by a Gaussian cut at the histogram's ends and made to sum to one, so that no count is lost.
std::vector<Row> spreading_rows(double sigma_bins) {
  std::vector<Row> rows(kColorBins, Row{});
  for (int from = 0; from < kColorBins; ++from) {
    Row& row = rows[static_cast<std::size_t>(from)];
    double sum = 0.0;
    for (int to = 0; to < kColorBins; ++to) {
      const double distance = sigma_bins > 0.0 ? (to - from) / sigma_bins : (to == from ? 0.0 : 1e3);
      sum += row[static_cast<std::size_t>(to)] = portable_exp(-0.5 * distance * distance);
    }
    for (double& weight : row) weight /= sum;
  }
  return rows;
}

std::vector<double> smoothed(const std::vector<double>& counts, const std::vector<Row>& rows) {
  std::vector<double> values = counts;
  const std::size_t bins = kColorBins;
  for (const std::size_t stride : {std::size_t{1}, bins, bins * bins}) {
    std::vector<double> next(values.size(), 0.0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] == 0.0) continue;
      const std::size_t position = i / stride % bins;
      const std::size_t first = i - position * stride;
      for (std::size_t to = 0; to < bins; ++to) next[first + to * stride] += values[i] * rows[position][to];
    }
    values.swap(next);
  }
  return values;
}

/// Probabilities of the bins.
std::vector<double> distribution(const ColorHistogram& histogram, const std::vector<Row>& rows, double uniform_share) {
  std::vector<double> values = smoothed(histogram.counts(), rows);
  const double total = histogram.total();
  const double even = 1.0 / static_cast<double>(values.size());
  for (double& value : values)
    value = total > 0.0 ? (1.0 - uniform_share) * value / total + uniform_share * even : even;
  return values;
}

}  // namespace

void ColorHistogram::add(geometry::ImageView<const geometry::Rgb> image, geometry::ImageView<const std::uint8_t> mask,
                         std::uint8_t value) {
  PRESCENE_CHECK(image.width() == mask.width() && image.height() == mask.height());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      if (mask(x, y) == value) add(image(x, y));
}

double ColorHistogram::total() const {
  double sum = 0.0;
  for (const double count : counts_) sum += count;
  return sum;
}

ColorModel make_color_model(const ColorHistogram& object, const ColorHistogram& rest,
                            const ColorModelOptions& options) {
  const std::vector<Row> rows = spreading_rows(options.smoothing_bins);
  const std::vector<double> p_object = distribution(object, rows, options.uniform_share);
  const std::vector<double> p_rest = distribution(rest, rows, options.uniform_share);
  const double limit = portable_log(options.max_ratio);
  ColorModel model;
  for (std::size_t i = 0; i < p_object.size(); ++i)
    model.log_ratio[i] = static_cast<float>(std::clamp(portable_log(p_object[i] / p_rest[i]), -limit, limit));
  return model;
}

}  // namespace prescene::rendering
