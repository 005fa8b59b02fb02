// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_history.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "json_fields.h"

namespace prescene::service {
namespace {

double shortened(double value) { return std::isfinite(value) ? std::round(value * 1e5) / 1e5 : 0.0; }

std::vector<std::string> columns_of(const BeliefSummary& summary) {
  std::vector<std::string> columns;
  for (const ObjectSummary& object : summary.objects) {
    for (const char* what : {"/state", "/confidence", "/existence"}) columns.push_back(object.name + what);
    for (const belief::ParameterEstimate& parameter : object.parameters)
      for (const char* what : {"", "/deviation"}) columns.push_back(object.name + "/" + parameter.name + what);
  }
  return columns;
}

}  // namespace

bool ViewHistory::add(const BeliefSummary& summary, std::uint64_t index) {
  std::vector<std::string> columns = columns_of(summary);
  if (columns != columns_ || summary.stamp_ns < last_ns_ || rows_.empty()) {
    columns_ = std::move(columns);
    rows_.clear();
    stride_ = 1;
    seen_ = 0;
    first_ns_ = summary.stamp_ns;
    ++revision_;
  }
  last_ns_ = summary.stamp_ns;
  if (seen_++ % stride_ != 0) return false;
  if (rows_.size() >= most_rows_) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < rows_.size(); i += 2) rows_[kept++] = std::move(rows_[i]);
    rows_.resize(kept);
    stride_ *= 2;
    ++revision_;
    if ((seen_ - 1) % stride_ != 0) return false;
  }
  Row row{index, seconds_of(summary.stamp_ns), {}};
  for (const ObjectSummary& object : summary.objects) {
    row.values.insert(row.values.end(),
                      {static_cast<double>(object.state), shortened(object.confidence), shortened(object.existence)});
    for (const belief::ParameterEstimate& parameter : object.parameters)
      row.values.insert(row.values.end(), {shortened(parameter.mean), shortened(parameter.standard_deviation)});
  }
  rows_.push_back(std::move(row));
  return true;
}

nlohmann::ordered_json to_json(const ViewHistory::Row& row) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  json.push_back(row.index);
  json.push_back(std::round(row.time * 1e4) / 1e4);
  for (const double value : row.values) json.push_back(value);
  return json;
}

nlohmann::ordered_json to_json(const ViewHistory& history) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const ViewHistory::Row& row : history.rows()) rows.push_back(to_json(row));
  return JsonFields().text("op", "history").texts("columns", history.columns()).field("rows", std::move(rows)).take();
}

}  // namespace prescene::service
