// SPDX-License-Identifier: Apache-2.0
#include "heat_map_legend.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "heat_map_layout.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/service/pictures/scene_view.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using Eigen::Vector2d;
using geometry::ColorImage;
using interfaces::TextAlign;

constexpr std::size_t kMostBars = 8, kMostLines = 6;
constexpr int kBarApart = 23, kLineApart = 17, kFirst = 30, kLeast = 196;
constexpr const char* kOtherwise = "otherwise";
constexpr double kName = 11.0, kNote = 9.0;  // letters' height

/// Items one after the other, in lines no wider than `width`; those beyond the last line are counted.
std::vector<std::string> lines_of(const std::vector<std::string>& items, double width) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!lines.empty() && interfaces::text_width(lines.back() + ", " + items[i], kNote) <= width) {
      lines.back() += ", " + items[i];
      continue;
    }
    if (lines.size() == kMostLines) {
      lines.back() = "and " + std::to_string(items.size() - i + 1) + " more, in the printed answer";
      break;
    }
    lines.push_back(items[i]);
  }
  return lines;
}

}  // namespace

std::string percent_text(double share) {
  const double p = 100.0 * share;
  if (p <= 0.0) return "0 %";
  if (p < 0.1) return "<0.1 %";
  if (p < 100.0 && p > 99.9) return ">99.9 %";
  return fixed_text(p, p < 10.0 || (p > 99.0 && p < 100.0) ? 1 : 0) + " %";
}

HeatMapLegend::HeatMapLegend(const belief::Scene& scene, const belief::PredictAnswer& answer, const HeatMapPart& part)
    : part_(part), bars_(std::min(kMostBars, part.endings.size())) {
  std::vector<std::string> items;
  const auto add = [&](const belief::OutcomeProbability& outcome) {
    items.push_back((outcome.group.empty() ? "" : outcome.group + " ") + outcome.name + " " +
                    percent_text(outcome.probability));
  };
  for (std::size_t i = bars_; i < part.endings.size(); ++i) add(*part.endings[i].probability);
  for (const belief::OutcomeProbability* outcome : part.further) add(*outcome);
  if (!items.empty()) items.front() = "Also: " + items.front();
  lines_ = lines_of(items, kPanelWidth - 10.0);
  notes_ = {
      "Each instance counts as a Gaussian 0.6 s n^(-1/6) wide within its outcome and resting face "
      "(s their spread, n their number).",
      std::string("Outlines: the instance nearest to the middle of each outcome, with its way. ") +
          (scene.robot.empty() ? "" : "Robot not shown. ") + std::to_string(answer.instances) +
          (answer.instances == 1 ? " instance." : " instances.")};
  if (scene.objects.size() > 1 && part.likeliest_run())
    notes_.emplace_back("Grey, seen through: the other objects where the likeliest of these instances leaves them.");
}

int HeatMapLegend::height() const {
  const int outcomes = kFirst + kBarApart * (static_cast<int>(bars_) + (part_.is_open() ? 1 : 0)) +
                       kLineApart * static_cast<int>(lines_.size()) + 36;
  const int notes = kFirst + 88 + 20 * static_cast<int>(notes_.size()) + 20;
  return std::max({kLeast, outcomes, notes});
}

void HeatMapLegend::draw(const GroundDensity& density, int top, ColorImage& canvas) const {
  draw_scale(density, kLeftAxis + kMargin, top + kFirst, canvas);
  draw_outcomes(kLeftAxis + kPanelWidth + 2.0 * kMargin + 10.0, top + kFirst, canvas);
}

/// The colour bar: what a square of the heat map's cell holds.
void HeatMapLegend::draw_scale(const GroundDensity& density, int x, int y, ColorImage& canvas) const {
  constexpr int kWidth = 440;
  const std::string side = core::rounded_text(100.0 * part_.poses->heat_map.cell);
  interfaces::draw_text("Probability that the centre of " + part_.poses->object + " comes to rest in the square of " +
                            side + " x " + side + " cm around a place",
                        {1.0 * x, 1.0 * y}, kName, kInk, canvas);
  for (int i = 0; i < kWidth; ++i) {
    const double value = i / (kWidth - 1.0);
    interfaces::fill_rectangle(x + i, y + 14, x + i + 1, y + 34, {200, 202, 205}, 1.0, canvas);
    interfaces::fill_rectangle(x + i, y + 14, x + i + 1, y + 34, warm_color(value), warm_opacity(value), canvas);
  }
  for (int i = 0; i <= 4; ++i) {
    const double value = i / 4.0;  // the square root of the share of the largest, as the colours
    const double mass = value * value * density.largest_mass();
    const int decimals = mass < 0.001 ? 3 : mass < 0.01 ? 2 : 1;
    interfaces::draw_text(i == 0 ? "0" : fixed_text(100.0 * mass, decimals) + " %",
                          {x + value * (kWidth - 1), y + 52.0}, 10.5, kSoft, canvas, TextAlign::kCenter);
  }
  const double line_y = y + 78.0;
  for (const bool half : {true, false}) {
    const double left = x + (half ? 0.0 : 230.0);
    const std::array<Vector2d, 2> sample{Vector2d(left, line_y - 4.0), Vector2d(left + 34.0, line_y - 4.0)};
    interfaces::draw_line(sample, half ? 2.2 : 1.1, {70, 20, 20}, 1.0, canvas);
    interfaces::draw_text(half ? "half of all ends inside" : "90 % of all ends inside", {left + 44.0, line_y}, 11.0,
                          kInk, canvas);
  }
  for (std::size_t i = 0; i < notes_.size(); ++i)
    interfaces::draw_text(notes_[i], {1.0 * x, y + 108.0 + 20.0 * static_cast<double>(i)}, kNote, kSoft, canvas);
}

/// The outcomes, with their intervals.
void HeatMapLegend::draw_outcomes(double x, double y, ColorImage& canvas) const {
  interfaces::draw_text(part_.endings.empty() ? "The scene names no outcomes for it"
                                              : "How it ends" + (part_.group.empty() ? "" : " (" + part_.group + ")"),
                        {x, y}, kName, kInk, canvas);
  double name_width = part_.is_open() ? interfaces::text_width(kOtherwise, kName) : 0.0;
  for (const HeatMapPart::Ending& ending : part_.endings)
    name_width = std::max(name_width, interfaces::text_width(ending.name, kName));
  const double bar = x + 34.0 + name_width, bar_end = x + kPanelWidth - 190.0;
  const auto at = [&](double value) { return bar + value * (bar_end - bar); };
  const auto fill = [&](double from, double to, const geometry::Rgb& color, double opacity) {
    interfaces::fill_rectangle(static_cast<int>(from), static_cast<int>(y) - 11, static_cast<int>(to),
                               static_cast<int>(y) + 1, color, opacity, canvas);
  };
  const auto row = [&](const std::string& name, double probability, double low, double high,
                       const geometry::Rgb& color) {
    y += kBarApart;
    fill(x, x + 14.0, color, 1.0);
    interfaces::draw_text(name, {x + 24.0, y}, kName, kInk, canvas);
    fill(bar, bar_end, {232, 234, 238}, 1.0);
    fill(bar, at(probability), color, 0.85);
    const std::array<Vector2d, 2> whisker{Vector2d(at(low), y - 5.0), Vector2d(at(high), y - 5.0)};
    interfaces::draw_line(whisker, 2.0, kInk, 1.0, canvas);
    interfaces::draw_text(percent_text(probability), {bar_end + 14.0, y}, kName, kInk, canvas);
    interfaces::draw_text("(" + fixed_text(100.0 * low, 1) + " to " + fixed_text(100.0 * high, 1) + ")",
                          {bar_end + 78.0, y}, kNote, kSoft, canvas);
  };
  for (std::size_t i = 0; i < bars_; ++i) {
    const belief::OutcomeProbability& p = *part_.endings[i].probability;
    row(part_.endings[i].name, p.probability, p.low, p.high, part_.endings[i].color);
    if (part_.is_open()) row(kOtherwise, 1.0 - p.probability, 1.0 - p.high, 1.0 - p.low, kSoft);
  }
  y += 8.0;
  for (const std::string& line : lines_) {
    y += kLineApart;
    interfaces::draw_text(line, {x, y}, kNote, kSoft, canvas);
  }
}

}  // namespace prescene::service
