// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/explained_again.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/why_answer.h"

namespace prescene::service {
namespace {

/// More than services keep by default, so that what they were asked about is here, too.
FrameHistorySettings replayed_history(const TrackerSettings& settings) {
  FrameHistorySettings history;
  history.seconds = 300.0;
  history.most_bytes = std::size_t{256} << 20;
  history.width = settings.filter.frame.terms.target_width;
  return history;
}

/// Whether frames have to be kept: only a recording of ours holds explanations, and few do. A file that can't be read
/// is left to the replay, which says so.
bool may_hold_explanations(const std::filesystem::path& path, const ReplayInput& input) {
  if (input.begins_later()) return false;
  if (input.read_options().all_parts) return true;
  if (std::filesystem::is_directory(path) || path.extension() == ".db3") return false;
  interfaces::McapReaderOptions only_answers;
  only_answers.topics = {kAnswerTopic};
  only_answers.salvage = true;
  only_answers.check_data = false;  // it was, when it was opened
  const auto reader = interfaces::McapReader::open(path, only_answers);
  if (!reader) return true;
  for (;;) {
    const auto answer = (*reader)->next();
    if (!answer) return true;
    if (!*answer) return false;
    const std::vector<std::uint8_t>& data = (*answer)->data;
    const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
    for (const char* key : {"\"explain\"", "\"why\""})
      if (text.find(key) != std::string_view::npos) return true;
  }
}

/// By so much, messages may stand in a recording before others that were received earlier.
constexpr core::TimeNs kDisorderNs = 10 * core::TimeNs{1'000'000'000};

/// What is compared: not how long it took.
std::string text_to_compare(nlohmann::ordered_json answer) {
  for (const char* task : {"explain", "why"})
    if (answer.contains(task))
      for (const char* key : {"wall_seconds", "cpu_seconds"}) answer[task].erase(key);
  answer.erase("final");  // of one that was to be streamed
  return belief::json_text(answer);
}

}  // namespace

ExplainedAgain::ExplainedAgain(const ReplayInput& input, std::filesystem::path path, const TrackerSettings& settings,
                               Backends& backends, const core::Cancellation& cancellation)
    : path_(std::move(path)),
      reads_all_parts_(input.read_options().all_parts),
      settings_(settings),
      backends_(backends),
      cancellation_(cancellation),
      scene_text_(input.scene_text()),
      keeps_frames_(may_hold_explanations(path_, input)),
      history_(replayed_history(settings)) {}

void ExplainedAgain::add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief) {
  if (keeps_frames_) history_.add(observation, std::move(belief));
}

core::Status ExplainedAgain::read_controls(core::TimeNs until_ns) {
  if (controls_end_ || !interfaces::is_bag(path_)) return core::ok_status();
  if (!reader_) {
    RecordingReadOptions options;
    options.check_data = false;  // it was, when it was opened
    options.all_parts = reads_all_parts_;
    PRESCENE_TRY(reader_, RecordingReader::open(path_, options));
  }
  while (controls_until_ns_ <= until_ns + kDisorderNs) {
    PRESCENE_TRY(const auto entry, reader_->next());
    if (!entry) {
      controls_end_ = true;
      return core::ok_status();
    }
    controls_until_ns_ = entry->message.received_ns;
    if (entry->is_json || entry->message.topic != kControlTopic) continue;
    const auto text = interfaces::decode_cdr<interfaces::RosString>(entry->message.cdr, interfaces::kSmallMessage);
    if (text) controls_.push_back({text->data, entry->message.source_ns, entry->message.received_ns});
  }
  return core::ok_status();
}

core::Result<queries::ExplainContext> ExplainedAgain::frames_context() {
  if (!likelihood_) {
    PRESCENE_TRY(likelihood_, backends_.make_likelihood());
  }
  queries::ExplainContext context{backends_.query_context(backends_.pool()), likelihood_.get(), settings_.filter};
  context.simulation.cancellation = &cancellation_;
  return context;
}

core::Result<std::string> ExplainedAgain::reasoned(const belief::WhyQuestion& question, const PastWindow& past) {
  PRESCENE_TRY(const queries::ExplainContext context, frames_context());
  PRESCENE_TRY(const Reasons found, why_past(past, question, context));
  return text_to_compare(why_answer_json(question, found));
}

core::Result<std::string> ExplainedAgain::explained(const belief::ExplainQuestion& question, PastWindow past,
                                                    core::TimeNs recorded_ns) {
  PRESCENE_RETURN_IF_ERROR(read_controls(recorded_ns));
  ControlLog controls;
  for (const SentControl& control : controls_)
    if (control.recorded_ns <= recorded_ns) controls.add(control.text, control.sent_ns);
  controls.put_into(past.window, past.remarks);
  belief::EventWeights weights;
  if (!scene_text_.empty()) {
    auto of_scene = interfaces::parse_event_weights(scene_text_, "the scene");
    if (!of_scene) return of_scene.status();
    weights = *of_scene;
  }
  PRESCENE_TRY(const queries::ExplainContext context, frames_context());
  PRESCENE_TRY(const Explained found, explain_past(std::move(past), question, weights, context));
  return text_to_compare(explain_answer_json(question, found));
}

core::Status ExplainedAgain::add_answer(const std::string& json, core::TimeNs recorded_ns) {
  const auto answer = parse_or_discard(json);
  if (!answer.is_object()) return core::ok_status();
  const std::string task = answer.contains("why") ? "why" : "explain";
  if (!answer.contains(task) || !answer[task].is_object()) return core::ok_status();
  const auto& recorded = answer[task];
  const auto cut_short = recorded.find("cut_short");
  if (!recorded.contains("asked") || (cut_short != recorded.end() && *cut_short == true)) return core::ok_status();
  const std::string asked = belief::json_text({{"id", id_of_document(answer)}, {task, recorded["asked"]}});
  std::optional<core::Result<std::string>> again;
  if (task == "why") {
    const auto question = belief::why_question_from_json(asked);
    if (!question) return question.status().at("a recorded answer");
    if (const auto past = history_.window(asked_window(*question))) again = reasoned(*question, *past);
  } else {
    const auto question = belief::explain_question_from_json(asked);
    if (!question) return question.status().at("a recorded answer");
    if (auto past = history_.window(*question)) again = explained(*question, *std::move(past), recorded_ns);
  }
  if (!again) return core::ok_status();  // the frames are not kept any more
  return compare(answer, *again);
}

core::Status ExplainedAgain::compare(const nlohmann::ordered_json& answer, const core::Result<std::string>& again) {
  if (!again && again.status().code() == core::StatusCode::kCancelled) return again.status();
  ++compared_;
  if (again && *again == text_to_compare(answer)) return core::ok_status();
  if (different_++ == 0)
    first_difference_ = "the answer '" + id_of_document(answer) + "' " +
                        (again ? "says something else when it is worked out again"
                               : "can't be worked out again: " + again.status().message());
  return core::ok_status();
}

}  // namespace prescene::service
