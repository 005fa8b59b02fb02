// SPDX-License-Identifier: Apache-2.0
#include "replay_text.h"

#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/service/outside_json.h"
#include "verb.h"

namespace prescene::service {

using core::fixed_text;
using nlohmann::ordered_json;

void DamagedRecords::add(const core::Status& first, std::uint64_t count) {
  if (first.ok() || count == 0) return;
  if (count_ == 0) first_ = first.message();
  count_ += count;
}

std::string DamagedRecords::text() const {
  if (count_ == 0) return "";
  return counted(count_, "record") + " of what really happened left out; the first: " + first_;
}

ordered_json tracking_json(const std::vector<ObjectTrackingScore>& rows) {
  ordered_json json = ordered_json::array();
  for (const ObjectTrackingScore& row : rows) json.push_back(to_json(row));
  return json;
}

/// Each object's error in each frame, where the recording holds the truth.
void add_errors(const TrackingScore& score, ordered_json& steps) {
  for (ordered_json& step : steps) {
    for (ordered_json& object : step["objects"]) {
      const auto error = score.error_at(step["stamp_ns"].get<core::TimeNs>(), object["name"].get<std::string>());
      if (!error) continue;
      object["truth"] = {{"position_error_m", error->position_error},
                         {"turn_error_rad", error->turn_error},
                         {"visible_share", error->visible_share}};
    }
  }
}

std::string tracking_text(const std::vector<ObjectTrackingScore>& rows) {
  if (rows.empty()) return "";
  std::vector<std::vector<std::string>> cells = {
      {"object", "frames", "visible", "median error, mm", "90 %, mm", "median turn, deg", "tracked", "wrong"}};
  for (const ObjectTrackingScore& row : rows) {
    cells.push_back({row.object, std::to_string(row.frames), std::to_string(row.visible_frames),
                     fixed_text(1e3 * row.median_position_error, 1), fixed_text(1e3 * row.p90_position_error, 1),
                     fixed_text(row.median_turn_error * 180.0 / std::numbers::pi, 1),
                     fixed_text(100.0 * row.share_tracked, 0) + " %",
                     fixed_text(100.0 * row.share_confidently_wrong, 0) + " %"});
  }
  return "\nTracking against the simulated truth\n" + table(cells);
}

std::string supports_text(const std::vector<SupportRow>& rows) {
  if (rows.empty()) return "";
  std::vector<std::vector<std::string>> cells = {{"support", "frames", "measured", "median tilt, deg", "largest",
                                                  "median height, mm", "largest", "points off it, mm"}};
  for (const SupportRow& row : rows) {
    cells.push_back({row.support, std::to_string(row.frames), std::to_string(row.measured),
                     fixed_text(row.median_tilt * geometry::kDegreesPerRadian, 2),
                     fixed_text(row.largest_tilt * geometry::kDegreesPerRadian, 2),
                     fixed_text(1e3 * row.median_height, 1), fixed_text(1e3 * row.largest_height, 1),
                     fixed_text(1e3 * row.median_rms, 1)});
  }
  return "\nSupports, each frame's plane against the first one's\n" + table(cells);
}

namespace {

/// A question, short enough to be read.
std::string one_line(const std::string& question) {
  constexpr std::size_t kMost = 100;
  const ordered_json json = parse_or_discard(question);
  std::string line = json.is_discarded() ? question : belief::json_text(json);
  if (line.size() > kMost) line = line.substr(0, kMost) + "...";
  return line;
}

}  // namespace

std::string answers_text(const std::vector<BusReplayResult::Answered>& answers) {
  std::string text;
  for (const BusReplayResult::Answered& answered : answers) {
    text += "\nAsked at " + fixed_text(answered.at, 2) + " s: " + one_line(answered.question) + "\n";
    if (answered.answer.empty()) {
      text += "no answer came\n";
      continue;
    }
    const ordered_json answer = parse_or_discard(answered.answer);
    text += "answered after " + fixed_text(answered.seconds, 2) + " s\n";
    const bool is_below = answer.is_object() && answer.contains("predict") && !answer.contains("error");
    text += is_below ? "the prediction is compared with what happened below\n" : answer_text(answer);
  }
  return text;
}

std::string foreseen_text_of(const ForeseenAndCame& foreseen) {
  const std::vector<Comparison> comparisons = foreseen.comparisons();
  if (comparisons.empty()) return "";
  std::string text = "\nPredictions and what happened\n";
  for (const Comparison& comparison : comparisons) {
    text += "\nAsked at " + fixed_text(comparison.at, 2) + " s: " + comparison.question + "\n" + comparison.note + "\n";
    std::vector<std::vector<std::string>> cells = {
        {"outcome", "group", "predicted", comparison.comparable ? "happened" : "happened (not to be compared)"}};
    for (const Comparison::Row& row : comparison.rows) {
      if (is_worth_a_row(row)) cells.push_back({row.outcome, row.group, foreseen_text(row), came_text(row)});
    }
    text += table(cells);
  }
  return text + (foreseen.knows_truth() ? kCameByTruth : kCameByTracking) + "\n";
}

ordered_json foreseen_json(const ForeseenAndCame& foreseen) {
  ordered_json json = ordered_json::array();
  for (const Comparison& comparison : foreseen.comparisons()) {
    ordered_json rows = ordered_json::array();
    for (const Comparison::Row& row : comparison.rows) {
      ordered_json cells = {{"name", row.outcome},
                            {"group", row.group},
                            {"probability", row.probability},
                            {"interval", {row.low, row.high}},
                            {"came", nullptr}};
      if (row.came) cells["came"] = *row.came;
      if (row.came.value_or(false)) cells["since"] = row.since;
      rows.push_back(std::move(cells));
    }
    json.push_back({{"at", comparison.at},
                    {"question", comparison.question},
                    {"note", comparison.note},
                    {"comparable", comparison.comparable},
                    {"outcomes", rows}});
  }
  return json;
}

/// What was doubtful or second best on the way, and what is wrong with the file.
std::string warnings_text(const ReplaySummary& summary) {
  std::string text;
  for (const auto& [what, steps] : summary.degraded) {
    text += "in " + std::to_string(steps) + " of " + std::to_string(summary.steps) + " steps: " + what + "\n";
  }
  if (summary.refused > 0) {
    text += counted(summary.refused, "message") + " refused; the first: " + summary.first_refusal + "\n";
  }
  if (summary.skipped > 0 && !summary.last_skip.empty()) text += "the last frame skipped: " + summary.last_skip + "\n";
  if (!summary.began_anew.empty()) text += summary.began_anew + "\n";
  if (!summary.loss.empty()) text += summary.loss + "\n";
  return text.empty() ? "" : "\nWarnings\n" + text;
}

ordered_json degraded_json(const ReplaySummary& summary) {
  ordered_json json = ordered_json::array();
  for (const auto& [what, steps] : summary.degraded) json.push_back({{"what", what}, {"steps", steps}});
  return json;
}

}  // namespace prescene::service
