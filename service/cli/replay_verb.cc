// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "final_states.h"
#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/queries/relation_history.h"
#include "prescene/service/live/bus_replay.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/explained_again.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/happened.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/session_report.h"
#include "prescene/service/recording/support_score.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/topics.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/view/recorded_page.h"
#include "relations_options.h"
#include "replay_text.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

struct ReplayOptions {
  std::string input;
  BackendSettings backends;
  std::string scene;
  std::string report;
  std::string proposals;
  std::string learned;
  bool over_dds = false;
  BusReplayOptions bus;
  RecordingReadOptions read;
  std::vector<std::string> questions;
  std::string timeline_file;
  TimelineOptions timeline;
  double depth_scale = 0.001;
  double frame_rate = 30.0;
  TrackerSettings tracker;
  const CLI::App* verb = nullptr;
};

/// "SECONDS:JSON".
core::Result<TimedQuestion> timed_question(const std::string& text) {
  const std::size_t colon = text.find(':');
  char* end = nullptr;
  const double at = std::strtod(text.c_str(), &end);
  const bool is_time = colon != std::string::npos && end == text.c_str() + colon && at >= 0.0 && std::isfinite(at);
  if (!is_time || !parse_or_discard(std::string_view(text).substr(colon + 1)).is_object()) {
    return core::invalid_input("--ask SECONDS:JSON, as 2.5:'{\"where\": {}}'; this is not: " + text);
  }
  return TimedQuestion{at, text.substr(colon + 1)};
}

ReplayInputOptions input_of(const ReplayOptions& options) {
  return {options.input, options.scene, options.depth_scale, options.frame_rate, options.read, Symmetries::kSuggested};
}

/// What the recording was made with, but for what the command line says otherwise.
core::Result<TrackerSettings> settings_of(const ReplayOptions& options, const ReplayInput& input) {
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *input.scene()));
  if (!input.has_settings()) return options.tracker;
  PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
  return with_given(*options.verb, std::move(recorded), options.tracker);
}

/// ", from 2 to 3 s"; "" of a whole recording.
std::string window_text(const RecordingReadOptions& read) {
  if (read.from <= 0.0 && !std::isfinite(read.to)) return "";
  return ", from " + core::rounded_text(read.from) +
         (std::isfinite(read.to) ? " to " + core::rounded_text(read.to) + " s" : " s on");
}

void warn_of_unchecked(const ReplayOptions& options, const std::string& unchecked, VerbContext& context) {
  if (!unchecked.empty()) core::log(context.log(), core::LogLevel::kInfo, options.input + ": " + unchecked);
}

/// kDataLoss where files of the recording are not there; --salvage takes what is.
core::Status check_files(const ReplayOptions& options, const std::string& missing) {
  if (missing.empty() || options.read.salvage) return core::ok_status();
  return core::data_loss(options.input + ": " + missing + "; --salvage takes what is there");
}

/// Whether every question has its answer.
core::Status check_answers(const std::vector<BusReplayResult::Answered>& answers) {
  for (const BusReplayResult::Answered& answered : answers) {
    if (answered.answer.empty()) return core::unavailable("not every question was answered");
    PRESCENE_RETURN_IF_ERROR(belief::error_from_json(parse_or_discard(answered.answer))
                                 .at("the question at " + fixed_text(answered.at, 2) + " s"));
  }
  return core::ok_status();
}

/// The frames that were played, now that it is known what was believed of each.
core::Status add_frames(const ReplayOptions& options, SessionReport& report) {
  RecordingReadOptions read = options.read;
  read.check_data = false;  // It was.
  PRESCENE_TRY(const auto reader, RecordingReader::open(options.input, read));
  for (;;) {
    PRESCENE_TRY(const auto entry, reader->next());
    if (!entry) return core::ok_status();
    if (!entry->is_json) report.add(entry->message);
  }
}

core::Status run_over_dds(ReplayOptions& options, VerbContext& context) {
  for (const std::string& text : options.questions) {
    PRESCENE_TRY(TimedQuestion question, timed_question(text));
    options.bus.questions.push_back(std::move(question));
  }
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(input_of(options), context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_TRY(const TrackerSettings settings, settings_of(options, input));
  std::stable_sort(options.bus.questions.begin(), options.bus.questions.end(),
                   [](const TimedQuestion& a, const TimedQuestion& b) { return a.at < b.at; });
  options.bus.read = options.read;
  options.bus.read.check_data = options.read.salvage;  // Checked when it was opened; its loss is reported here.
  TrackingScore score(input.scene());
  Backends backends(context.pool(), options.backends);
  SessionReport report(input.scene(), settings, backends);
  ForeseenAndCame foreseen(input.scene(), first_topics(settings, *input.scene()).depth);
  DamagedRecords damaged;
  FinalStates states;
  PRESCENE_TRY(BusReplayResult result,
               replay_over_bus(options.input, options.bus, context.cancellation(), context.progress("replaying"),
                               context.log(), [&](const RecordedEntry& entry) {
                                 foreseen.add(entry);
                                 if (!entry.is_json || entry.message.topic != kTruthTopic) return;
                                 const std::string json(entry.message.cdr.begin(), entry.message.cdr.end());
                                 const auto truth = truth_from_json(json);
                                 if (truth)
                                   score.add(*truth);
                                 else
                                   damaged.add(truth.status());
                               }));
  damaged.add(foreseen.first_damage(), foreseen.damaged_records());
  for (const BeliefSummary& summary : result.beliefs) {
    score.add(summary);
    report.add(summary);
    foreseen.add(summary);
    states.add(summary);
  }
  ordered_json answers = ordered_json::array();
  for (const BusReplayResult::Answered& answered : result.answers) {
    const ordered_json answer = parse_or_discard(answered.answer);
    answers.push_back({{"at", answered.at},
                       {"seconds", answered.seconds},
                       {"answer", answer.is_discarded() ? ordered_json() : answer}});
    report.add_answer(answered.at, answered.answer);
    foreseen.add(answered.at, answered.question, answered.answer);
  }
  report.set_foreseen(foreseen);
  const std::vector<ObjectTrackingScore> rows = score.rows();
  if (!options.report.empty()) {
    PRESCENE_RETURN_IF_ERROR(add_frames(options, report));
    PRESCENE_RETURN_IF_ERROR(report.write(options.report, score));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  if (!result.loss.empty()) core::log(context.log(), core::LogLevel::kWarning, options.input + ": " + result.loss);
  if (damaged.count() > 0) core::log(context.log(), core::LogLevel::kWarning, options.input + ": " + damaged.text());
  warn_of_unchecked(options, result.unchecked, context);
  context.print({{"recording", options.input},
                 {"messages", result.messages},
                 {"rounds", result.rounds},
                 {"beliefs", result.beliefs.size()},
                 {"objects", states.json()},
                 {"tracking", tracking_json(rows)},
                 {"answers", answers},
                 {"foreseen", foreseen_json(foreseen)},
                 {"loss", result.loss},
                 {"missing", result.missing},
                 {"damaged_records", damaged.count()},
                 {"unchecked", result.unchecked}},
                std::to_string(result.messages) + " messages played" +
                    (options.bus.loop ? " in " + counted(result.rounds, "round") : "") + ", " +
                    std::to_string(result.beliefs.size()) + " beliefs came back" +
                    (options.bus.loop ? " in the last one\n" : "\n") + answers_text(result.answers) +
                    foreseen_text_of(foreseen) + states.text() + tracking_text(rows));
  // A loop has no other end.
  if (context.cancellation().requested() && !options.bus.loop)
    return core::cancelled("stopped on request; what was done is printed");
  PRESCENE_RETURN_IF_ERROR(check_answers(result.answers));
  return check_files(options, result.missing);
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

core::Status run_here(ReplayOptions& options, VerbContext& context) {
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(input_of(options), context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_TRY(TrackerSettings settings, settings_of(options, input));
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
  PRESCENE_RETURN_IF_ERROR(check_files(options, summary->missing));
  return check_steps(*summary, first_topics(settings, *input.scene())).at(options.input + window_text(options.read));
}

/// kInvalidInput for an option that would do nothing.
core::Status check_options(const ReplayOptions& options) {
  const auto given = [&options](const char* name) { return options.verb->count(name) > 0; };
  if (options.over_dds && given("--proposals"))
    return core::invalid_input("--proposals is for replaying here: give it to the running `serve` instead");
  if (!options.over_dds) {
    for (const char* name : kDomainOptions)
      if (given(name))
        return core::invalid_input(std::string(name) + " is for --over-dds: leave it out, or give that too");
  } else {
    for (const char* name : {"--timeline", "--interval", "--other", "--relation"})
      if (given(name))
        return core::invalid_input(std::string(name) +
                                   " goes without --over-dds: with it, ask the `serve` that tracks");
    for (const char* name : {"--learned", "--new-objects"})
      if (given(name))
        return core::invalid_input(std::string(name) + " goes without --over-dds: give it to the `serve` that tracks");
  }
  if (!(options.read.from < options.read.to))
    return core::invalid_input("--from " + core::rounded_text(options.read.from) + " is not before --to " +
                               core::rounded_text(options.read.to) + ": exchange them");
  if (!interfaces::is_bag(options.input)) {
    for (const char* name : {"--from", "--to", "--all-parts"})
      if (given(name)) return core::invalid_input(std::string(name) + " is for recordings: leave it out");
    return core::ok_status();
  }
  return check_folder_options(*options.verb, options.input);
}

}  // namespace

Verb add_replay_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "replay", "Replay a recording or a folder of images: here, or onto the bus for a running `serve`");
  auto options = std::make_shared<ReplayOptions>();
  verb->add_option(
          "RECORDING", options->input,
          "MCAP or .db3 file, folder of rosbag2, or folder with frames/, intrinsics.K.txt and camera_poses.csv")
      ->required();
  verb->add_option(
          "--scene", options->scene,
          "Scene file; default: the one that the recording holds; a folder without one is searched for its support")
      ->check(file_name());
  verb->add_flag("--over-dds", options->over_dds,
                 "Publish the robot's messages as they were, and listen to a running `serve`");
  verb->add_option("--speed", options->bus.speed, "Over DDS: times as fast as recorded")
      ->check(in_range(kReplaySpeeds))
      ->needs("--over-dds")
      ->capture_default_str();
  verb->add_option("--ask", options->questions, "Over DDS: SECONDS:JSON, a question to ask at that time; repeatable")
      ->needs("--over-dds");
  verb->add_flag("--loop", options->bus.loop,
                 "Over DDS: play it again and again from the start, with the same stamps, until Ctrl-C")
      ->needs("--over-dds")
      ->excludes("--ask");
  add_input_options(*verb, options->depth_scale, options->frame_rate, options->read);
  verb->add_option("--from", options->read.from,
                   "Begin so many seconds after the recording's first message: the belief begins anew there")
      ->check(number_between(0.0, 1e9))
      ->capture_default_str();
  verb->add_option("--to", options->read.to, "End so many seconds after the recording's first message")
      ->check(number_between(0.0, 1e9));
  verb->add_option("--report", options->report, "Write an HTML page with pictures, tables and timelines")
      ->check(file_name())
      ->excludes("--loop");
  verb->add_option("--timeline", options->timeline_file,
                   "Write when which relations held (on, in, touches, moves, falls, ...) as JSON")
      ->check(file_name());
  add_timeline_options(*verb, options->timeline);
  add_proposals_option(*verb, options->proposals);
  add_bus_options(*verb, options->bus.dds, options->tracker);
  add_camera_options(*verb, options->tracker.assembler);
  add_belief_options(*verb, options->tracker, options->learned);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer(
      "Examples: prescene replay milk.mcap --report milk.html\n"
      "          prescene replay bag_folder --scene table.yaml --from 12 --to 20\n"
      "          prescene replay milk.mcap --over-dds --ask '2.4:{\"predict\": {}}'");
  return {
      verb, [options](VerbContext& context) -> core::Status {
        PRESCENE_RETURN_IF_ERROR(check_options(*options));
        if (options->over_dds) PRESCENE_RETURN_IF_ERROR(take_domain(*options->verb, options->bus.dds));
        PRESCENE_RETURN_IF_ERROR(check_output("--report", options->report, {options->input, options->scene}));
        PRESCENE_RETURN_IF_ERROR(check_output("--timeline", options->timeline_file, {options->input, options->scene}));
        PRESCENE_RETURN_IF_ERROR(check_apart("--learned", options->learned, "--report", options->report));
        for (const auto& [name, file] :
             {std::pair("--learned", options->learned), std::pair("--report", options->report)})
          PRESCENE_RETURN_IF_ERROR(check_apart("--timeline", options->timeline_file, name, file));
        PRESCENE_RETURN_IF_ERROR(timeline_question(options->timeline).status());
        PRESCENE_RETURN_IF_ERROR(take_learned(options->learned, {options->input, options->scene}, options->tracker));
        PRESCENE_RETURN_IF_ERROR(validate(options->tracker.topics));
        return options->over_dds ? run_over_dds(*options, context) : run_here(*options, context);
      }};
}

}  // namespace prescene::service
