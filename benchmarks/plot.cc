// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string_view>

#include "prescene/core/check.h"

namespace prescene::benchmarks {
namespace {

constexpr double kWidth = 620.0, kHeight = 360.0;  // of the chart itself
constexpr double kLeft = 70.0, kTop = 40.0, kLegend = 300.0;
constexpr double kBottom = 130.0;  // room for labels at a slant

// Colours that people with any kind of colour vision can tell apart (after Okabe and Ito, without the yellow).
constexpr std::array<std::string_view, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                      "#56b4e9", "#e69f00", "#000000"};

std::string number(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string text_at(double x, double y, std::string_view words, std::string_view more = "") {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + std::string(more) + ">" + escaped(words) +
         "</text>\n";
}

std::string line_between(double x0, double y0, double x1, double y1, std::string_view style) {
  return "<line x1=\"" + number(x0) + "\" y1=\"" + number(y0) + "\" x2=\"" + number(x1) + "\" y2=\"" + number(y1) +
         "\" " + std::string(style) + "/>\n";
}

/// Whole decades around all values.
struct Scale {
  int low = std::numeric_limits<int>::max();
  int high = std::numeric_limits<int>::min();

  explicit Scale(const std::vector<Series>& all) {
    for (const Series& series : all) {
      for (const double value : series.values) {
        if (std::isnan(value)) continue;
        PRESCENE_CHECK_MSG(value > 0.0, series.name);
        low = std::min(low, static_cast<int>(std::floor(std::log10(value))));
        high = std::max(high, static_cast<int>(std::ceil(std::log10(value))));
      }
    }
    if (low == high) ++high;
  }
  bool empty() const { return low > high; }
  double y(double value) const { return kTop + kHeight * (high - std::log10(value)) / (high - low); }
};

std::string lines_of(const Series& series, const Scale& scale, std::string_view colour, double step) {
  const std::string dashes = series.dashed ? "\" stroke-dasharray=\"6 4" : "";
  std::string svg, points;
  const auto finish = [&] {
    if (!points.empty())
      svg += "<polyline fill=\"none\" stroke-width=\"2\" stroke=\"" + std::string(colour) + dashes + "\" points=\"" +
             points + "\"/>\n";
    points.clear();
  };
  for (std::size_t i = 0; i < series.values.size(); ++i) {
    if (std::isnan(series.values[i])) {
      finish();
      continue;
    }
    const std::string x = number(kLeft + step * (static_cast<double>(i) + 0.5)), y = number(scale.y(series.values[i]));
    points.append(points.empty() ? "" : " ").append(x).append(",").append(y);
    svg += "<circle r=\"3\" cx=\"" + x + "\" cy=\"" + y + "\" fill=\"" + std::string(colour) + "\"/>\n";
  }
  finish();
  return svg;
}

}  // namespace

std::string svg_of(const Plot& plot) {
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(kLeft + kWidth + kLegend) + "\" height=\"" +
      number(kTop + kHeight + kBottom) + "\" font-family=\"sans-serif\" font-size=\"12\">\n" +
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" + text_at(kLeft, 22.0, plot.title, "font-size=\"15\"");
  const Scale scale(plot.series);
  if (scale.empty()) return svg + text_at(kLeft, kTop + 40.0, "nothing was measured") + "</svg>\n";

  for (int decade = scale.low; decade <= scale.high; ++decade) {
    const double y = scale.y(std::pow(10.0, decade));
    svg += line_between(kLeft, y, kLeft + kWidth, y, "stroke=\"#bbbbbb\"");
    svg += text_at(kLeft - 6.0, y + 4.0, number(std::pow(10.0, decade)), "text-anchor=\"end\"");
  }
  const double step = kWidth / static_cast<double>(std::max<std::size_t>(1, plot.x_labels.size()));
  for (std::size_t i = 0; i < plot.x_labels.size(); ++i) {
    const double x = kLeft + step * (static_cast<double>(i) + 0.5), y = kTop + kHeight + 16.0;
    svg += text_at(x, y, plot.x_labels[i],
                   "text-anchor=\"end\" transform=\"rotate(-30 " + number(x) + " " + number(y) + ")\"");
  }
  svg += text_at(16.0, kTop + kHeight / 2.0, plot.y_label,
                 "text-anchor=\"middle\" transform=\"rotate(-90 16 " + number(kTop + kHeight / 2.0) + ")\"");
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    PRESCENE_CHECK_MSG(plot.series[i].values.size() == plot.x_labels.size(), plot.series[i].name);
    const std::string_view colour = kColours[i % kColours.size()];
    svg += lines_of(plot.series[i], scale, colour, step);
    const double x = kLeft + kWidth + 12.0, y = kTop + 18.0 * (static_cast<double>(i) + 0.5);
    svg += line_between(x, y, x + 26.0, y,
                        "stroke-width=\"2\" stroke=\"" + std::string(colour) +
                            (plot.series[i].dashed ? "\" stroke-dasharray=\"6 4\"" : "\""));
    svg += text_at(x + 32.0, y + 4.0, plot.series[i].name);
  }
  return svg + "</svg>\n";
}

}  // namespace prescene::benchmarks
