// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/why_answer.h"

#include <cstdint>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/queries/camera_name.h"
#include "prescene/rendering/reference/reference_likelihood.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

double time_of(const Reasons& reasons, std::size_t frame) {
  return core::seconds_of(reasons.answer.views[frame].stamp_ns - reasons.first_ns);
}

ordered_json terms_json(const queries::WhyTerms& terms) {
  return {{"surface", terms.surface}, {"outline", terms.outline}, {"color", terms.color}, {"missing", terms.missing}};
}

const char* name_of(queries::HiddenBy::Kind kind) {
  switch (kind) {
    case queries::HiddenBy::Kind::kObject:
      return "object";
    case queries::HiddenBy::Kind::kRobot:
      return "robot";
    case queries::HiddenBy::Kind::kSupport:
      break;
  }
  return "support";
}

ordered_json view_json(const Reasons& reasons, std::size_t k) {
  const queries::WhyView& view = reasons.answer.views[k];
  const rendering::PoseEvidence& e = view.evidence;
  ordered_json hidden = ordered_json::array();
  for (const queries::HiddenBy& by : view.hidden_by) {
    ordered_json one = {{"kind", name_of(by.kind)}, {"pixels", by.pixels}};
    if (!by.name.empty()) one["object"] = by.name;
    hidden.push_back(std::move(one));
  }
  ordered_json json = {{"time", time_of(reasons, k)}};
  if (!reasons.cameras[k].empty()) json["camera"] = reasons.cameras[k];
  json.update(ordered_json{{"pose", belief::to_json(view.X_WO)},
                           {"log_ratio", e.log_ratio},
                           {"tempering", reasons.answer.tempering[k]},
                           {"pixels",
                            {{"in_view", e.in_view},
                             {"seen", e.visible},
                             {"matching", e.hits},
                             {"hidden", e.in_view - e.covered},
                             {"behind_unknown", e.measured - e.visible},
                             {"without_depth", e.covered - e.measured}}},
                           {"hidden_by", std::move(hidden)}});
  return json;
}

// Rows from the top without padding, little-endian, as those of a view.
ordered_json image_json(const geometry::Image<float>& image) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(image.data());
  return {{"width", image.width()},
          {"height", image.height()},
          {"encoding", "32FC1"},
          {"base64", core::base64({bytes, image.size() * sizeof(float)})}};
}

ordered_json comparison_json(const Reasons& reasons, const queries::WhyComparison& c) {
  ordered_json frames = ordered_json::array(), deciding = ordered_json::array(), images = ordered_json::array();
  for (std::size_t k = 0; k < c.frames.size(); ++k) {
    const queries::WhyFrame& frame = c.frames[k];
    frames.push_back({{"time", time_of(reasons, k)},
                      {"log_ratio", frame.log_ratio},
                      {"tempered", frame.tempered},
                      {"terms", terms_json(frame.terms)},
                      {"for", frame.speaks_for},
                      {"against", frame.speaks_against},
                      {"pixels_for", frame.pixels_for},
                      {"pixels_against", frame.pixels_against}});
  }
  for (const std::size_t k : c.deciding) deciding.push_back(time_of(reasons, k));
  for (const queries::WhyImage& image : c.images) {
    ordered_json& one = images.emplace_back(ordered_json{{"time", time_of(reasons, image.frame)}});
    if (const std::string& camera = reasons.cameras[image.frame]; !camera.empty()) one["camera"] = camera;
    one["nats"] = image_json(image.nats);
  }
  ordered_json json = {{"against", belief::name_of(c.against)}};
  if (c.X_WO) json["pose"] = belief::to_json(*c.X_WO);
  if (c.probability) json["probability"] = *c.probability;
  json.update(ordered_json{{"log_ratio", c.log_ratio},
                           {"tempered", c.tempered},
                           {"terms", terms_json(c.terms)},
                           {"tempered_terms", terms_json(c.tempered_terms)},
                           {"frames", std::move(frames)},
                           {"deciding", std::move(deciding)}});
  if (c.place) {
    json["place"] = {{"in_image", c.place->in_image}};
    if (const auto& p = c.place->p_OQ) json["place"]["on_object"] = {p->x(), p->y(), p->z()};
  }
  json["images"] = std::move(images);
  json["text"] = c.text;
  return json;
}

}  // namespace

AskedWindow asked_window(const belief::WhyQuestion& question) { return {question.from, question.to, question.last}; }

core::Result<Reasons> why_past(const PastWindow& past, const belief::WhyQuestion& question,
                               const queries::ExplainContext& context) {
  const core::Stopwatch watch;
  const double cpu = core::process_cpu_seconds();
  Reasons reasons;
  PRESCENE_TRY(reasons.answer, queries::why(past.window.frames,
                                            {.object = question.object,
                                             .against = question.against,
                                             .X_WO = question.X_WO,
                                             .images = question.images,
                                             .begin_ns = past.first_ns},
                                            {context, rendering::log_ratio_map}));
  reasons.first_ns = past.first_ns;
  reasons.from = past.from;
  reasons.to = past.to;
  const belief::Scene& scene = *past.window.frames.back().belief->scene;
  for (const queries::WhyView& view : reasons.answer.views)
    reasons.cameras.push_back(queries::camera_name(scene, view.camera));
  reasons.seconds = watch.seconds();
  reasons.cpu_seconds = core::process_cpu_seconds() - cpu;
  return reasons;
}

ordered_json why_answer_json(const belief::WhyQuestion& question, const Reasons& reasons) {
  const queries::WhyAnswer& answer = reasons.answer;
  ordered_json frames = ordered_json::array(), comparisons = ordered_json::array();
  for (std::size_t k = 0; k < answer.views.size(); ++k) frames.push_back(view_json(reasons, k));
  for (const queries::WhyComparison& c : answer.comparisons) comparisons.push_back(comparison_json(reasons, c));
  belief::WhyQuestion asked = question;
  asked.from = reasons.from;
  asked.to = reasons.to;
  asked.last.reset();
  ordered_json why = {{"object", answer.object},
                      {"pose", belief::to_json(answer.X_WO)},
                      {"existence", answer.existence},
                      {"from", reasons.from},
                      {"to", reasons.to},
                      {"comparisons", std::move(comparisons)},
                      {"frames", std::move(frames)},
                      {"text", answer.text},
                      {"remarks", answer.remarks},
                      {"cut_short", answer.cut_short},
                      {"wall_seconds", reasons.seconds},
                      {"cpu_seconds", reasons.cpu_seconds},
                      {"asked", belief::to_json(asked)["why"]}};
  return {{"id", question.id}, {"step", answer.step}, {"why", std::move(why)}};
}

}  // namespace prescene::service
