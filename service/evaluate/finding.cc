// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/finding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/core/clock.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/geometry/pose_error.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/service/evaluate/pose_auc.h"
#include "prescene/service/evaluate/simulated_supports.h"

namespace prescene::service {
namespace {

constexpr double kRight = 0.02;       // m of ADD-S, the usual threshold of success
constexpr double kSurelyFound = 0.5;  // confidence
constexpr int kSurfacePoints = 1000;  // that ADD-S is the mean of
constexpr double kHalfHidden = 0.75;  // visible share below which an object counts as partly hidden

std::vector<geometry::Vector3d> surface_points(const belief::ObjectModel& model) {
  std::vector<geometry::Vector3d> points;
  for (const geometry::SurfacePoint& point : geometry::sample_surface(*model.visual, kSurfacePoints, 1))
    points.push_back(point.position);
  return points;
}

std::string text_of(ListedSupports listed) {
  switch (listed) {
    case ListedSupports::kAll:
      return "all supports listed";
    case ListedSupports::kNone:
      return "no support listed";
    case ListedSupports::kSome:
      return "some supports listed";
  }
  return {};
}

void count(const FoundObject& object, const std::string& group, std::vector<FindingRow>& rows) {
  auto row = std::find_if(rows.begin(), rows.end(), [&](const FindingRow& r) { return r.group == group; });
  if (row == rows.end()) {
    rows.push_back({group});
    row = rows.end() - 1;
  }
  const bool wrong = object.reported && !object.right();
  ++row->looked_for;
  row->expected += object.expected ? 1 : 0;
  row->found += object.expected && object.right() ? 1 : 0;
  row->wrong += wrong ? 1 : 0;
  row->sure_wrong += wrong && object.confidence >= kSurelyFound ? 1 : 0;
}

}  // namespace

bool FoundObject::right() const { return reported && adds_m < kRight; }

core::Result<FindingReport> evaluate_finding(const FindingOptions& options, core::ThreadPool& threads,
                                             const core::ProgressSink& progress,
                                             const core::Cancellation* cancellation) {
  PRESCENE_TRY(auto batch, rendering::make_likelihood_batch(options.likelihood));
  const auto renderer = rendering::make_reference_renderer();
  FindingReport report;
  report.rows = {{"all"}};
  std::vector<double> errors;
  int of_five = 0, right = 0, wrong = 0;
  for (int i = 0; i < options.frames; ++i) {
    if (cancellation != nullptr && cancellation->requested()) return core::cancelled("stopped on request");
    const std::uint64_t number = options.first + static_cast<std::uint64_t>(i);
    if (progress) progress({static_cast<double>(i) / options.frames, std::nullopt, "room " + std::to_string(number)});
    PRESCENE_TRY(const SupportsFrame frame, simulate_supports(number, *renderer));
    filter::FilterSettings settings;
    settings.learned = options.learned;
    filter::ParticleFilter filter(*batch, *renderer, threads, settings);
    const belief::Belief start = filter.start(frame.scene, number);
    const double before = core::process_cpu_seconds();
    const filter::StepResult result = filter.step(start, frame.observation, {});
    const double seconds = core::process_cpu_seconds() - before;
    PRESCENE_RETURN_IF_ERROR(result.frame_status);
    ++report.frames;
    report.cpu_s += seconds;
    report.most_cpu_s = std::max(report.most_cpu_s, seconds);
    if (frame.truth.size() == 5) ++of_five, report.cpu_s_of_five += seconds;
    for (std::size_t k = 0; k < frame.truth.size(); ++k) {
      const belief::ObjectBelief& object = result.belief.objects[k];
      const belief::ObjectEstimate estimate = belief::estimate(result.belief, object);
      const TrueObject& truth = frame.truth[k];
      FoundObject found;
      found.room = number;
      found.object = object.name;
      found.stands_on = truth.stands_on;
      found.visible_share = truth.visible_share;
      found.expected = truth.expected;
      found.reported = object.state == belief::TrackState::kTracked || object.state == belief::TrackState::kDoubtful;
      found.adds_m = std::numeric_limits<double>::infinity();
      if (found.reported) {
        const geometry::AddsEvaluator evaluator(surface_points(frame.scene->model_of(frame.scene->objects[k])));
        found.adds_m = evaluator.adds(estimate.mean, truth.X_WO);
        found.confidence = estimate.confidence;
        (found.right() ? right : wrong)++;
        (found.right() ? report.right_confidence : report.wrong_confidence) += estimate.confidence;
      }
      if (found.right()) errors.push_back(found.adds_m);
      count(found, "all", report.rows);
      count(found, text_of(frame.listed), report.rows);
      count(found, std::to_string(frame.supports) + " supports", report.rows);
      count(found, frame.has_floor ? "floor in view" : "no floor", report.rows);
      if (found.stands_on.rfind("on ", 0) == 0) count(found, "on another thing", report.rows);
      count(found, found.visible_share < kHalfHidden ? "partly hidden" : "mostly visible", report.rows);
      report.objects.push_back(std::move(found));
    }
  }
  std::sort(report.rows.begin() + 1, report.rows.end(),
            [](const FindingRow& a, const FindingRow& b) { return a.group < b.group; });
  report.median_adds_m = median_of(errors);
  report.right_confidence /= std::max(1, right);
  report.wrong_confidence /= std::max(1, wrong);
  report.cpu_s /= std::max(1, report.frames);
  report.cpu_s_of_five /= std::max(1, of_five);
  return report;
}

nlohmann::ordered_json to_json(const FindingReport& report) {
  nlohmann::ordered_json json;
  json["frames"] = report.frames;
  json["median_adds_m"] = report.median_adds_m;
  json["right_confidence"] = report.right_confidence;
  json["wrong_confidence"] = report.wrong_confidence;
  json["cpu_s"] = report.cpu_s;
  json["most_cpu_s"] = report.most_cpu_s;
  json["cpu_s_of_five"] = report.cpu_s_of_five;
  json["groups"] = nlohmann::ordered_json::array();
  for (const FindingRow& row : report.rows)
    json["groups"].push_back({{"group", row.group},
                              {"looked_for", row.looked_for},
                              {"expected", row.expected},
                              {"found", row.found},
                              {"wrong", row.wrong},
                              {"sure_wrong", row.sure_wrong}});
  json["objects"] = nlohmann::ordered_json::array();
  for (const FoundObject& object : report.objects)
    json["objects"].push_back(
        {{"room", object.room},
         {"object", object.object},
         {"stands_on", object.stands_on},
         {"visible_share", object.visible_share},
         {"expected", object.expected},
         {"reported", object.reported},
         {"adds_m", std::isfinite(object.adds_m) ? nlohmann::ordered_json(object.adds_m) : nlohmann::ordered_json()},
         {"confidence", object.confidence}});
  return json;
}

}  // namespace prescene::service
