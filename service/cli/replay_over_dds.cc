// SPDX-License-Identifier: Apache-2.0
// `replay --over-dds`: the robot's messages go onto the bus, and what a running `serve` believes of them comes back.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "final_states.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/session_report.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/topics.h"
#include "replay_options.h"
#include "replay_text.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

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

/// Whether every question has its answer.
core::Status check_answers(const std::vector<BusReplayResult::Answered>& answers) {
  for (const BusReplayResult::Answered& answered : answers) {
    if (answered.answer.empty()) return core::unavailable("not every question was answered");
    PRESCENE_RETURN_IF_ERROR(belief::error_from_json(parse_or_discard(answered.answer))
                                 .at("the question at " + core::fixed_text(answered.at, 2) + " s"));
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

}  // namespace

core::Status replay_over_dds(ReplayOptions& options, VerbContext& context) {
  for (const std::string& text : options.questions) {
    PRESCENE_TRY(TimedQuestion question, timed_question(text));
    options.bus.questions.push_back(std::move(question));
  }
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(replay_input_of(options), context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_TRY(const TrackerSettings settings, replay_settings_of(options, input));
  std::stable_sort(options.bus.questions.begin(), options.bus.questions.end(),
                   [](const TimedQuestion& a, const TimedQuestion& b) { return a.at < b.at; });
  options.bus.read = options.read;
  options.bus.read.check_data = options.read.salvage;  // Checked when it was opened; its loss is reported here.
  TrackingScore score(input.scene());
  Backends backends(context.pool(), options.backends);
  SessionReport report(input.scene(), settings, backends);
  const std::string depth_topic = first_topics(settings, *input.scene()).depth;
  std::size_t depth_images = 0;
  ForeseenAndCame foreseen(input.scene(), depth_topic);
  DamagedRecords damaged;
  FinalStates states;
  PRESCENE_TRY(BusReplayResult result,
               replay_over_bus(options.input, options.bus, context.cancellation(), context.progress("replaying"),
                               context.log(), [&](const RecordedEntry& entry) {
                                 foreseen.add(entry);
                                 if (!entry.is_json && entry.message.topic == depth_topic) ++depth_images;
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
  const bool is_whole = !options.bus.loop && !context.cancellation().requested();
  if (const std::string unused = unused_frames_text(depth_images, result.beliefs.size()); is_whole && !unused.empty())
    core::log(context.log(), core::LogLevel::kWarning, unused);
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
  return check_files_are_there(options, result.missing);
}

}  // namespace prescene::service
