// SPDX-License-Identifier: Apache-2.0
#include "inspect_recording.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "output_files.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/queries/camera_name.h"
#include "prescene/service/pictures/belief_overlay.h"
#include "prescene/service/pictures/likelihood_picture.h"
#include "prescene/service/recording/recording_overview.h"
#include "prescene/service/tracking/tracker.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

/// What is known when a frame has been looked at.
struct InspectedFrame {
  std::shared_ptr<const belief::Belief> belief;
  belief::Observation observation;
};

core::Result<InspectedFrame> replay_to(int number, const ReplayInput& input, Tracker& tracker, VerbContext& context) {
  core::Cancellation stop;
  std::optional<InspectedFrame> found;
  int seen = 0;
  const StepSink on_step = [&](const TrackerStep& step, const Tracker& at) -> core::Status {
    if (context.cancellation().requested()) stop.request();
    if (found || seen++ < number) return core::ok_status();
    found = {at.belief(), step.observation};
    stop.request();
    return core::ok_status();
  };
  const JsonSink on_json = [](const std::string&, const std::string&, core::TimeNs) { return core::ok_status(); };
  const auto summary = input.replay(tracker, stop, context.progress("replaying"), on_step, on_json);
  context.end_progress();
  if (!summary) return summary.status();
  if (found) return *std::move(found);
  if (context.cancellation().requested()) return core::cancelled("stopped on request");
  PRESCENE_RETURN_IF_ERROR(check_steps(*summary, tracker.settings().topics));
  return core::invalid_input("there is no frame " + std::to_string(number) + ": it has " + std::to_string(seen) +
                             " that can be used, 0 to " + std::to_string(seen - 1));
}

ordered_json to_json(const rendering::PoseEvidence& evidence) {
  return {{"log_ratio", evidence.log_ratio},           {"pixels_in_view", evidence.in_view},
          {"pixels_not_hidden", evidence.covered},     {"pixels_measured", evidence.measured},
          {"pixels_visible", evidence.visible},        {"pixels_on_surface", evidence.hits},
          {"visible_share", evidence.visible_share()}, {"hit_share", evidence.hit_share()}};
}

std::string text_of(const BeliefSummary& summary, const std::vector<ObjectEvidence>& evidences) {
  std::vector<std::vector<std::string>> rows = {
      {"object", "state", "confidence", "log ratio, nats", "pixels", "visible", "on its surface"}};
  for (const ObjectSummary& object : summary.objects) {
    std::vector<std::string> row = {object.name, belief::to_string(object.state), fixed_text(object.confidence, 2)};
    for (const ObjectEvidence& evidence : evidences) {
      if (evidence.object != object.name) continue;
      row.insert(row.end(), {fixed_text(evidence.evidence.log_ratio, 0), std::to_string(evidence.evidence.covered),
                             fixed_text(100.0 * evidence.evidence.visible_share(), 0) + " %",
                             fixed_text(100.0 * evidence.evidence.hit_share(), 0) + " %"});
    }
    row.resize(rows.front().size());
    rows.push_back(std::move(row));
  }
  return summary.objects.empty() ? "nothing is believed to be there\n" : table(rows);
}

std::string megabytes(std::uint64_t bytes) { return fixed_text(1e-6 * static_cast<double>(bytes), 2) + " MB"; }

std::string cameras_text(const RecordingOverview& overview) {
  std::string text;
  for (const RecordedImages& images : overview.images)
    text += images.topic + ": " + images.encoding +
            (images.width > 0 ? ", " + std::to_string(images.width) + " x " + std::to_string(images.height) : "") +
            ", frame " + images.frame + "\n";
  for (const RecordedCamera& camera : overview.cameras)
    text += camera.topic + ": " + std::to_string(camera.width) + " x " + std::to_string(camera.height) + ", fx " +
            fixed_text(camera.fx, 1) + ", fy " + fixed_text(camera.fy, 1) + ", cx " + fixed_text(camera.cx, 1) +
            ", cy " + fixed_text(camera.cy, 1) + ", frame " + camera.frame + ", " +
            (camera.is_distorted ? "distorted (" + camera.distortion_model + ")" : "not distorted") + "\n";
  return text;
}

std::string text_of(const std::string& path, const RecordingOverview& overview) {
  std::string text = path + ": " + overview.storage + ", " + std::to_string(overview.files.size()) +
                     (overview.files.size() == 1 ? " file, " : " files, ") + megabytes(overview.bytes) + ", " +
                     fixed_text(overview.seconds, 2) + " s, " + std::to_string(overview.messages) + " messages\n";
  if (overview.has_scene)
    text += "scene " + (overview.scene_file.empty() ? "without a name" : overview.scene_file) + ", seed " +
            std::to_string(overview.seed) + ", " + std::to_string(overview.attachments.size()) + " attached files\n";
  std::vector<std::vector<std::string>> rows = {
      {"topic", "type", "of", "messages", "rate, Hz", "longest gap, s", "size"}};
  for (const RecordedTopic& topic : overview.topics)
    rows.push_back({topic.name, topic.type, topic.of == "robot" ? "" : "prescene", std::to_string(topic.messages),
                    topic.rate() ? fixed_text(*topic.rate(), 1) : "",
                    topic.messages > 1 ? fixed_text(topic.longest_gap, 3) : "", megabytes(topic.bytes)});
  text += "\n" + table(rows) + "\n" + cameras_text(overview);
  std::size_t fixed = 0;
  for (const RecordedTransform& transform : overview.transforms) fixed += transform.is_static ? 1 : 0;
  text += std::to_string(overview.transforms.size()) + " transforms, " + std::to_string(fixed) + " of them static\n";
  for (const std::string& problem : overview.problems) text += "problem: " + problem + "\n";
  return text + (overview.problems.empty() ? "no problems found\n" : "");
}

core::Status write_picture(const std::string& path, const geometry::ColorImage& picture, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(interfaces::write_png(path, picture.view()));
  core::log(context.log(), core::LogLevel::kInfo, "picture written to " + path);
  return core::ok_status();
}

}  // namespace

core::Status describe_recording(const std::string& path, VerbContext& context) {
  const auto overview = overview_of(path, context.cancellation(), context.progress("reading"));
  context.end_progress();
  if (!overview) return overview.status();
  ordered_json document = {{"recording", path}};
  document.update(service::to_json(*overview));
  context.print(document, text_of(path, *overview));
  return core::ok_status();
}

core::Status inspect_recording(const RecordingInspection& options, VerbContext& context) {
  const std::string place = options.input.path.string();
  PRESCENE_RETURN_IF_ERROR(check_apart("--overlay", options.overlay, "--likelihood-map", options.likelihood_map));
  for (const auto& [name, output] :
       {std::pair("--overlay", &options.overlay), std::pair("--likelihood-map", &options.likelihood_map)}) {
    PRESCENE_RETURN_IF_ERROR(check_output(name, *output, {place}));
    PRESCENE_RETURN_IF_ERROR(check_png(name, *output));
  }
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(options.input, context.log()));
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *input.scene()));
  TrackerSettings settings = options.tracker;
  if (input.has_settings()) {
    PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
    settings = with_given(*options.verb, std::move(recorded), options.tracker);
  }
  settings.assembler.robot = input.robot();
  Backends backends(context.pool());
  const CommonOptions& common = context.options();
  const std::uint64_t seed = common.seed_given ? common.seed : input.seed_or(common.seed);
  PRESCENE_TRY(const auto tracker, Tracker::create(input.scene(), settings, seed, backends));
  auto frame = replay_to(options.frame, input, *tracker, context);
  if (!frame) return frame.status().at(place);

  const BeliefSummary summary = summary_of(*frame->belief);
  PRESCENE_TRY(
      const std::vector<ObjectEvidence> evidences,
      evidence_of_pixels(*frame->belief, frame->observation, settings.filter.colors, settings.filter.frame, backends));
  if (!options.overlay.empty()) {
    PRESCENE_TRY(const auto picture, belief_overlay(*frame->belief->scene, summary, frame->observation, backends));
    PRESCENE_RETURN_IF_ERROR(write_picture(options.overlay, picture, context));
  }
  if (!options.likelihood_map.empty()) {
    PRESCENE_RETURN_IF_ERROR(
        write_picture(options.likelihood_map, likelihood_picture(frame->observation, evidences), context));
  }
  ordered_json belief = to_json(summary);
  for (ordered_json& object : belief["objects"])
    for (const ObjectEvidence& evidence : evidences)
      if (object["name"] == evidence.object) object["evidence"] = to_json(evidence.evidence);
  const std::string camera = queries::camera_name(*input.scene(), frame->observation.camera);
  ordered_json document = {{"recording", place}, {"frame", options.frame}, {"seed", seed}};
  if (!camera.empty()) document["camera"] = camera;
  document.update(belief);
  context.print(document, "frame " + std::to_string(options.frame) + " of " + place +
                              (camera.empty() ? "" : ", of camera " + camera) + "\n" + text_of(summary, evidences));
  return core::ok_status();
}

}  // namespace prescene::service
