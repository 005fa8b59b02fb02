// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/session_report.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/queries/camera_name.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/pictures/belief_overlay.h"
#include "tracking_sections.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

constexpr std::size_t kMaxObservations = 48;              // in memory, evenly spread
constexpr std::size_t kMaxPixels = std::size_t{1} << 24;  // of all of them: 54 of 640 x 480
constexpr std::size_t kPictures = 6;                      // of them on the page, of each camera
constexpr std::size_t kMostChanges = 20;                  // of states, on the page
constexpr int kSmallPicture = 320;                        // columns of what the camera saw, beside the overlay

/// Pictures need a place even where nobody tells one.
std::vector<CameraInput> pictured_cameras(const belief::Scene& scene, const TrackerSettings& tracker) {
  std::vector<CameraInput> cameras = camera_inputs(tracker, scene);
  AssemblerSettings& first = cameras.front().assembler;
  if (!first.X_WC && scene.camera) first.X_WC = scene.camera->X_WC;
  return cameras;
}

belief::Timeline timeline_from(const ordered_json& json) {
  belief::Timeline timeline;
  constexpr belief::Relation kRelations[] = {
      belief::Relation::kContact, belief::Relation::kSupports, belief::Relation::kInside, belief::Relation::kHolds,
      belief::Relation::kMoving,  belief::Relation::kUpright,  belief::Relation::kFalling};
  if (!json.is_array()) return timeline;
  for (const ordered_json& interval : json) {
    const std::string word = interval.value("relation", "");
    for (const belief::Relation relation : kRelations) {
      if (belief::to_string(relation) != word) continue;
      timeline.push_back({relation, interval.value("subject", ""), interval.value("other", ""),
                          interval.value("begin", 0.0), interval.value("end", 0.0)});
    }
  }
  return timeline;
}

belief::OutcomeProbability outcome_from(const ordered_json& json) {
  const auto limits = json.value("interval", std::vector<double>{0.0, 1.0});
  return {json.value("name", ""), json.value("group", ""), json.value("probability", 0.0), limits.at(0), limits.at(1)};
}

void add_prediction(const ordered_json& predict, const belief::Scene& scene, interfaces::ReportSection& section) {
  interfaces::OutcomeBlock outcomes;
  outcomes.caption = std::to_string(predict.value("instances", 0)) +
                     (predict.value("instances", 0) == 1 ? " simulated instance" : " simulated instances");
  for (const ordered_json& outcome : predict.value("outcomes", ordered_json::array()))
    outcomes.outcomes.push_back(outcome_from(outcome));
  section.blocks.push_back(std::move(outcomes));
  for (const ordered_json& poses : predict.value("final_poses", ordered_json::array())) {
    const ordered_json& map = poses.at("heat_map");
    interfaces::HeatMapBlock block;
    block.caption = "Where " + poses.value("object", "") + " ends, from above";
    block.map = {map.value("cell", 0.02), map.value("x0", 0.0), map.value("y0", 0.0),
                 map.value("nx", 0),      map.value("ny", 0),   map.value("mass", std::vector<double>{})};
    if (block.map.nx < 0 || block.map.ny < 0 ||
        block.map.mass.size() != static_cast<std::size_t>(block.map.nx) * static_cast<std::size_t>(block.map.ny)) {
      section.blocks.push_back(interfaces::TextBlock{"The heat map has not the form of docs/reference/queries.md."});
      continue;
    }
    block.outlines = interfaces::support_outlines(scene);
    section.blocks.push_back(std::move(block));
  }
  for (const ordered_json& run : predict.value("typical_runs", ordered_json::array())) {
    interfaces::TimelineBlock block;
    const std::string group = run.value("group", "");
    block.caption = "A typical run that ends " + (group.empty() ? "" : group + ": ") + run.value("outcome", "") + " (" +
                    fixed_text(100.0 * run.value("share", 0.0), 0) + " %)";
    block.timeline = timeline_from(run.value("timeline", ordered_json::array()));
    section.blocks.push_back(std::move(block));
  }
}

/// Every n-th pixel.
geometry::ColorImage smaller(const geometry::ColorImage& image) {
  const int step = std::max(1, image.width() / kSmallPicture);
  if (step == 1) return image;
  geometry::ColorImage small(image.width() / step, image.height() / step);
  for (int y = 0; y < small.height(); ++y)
    for (int x = 0; x < small.width(); ++x) small(x, y) = image(step * x, step * y);
  return small;
}

}  // namespace

SessionReport::SessionReport(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings,
                             Backends& backends)
    : scene_(std::move(scene)),
      frames_(pictured_cameras(*scene_, settings), robot_names(*scene_), settings.tf),
      backends_(&backends),
      residual_meter_(backends) {}

void SessionReport::add(const interfaces::ReceivedMessage& message) {
  // What makes no sense is reported by the tracker; here it is only left out.
  static_cast<void>(frames_.take_in(message, next_index_++, message.received_ns));
  while (const auto frame = frames_.take(message.received_ns)) add(frame->observation);
  static_cast<void>(frames_.take_skipped());
}

void SessionReport::add(const belief::Observation& observation) {
  const auto summary = summaries_.find(observation.stamp_ns);
  if (summary == summaries_.end()) return;
  residuals_[observation.stamp_ns] = residual_meter_.measure(*scene_, summary->second, observation);
  if (changes_.contains(observation.stamp_ns) && at_changes_.size() < kMostChanges)
    at_changes_[observation.stamp_ns] = observation;
  Kept& kept = kept_[observation.camera];
  if (kept.seen++ % kept.every != 0) return;
  kept.observations.push_back(observation);
  const auto cameras = static_cast<std::size_t>(belief::camera_count(*scene_));
  const auto too_many = [&] {
    std::size_t pixels = 0;
    for (const belief::Observation& one : kept.observations) pixels += one.frame.depth ? one.frame.depth->size() : 0;
    return kept.observations.size() > std::max<std::size_t>(kPictures, kMaxObservations / cameras) ||
           (kept.observations.size() > 1 && pixels > kMaxPixels / cameras);
  };
  while (too_many()) {
    std::vector<belief::Observation> fewer;
    for (std::size_t i = 0; i < kept.observations.size(); i += 2) fewer.push_back(std::move(kept.observations[i]));
    kept.observations = std::move(fewer);
    kept.every *= 2;
  }
}

void SessionReport::add(const BeliefSummary& summary) {
  const auto next = summaries_.lower_bound(summary.stamp_ns);
  const std::string what =
      next == summaries_.begin() ? "the first frame" : state_changes(std::prev(next)->second, summary);
  if (!what.empty()) changes_[summary.stamp_ns] = what;
  summaries_[summary.stamp_ns] = summary;
}

std::string SessionReport::by_camera(const belief::Observation& observation) const {
  const std::string name = queries::camera_name(*scene_, observation.camera);
  return name.empty() ? "" : ", camera " + name;
}

interfaces::PictureBlock SessionReport::pictures() const {
  interfaces::PictureBlock block;
  if (summaries_.empty()) return block;
  const core::TimeNs first_ns = summaries_.begin()->first;
  for (const auto& [camera, kept] : kept_) {
    const std::vector<belief::Observation>& all = kept.observations;
    const std::size_t count = std::min(kPictures, all.size());
    for (std::size_t i = 0; i < count; ++i) {
      const belief::Observation& observation = all[count > 1 ? i * (all.size() - 1) / (count - 1) : 0];
      auto picture = belief_overlay(*scene_, summaries_.at(observation.stamp_ns), observation, *backends_);
      if (!picture) continue;
      const std::string time = fixed_text(core::seconds_of(observation.stamp_ns - first_ns), 2) + " s";
      block.pictures.push_back({time + by_camera(observation), *std::move(picture), false});
    }
  }
  return block;
}

void SessionReport::add_changes(interfaces::ReportContents& contents) const {
  if (changes_.empty()) return;
  interfaces::ReportSection section{"Each change of a state: what the camera saw, and the belief drawn in", {}};
  const core::TimeNs first_ns = summaries_.begin()->first;
  interfaces::PictureBlock block;
  for (const auto& [stamp_ns, observation] : at_changes_) {
    const std::string caption = fixed_text(core::seconds_of(stamp_ns - first_ns), 2) + " s" + by_camera(observation) +
                                ": " + changes_.at(stamp_ns);
    block.pictures.push_back({caption, smaller(picture_of(observation)), false});
    auto picture = belief_overlay(*scene_, summaries_.at(stamp_ns), observation, *backends_);
    if (picture) block.pictures.push_back({"the belief then", *std::move(picture), false});
  }
  section.blocks.emplace_back(std::move(block));
  if (changes_.size() > at_changes_.size()) {
    interfaces::TableBlock rest{"Changes without a picture here", {"time, s", "change"}, {}};
    for (const auto& [stamp_ns, what] : changes_)
      if (!at_changes_.contains(stamp_ns))
        rest.rows.push_back({fixed_text(core::seconds_of(stamp_ns - first_ns), 2), what});
    section.blocks.emplace_back(std::move(rest));
  }
  contents.sections.push_back(std::move(section));
}

void SessionReport::add_supports(interfaces::ReportContents& contents) const {
  if (supports_.frames().empty()) return;
  interfaces::TableBlock table{
      "Each frame's own plane against that of the first frame: where nothing moves, what is left is error",
      {"support", "frames", "measured", "median tilt, deg", "largest tilt, deg", "median height, mm",
       "largest height, mm", "points off the plane, mm", "of its pixels, %"},
      {}};
  for (const SupportRow& row : supports_.rows()) {
    table.rows.push_back({row.support, std::to_string(row.frames), std::to_string(row.measured),
                          fixed_text(row.median_tilt * 180.0 / std::numbers::pi, 2),
                          fixed_text(row.largest_tilt * 180.0 / std::numbers::pi, 2),
                          fixed_text(1e3 * row.median_height, 1), fixed_text(1e3 * row.largest_height, 1),
                          fixed_text(1e3 * row.median_rms, 1), fixed_text(100.0 * row.median_share, 0)});
  }
  interfaces::ChartBlock height{"Height over the first frame's plane", "time, s", "mm", {}, true};
  interfaces::ChartBlock tilt{"Tilt against the first frame's plane", "time, s", "deg", {}, true};
  const core::TimeNs first_ns = summaries_.empty() ? 0 : summaries_.begin()->first;
  for (const std::vector<SupportFrame>& frames : supports_.frames()) {
    const std::string& name = frames.front().measured.support;
    height.curves.push_back({name, {}});
    tilt.curves.push_back({name, {}});
    for (const SupportFrame& frame : frames) {
      const double time = core::seconds_of(frame.stamp_ns - first_ns);
      height.curves.back().points.emplace_back(time, 1e3 * frame.height);
      tilt.curves.back().points.emplace_back(time, frame.tilt * 180.0 / std::numbers::pi);
    }
  }
  contents.sections.push_back({"Supports", {std::move(table), std::move(height), std::move(tilt)}});
}

void SessionReport::add_foreseen(interfaces::ReportContents& contents) const {
  if (comparisons_.empty()) return;
  interfaces::ReportSection section{"Predictions and what happened", {}};
  for (const Comparison& comparison : comparisons_) {
    section.blocks.push_back(interfaces::TextBlock{"Asked at " + fixed_text(comparison.at, 2) +
                                                   " s: " + comparison.question + "\n\n" + comparison.note});
    interfaces::TableBlock table{comparison.comparable ? "" : "Not to be compared: see above",
                                 {"outcome", "group", "predicted", "happened"},
                                 {}};
    for (const Comparison::Row& row : comparison.rows) {
      if (is_worth_a_row(row)) table.rows.push_back({row.outcome, row.group, foreseen_text(row), came_text(row)});
    }
    section.blocks.push_back(std::move(table));
  }
  section.blocks.push_back(interfaces::TextBlock{came_is_truth_ ? kCameByTruth : kCameByTracking});
  contents.sections.push_back(std::move(section));
}

void SessionReport::add_answers(interfaces::ReportContents& contents) const {
  for (const auto& [at, text] : answers_) {
    try {
      add_answer_section(at, parse_or_discard(text), contents);
    } catch (const std::exception&) {  // ordered_json's, or an interval of one number
      contents.sections.push_back(
          {"Asked at " + fixed_text(at, 1) + " s",
           {interfaces::TextBlock{"The answer has not the form of docs/reference/queries.md."}}});
    }
  }
}

void SessionReport::add_answer_section(double at, const ordered_json& answer,
                                       interfaces::ReportContents& contents) const {
  {
    interfaces::ReportSection section;
    section.title = "Asked at " + fixed_text(at, 1) + " s";
    if (!answer.is_object()) {
      section.blocks.push_back(interfaces::TextBlock{"No answer came."});
    } else if (const core::Status error = belief::error_from_json(answer); !error.ok()) {
      section.blocks.push_back(interfaces::TextBlock{core::to_string(error)});
    } else if (answer.contains("predict")) {
      section.title += ": what happens?";
      add_prediction(answer["predict"], *scene_, section);
    } else if (answer.contains("stability")) {
      const ordered_json& stability = answer["stability"];
      section.title += ": does " + stability.value("object", "") + " stay?";
      section.blocks.push_back(
          interfaces::OutcomeBlock{stability.value("likely_event", ""), {outcome_from(stability.at("stable"))}});
    } else {
      return;  // where things are is in the pictures
    }
    contents.sections.push_back(std::move(section));
  }
}

core::Status SessionReport::write(const std::filesystem::path& path, const TrackingScore& score) const {
  interfaces::ReportContents contents;
  contents.title = scene_->name.empty() ? "Prescene" : scene_->name;
  contents.subtitle = "What was seen, believed and answered";
  contents.facts = {{"steps", std::to_string(summaries_.size())},
                    {"objects", std::to_string(scene_->objects.size())},
                    {"supports", std::to_string(scene_->supports.size())}};
  if (!proposals_.empty()) contents.facts.push_back({"proposals", proposals_});
  if (!page_.html.empty()) contents.sections.push_back({"The session, step by step", {page_}});
  interfaces::ReportSection seen{"What the camera saw, with the belief drawn in", {pictures()}};
  contents.sections.push_back(std::move(seen));
  add_changes(contents);
  add_foreseen(contents);
  interfaces::ReportSection tracking{"Tracking", {}};
  const std::vector<ObjectTrackingScore> rows = score.rows();
  if (!rows.empty()) {
    interfaces::TableBlock table{
        "Against the simulated truth, over frames in which at least half of the object is visible",
        {"object", "frames", "visible", "median error, mm", "90 %, mm", "median turn, deg", "tracked, %"},
        {}};
    for (const ObjectTrackingScore& row : rows) {
      table.rows.push_back({row.object, std::to_string(row.frames), std::to_string(row.visible_frames),
                            fixed_text(1e3 * row.median_position_error, 1), fixed_text(1e3 * row.p90_position_error, 1),
                            fixed_text(row.median_turn_error * 180.0 / std::numbers::pi, 1),
                            fixed_text(100.0 * row.share_tracked, 0)});
    }
    tracking.blocks.push_back(std::move(table));
  }
  for (interfaces::ReportBlock& block : tracking_blocks(summaries_, residuals_, score))
    tracking.blocks.push_back(std::move(block));
  if (tracking.blocks.empty()) {
    tracking.blocks.push_back(
        interfaces::TextBlock{"The scene names no objects; its supports are drawn where they were found."});
  }
  contents.sections.push_back(std::move(tracking));
  if (auto hidden = hidden_section(summaries_, *scene_, score)) contents.sections.push_back(*std::move(hidden));
  if (auto learned = learned_section(summaries_)) contents.sections.push_back(*std::move(learned));
  add_supports(contents);
  add_answers(contents);
  return interfaces::write_report(path, contents);
}

}  // namespace prescene::service
