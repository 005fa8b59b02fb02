// SPDX-License-Identifier: Apache-2.0
// `replay` without a bus: the recording is tracked in this process.
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "final_states.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/queries/relation_history.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/recording/explained_again.h"
#include "prescene/service/recording/happened.h"
#include "prescene/service/recording/session_report.h"
#include "prescene/service/recording/support_score.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/topics.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/view/recorded_page.h"
#include "replay_options.h"
#include "replay_text.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

/// ", from 2 to 3 s"; "" of a whole recording.
std::string window_text(const RecordingReadOptions& read) {
  if (read.from <= 0.0 && !std::isfinite(read.to)) return "";
  return ", from " + core::rounded_text(read.from) +
         (std::isfinite(read.to) ? " to " + core::rounded_text(read.to) + " s" : " s on");
}

/// Writes what was learned where it is to be kept.
core::Status keep_learned(const ReplayOptions& options, const Tracker& tracker, VerbContext& context) {
  if (options.learned.empty()) return core::ok_status();
  const std::string text = interfaces::learned_yaml(tracker.learned());
  PRESCENE_RETURN_IF_ERROR(interfaces::write_file(options.learned, std::string_view(text)));
  core::log(context.log(), core::LogLevel::kInfo, "what was learned was written to " + options.learned);
  return core::ok_status();
}

/// The history of relations of what is replayed; everything of it, whatever its length.
class ReplayTimeline {
 public:
  /// Does nothing unless the options ask for it.
  ReplayTimeline(const ReplayOptions& options, Backends& backends)
      : options_(options), is_asked_(!options.timeline_file.empty() || !(options.timeline == TimelineOptions{})) {
    if (is_asked_) context_ = backends.query_context(backends.pool());
  }
  void add(const belief::Belief& belief) {
    if (!is_asked_) return;
    // Two cameras may have taken frames at one instant.
    const bool is_at_once = last_ && belief.stamp_ns == last_ns_ && !belief.cameras.empty();
    last_ = belief.scene;
    last_ns_ = belief.stamp_ns;
    if (!is_at_once) static_cast<void>(history_.add(belief, context_));  // the history counts what can't be judged
  }
  /// Answers the question of the options, and writes the file.
  core::Status finish(VerbContext& context) {
    if (!is_asked_) return core::ok_status();
    if (!last_) return core::not_found("--timeline: there was no frame");
    PRESCENE_TRY(const ordered_json question, timeline_question(options_.timeline));
    PRESCENE_TRY(const belief::Query query, belief::query_from_json(belief::json_text(question)));
    context_.timeline = [this] { return history_.timeline(); };
    PRESCENE_TRY(const belief::TimelineAnswer answer,
                 queries::observed(*last_, std::get<belief::TimelineQuery>(query.what), context_));
    belief::Answer answered;
    answered.what = answer;
    document_ = belief::to_json(answered).at("timeline");
    if (options_.timeline_file.empty()) return core::ok_status();
    answered.what = belief::match(*history_.timeline(), {});
    const std::string text = belief::json_text(belief::to_json(answered).at("timeline"), 2) + "\n";
    PRESCENE_RETURN_IF_ERROR(interfaces::write_file(options_.timeline_file, std::string_view(text)));
    core::log(context.log(), core::LogLevel::kInfo, "timeline written to " + options_.timeline_file);
    return core::ok_status();
  }
  const ordered_json& json() const { return document_; }
  /// Of what was asked; the file alone says nothing here.
  std::string text() const {
    return document_.is_null() || options_.timeline == TimelineOptions{} ? "" : timeline_text(document_);
  }

 private:
  const ReplayOptions& options_;
  bool is_asked_;
  queries::QueryContext context_;
  std::shared_ptr<const belief::Scene> last_;
  core::TimeNs last_ns_ = 0;
  ordered_json document_;
  queries::RelationHistory history_{{.seconds = 1e9, .most_intervals = 100'000}};
};

}  // namespace

core::Status replay_here(const ReplayOptions& options, VerbContext& context) {
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(replay_input_of(options), context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_TRY(TrackerSettings settings, replay_settings_of(options, input));
  settings.assembler.robot = input.robot();
  if (!options.proposals.empty()) {
    PRESCENE_TRY(settings.filter.learned, load_proposals(options.proposals, *input.scene()));
  }
  if (options.read.from > 0.0)
    core::log(context.log(), core::LogLevel::kInfo,
              "the belief begins anew at " + core::rounded_text(options.read.from) +
                  " s, so its steps are not compared with recorded ones");
  Backends backends(context.pool(), options.backends);
  const std::uint64_t seed =
      context.options().seed_given ? context.options().seed : input.seed_or(context.options().seed);
  PRESCENE_TRY(const auto tracker, Tracker::create(input.scene(), settings, seed, backends));
  tracker->report_supports(true);
  TrackingScore score(input.scene());
  SupportScore supports;
  FinalStates states;
  ReplayTimeline timeline(options, backends);
  ExplainedAgain explained(input, options.input, settings, backends, context.cancellation());
  SessionReport report(input.scene(), settings, backends);
  report.set_proposals(options.proposals);
  RecordedPage page({.title = std::filesystem::path(options.input).filename().string()});
  ordered_json steps = ordered_json::array();
  std::optional<core::TimeNs> first_ns;
  const StepSink on_step = [&](const TrackerStep& step, const Tracker& at) -> core::Status {
    const BeliefSummary summary = summary_of(*at.belief());
    if (!first_ns) first_ns = summary.stamp_ns;
    score.add(summary);
    states.add(summary);
    timeline.add(*at.belief());
    explained.add(step.observation, at.belief());
    if (!options.report.empty()) {
      report.set_scene(at.belief()->scene);
      report.add(summary);
      report.add(step.observation);
      page.add({at.belief(), step.observation, step.record.seconds, step.record.degraded});
    }
    const std::vector<SupportFrame> support_frames = supports.add(summary.stamp_ns, step.supports);
    if (!context.options().json) return core::ok_status();  // Long recordings have many steps.
    ordered_json record = to_json(step.record);
    record["objects"] = to_json(summary)["objects"];
    add_learned_seconds(*first_ns, record["objects"]);
    record["supports"] = ordered_json::array();
    for (const SupportFrame& frame : support_frames) record["supports"].push_back(to_json(frame));
    steps.push_back(std::move(record));
    return core::ok_status();
  };
  DamagedRecords damaged;
  std::optional<HappenedRecord> happened;
  const JsonSink on_json = [&](const std::string& topic, const std::string& json,
                               core::TimeNs time_ns) -> core::Status {
    if (topic == kAnswerTopic) {
      if (!options.report.empty()) page.add_answer(json);
      return explained.add_answer(json, time_ns);
    }
    if (topic == kTruthTopic) {
      const auto truth = truth_from_json(json);
      if (truth)
        score.add(*truth);
      else
        damaged.add(truth.status());
    } else if (topic == kOutcomeTopic) {
      if (const auto outcomes = outcome_record_from_json(json); !outcomes) damaged.add(outcomes.status());
    } else if (topic == kHappenedTopic) {
      if (auto record = happened_from_json(json))
        happened = *std::move(record);
      else
        damaged.add(record.status());
    }
    return core::ok_status();
  };
  const core::Result<ReplaySummary> summary =
      input.replay(*tracker, context.cancellation(), context.progress("replaying"), on_step, on_json);
  context.end_progress();
  if (!summary) return summary.status();
  PRESCENE_RETURN_IF_ERROR(keep_learned(options, *tracker, context));
  PRESCENE_RETURN_IF_ERROR(timeline.finish(context));
  add_errors(score, steps);
  report.set_supports(supports);
  const std::vector<ObjectTrackingScore> rows = score.rows();
  ordered_json support_rows = ordered_json::array();
  for (const SupportRow& row : supports.rows()) support_rows.push_back(to_json(row));
  if (!options.report.empty()) {
    report.set_page(page.page());
    PRESCENE_RETURN_IF_ERROR(report.write(options.report, score));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  if (context.options().json) {  // The text has them itself.
    for (const std::string& problem : {summary->loss, summary->first_refusal}) {
      if (!problem.empty()) core::log(context.log(), core::LogLevel::kWarning, options.input + ": " + problem);
    }
  }
  if (damaged.count() > 0) core::log(context.log(), core::LogLevel::kWarning, options.input + ": " + damaged.text());
  warn_of_unchecked(options, summary->unchecked, context);
  context.print(
      {{"recording", options.input},
       {"seed", seed},
       {"messages", summary->messages},
       {"refused", summary->refused},
       {"skipped_frames", summary->skipped},
       {"last_skip", summary->last_skip},
       {"followed_step_records", summary->followed_step_records},
       {"compared_steps", summary->compared},
       {"different_steps", summary->different},
       {"compared_explanations", explained.compared()},
       {"different_explanations", explained.different()},
       {"began_anew", summary->began_anew},
       {"loss", summary->loss},
       {"missing", summary->missing},
       {"damaged_records", damaged.count()},
       {"unchecked", summary->unchecked},
       {"learned", options.learned},
       {"proposals", options.proposals},
       {"degraded", degraded_json(*summary)},
       {"objects", states.json()},
       {"tracking", tracking_json(rows)},
       {"supports", support_rows},
       {"happened", happened ? to_json(*happened) : ordered_json()},
       {"timeline", timeline.json()},
       {"steps", steps}},
      std::to_string(summary->steps) + " steps from " + std::to_string(summary->messages) + " messages, " +
          std::to_string(summary->skipped) + " frames skipped\n" +
          (options.proposals.empty() ? "" : "proposals of " + options.proposals + "\n") +
          (summary->followed_step_records ? std::to_string(summary->compared - summary->different) + " of " +
                                                std::to_string(summary->compared) + " steps have the recorded bits\n"
                                          : "") +
          (explained.compared() > 0
               ? std::to_string(explained.compared() - explained.different()) + " of " +
                     std::to_string(explained.compared()) + " recorded explanations have the recorded bits\n"
               : "") +
          states.text() + tracking_text(rows) + supports_text(supports.rows()) +
          (happened ? happened_text(*happened) : "") + timeline.text() + warnings_text(*summary));
  if (summary->cancelled) return core::cancelled("stopped on request; what was done is printed");
  if (summary->different > 0) {
    return core::unavailable("step " + std::to_string(*summary->first_different_step) +
                             " is the first that differs from the recording: another version, machine or setting?");
  }
  if (explained.different() > 0)
    return core::unavailable(explained.first_difference() + ": another version, machine or setting?");
  PRESCENE_RETURN_IF_ERROR(check_files_are_there(options, summary->missing));
  return check_steps(*summary, first_topics(settings, *input.scene())).at(options.input + window_text(options.read));
}

}  // namespace prescene::service
