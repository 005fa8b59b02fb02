// SPDX-License-Identifier: Apache-2.0
// Answers to "how must it be done" as a picture and as sections of a report.
#include "achieve_sections.h"

#include <algorithm>
#include <utility>

#include "html_text.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/reports/action_map_picture.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/interfaces/reports/overlay.h"

namespace prescene::interfaces {
namespace {

constexpr geometry::Rgb kInk{30, 30, 30}, kPaper{255, 255, 255}, kImpossible{205, 205, 205};

const belief::SearchedParameter* parameter_named(const belief::AchieveAnswer& answer, const std::string& name) {
  const auto found = std::find_if(answer.parameters.begin(), answer.parameters.end(),
                                  [&](const belief::SearchedParameter& one) { return one.name == name; });
  return found == answer.parameters.end() ? nullptr : &*found;
}

/// Where a choice's value of a parameter lies in its range, in [0, 1]; below 0: the choice has none.
double place_of(const belief::AchieveAnswer& answer, const std::vector<double>& values, const std::string& name) {
  for (std::size_t i = 0; i < answer.parameters.size() && i < values.size(); ++i) {
    const belief::SearchedParameter& parameter = answer.parameters[i];
    if (parameter.name == name) return (values[i] - parameter.low) / (parameter.high - parameter.low);
  }
  return -1.0;
}

std::string values_text(const belief::AchieveAnswer& answer, const belief::ActionChoice& choice) {
  std::string text;
  for (std::size_t i = 0; i < choice.values.size() && i < answer.parameters.size(); ++i) {
    text += (i > 0 ? ", " : "") + answer.parameters[i].name + " " + significant(choice.values[i], 3);
    if (!choice.low.empty())
      text += " (" + significant(choice.low[i], 3) + " to " + significant(choice.high[i], 3) + ")";
  }
  return text;
}

}  // namespace

geometry::ColorImage action_map_picture(const belief::AchieveAnswer& answer) {
  if (!answer.map) return {};
  const belief::ActionMap& map = *answer.map;
  constexpr int kCell = 26, kLeft = 96, kTop = 44, kBottom = 64, kRight = 110;
  const int width = kCell * map.nx, height = kCell * map.ny;
  geometry::ColorImage picture(kLeft + width + kRight, kTop + height + kBottom, kPaper);
  for (int iy = 0; iy < map.ny; ++iy)
    for (int ix = 0; ix < map.nx; ++ix) {
      const double share = map.share[static_cast<std::size_t>(iy * map.nx + ix)];
      const int x0 = kLeft + kCell * ix, y0 = kTop + height - kCell * (iy + 1);
      fill_rectangle(x0, y0, x0 + kCell, y0 + kCell, share < 0.0 ? kImpossible : heat_color(share), 1.0, picture);
    }
  const belief::SearchedParameter* x = parameter_named(answer, map.x);
  const belief::SearchedParameter* y = parameter_named(answer, map.y);
  draw_text("P(" + answer.outcome + ")", {kLeft, 24.0}, 12.0, kInk, picture);
  if (x && y) {
    const auto ends = [](const belief::SearchedParameter& of) {
      return std::pair(core::rounded_text(of.low), core::rounded_text(of.high));
    };
    const double below = kTop + height + 18.0;
    draw_text(ends(*x).first, {kLeft, below}, 9.0, kInk, picture);
    draw_text(ends(*x).second, {kLeft + width, below}, 9.0, kInk, picture, TextAlign::kRight);
    draw_text(x->name + ", " + x->unit, {kLeft + 0.5 * width, below + 24.0}, 11.0, kInk, picture, TextAlign::kCenter);
    draw_text(ends(*y).first, {kLeft - 8.0, kTop + height}, 9.0, kInk, picture, TextAlign::kRight);
    draw_text(ends(*y).second, {kLeft - 8.0, kTop + 10.0}, 9.0, kInk, picture, TextAlign::kRight);
    draw_text(y->name, {kLeft - 8.0, kTop + 0.5 * height}, 11.0, kInk, picture, TextAlign::kRight);
    draw_text(y->unit, {kLeft - 8.0, kTop + 0.5 * height + 18.0}, 11.0, kInk, picture, TextAlign::kRight);
  }
  // Light frames where choices are: the neighbourhood, and a cross at the best.
  const auto at = [&](double u, double v) { return Eigen::Vector2d(kLeft + width * u, kTop + height * (1.0 - v)); };
  if (answer.robust) {
    const double u0 = place_of(answer, answer.robust->low, map.x), u1 = place_of(answer, answer.robust->high, map.x);
    const double v0 = place_of(answer, answer.robust->low, map.y), v1 = place_of(answer, answer.robust->high, map.y);
    const std::vector<Eigen::Vector2d> frame = {at(u0, v0), at(u1, v0), at(u1, v1), at(u0, v1), at(u0, v0)};
    draw_line(frame, 5.0, kPaper, 0.9, picture);
    draw_line(frame, 2.0, kInk, 1.0, picture);
  }
  const double u = place_of(answer, answer.best.values, map.x), v = place_of(answer, answer.best.values, map.y);
  if (u >= 0.0 && v >= 0.0) {
    for (const auto& [ink, thickness] : {std::pair(kPaper, 5.0), std::pair(kInk, 2.0)}) {
      const Eigen::Vector2d middle = at(u, v);
      for (const Eigen::Vector2d& arm : {Eigen::Vector2d(7.0, 7.0), Eigen::Vector2d(7.0, -7.0)}) {
        const std::vector<Eigen::Vector2d> line = {middle - arm, middle + arm};
        draw_line(line, thickness, ink, 1.0, picture);
      }
    }
  }
  // The scale.
  const int bar = kLeft + width + 24;
  for (int i = 0; i < height; ++i)
    fill_rectangle(bar, kTop + height - 1 - i, bar + 16, kTop + height - i,
                   heat_color(static_cast<double>(i) / std::max(1, height - 1)), 1.0, picture);
  draw_text("1", {bar + 22.0, kTop + 10.0}, 9.0, kInk, picture);
  draw_text("0", {bar + 22.0, kTop + height + 0.0}, 9.0, kInk, picture);
  return picture;
}

std::vector<ReportSection> achieve_sections(const belief::AchieveAnswer& answer) {
  ReportSection section{"How to reach '" + answer.outcome + "' by " + answer.action, {}};
  TableBlock table;
  table.columns = {"choice", "parameters", "probability", "interval", "instances"};
  const auto add = [&](const std::string& name, const belief::ActionChoice& choice) {
    table.rows.push_back({name, values_text(answer, choice), percent(choice.probability),
                          percent(choice.lower) + " to " + percent(choice.upper), std::to_string(choice.instances)});
  };
  add(answer.found ? "best" : "best, not certified", answer.best);
  if (answer.robust) add("most robust", *answer.robust);
  section.blocks.push_back(std::move(table));
  if (answer.map)
    section.blocks.push_back(
        PictureBlock{{{"Share of instances with the outcome, the other parameters being at the "
                       "best choice (cross). Grey: something is in the way. Frame: the most "
                       "robust neighbourhood.",
                       action_map_picture(answer), false}}});
  ChartBlock chart;
  chart.caption = "Share of instances with the outcome along each parameter's range";
  chart.x_label = "place in the range, from 0 to 1";
  chart.y_label = "share";
  for (const belief::SearchedParameter& parameter : answer.parameters) {
    ChartBlock::Curve curve{parameter.name, {}};
    const auto count = static_cast<double>(parameter.profile.size());
    for (std::size_t i = 0; i < parameter.profile.size(); ++i)
      curve.points.push_back({(static_cast<double>(i) + 0.5) / count, std::max(0.0, parameter.profile[i])});
    if (!curve.points.empty()) chart.curves.push_back(std::move(curve));
  }
  if (!chart.curves.empty()) section.blocks.push_back(std::move(chart));
  if (!answer.failures.empty()) {
    TableBlock failures;
    failures.caption = "What happens instead, over all choices";
    failures.columns = {"", "what happens", "share"};
    for (const belief::FailureReason& reason : answer.failures)
      failures.rows.push_back({reason.what, reason.event, percent(reason.share)});
    section.blocks.push_back(std::move(failures));
  }
  for (const std::string& remark : answer.remarks) section.blocks.push_back(TextBlock{remark});
  return {std::move(section)};
}

}  // namespace prescene::interfaces
