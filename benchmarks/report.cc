// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/report.h"

#include <hwy/highway.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"

namespace prescene::benchmarks {
namespace {

using Json = nlohmann::ordered_json;

std::string number_text(double value) {
  if (std::isnan(value)) return "-";
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), std::abs(value) >= 1e4 ? "%.0f" : "%.4g", value);
  return text.data();
}

std::string figure_text(const Figure& figure) {
  if (const auto* text = std::get_if<std::string>(&figure)) return *text;
  if (const auto* count = std::get_if<std::int64_t>(&figure)) return std::to_string(*count);
  return number_text(std::get<double>(figure));
}

bool is_number(const Figure& figure) { return !std::holds_alternative<std::string>(figure); }

std::string csv_text(const Figure& figure) {
  if (const auto* text = std::get_if<std::string>(&figure)) {
    std::string quoted = "\"";
    for (const char c : *text) {
      if (c == '"') quoted += '"';
      quoted += c;
    }
    return quoted + '"';
  }
  if (const auto* count = std::get_if<std::int64_t>(&figure)) return std::to_string(*count);
  const double value = std::get<double>(figure);
  if (std::isnan(value)) return "";
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

Json json_of(const Figure& figure) {
  if (const auto* text = std::get_if<std::string>(&figure)) return *text;
  if (const auto* count = std::get_if<std::int64_t>(&figure)) return *count;
  const double value = std::get<double>(figure);
  return std::isnan(value) ? Json(nullptr) : Json(value);
}

const char* to_string(Better better) {
  switch (better) {
    case Better::kHigher:
      return "higher";
    case Better::kLower:
      return "lower";
    case Better::kWithin:
      return "within";
  }
  return "";
}

Json json_of(const std::optional<Goal>& goal, Better better) {
  if (!goal) return nullptr;
  if (better == Better::kWithin) return Json::array({goal->low, goal->high});
  return better == Better::kHigher ? goal->low : goal->high;
}

std::string goal_text(const std::optional<Goal>& goal, Better better) {
  if (!goal) return "";
  if (better == Better::kWithin) return number_text(goal->low) + " to " + number_text(goal->high);
  return better == Better::kHigher ? ">= " + number_text(goal->low) : "<= " + number_text(goal->high);
}

std::string mark_of(const Target& target) {
  if (!target.reached || (!target.must && !target.aim)) return "-";
  if (target.aim && meets(target, *target.aim)) return "aim";
  if (!target.must) return "-";
  return meets(target, *target.must) ? "must" : "MISSED";
}

Json json_of(const Target& target) {
  Json json = {{"work", target.work},
               {"must", json_of(target.must, target.better)},
               {"aim", json_of(target.aim, target.better)},
               {"reached", target.reached ? Json(*target.reached) : Json(nullptr)},
               {"better", to_string(target.better)},
               {"unit", target.unit},
               {"n", target.n},
               {"baseline", target.baseline}};
  if (!target.why.empty()) json["why"] = target.why;
  return json;
}

core::Status write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file)
    return core::unavailable("cannot write " + path.string() + "; check that the folder exists and the disk has room");
  return core::ok_status();
}

}  // namespace

bool meets(const Target& target, const Goal& goal) {
  if (!target.reached) return false;
  const bool high_enough = *target.reached >= goal.low, low_enough = *target.reached <= goal.high;
  switch (target.better) {
    case Better::kHigher:
      return high_enough;
    case Better::kLower:
      return low_enough;
    case Better::kWithin:
      return high_enough && low_enough;
  }
  return false;
}

std::string best_simd_target() { return hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()); }

Report::Report(std::string name, std::string simd_target)
    : name_(std::move(name)), simd_target_(std::move(simd_target)), machine_(machine_name()) {}

void Report::add(Target target) {
  PRESCENE_CHECK_MSG(target.reached || !target.why.empty(), target.work);
  targets_.push_back(std::move(target));
}

void Report::add(Table table) {
  for (const std::vector<Figure>& row : table.rows) PRESCENE_CHECK_MSG(row.size() == table.columns.size(), table.name);
  tables_.push_back(std::move(table));
}

void Report::add(Plot plot) { plots_.push_back(std::move(plot)); }

void Report::note(std::string sentence) { notes_.push_back(std::move(sentence)); }

std::string Report::text() const {
  Table table{name_, {"work", "must", "aim", "reached", "unit", "", "n", "compared with"}, {}};
  std::string remarks;
  for (const Target& target : targets_) {
    table.rows.push_back({target.work, goal_text(target.must, target.better), goal_text(target.aim, target.better),
                          target.reached ? number_text(*target.reached) : "-", target.unit, mark_of(target), target.n,
                          target.baseline});
    if (!target.why.empty()) remarks += "  " + target.work + ": " + target.why + "\n";
  }
  std::string text = name_ + " on " + machine_ + ", " + simd_target_ + "\n";
  for (const std::string& sentence : notes_) text += sentence + "\n";
  return text + "\n" + text_of(table) + (remarks.empty() ? "" : "\n" + remarks);
}

int Report::finish(const std::filesystem::path& path) const {
  if (path.empty()) return 0;
  const core::Status status = write(path);
  if (!status.ok()) std::fprintf(stderr, "%s\n", core::to_string(status).c_str());
  return status.ok() ? 0 : 1;
}

core::Status Report::write(const std::filesystem::path& path) const {
  Json json = {{"name", name_}, {"machine", machine_}, {"simd_target", simd_target_}, {"notes", notes_}};
  json["targets"] = Json::array();
  for (const Target& target : targets_) json["targets"].push_back(json_of(target));
  json["raw"] = Json::object();
  for (const Table& table : tables_) {
    Json rows = Json::array();
    std::string csv;
    for (std::size_t i = 0; i < table.columns.size(); ++i) csv += (i == 0 ? "" : ",") + csv_text(table.columns[i]);
    for (const std::vector<Figure>& row : table.rows) {
      Json values = Json::object();
      csv += "\n";
      for (std::size_t i = 0; i < row.size(); ++i) {
        values[table.columns[i]] = json_of(row[i]);
        csv += (i == 0 ? "" : ",") + csv_text(row[i]);
      }
      rows.push_back(std::move(values));
    }
    json["raw"][table.name] = std::move(rows);
    std::filesystem::path csv_path = path;
    if (!table.rows.empty())
      PRESCENE_RETURN_IF_ERROR(write_file(csv_path.replace_extension(table.name + ".csv"), csv + "\n"));
  }
  for (const Plot& plot : plots_) {
    std::filesystem::path svg_path = path;
    PRESCENE_RETURN_IF_ERROR(write_file(svg_path.replace_extension(plot.name + ".svg"), svg_of(plot)));
  }
  return write_file(path, belief::json_text(json, 1) + "\n");
}

std::string text_of(const Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(column.size());
  for (const std::vector<Figure>& row : table.rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], figure_text(row[i]).size());
  std::string text;
  const auto line = [&](const std::vector<Figure>& row) {
    std::string words;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string word = figure_text(row[i]);
      const std::string space(widths[i] - word.size(), ' ');
      words += (i == 0 ? "" : "  ") + (is_number(row[i]) ? space + word : word + space);
    }
    words.erase(words.find_last_not_of(' ') + 1);
    text += words + "\n";
  };
  line({table.columns.begin(), table.columns.end()});
  for (const std::vector<Figure>& row : table.rows) line(row);
  return text;
}

std::string machine_name() {
  std::ifstream file("/proc/cpuinfo");
  std::string line, name = "unknown processor";
  while (std::getline(file, line)) {
    if (!line.starts_with("model name")) continue;
    name = line.substr(std::min(line.find(':') + 2, line.size()));
    break;
  }
  return name + ", " + std::to_string(std::thread::hardware_concurrency()) + " processors";
}

}  // namespace prescene::benchmarks
