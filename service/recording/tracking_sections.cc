// SPDX-License-Identifier: Apache-2.0
#include "tracking_sections.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "prescene/core/clock.h"
#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using belief::TrackState;
using core::fixed_text;

constexpr double kChiSquaredPlane90 = 4.605170186;  // 2 degrees of freedom
constexpr double kLeastReach = 0.04;                // m, of a map to either side
constexpr int kMapCells = 60;                       // in each direction

const ObjectSummary* find(const BeliefSummary& summary, const std::string& name) {
  const auto found = std::find_if(summary.objects.begin(), summary.objects.end(),
                                  [&](const ObjectSummary& object) { return object.name == name; });
  return found == summary.objects.end() ? nullptr : &*found;
}

/// In the order in which they come up.
std::vector<std::string> names_in(const SessionSummaries& summaries) {
  std::vector<std::string> names;
  for (const auto& [stamp_ns, summary] : summaries)
    for (const ObjectSummary& object : summary.objects)
      if (std::find(names.begin(), names.end(), object.name) == names.end()) names.push_back(object.name);
  return names;
}

double since_start(const SessionSummaries& summaries, core::TimeNs stamp_ns) {
  return core::seconds_of(stamp_ns - summaries.begin()->first);
}

/// A curve an object; `value` is not finite where there is none.
interfaces::ChartBlock chart(const SessionSummaries& summaries, const std::string& caption, const std::string& y_label,
                             const std::function<double(core::TimeNs, const ObjectSummary&)>& value) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  interfaces::ChartBlock block{caption, "time, s", y_label, {}, true};
  for (const std::string& name : names_in(summaries)) {
    interfaces::ChartBlock::Curve curve{name, {}};
    bool any = false;
    for (const auto& [stamp_ns, summary] : summaries) {
      const ObjectSummary* object = find(summary, name);
      const double y = object ? value(stamp_ns, *object) : kNone;
      any = any || std::isfinite(y);
      curve.points.emplace_back(since_start(summaries, stamp_ns), y);
    }
    if (any) block.curves.push_back(std::move(curve));
  }
  return block;
}

interfaces::StateBandBlock state_band(const SessionSummaries& summaries) {
  interfaces::StateBandBlock band;
  band.caption = "State of each object in each frame";
  for (const TrackState state : {TrackState::kTracked, TrackState::kDoubtful, TrackState::kUnseen, TrackState::kLost})
    band.states.push_back(belief::to_string(state));
  for (const std::string& name : names_in(summaries)) {
    interfaces::StateBandBlock::Lane lane{name, {}};
    for (auto at = summaries.begin(); at != summaries.end(); ++at) {
      const ObjectSummary* object = find(at->second, name);
      if (!object) continue;
      const double begin = since_start(summaries, at->first);
      const auto next = std::next(at);
      const double end = next == summaries.end() ? begin : since_start(summaries, next->first);
      const std::string state = belief::to_string(object->state);
      if (!lane.segments.empty() && lane.segments.back().state == state && lane.segments.back().end == begin)
        lane.segments.back().end = end;
      else
        lane.segments.push_back({begin, end, state});
    }
    band.lanes.push_back(std::move(lane));
  }
  return band;
}

std::string estimate_text(const belief::ParameterEstimate& estimate) {
  return core::rounded_text(estimate.mean) + " ± " + core::rounded_text(estimate.standard_deviation);
}

/// Of the Gaussian of an object's position, from above.
belief::HeatMap map_of(const ObjectSummary& object) {
  const Eigen::Matrix2d spread = object.covariance.block<2, 2>(3, 3) + 1e-8 * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d mean = object.X_WO.translation.head<2>();
  const double reach = std::max(kLeastReach, 3.0 * std::sqrt(std::max(spread(0, 0), spread(1, 1))));
  belief::HeatMap map;
  map.nx = map.ny = kMapCells;
  map.cell = 2.0 * reach / kMapCells;
  map.x0 = mean.x() - reach;
  map.y0 = mean.y() - reach;
  const double determinant = spread(0, 0) * spread(1, 1) - spread(0, 1) * spread(1, 0);
  double sum = 0.0;
  for (int y = 0; y < map.ny; ++y)
    for (int x = 0; x < map.nx; ++x) {
      const double dx = map.x0 + (x + 0.5) * map.cell - mean.x(), dy = map.y0 + (y + 0.5) * map.cell - mean.y();
      const double squares =
          (spread(1, 1) * dx * dx - 2.0 * spread(0, 1) * dx * dy + spread(0, 0) * dy * dy) / determinant;
      map.mass.push_back(std::exp(-0.5 * squares));
      sum += map.mass.back();
    }
  for (double& mass : map.mass) mass /= sum;
  return map;
}

struct HiddenTime {
  core::TimeNs begin_ns = 0, end_ns = 0;
  const ObjectSummary* last = nullptr;
};

/// The longest time that the object was out of sight in a row.
HiddenTime longest_hidden(const SessionSummaries& summaries, const std::string& name) {
  HiddenTime longest, now;
  for (const auto& [stamp_ns, summary] : summaries) {
    const ObjectSummary* object = find(summary, name);
    if (!object || object->state != TrackState::kUnseen) {
      now = {};
      continue;
    }
    if (!now.last) now.begin_ns = stamp_ns;
    now.end_ns = stamp_ns;
    now.last = object;
    if (!longest.last || now.end_ns - now.begin_ns > longest.end_ns - longest.begin_ns) longest = now;
  }
  return longest;
}

}  // namespace

std::string state_changes(const BeliefSummary& before, const BeliefSummary& after) {
  std::string text;
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  for (const ObjectSummary& object : after.objects) {
    const ObjectSummary* was = find(before, object.name);
    if (!was)
      add(object.name + " is new");
    else if (was->state != object.state)
      add(object.name + ": " + belief::to_string(was->state) + ", then " + belief::to_string(object.state));
  }
  for (const ObjectSummary& object : before.objects)
    if (!find(after, object.name)) add(object.name + " is forgotten");
  return text;
}

std::vector<interfaces::ReportBlock> tracking_blocks(const SessionSummaries& summaries,
                                                     const SessionResiduals& residuals, const TrackingScore& score) {
  std::vector<interfaces::ReportBlock> blocks;
  if (summaries.empty() || names_in(summaries).empty()) return blocks;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto residual = [&](core::TimeNs stamp_ns, const ObjectSummary& object) {
    const auto frame = residuals.find(stamp_ns);
    if (frame == residuals.end()) return kNone;
    const auto found = frame->second.find(object.name);
    return found == frame->second.end() ? kNone : 1e3 * found->second;
  };
  const auto position_error = [&](core::TimeNs stamp_ns, const ObjectSummary& object) {
    const auto error = score.error_at(stamp_ns, object.name);
    return error && object.state != TrackState::kLost ? 1e3 * error->position_error : kNone;
  };
  const auto turn_error = [&](core::TimeNs stamp_ns, const ObjectSummary& object) {
    const auto error = score.error_at(stamp_ns, object.name);
    return error && object.state != TrackState::kLost ? error->turn_error * 180.0 / std::numbers::pi : kNone;
  };
  blocks.emplace_back(state_band(summaries));
  const auto add = [&blocks](interfaces::ChartBlock block) {
    if (!block.curves.empty()) blocks.emplace_back(std::move(block));
  };
  add(chart(summaries, "Confidence", "probability",
            [](core::TimeNs, const ObjectSummary& object) { return object.confidence; }));
  add(chart(summaries, "Residual: median distance of measured depth from the believed surface", "mm", residual));
  add(chart(summaries, "Error of the position, against the simulated truth", "mm", position_error));
  add(chart(summaries, "Error of the rotation, up to symmetry", "deg", turn_error));
  add(chart(summaries, "Evidence for a visible pixel", "nats",
            [](core::TimeNs, const ObjectSummary& object) { return object.evidence_per_pixel; }));
  add(chart(summaries, "Height of the object's origin", "m", [](core::TimeNs, const ObjectSummary& object) {
    return object.state == TrackState::kLost ? kNone : object.X_WO.translation.z();
  }));
  return blocks;
}

std::optional<interfaces::ReportSection> learned_section(const SessionSummaries& summaries) {
  if (summaries.empty()) return std::nullopt;
  interfaces::TableBlock table{
      "Before: the scene's priors, or what an earlier session learned",
      {"object", "parameter", "before", "now", "90 % interval", "learned at, s", "from motions"},
      {}};
  const BeliefSummary& last = summaries.rbegin()->second;
  for (const ObjectSummary& object : last.objects) {
    const ObjectSummary* first = nullptr;
    for (auto at = summaries.begin(); at != summaries.end() && !first; ++at) first = find(at->second, object.name);
    for (const belief::ParameterEstimate& now : object.parameters) {
      const auto before = std::find_if(first->parameters.begin(), first->parameters.end(),
                                       [&](const auto& other) { return other.name == now.name; });
      const double at = since_start(summaries, object.learned_ns);
      const std::string when = object.lessons == 0 ? "not yet" : at < 0.0 ? "earlier session" : fixed_text(at, 1);
      table.rows.push_back({object.name, now.name, before == first->parameters.end() ? "" : estimate_text(*before),
                            estimate_text(now), core::rounded_text(now.low) + " to " + core::rounded_text(now.high),
                            when, std::to_string(object.lessons)});
    }
  }
  if (table.rows.empty()) return std::nullopt;
  return interfaces::ReportSection{"Physical parameters, and what was learned of them", {std::move(table)}};
}

std::optional<interfaces::ReportSection> hidden_section(const SessionSummaries& summaries, const belief::Scene& scene,
                                                        const TrackingScore& score) {
  interfaces::ReportSection section{"Out of sight", {}};
  for (const std::string& name : names_in(summaries)) {
    const HiddenTime hidden = longest_hidden(summaries, name);
    if (!hidden.last) continue;
    const Eigen::Vector3d deviations = hidden.last->covariance.diagonal().tail<3>().cwiseSqrt();
    const double reach = 1e3 * std::sqrt(kChiSquaredPlane90);
    std::string text = name + " was not seen from " + fixed_text(since_start(summaries, hidden.begin_ns), 2) + " to " +
                       fixed_text(since_start(summaries, hidden.end_ns), 2) +
                       " s. In the last of these frames it is believed to be within " +
                       fixed_text(reach * deviations.x(), 0) + " mm along x and " +
                       fixed_text(reach * deviations.y(), 0) + " mm along y of the middle of the map (90 %)";
    if (const auto error = score.error_at(hidden.end_ns, name))
      text += "; it truly was " + fixed_text(1e3 * error->position_error, 0) + " mm from there";
    section.blocks.emplace_back(interfaces::TextBlock{text + "."});
    interfaces::HeatMapBlock map{
        "Where " + name + " may be at " + fixed_text(since_start(summaries, hidden.end_ns), 2) + " s, from above",
        map_of(*hidden.last), interfaces::support_outlines(scene)};
    section.blocks.emplace_back(std::move(map));
  }
  if (section.blocks.empty()) return std::nullopt;
  return section;
}

}  // namespace prescene::service
