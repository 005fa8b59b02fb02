// SPDX-License-Identifier: Apache-2.0
// JSON of questions about what cameras will see, and of their answers.
#include "json_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"

namespace prescene::belief {
namespace {

// Rows from the top without padding, little-endian, in base64; `encoding` as in ROS.
template <class Pixel>
Json image_json(const geometry::Image<Pixel>& image, const char* encoding) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(image.data());
  return {{"width", image.width()},
          {"height", image.height()},
          {"encoding", encoding},
          {"base64", core::base64({bytes, image.size() * sizeof(Pixel)})}};
}

/// Whole numbers of `scale`; what is larger than the largest of them is that.
template <class Pixel>
Json scaled_json(const geometry::Image<float>& image, double scale, const char* encoding) {
  geometry::Image<Pixel> whole(image.width(), image.height());
  constexpr double kLargest = std::numeric_limits<Pixel>::max();
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double value = static_cast<double>(image.data()[i]) / scale;
    whole.data()[i] = static_cast<Pixel>(std::lround(value > 0.0 ? std::min(value, kLargest) : 0.0));
  }
  Json json = image_json(whole, encoding);
  json["scale"] = scale;
  return json;
}

/// m, of depths and their deviations.
Json length_json(const geometry::Image<float>& image, bool compact, double scale) {
  return compact ? scaled_json<std::uint16_t>(image, scale, "16UC1") : image_json(image, "32FC1");
}

Json probability_json(const geometry::Image<float>& image, bool compact) {
  return compact ? scaled_json<std::uint8_t>(image, 1.0 / 255.0, "mono8") : image_json(image, "32FC1");
}

Json intrinsics_json(const geometry::PinholeCamera& camera) {
  return {{"width", camera.width}, {"height", camera.height}, {"fx", camera.fx},
          {"fy", camera.fy},       {"cx", camera.cx},         {"cy", camera.cy}};
}

geometry::PinholeCamera intrinsics_from(const JsonAt& at) {
  constexpr int kMostSide = 16384;
  geometry::PinholeCamera camera;
  JsonObject fields(at);
  if (const auto width = fields.require("width")) camera.width = static_cast<int>(width->integer(1, kMostSide));
  if (const auto height = fields.require("height")) camera.height = static_cast<int>(height->integer(1, kMostSide));
  if (const auto fx = fields.require("fx")) camera.fx = fx->number();
  camera.fy = camera.fx;
  if (const auto fy = fields.find("fy")) camera.fy = fy->number();
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  if (const auto cx = fields.find("cx")) camera.cx = cx->number();
  if (const auto cy = fields.find("cy")) camera.cy = cy->number();
  return camera;
}

constexpr std::pair<const char*, bool ViewDetail::*> kViewDetailWords[] = {
    {"spread", &ViewDetail::spread}, {"objects", &ViewDetail::objects}, {"color", &ViewDetail::color}};

}  // namespace

const std::vector<std::pair<std::string, ViewAbout>>& view_about_words() {
  static const std::vector<std::pair<std::string, ViewAbout>> kWords{
      {"place", ViewAbout::kPlace}, {"pose", ViewAbout::kPose}, {"existence", ViewAbout::kExistence}};
  return kWords;
}

void add_view_question(const ViewQuery& query, Json& json) {
  json["time"] = query.time;
  if (query.X_WC) json["pose"] = to_json(*query.X_WC);
  if (query.intrinsics) json["intrinsics"] = intrinsics_json(*query.intrinsics);
  json["draws"] = query.draws;
  Json detail = Json::array();
  for (const auto& [word, field] : kViewDetailWords)
    if (query.detail.*field) detail.push_back(word);
  json["detail"] = std::move(detail);
  json["compact"] = query.compact;
}

ViewQuery view_question_from(JsonObject& fields) {
  ViewQuery query;
  if (const auto time = read_number(fields, "time", kViewTimes)) query.time = *time;
  if (const auto at = fields.find("pose")) query.X_WC = pose_from(*at);
  if (const auto at = fields.find("intrinsics")) query.intrinsics = intrinsics_from(*at);
  if (const auto at = fields.find("draws"))
    query.draws = static_cast<int>(at->integer(kFewestViewDraws, kMostViewDraws));
  if (const auto at = fields.find("detail")) {
    for (const JsonAt& item : at->items()) {
      const std::string asked = item.text();
      const auto* const found =
          std::ranges::find_if(kViewDetailWords, [&](const auto& word) { return asked == word.first; });
      if (found == std::end(kViewDetailWords))
        item.fail("one of spread, objects, color is needed");
      else
        query.detail.*found->second = true;
    }
  }
  if (const auto at = fields.find("compact")) query.compact = at->boolean();
  return query;
}

Json view_answer_json(const ViewAnswer& answer) {
  constexpr double kMillimetre = 0.001, kTenth = 0.0001;
  const bool compact = answer.compact;
  Json json{{"depth", length_json(answer.depth, compact, kMillimetre)},
            {"labels", image_json(answer.labels, "16UC1")},
            {"label_names", answer.label_names},
            {"presence", probability_json(answer.presence, compact)}};
  if (answer.mean_depth) json["mean_depth"] = length_json(*answer.mean_depth, compact, kMillimetre);
  if (answer.depth_deviation) json["depth_deviation"] = length_json(*answer.depth_deviation, compact, kTenth);
  if (!answer.objects.empty()) {
    Json objects = Json::array();
    for (const ViewAnswer::ObjectShare& share : answer.objects)
      objects.push_back({{"object", share.object},
                         {"existence", share.existence},
                         {"probability", probability_json(share.probability, compact)}});
    json["objects"] = std::move(objects);
  }
  if (answer.color) json["color"] = image_json(*answer.color, "rgb8");
  if (!answer.color_sources.empty()) {
    if (!answer.color) json["color"] = nullptr;
    Json sources = Json::array();
    for (const ViewAnswer::ColorSource& source : answer.color_sources)
      sources.push_back({{"name", source.name}, {"from", source.from.empty() ? Json(nullptr) : Json(source.from)}});
    json["color_sources"] = std::move(sources);
  }
  json["failed_instances"] = answer.failed_instances;
  json["remarks"] = answer.remarks;
  return json;
}

Json next_view_json(const NextViewQuery& query) {
  Json views = Json::array();
  for (const CandidateView& view : query.views) {
    Json json = Json::object();
    if (!view.name.empty()) json["name"] = view.name;
    json["pose"] = to_json(view.X_WC);
    if (view.intrinsics) json["intrinsics"] = intrinsics_json(*view.intrinsics);
    views.push_back(std::move(json));
  }
  return {{"object", query.object},
          {"about", word_of(view_about_words(), query.about)},
          {"views", std::move(views)},
          {"draws", query.draws},
          {"confidence", query.confidence}};
}

NextViewQuery next_view_from(JsonObject& fields) {
  NextViewQuery query;
  if (const auto name = fields.require("object")) query.object = name->text();
  if (const auto about = fields.find("about")) query.about = about->word(view_about_words());
  if (const auto views = fields.require("views")) {
    for (const JsonAt& item : views->items()) {
      CandidateView& view = query.views.emplace_back();
      JsonObject keys(item);
      if (const auto name = keys.find("name")) view.name = name->text();
      if (const auto pose = keys.require("pose")) view.X_WC = pose_from(*pose);
      if (const auto intrinsics = keys.find("intrinsics")) view.intrinsics = intrinsics_from(*intrinsics);
    }
  }
  if (const auto draws = fields.find("draws"))
    query.draws = static_cast<int>(draws->integer(kFewestViewDraws, kMostViewDraws));
  if (const auto confidence = read_number(fields, "confidence", kConfidences)) query.confidence = *confidence;
  return query;
}

Json next_view_answer_json(const NextViewAnswer& answer) {
  Json hypotheses = Json::array(), views = Json::array();
  for (const NextViewAnswer::Hypothesis& hypothesis : answer.hypotheses)
    hypotheses.push_back({{"pose", hypothesis.X_WO ? to_json(*hypothesis.X_WO) : Json(nullptr)},
                          {"probability", hypothesis.probability}});
  for (const NextViewAnswer::View& view : answer.views)
    views.push_back({{"name", view.name},
                     {"index", view.index},
                     {"reduction", view.reduction},
                     {"interval", Json::array({view.low, view.high})},
                     {"visible_pixels", view.visible_pixels},
                     {"different_pixels", view.different_pixels}});
  return {{"object", answer.object},
          {"about", word_of(view_about_words(), answer.about)},
          {"entropy", answer.entropy},
          {"views", std::move(views)},
          {"any_tells", answer.any_tells},
          {"best_is_clear", answer.best_is_clear},
          {"hypotheses", std::move(hypotheses)},
          {"draws", answer.draws},
          {"remarks", answer.remarks}};
}

}  // namespace prescene::belief
