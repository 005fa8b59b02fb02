// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_history.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "json_fields.h"

namespace prescene::service {
namespace {

double shortened(double value) { return std::isfinite(value) ? std::round(value * 1e5) / 1e5 : 0.0; }

constexpr std::size_t kMostColumnText = 256 << 10;  // bytes; a name from the bus may have any length

std::vector<std::string> columns_of(std::span<const ObjectSummary> objects) {
  std::vector<std::string> columns;
  for (const ObjectSummary& object : objects) {
    for (const char* what : {"/state", "/confidence", "/existence"}) columns.push_back(object.name + what);
    for (const belief::ParameterEstimate& parameter : object.parameters)
      for (const char* what : {"", "/deviation"}) columns.push_back(object.name + "/" + parameter.name + what);
  }
  return columns;
}

std::vector<std::string> names_of(std::span<const ObjectSummary> objects) {
  std::vector<std::string> names;
  for (const ObjectSummary& object : objects) names.push_back(object.name);
  return names;
}

/// Of each of the old ones, which of the new it is; nothing where one is not among them.
std::optional<std::vector<std::size_t>> places_among(const std::vector<std::string>& old_names,
                                                     const std::vector<std::string>& new_names) {
  std::map<std::string_view, std::size_t> place_of;  // a belief from the bus may have very many
  for (std::size_t i = 0; i < new_names.size(); ++i) place_of.try_emplace(new_names[i], i);
  std::vector<std::size_t> places;
  for (const std::string& name : old_names) {
    const auto found = place_of.find(name);
    if (found == place_of.end()) return std::nullopt;
    places.push_back(found->second);
  }
  return places;
}

/// Runs are kept for long, and there are many: a name from the bus may have any length.
std::string hand_of(const ObjectSummary& object) {
  std::string hand = object.held_by.value_or("");
  if (hand.size() <= ViewHistory::kMostHandBytes) return hand;
  constexpr std::string_view kMore = "...";
  std::size_t end = ViewHistory::kMostHandBytes - kMore.size();
  while (end > 0 && (static_cast<unsigned char>(hand[end]) & 0xC0U) == 0x80U) --end;  // not within a character
  return hand.substr(0, end).append(kMore);
}

}  // namespace

/// The first of them, as many as there is room for.
ViewHistory::Objects ViewHistory::that_fit(const std::vector<ObjectSummary>& objects) const {
  std::size_t count = 0, columns = 0, text = 0;
  for (const ObjectSummary& object : objects) {
    const std::size_t own = 3 + 2 * object.parameters.size();
    columns += own;
    text += own * object.name.size();
    for (const belief::ParameterEstimate& parameter : object.parameters) text += 2 * parameter.name.size();
    if (columns > most_columns_ || text > kMostColumnText) break;
    ++count;
  }
  return Objects(objects).first(count);
}

bool ViewHistory::add(const BeliefSummary& summary, std::uint64_t index) {
  const Objects objects = that_fit(summary.objects);
  if (const std::size_t left_out = summary.objects.size() - objects.size(); left_out > left_out_) {
    left_out_ = left_out;
    ++revision_;
  }
  std::vector<std::string> columns = columns_of(objects);
  if (rows_.empty() || summary.stamp_ns < last_ns_ || (columns != columns_ && !make_room_for(objects, columns)))
    begin_anew(summary.stamp_ns, objects, std::move(columns));
  last_ns_ = summary.stamp_ns;
  add_runs(summary.stamp_ns, objects, index);
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
  for (const ObjectSummary& object : objects) {
    row.values.insert(row.values.end(),
                      {static_cast<double>(object.state), shortened(object.confidence), shortened(object.existence)});
    for (const belief::ParameterEstimate& parameter : object.parameters)
      row.values.insert(row.values.end(), {shortened(parameter.mean), shortened(parameter.standard_deviation)});
  }
  rows_.push_back(std::move(row));
  return true;
}

void ViewHistory::begin_anew(core::TimeNs stamp_ns, Objects objects, std::vector<std::string>&& columns) {
  forgotten_ += seen_;
  columns_ = std::move(columns);
  rows_.clear();
  stride_ = 1;
  seen_ = 0;
  first_ns_ = stamp_ns;
  ++revision_;
  objects_ = names_of(objects);
  runs_.clear();
  current_.assign(objects_.size(), std::nullopt);
  shortest_run_ = 0.0;
  joined_ = 0;
}

/// What was before stays, in the new columns and under the new numbers of the objects; false where one of them went.
bool ViewHistory::make_room_for(Objects objects, const std::vector<std::string>& columns) {
  std::vector<std::string> names = names_of(objects);
  const auto new_columns = places_among(columns_, columns), new_objects = places_among(objects_, names);
  if (!new_columns || !new_objects) return false;
  for (Row& row : rows_) {
    std::vector<double> values(columns.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < row.values.size(); ++i) values[(*new_columns)[i]] = row.values[i];
    row.values = std::move(values);
  }
  for (Run& run : runs_) run.object = (*new_objects)[run.object];
  decltype(current_) current(objects.size());
  for (std::size_t i = 0; i < current_.size(); ++i) current[(*new_objects)[i]] = std::move(current_[i]);
  current_ = std::move(current);
  columns_ = columns;
  objects_ = std::move(names);
  ++revision_;
  return true;
}

void ViewHistory::add_runs(core::TimeNs stamp_ns, Objects objects, std::uint64_t index) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectSummary& object = objects[i];
    const std::string held_by = hand_of(object);
    const std::pair now(object.state, held_by);
    if (current_[i] == now) continue;
    current_[i] = now;
    runs_.push_back({i, index, seconds_of(stamp_ns), object.state, held_by});
  }
  if (runs_.size() > std::max(most_runs_, 2 * objects_.size())) join_short_runs();
}

void ViewHistory::join_short_runs() {
  constexpr double kFirst = 0.1;  // s: three frames of a usual camera
  ++revision_;
  const std::size_t most = std::max(most_runs_ / 2, 2 * objects_.size());  // the first and the last of each stay
  while (runs_.size() > most) {
    shortest_run_ = shortest_run_ > 0.0 ? 2.0 * shortest_run_ : kFirst;
    std::vector<Run> kept;
    for (std::size_t object = 0; object < objects_.size(); ++object) {
      std::vector<Run> own;
      for (Run& run : runs_)
        if (run.object == object) own.push_back(std::move(run));
      const std::size_t first = kept.size();
      for (std::size_t i = 0; i < own.size(); ++i) {
        const bool is_short = i > 0 && i + 1 < own.size() && own[i + 1].time - own[i].time < shortest_run_;
        const bool is_as_before =
            kept.size() > first && kept.back().state == own[i].state && kept.back().held_by == own[i].held_by;
        if (is_short || is_as_before) {
          ++joined_;
        } else {
          kept.push_back(std::move(own[i]));
        }
      }
    }
    std::stable_sort(kept.begin(), kept.end(), [](const Run& a, const Run& b) { return a.index < b.index; });
    runs_ = std::move(kept);
  }
}

nlohmann::ordered_json to_json(const ViewHistory::Row& row) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  json.push_back(row.index);
  json.push_back(std::round(row.time * 1e4) / 1e4);
  for (const double value : row.values)
    json.push_back(std::isnan(value) ? nlohmann::ordered_json() : nlohmann::ordered_json(value));
  return json;
}

nlohmann::ordered_json to_json(const ViewHistory::Run& run) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  json.push_back(run.object);
  json.push_back(run.index);
  json.push_back(std::round(run.time * 1e4) / 1e4);
  json.push_back(belief::to_string(run.state));
  json.push_back(run.held_by.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(run.held_by));
  return json;
}

nlohmann::ordered_json to_json(const ViewHistory& history) {
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const ViewHistory::Run& run : history.runs()) runs.push_back(to_json(run));
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const ViewHistory::Row& row : history.rows()) rows.push_back(to_json(row));
  return JsonFields()
      .text("op", "history")
      .texts("columns", history.columns())
      .field("rows", std::move(rows))
      .texts("objects", history.objects())
      .field("runs", std::move(runs))
      .number("shortest_run", history.shortest_run())
      .count("joined_runs", history.joined_runs())
      .count("forgotten_steps", history.forgotten_steps())
      .count("left_out_objects", history.left_out_objects())
      .take();
}

}  // namespace prescene::service
