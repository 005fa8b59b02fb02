// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "achieve_options.h"
#include "prescene/belief/explain_question.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/question_client.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/outside_json.h"
#include "relations_options.h"
#include "verb.h"
#include "view_options.h"
#include "why_options.h"

namespace prescene::service {
namespace {

struct AskOptions {
  std::string kind;
  std::string object;
  std::string json;
  std::optional<double> timeout;
  bool margin = false;
  bool removal = false;
  AchieveOptions achieve;
  TimelineOptions timeline;
  std::string reach;
  std::optional<double> from, to, last;  // of explain and why
  bool change = false;                   // of explain, and ...
  std::string wanted;                    // ... the same
  std::string against;
  ViewQuestionOptions view;
  std::string scene;
  bool stream = false;
  const CLI::App* verb = nullptr;
  interfaces::DdsOptions dds;
};

/// How far to look ahead, and how long to work on it.
void add_limits(const AchieveOptions& given, nlohmann::ordered_json& question) {
  if (given.duration) question["duration"] = *given.duration;
  if (given.max_seconds) question["effort"]["max_seconds"] = *given.max_seconds;
}

/// `seed`: of what asks for one.
core::Result<nlohmann::ordered_json> question_of(const AskOptions& options, std::uint64_t seed) {
  if (!options.json.empty()) {
    if (!options.kind.empty())
      return core::invalid_input("'" + options.kind + "' and --question are two questions: leave one of them out");
    auto question = belief::parse_json(options.json);
    if (!question) return question.status().at("--question");
    if (!question->is_object()) return core::invalid_input("--question: not a JSON object (docs/reference/queries.md)");
    return question;
  }
  AchieveOptions of_achieve = options.achieve;
  if (options.kind == "relations") of_achieve.object.clear();
  if (options.kind == "stability" || options.kind == "release") of_achieve.duration = of_achieve.max_seconds = {};
  if (options.kind != "achieve" && (of_achieve.duration || of_achieve.max_seconds))
    return core::invalid_input(
        "--duration and --max-seconds are of 'ask stability', 'ask release' and 'ask achieve': leave them out");
  if (options.kind != "achieve" && !(of_achieve == AchieveOptions{}))
    return core::invalid_input("--action, --free and what goes with them are of 'ask achieve': leave them out");
  if (options.kind != "stability" && (options.margin || options.removal))
    return core::invalid_input("--margin and --removal are of 'ask stability': leave them out");
  if (options.kind != "timeline" && !(options.timeline == TimelineOptions{}))
    return core::invalid_input("--interval, --other and --relation are of 'ask timeline': leave them out");
  if (options.kind != "relations" && !options.reach.empty())
    return core::invalid_input("--reach is of 'ask relations': leave it out");
  const bool of_why = options.kind == "why";
  if (options.kind != "explain" && !of_why && (options.from || options.to || options.last))
    return core::invalid_input("--from, --to and --last are of 'ask explain' and 'ask why': leave them out");
  if (options.kind != "explain" && (options.change || !options.wanted.empty()))
    return core::invalid_input("--change and --wanted are of 'ask explain': leave them out");
  if (!of_why && !options.against.empty()) return core::invalid_input("--against is of 'ask why': leave it out");
  ViewQuestionOptions of_views = options.view;
  if (of_why) of_views.images.clear();
  const bool of_view = options.kind == "view" || options.kind == "next_view";
  if (!of_view && !(of_views == ViewQuestionOptions{}))
    return core::invalid_input(
        "--look-from, --look-at and --about are of 'ask view' and 'ask next_view', --images is of 'ask view' and 'ask "
        "why': leave them out");
  if (of_why) {
    if (!options.scene.empty())
      return core::invalid_input(
          "ask why is about frames that were seen, and of a scene file none was: ask a running 'serve' (without "
          "--scene)");
    return why_question(options.object, options.against, options.last, options.from, options.to);
  }
  if (options.kind == "view") {
    if (!options.object.empty()) return core::invalid_input("ask view takes no object: leave it out");
    return view_question(options.view);
  }
  if (options.kind == "next_view") return next_view_question(options.object, options.view);
  if (options.kind == "explain") {
    if (!options.scene.empty())
      return core::invalid_input(
          "ask explain is about frames that were seen, and of a scene file none was: ask a running 'serve' (without "
          "--scene), or 'prescene explain' of a recording");
    nlohmann::ordered_json explain = nlohmann::ordered_json::object();
    if (!options.object.empty()) explain["object"] = options.object;
    if (options.from) explain["from"] = *options.from;
    if (options.to) explain["to"] = *options.to;
    if (options.last) explain["last"] = *options.last;
    if (options.change) explain["change"] = true;
    if (!options.wanted.empty() && options.wanted.front() == '{') {
      auto outcome = belief::parse_json(options.wanted);
      if (!outcome) return outcome.status().at("--wanted");
      explain["wanted"] = *std::move(outcome);
    } else if (!options.wanted.empty()) {
      explain["wanted"] = options.wanted;
    }
    explain["seed"] = seed;
    return nlohmann::ordered_json{{"explain", std::move(explain)}};
  }
  if (options.kind == "relations") {
    const std::string& named = options.achieve.object;
    if (!options.object.empty() && !named.empty())
      return core::invalid_input("'" + options.object + "' and --object are two objects: leave one of them out");
    return relations_question(options.object.empty() ? named : options.object, options.reach);
  }
  if (options.kind == "timeline") {
    if (!options.object.empty())
      return core::invalid_input("ask timeline takes no object: give --interval '" + options.object + " ...'");
    return timeline_question(options.timeline);
  }
  const auto needs_object = [&]() -> core::Status {
    return options.object.empty() ? core::invalid_input("ask " + options.kind + " OBJECT: name the object")
                                  : core::ok_status();
  };
  if (options.kind == "where") {
    return options.object.empty() ? nlohmann::ordered_json{{"where", nlohmann::ordered_json::object()}}
                                  : nlohmann::ordered_json{{"where", {{"object", options.object}}}};
  }
  if (options.kind == "stability") {
    PRESCENE_RETURN_IF_ERROR(needs_object());
    nlohmann::ordered_json stability = {{"object", options.object}};
    if (options.margin) stability["detail"].push_back("margin");
    if (options.removal) stability["detail"].push_back("removal");
    add_limits(options.achieve, stability);
    return nlohmann::ordered_json{{"stability", std::move(stability)}};
  }
  if (options.kind == "release") {
    PRESCENE_RETURN_IF_ERROR(needs_object());
    const nlohmann::ordered_json release = {{"time", 0.0}, {"release", {{"object", options.object}}}};
    nlohmann::ordered_json predict = {{"actions", nlohmann::ordered_json::array({release})}};
    add_limits(options.achieve, predict);
    return nlohmann::ordered_json{{"predict", std::move(predict)}};
  }
  if (options.kind == "achieve") {
    AchieveOptions achieve = options.achieve;
    achieve.outcome = options.object;
    if (achieve.outcome.empty()) return core::invalid_input("ask achieve OUTCOME: name the outcome that is wanted");
    return achieve_question(achieve);
  }
  return core::invalid_input(
      "ask where | relations | timeline | explain | why OBJECT | view | next_view OBJECT | stability OBJECT | release "
      "OBJECT | achieve OUTCOME, or --question JSON");
}

core::Status write_images(const AskOptions& options, const nlohmann::ordered_json& answer) {
  if (options.view.images.empty()) return core::ok_status();
  if (const auto why = answer.find("why"); why != answer.end()) return write_why_images(*why, options.view.images);
  const auto view = answer.find("view");
  return view == answer.end() ? core::data_loss("the answer has no images")
                              : write_view_images(*view, options.view.images);
}

/// What is known until the answer is there.
void print_so_far(const nlohmann::ordered_json& answer, VerbContext& context) {
  context.print_line(answer, "so far:\n" + answer_text(answer));
}

void print_answer(const AskOptions& options, const nlohmann::ordered_json& answer, VerbContext& context) {
  if (options.stream)
    context.print_line(answer, answer_text(answer));
  else
    context.print(answer, answer_text(answer));
}

/// Of a scene file, of which nothing has been seen.
core::Status ask_scene(const AskOptions& options, const nlohmann::ordered_json& question, VerbContext& context) {
  std::vector<const char*> of_bus(kDomainOptions.begin(), kDomainOptions.end());
  of_bus.push_back("--timeout");
  for (const char* name : of_bus)
    if (options.verb->count(name) > 0)
      return core::invalid_input(std::string(name) + " is for asking a `serve`: leave it out, or --scene");
  PRESCENE_TRY(const auto scene, load_scene(options.scene, context.log()));
  PRESCENE_TRY(const belief::Query query, belief::query_from_json(belief::json_text(question)));
  Backends backends(context.pool());
  queries::QueryContext asked = backends.query_context(context.pool());
  asked.cancellation = asked.abandoned = &context.cancellation();
  if (options.kind == "release" && !options.achieve.duration)
    core::log(context.log(), core::LogLevel::kInfo,
              "looking " + core::rounded_text(scene->duration) + " s ahead, the scene's duration (--duration)");
  if (options.stream)
    asked.on_answer_so_far = [&context](const belief::Answer& so_far) {
      print_so_far(belief::to_json(so_far), context);
    };
  const belief::Answer answer = queries::answer(scene, context.options().seed, query, asked);
  PRESCENE_RETURN_IF_ERROR(answer.error);
  const nlohmann::ordered_json document = belief::to_json(answer);
  PRESCENE_RETURN_IF_ERROR(write_images(options, document));
  print_answer(options, document, context);
  return core::ok_status();
}

core::Status run(AskOptions& options, VerbContext& context) {
  PRESCENE_TRY(auto question, question_of(options, context.options().seed));
  if (options.stream) question["stream"] = true;
  if (!options.scene.empty()) return ask_scene(options, question, context);
  PRESCENE_RETURN_IF_ERROR(take_domain(*options.verb, options.dds));
  PRESCENE_TRY(const auto client, QuestionClient::create(options.dds, context.log()));
  QuestionClient::Sinks sinks;
  if (options.stream)
    sinks.so_far = [&context](const std::string& text) {
      if (const auto so_far = parse_or_discard(text); so_far.is_object()) print_so_far(so_far, context);
    };
  else
    sinks.progress = context.progress("answering");
  const auto asked = client->ask(belief::json_text(question), options.timeout.value_or(seconds_to_wait(question)),
                                 context.cancellation(), sinks);
  context.end_progress();
  PRESCENE_TRY(const std::string text, asked);
  const auto answer = parse_or_discard(text);
  if (!answer.is_object()) return core::data_loss("the answer is not JSON: " + text.substr(0, 200));
  PRESCENE_RETURN_IF_ERROR(belief::error_from_json(answer));
  PRESCENE_RETURN_IF_ERROR(write_images(options, answer));
  print_answer(options, answer, context);
  return core::ok_status();
}

}  // namespace

Verb add_ask_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("ask",
                                  "Ask a running `serve`, or a scene file: where | relations | timeline | explain | "
                                  "why OBJECT | view | next_view OBJECT | stability OBJECT | release OBJECT | achieve "
                                  "OUTCOME");
  auto options = std::make_shared<AskOptions>();
  verb->add_option("KIND", options->kind,
                   "where: poses and confidence; relations: what is on, in, held by what; timeline: what was when; "
                   "explain: what happened in the last seconds; why: what frames and pixels say for a pose and against "
                   "it; view: what a camera will see; next_view: from where a look would tell most; stability: does it "
                   "stay; release: what if it is let "
                   "go; achieve: how must it be done")
      ->type_name("TEXT:{where,relations,timeline,explain,why,view,next_view,stability,release,achieve}")
      ->check(utf8_text());
  verb->add_option("OBJECT", options->object, "The object's name in the scene; of achieve, the outcome's")
      ->check(utf8_text());
  verb->add_option("--question", options->json, "Any question as JSON (docs/reference/queries.md) instead")
      ->check(utf8_text());
  verb->add_option(
          "--timeout", options->timeout,
          "How long to wait for an answer, s; default: 15, or 3 more than a --question's max_seconds if that is longer")
      ->check(in_range(belief::kWallSeconds));
  verb->add_flag("--margin", options->margin,
                 "Of stability: also how hard a knock makes it fall, and in which direction");
  verb->add_flag("--removal", options->removal, "Of stability: also whether the others stay where it is taken away");
  add_achieve_options(*verb, options->achieve);
  verb->add_option("--reach", options->reach,
                   "Of relations: also what is within reach of a point or robot body, as 0.4,0,0.9:0.8 or hand:0.8 (m)")
      ->check(utf8_text());
  add_timeline_options(*verb, options->timeline);
  add_view_question_options(*verb, options->view);
  verb->add_option("--last", options->last, "Of explain and why: the window, so many last seconds; default: 2")
      ->check(in_range(belief::kWindowSeconds));
  verb->add_option("--from", options->from,
                   "Of explain and why: start of the window, s since the session's first frame")
      ->check(in_range(belief::kWindowEnds));
  verb->add_option("--to", options->to, "Of explain and why: its end")->check(in_range(belief::kWindowEnds));
  verb->add_flag("--change", options->change,
                 "Of explain: also the smallest change that would have kept the object as it was");
  verb->add_option("--wanted", options->wanted,
                   "Of explain: the same for this outcome, a name of the scene's or one as JSON")
      ->check(utf8_text());
  add_why_options(*verb, options->against);
  verb->add_option("--scene", options->scene, "Ask of this scene file instead of a running `serve`")
      ->check(file_name());
  verb->add_flag(
      "--stream", options->stream,
      "Also what is known so far, as soon as there is anything, and then better; with --json each on a line");
  options->verb = verb;
  add_domain_option(*verb, options->dds);
  verb->footer(
      "Examples: prescene ask stability carton\n"
      "          prescene ask relations mug\n"
      "          prescene ask explain carton --last 2\n"
      "          prescene ask timeline --interval 'touches carton mug' --relation before --other 'falls carton'");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
