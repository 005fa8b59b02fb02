// SPDX-License-Identifier: Apache-2.0
#include "charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "html_text.h"
#include "prescene/interfaces/reports/overlay.h"

namespace prescene::interfaces {
namespace {

std::string number(double value) { return decimal(value, 2); }

std::string svg_begin(double width, double height, const std::string& label) {
  return "<svg viewBox=\"0 0 " + number(width) + " " + number(height) + "\" width=\"" + number(width) + "\" height=\"" +
         number(height) + "\" role=\"img\" aria-label=\"" + escaped(label) +
         "\" xmlns=\"http://www.w3.org/2000/svg\">\n";
}
std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
         "\" class=\"" + style + "\"/>\n";
}
std::string text_at(double x, double y, const std::string& text, const std::string& style) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" class=\"" + style + "\">" + escaped(text) + "</text>\n";
}
std::string rectangle(double x, double y, double width, double height, const std::string& fill,
                      const std::string& title) {
  return "<rect x=\"" + number(x) + "\" y=\"" + number(y) + "\" width=\"" + number(width) + "\" height=\"" +
         number(height) + "\" rx=\"2\" fill=\"" + fill + "\">" +
         (title.empty() ? "" : "<title>" + escaped(title) + "</title>") + "</rect>\n";
}

/// Decimals that tell neighbouring ticks apart.
int tick_decimals(const std::vector<double>& ticks) {
  if (ticks.size() < 2) return 2;
  return std::clamp(static_cast<int>(std::ceil(-std::log10(ticks[1] - ticks[0]) - 1e-9)), 0, 9);
}

/// A linear map from values to the page.
struct Axis {
  double low, high;  // values
  double from, to;   // page
  double operator()(double value) const { return from + (value - low) / (high - low) * (to - from); }
};

/// Never empty, so that an axis can be drawn.
std::pair<double, double> widened(double low, double high) {
  if (!(low <= high)) return {0.0, 1.0};
  if (high - low > 1e-12 * std::max(std::abs(low), std::abs(high))) return {low, high};
  const double room = std::max(0.5 * std::abs(low), 1e-9);
  return {low - room, high + room};
}

std::string x_axis(const Axis& x, double top, double bottom, const std::string& label) {
  std::string out;
  const std::vector<double> ticks = round_ticks(x.low, x.high, 8);
  for (double tick : ticks) {
    out += line(x(tick), top, x(tick), bottom, "grid");
    out += text_at(x(tick), bottom + 16.0, decimal(tick, tick_decimals(ticks)), "tick middle");
  }
  return out + text_at(0.5 * (x.from + x.to), bottom + 34.0, label, "label middle");
}

std::string y_axis(const Axis& y, double left, double right, const std::string& label) {
  std::string out;
  const std::vector<double> ticks = round_ticks(y.low, y.high, 5);
  for (double tick : ticks) {
    out += line(left, y(tick), right, y(tick), "grid");
    out += text_at(left - 8.0, y(tick) + 4.0, decimal(tick, tick_decimals(ticks)), "tick end");
  }
  const double middle = 0.5 * (y.from + y.to);
  return out + "<text transform=\"translate(14 " + number(middle) + ") rotate(-90)\" class=\"label middle\">" +
         escaped(label) + "</text>\n";
}

std::string curve_path(const ChartBlock::Curve& curve, const Axis& x, const Axis& y) {
  std::string path;
  bool pen_down = false;
  for (const auto& [px, py] : curve.points) {
    if (!std::isfinite(px) || !std::isfinite(py)) {
      pen_down = false;
      continue;
    }
    path += (pen_down ? "L" : "M") + number(x(px)) + " " + number(y(py)) + " ";
    pen_down = true;
  }
  return path;
}

/// The area between the lows and highs of a curve.
std::string band_path(const ChartBlock::Curve& curve, const Axis& x, const Axis& y, const std::string& color) {
  const std::size_t count = std::min(curve.band.size(), curve.points.size());
  if (count < 2) return "";
  std::string path;
  for (std::size_t i = 0; i < count; ++i)
    path += (i == 0 ? "M" : "L") + number(x(curve.points[i].first)) + " " + number(y(curve.band[i].second)) + " ";
  for (std::size_t i = count; i-- > 0;)
    path += "L" + number(x(curve.points[i].first)) + " " + number(y(curve.band[i].first)) + " ";
  return "<path d=\"" + path + "Z\" fill=\"" + color + "\" fill-opacity=\"0.16\" stroke=\"none\"/>\n";
}

constexpr std::size_t kMostLanes = 40;

/// "carton inside bin", "carton falls".
std::string lane_name(belief::Relation relation, const std::string& subject, const std::string& other) {
  switch (relation) {
    case belief::Relation::kContact:
      return subject + " touches " + other;
    case belief::Relation::kMoving:
      return subject + " moves";
    case belief::Relation::kFalling:
      return subject + " falls";
    default:
      return subject + " " + belief::to_string(relation) + (other.empty() ? "" : " " + other);
  }
}

/// At most `most` characters (of one byte), the last of them dots.
std::string shortened(const std::string& text, std::size_t most) {
  return text.size() <= most ? text : text.substr(0, most - 3) + "...";
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low) || count < 1) return ticks;
  const double rough = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) {
      step = factor * power;
      break;
    }
  }
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step && ticks.size() < 100; i += 1.0)
    ticks.push_back(i * step);
  return ticks;
}

std::string probability_bar(const belief::OutcomeProbability& outcome) {
  constexpr double kWidth = 260.0, kHeight = 22.0, kMiddle = 0.5 * kHeight;
  const auto x = [](double p) { return std::isfinite(p) ? 2.0 + (kWidth - 4.0) * std::clamp(p, 0.0, 1.0) : 2.0; };
  std::string out = svg_begin(kWidth, kHeight, outcome.name + " " + percent(outcome.probability));
  out += "<rect x=\"2\" y=\"3\" width=\"" + number(kWidth - 4.0) + "\" height=\"16\" rx=\"3\" class=\"track\"/>\n";
  out += "<rect x=\"2\" y=\"3\" width=\"" + number(x(outcome.probability) - 2.0) +
         "\" height=\"16\" rx=\"3\" class=\"bar\"/>\n";
  out += line(x(outcome.low), kMiddle, x(outcome.high), kMiddle, "whisker");
  out += line(x(outcome.low), kMiddle - 5.0, x(outcome.low), kMiddle + 5.0, "whisker");
  out += line(x(outcome.high), kMiddle - 5.0, x(outcome.high), kMiddle + 5.0, "whisker");
  return out + "</svg>";
}

std::string chart_svg(const ChartBlock& chart) {
  constexpr double kWidth = 860.0, kHeight = 300.0, kLeft = 74.0, kRight = 20.0, kTop = 34.0, kBottom = 48.0;
  double x_low = 1e300, x_high = -1e300, y_low = 1e300, y_high = -1e300;
  for (const ChartBlock::Curve& curve : chart.curves) {
    for (const auto& [low, high] : curve.band) {
      if (std::isfinite(low)) y_low = std::min(y_low, low);
      if (std::isfinite(high)) y_high = std::max(y_high, high);
    }
    for (const auto& [px, py] : curve.points) {
      if (!std::isfinite(px) || !std::isfinite(py)) continue;
      x_low = std::min(x_low, px);
      x_high = std::max(x_high, px);
      y_low = std::min(y_low, py);
      y_high = std::max(y_high, py);
    }
  }
  if (chart.from_zero && y_low <= y_high) {
    y_low = std::min(y_low, 0.0);
    y_high = std::max(y_high, 0.0);
  }
  std::tie(x_low, x_high) = widened(x_low, x_high);
  std::tie(y_low, y_high) = widened(y_low, y_high);
  const Axis x{x_low, x_high, kLeft, kWidth - kRight};
  const Axis y{y_low, y_high + 0.05 * (y_high - y_low), kHeight - kBottom, kTop};

  std::string out = svg_begin(kWidth, kHeight, chart.caption);
  out += x_axis(x, kTop, kHeight - kBottom, chart.x_label) + y_axis(y, kLeft, kWidth - kRight, chart.y_label);
  double legend = kLeft;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const std::string color = hex(series_color(i));
    out += band_path(chart.curves[i], x, y, color);
    out += "<path d=\"" + curve_path(chart.curves[i], x, y) + "\" fill=\"none\" stroke=\"" + color +
           "\" stroke-width=\"2\" stroke-linejoin=\"round\"/>\n";
    out += rectangle(legend, 9.0, 14.0, 10.0, color, chart.curves[i].name);
    out += text_at(legend + 20.0, 18.0, chart.curves[i].name, "tick");
    legend += 44.0 + 7.2 * static_cast<double>(chart.curves[i].name.size());
  }
  return out + "</svg>";
}

std::string tornado_svg(const TornadoBlock& block) {
  constexpr double kWidth = 860.0, kLane = 30.0, kLeft = 250.0, kRight = 150.0, kTop = 24.0;
  const double bottom = kTop + kLane * static_cast<double>(block.rows.size());
  double low = block.overall, high = block.overall;
  for (const TornadoBlock::Row& row : block.rows) {
    low = std::min({low, row.small, row.large});
    high = std::max({high, row.small, row.large});
  }
  std::tie(low, high) = widened(std::max(0.0, low - 0.03), std::min(1.0, high + 0.03));
  const Axis x{low, high, kLeft, kWidth - kRight};
  std::string out = svg_begin(kWidth, bottom + 44.0, block.caption);
  out += x_axis(x, kTop, bottom, "probability where the input is in its lowest and in its highest fifth");
  out += text_at(kWidth - kRight + 14.0, kTop - 8.0, "decides alone", "tick");
  for (std::size_t i = 0; i < block.rows.size(); ++i) {
    const TornadoBlock::Row& row = block.rows[i];
    const double top = kTop + kLane * static_cast<double>(i), middle = top + 0.5 * kLane;
    const auto value = [](double p) { return std::isfinite(p) ? std::clamp(p, 0.0, 1.0) : 0.0; };
    const double small = x(value(row.small)), large = x(value(row.large)), base = x(value(block.overall));
    out += text_at(kLeft - 10.0, middle + 4.0, shortened(row.input, 38), "lane end");
    out += rectangle(std::min(small, base), top + 6.0, std::abs(small - base), kLane - 12.0, hex(series_color(1)),
                     "lowest fifth: " + percent(row.small));
    out += rectangle(std::min(large, base), top + 6.0, std::abs(large - base), kLane - 12.0, hex(series_color(0)),
                     "highest fifth: " + percent(row.large));
    out += text_at(kWidth - kRight + 14.0, middle + 4.0,
                   percent(row.share) + " \u00b1 " + decimal(std::max(0.1, 100.0 * row.standard_error), 1), "tick");
  }
  out += line(x(block.overall), kTop, x(block.overall), bottom, "whisker");
  out += rectangle(kLeft, 4.0, 12.0, 10.0, hex(series_color(1)), "");
  out += text_at(kLeft + 18.0, 13.0, "input small", "tick");
  out += rectangle(kLeft + 110.0, 4.0, 12.0, 10.0, hex(series_color(0)), "");
  out += text_at(kLeft + 128.0, 13.0, "input large", "tick");
  return out + "</svg>";
}

std::string timeline_svg(const TimelineBlock& block) {
  // A lane for each relation between the same two things, in the order of their first interval.
  using LaneKey = std::tuple<belief::Relation, std::string, std::string>;
  std::vector<std::pair<LaneKey, std::vector<const belief::Interval*>>> lanes;
  std::map<LaneKey, std::size_t> index;
  double begin = block.begin, end = block.end;
  const bool fit = !(end > begin);
  if (fit) begin = 1e300, end = -1e300;
  std::size_t left_out = 0;
  for (const belief::Interval& interval : block.timeline) {
    if (fit) {
      begin = std::min(begin, interval.begin);
      end = std::max(end, interval.end);
    }
    const LaneKey key{interval.relation, interval.subject, interval.other};
    const auto [found, added] = index.try_emplace(key, lanes.size());
    if (added && lanes.size() == kMostLanes) {
      index.erase(found);
      ++left_out;
      continue;
    }
    if (added) lanes.push_back({key, {}});
    lanes[found->second].second.push_back(&interval);
  }
  std::tie(begin, end) = widened(begin, end);

  constexpr double kWidth = 860.0, kLane = 24.0, kLeft = 250.0, kRight = 20.0, kTop = 8.0;
  const double bottom = kTop + kLane * static_cast<double>(lanes.size());
  const Axis x{begin, end, kLeft, kWidth - kRight};
  std::string out = svg_begin(kWidth, bottom + 44.0 + (left_out > 0 ? 18.0 : 0.0), block.caption);
  out += x_axis(x, kTop, bottom, "time, s");
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const auto& [key, intervals] = lanes[i];
    const auto& [relation, subject, other] = key;
    const std::string name = lane_name(relation, subject, other);
    const double top = kTop + kLane * static_cast<double>(i);
    out += text_at(kLeft - 10.0, top + 16.0, shortened(name, 38), "lane end");
    out += line(kLeft, top + kLane, kWidth - kRight, top + kLane, "grid");
    for (const belief::Interval* interval : intervals) {
      const double from = x(std::clamp(interval->begin, begin, end)), to = x(std::clamp(interval->end, begin, end));
      out += rectangle(from, top + 5.0, std::max(2.0, to - from), 14.0,
                       hex(series_color(static_cast<std::size_t>(relation))),
                       name + ", " + decimal(interval->begin, 3) + " to " + decimal(interval->end, 3) + " s");
    }
  }
  if (left_out > 0)
    out += text_at(kLeft, bottom + 56.0, std::to_string(left_out) + " more intervals are not shown", "tick");
  return out + "</svg>";
}

std::string state_band_svg(const StateBandBlock& block) {
  // From good to bad: green, yellow, blue, red; states beyond go on with the series.
  constexpr std::array<std::size_t, 4> kStateColors = {2, 5, 1, 3};
  const auto color = [&](std::size_t state) {
    return hex(series_color(state < kStateColors.size() ? kStateColors[state] : state));
  };
  double begin = 1e300, end = -1e300;
  for (const StateBandBlock::Lane& lane : block.lanes)
    for (const StateBandBlock::Segment& segment : lane.segments) {
      begin = std::min(begin, segment.begin);
      end = std::max(end, segment.end);
    }
  std::tie(begin, end) = widened(begin, end);
  const std::size_t count = std::min(block.lanes.size(), kMostLanes);
  constexpr double kWidth = 860.0, kLane = 24.0, kLeft = 150.0, kRight = 20.0, kTop = 28.0;
  const double bottom = kTop + kLane * static_cast<double>(count);
  const Axis x{begin, end, kLeft, kWidth - kRight};
  std::string out = svg_begin(kWidth, bottom + 44.0 + (count < block.lanes.size() ? 18.0 : 0.0), block.caption);
  for (std::size_t i = 0; i < block.states.size(); ++i) {
    const double left = kLeft + 110.0 * static_cast<double>(i);
    out += rectangle(left, 6.0, 12.0, 10.0, color(i), "");
    out += text_at(left + 18.0, 15.0, block.states[i], "tick");
  }
  out += x_axis(x, kTop, bottom, "time, s");
  for (std::size_t i = 0; i < count; ++i) {
    const double top = kTop + kLane * static_cast<double>(i);
    out += text_at(kLeft - 10.0, top + 16.0, shortened(block.lanes[i].name, 22), "lane end");
    for (const StateBandBlock::Segment& segment : block.lanes[i].segments) {
      const auto state = std::find(block.states.begin(), block.states.end(), segment.state);
      if (state == block.states.end()) continue;
      out += rectangle(x(segment.begin), top + 4.0, std::max(1.0, x(segment.end) - x(segment.begin)), 16.0,
                       color(static_cast<std::size_t>(state - block.states.begin())),
                       block.lanes[i].name + ": " + segment.state + ", " + decimal(segment.begin, 2) + " to " +
                           decimal(segment.end, 2) + " s");
    }
  }
  if (count < block.lanes.size())
    out += text_at(kLeft, bottom + 56.0, std::to_string(block.lanes.size() - count) + " more are not shown", "tick");
  return out + "</svg>";
}

std::string heat_map_svg(const HeatMapBlock& block) {
  const belief::HeatMap& map = block.map;
  if (map.nx < 1 || map.ny < 1) return "";
  double x_low = map.x0, x_high = map.x0 + map.nx * map.cell, y_low = map.y0, y_high = map.y0 + map.ny * map.cell;
  // Some room around, so that outlines near by are seen as what they are.
  const double room = 0.08 * std::max(x_high - x_low, y_high - y_low);
  x_low -= room, x_high += room, y_low -= room, y_high += room;
  constexpr double kLeft = 74.0, kTop = 12.0, kBottom = 48.0, kRight = 96.0, kSide = 560.0;
  const double scale = std::min(kSide / (x_high - x_low), 0.9 * kSide / (y_high - y_low));
  const double width = kLeft + scale * (x_high - x_low) + kRight, height = kTop + scale * (y_high - y_low) + kBottom;
  const Axis x{x_low, x_high, kLeft, width - kRight};
  const Axis y{y_low, y_high, height - kBottom, kTop};

  std::string out = svg_begin(width, height, block.caption);
  // A drawing inside the drawing clips what lies outside of it.
  const std::string frame =
      number(kLeft) + " " + number(kTop) + " " + number(width - kRight - kLeft) + " " + number(height - kBottom - kTop);
  out += "<svg x=\"" + number(kLeft) + "\" y=\"" + number(kTop) + "\" width=\"" + number(width - kRight - kLeft) +
         "\" height=\"" + number(height - kBottom - kTop) + "\" viewBox=\"" + frame + "\">\n";
  out += rectangle(kLeft, kTop, width - kRight - kLeft, height - kBottom - kTop, hex(heat_color(0.0)), "");
  out += "<image x=\"" + number(x(map.x0)) + "\" y=\"" + number(y(map.y0 + map.ny * map.cell)) + "\" width=\"" +
         number(scale * map.nx * map.cell) + "\" height=\"" + number(scale * map.ny * map.cell) +
         "\" preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" href=\"" +
         png_data_uri(heat_map_picture(map)) + "\"/>\n";
  for (const HeatMapBlock::Outline& outline : block.outlines) {
    std::string points;
    for (const Eigen::Vector2d& p : outline.corners) points += number(x(p.x())) + "," + number(y(p.y())) + " ";
    out +=
        "<polygon points=\"" + points + "\" class=\"outline\"><title>" + escaped(outline.name) + "</title></polygon>\n";
  }
  out += "</svg>\n";
  const std::vector<double> x_ticks = round_ticks(x_low, x_high, 6), y_ticks = round_ticks(y_low, y_high, 6);
  for (double tick : x_ticks)
    out += text_at(x(tick), height - kBottom + 16.0, decimal(tick, tick_decimals(x_ticks)), "tick middle");
  for (double tick : y_ticks)
    out += text_at(kLeft - 8.0, y(tick) + 4.0, decimal(tick, tick_decimals(y_ticks)), "tick end");
  out += text_at(0.5 * (kLeft + width - kRight), height - 12.0, "x, m", "label middle");
  out += "<text transform=\"translate(14 " + number(0.5 * (kTop + height - kBottom)) +
         ") rotate(-90)\" class=\"label middle\">y, m</text>\n";

  // The scale: masses per cell at a few levels of the square-root colours.
  const double largest = map.mass.empty() ? 0.0 : *std::max_element(map.mass.begin(), map.mass.end());
  for (int i = 0; i <= 8; ++i) {
    const double level = 1.0 - i / 8.0;
    out += rectangle(width - kRight + 14.0, kTop + 20.0 * i, 16.0, 20.0, hex(heat_color(level)), "");
    out += text_at(width - kRight + 36.0, kTop + 20.0 * i + 14.0,
                   significant(100.0 * level * level * largest, 2) + " %", "tick");
  }
  return out + "</svg>";
}

}  // namespace prescene::interfaces
