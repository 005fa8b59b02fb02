// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/explained.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/queries/camera_name.h"
#include "prescene/service/recording/frame_history.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

constexpr double kRounding = 1e-6;  // s

/// What the robot said that it does in the window; a folder of images says nothing.
core::Status read_actions(const ExplainOptions& options, queries::ExplainWindow& window,
                          std::vector<std::string>& remarks) {
  if (!interfaces::is_bag(options.path)) return core::ok_status();
  RecordingReadOptions read = options.read;
  read.check_data = false;  // it was, when it was opened
  PRESCENE_TRY(const auto reader, RecordingReader::open(options.path, read));
  ControlLog controls;
  for (;;) {
    PRESCENE_TRY(const auto entry, reader->next());
    if (!entry) break;
    if (entry->is_json || entry->message.topic != kControlTopic) continue;
    const auto text = interfaces::decode_cdr<interfaces::RosString>(entry->message.cdr, interfaces::kSmallMessage);
    if (!text) continue;  // The tracker refused it, and said so.
    controls.add(text->data, entry->message.source_ns);
  }
  controls.put_into(window, remarks);
  return core::ok_status();
}

/// "" where there is one.
std::string camera_of(const queries::ExplainWindow& window, const queries::DecidingFrame& deciding) {
  if (!window.start || deciding.frame >= window.frames.size()) return "";
  return queries::camera_name(*window.start->scene, window.frames[deciding.frame].observation.camera);
}

ordered_json value_json(const queries::EventValue& value, double shift = 0.0) {
  return {{"mean", value.mean + shift}, {"interval", {value.low + shift, value.high + shift}}};
}

ordered_json explanation_json(const queries::Explanation& e, double from) {
  ordered_json json = {{"event", belief::name_of(e.kind)}};
  if (!e.object.empty()) json["object"] = e.object;
  if (!e.partner.empty()) json["partner"] = e.partner;
  if (e.present_at_start) json["present_at_start"] = *e.present_at_start;
  json["probability"] = e.probability;
  json["interval"] = {e.low, e.high};
  json["log_bayes_factor"] = e.log_bayes_factor;
  if (e.time) json["time"] = value_json(*e.time, from);
  if (e.towards) json["towards_deg"] = value_json(*e.towards);
  if (e.speed) json["speed"] = value_json(*e.speed);
  if (e.impulse) json["impulse"] = value_json(*e.impulse);
  if (e.touched_at) json["touched_at"] = value_json(*e.touched_at);
  if (e.kind != belief::EventKind::kNothing && e.kind != belief::EventKind::kOther && e.time)
    json["effects"] = {{"tips", e.tips}, {"falls", e.falls}};
  if (!e.timeline.empty()) {
    ordered_json timeline = ordered_json::array();
    for (const belief::Interval& interval : e.timeline) {
      ordered_json entry = {{"relation", belief::to_string(interval.relation)}, {"subject", interval.subject}};
      if (!interval.other.empty()) entry["other"] = interval.other;
      entry["begin"] = interval.begin + from;
      entry["end"] = interval.end + from;
      timeline.push_back(std::move(entry));
    }
    json["timeline"] = std::move(timeline);
  }
  json["sentence"] = e.sentence;
  return json;
}

ordered_json change_json(const queries::SmallestChange& change) {
  ordered_json parts = ordered_json::array();
  for (const queries::ChangedPart& part : change.parts)
    parts.push_back({{"name", part.name},
                     {"unit", part.unit},
                     {"from", part.from},
                     {"to", part.to},
                     {"deviations", part.deviations}});
  return {{"wanted", change.wanted},
          {"wanted_probability", change.wanted_probability},
          {"found", change.found},
          {"deviations", change.size},
          {"parts", parts},
          {"probability", change.probability},
          {"interval", {change.low, change.high}},
          {"instances", change.instances},
          {"unchanged_probability", change.unchanged_probability},
          {"instances_searched", change.instances_searched},
          {"sentence", change.sentence}};
}

}  // namespace

bool WindowKeeper::add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief) {
  if (!any_) first_ns_ = observation.stamp_ns;
  any_ = true;
  const double t = core::seconds_of(observation.stamp_ns - first_ns_);
  if (t > to_ + kRounding) return false;
  last_ns_ = observation.stamp_ns;
  if (t <= from_ + kRounding)
    window_.start = std::move(belief);
  else
    window_.frames.push_back({observation, std::move(belief)});
  return true;
}

core::Result<Explained> explain_recording(const ReplayInput& input, const ExplainOptions& options,
                                          const TrackerSettings& settings, std::uint64_t seed, Backends& backends,
                                          const core::Cancellation& cancellation, const core::ProgressSink& progress) {
  if (!(options.from >= 0.0 && options.to > options.from))
    return core::invalid_input("the window from " + core::rounded_text(options.from) + " to " +
                               core::rounded_text(options.to) +
                               " s is none: give a --from of at least 0, and a --to that is later");
  PRESCENE_RETURN_IF_ERROR(queries::validate(options.query));
  queries::ExplainQuery query = options.query;
  if (!input.scene_text().empty()) {
    auto weights = interfaces::parse_event_weights(input.scene_text(), "the scene");
    if (!weights) return weights.status();
    query.weights = *weights;
  }
  PRESCENE_TRY(const auto tracker, Tracker::create(input.scene(), settings, seed, backends));
  WindowKeeper keeper(options.from, options.to);
  bool over = false;
  const auto summary = input.replay(*tracker, cancellation, progress,
                                    [&](const TrackerStep& step, const Tracker& at) -> core::Status {
                                      over = !keeper.add(step.observation, at.belief());
                                      return over ? core::cancelled("the window is over") : core::ok_status();
                                    },
                                    {});
  if (!summary && !over) return summary.status();
  if (cancellation.requested()) return core::cancelled("stopped on request before the window was tracked");
  queries::ExplainWindow& window = keeper.window();
  if (!window.start) {
    if (summary) PRESCENE_RETURN_IF_ERROR(check_steps(*summary, first_topics(settings, *input.scene())));
    return core::invalid_input("there is no frame before the window's start");
  }
  const double end = core::seconds_of(keeper.last_ns() - keeper.first_ns());
  const double between =
      window.frames.size() > 1
          ? core::seconds_of(window.frames.back().observation.stamp_ns - window.frames.front().observation.stamp_ns) /
                static_cast<double>(window.frames.size() - 1)
          : 0.1;
  if (window.frames.empty() || (!over && options.to > end + between + 0.01))
    return core::invalid_input("the window from " + core::rounded_text(options.from) + " to " +
                               core::rounded_text(options.to) + " s is not in the recording, whose last frame is at " +
                               fixed_text(end, 2) + " s: give an earlier --to" +
                               (window.frames.empty() ? " and an earlier --from" : ""));
  Explained explained;
  explained.from = core::seconds_of(window.start->stamp_ns - keeper.first_ns());
  explained.to = end;
  explained.step = window.frames.back().belief->step;
  PRESCENE_RETURN_IF_ERROR(read_actions(options, window, explained.remarks));
  PRESCENE_TRY(const auto likelihood, backends.make_likelihood());
  queries::ExplainContext context;
  context.simulation = backends.query_context(backends.pool());
  context.simulation.cancellation = &cancellation;
  context.likelihood = likelihood.get();
  context.settings = settings.filter;
  const core::Stopwatch watch;
  const double cpu = core::process_cpu_seconds();
  if (options.max_seconds) context.simulation.simulate_until = queries::deadline_after(*options.max_seconds);
  PRESCENE_TRY(explained.answer, queries::explain(window, query, context));
  explained.seconds = watch.seconds();
  explained.cpu_seconds = core::process_cpu_seconds() - cpu;
  explained.window = std::move(window);
  return explained;
}

ordered_json to_json(const Explained& explained) {
  const queries::ExplainAnswer& answer = explained.answer;
  ordered_json explanations = ordered_json::array(), objects = ordered_json::array(), frames = ordered_json::array();
  for (const queries::Explanation& e : answer.explanations) explanations.push_back(explanation_json(e, explained.from));
  for (const queries::WhereItIs& object : answer.objects)
    objects.push_back({{"object", object.object},
                       {"present", object.present},
                       {"mean", {object.mean.x(), object.mean.y(), object.mean.z()}},
                       {"radius_90", object.radius_90},
                       {"out_of_sight", object.out_of_sight}});
  for (const queries::DecidingFrame& frame : answer.frames) {
    ordered_json& entry = frames.emplace_back(ordered_json{{"time", frame.time + explained.from}});
    if (const std::string camera = camera_of(explained.window, frame); !camera.empty()) entry["camera"] = camera;
    entry["against_nothing"] = frame.against_nothing;
    entry["against_second"] = frame.against_second;
  }
  ordered_json remarks = answer.remarks;
  for (const std::string& remark : explained.remarks) remarks.push_back(remark);
  ordered_json json = {{"from", explained.from},
                       {"to", explained.to},
                       {"explanations", explanations},
                       {"objects", objects},
                       {"frames", frames}};
  if (answer.change) json["change"] = change_json(*answer.change);
  json.update(ordered_json{{"text", answer.text},
                           {"remarks", remarks},
                           {"cut_short", answer.cut_short},
                           {"simulated_instances", answer.simulated},
                           {"weighed_instances", answer.evaluated},
                           {"failed_instances", answer.failed},
                           {"stepper", answer.stepper},
                           {"wall_seconds", explained.seconds},
                           {"cpu_seconds", explained.cpu_seconds}});
  return json;
}

}  // namespace prescene::service
