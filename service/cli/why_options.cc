// SPDX-License-Identifier: Apache-2.0
#include "why_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/overlay.h"
#include "verb.h"
#include "view_options.h"

namespace prescene::service {
namespace {

using Json = nlohmann::ordered_json;
using core::fixed_text;

constexpr double kEndOfScale = 8.0;  // nats: what one pixel says at most, about
constexpr int kEnlarged = 8;         // pixels on a side, for each of the likelihood's
constexpr int kLargestSide = 2048;   // of an image that is enlarged
constexpr geometry::Rgb kNotSeen = {90, 90, 90};

core::Result<Json> pose_of(const std::string& text) {
  std::array<double, 6> numbers{};
  std::size_t begin = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t end = i + 1 < numbers.size() ? text.find(',', begin) : text.size();
    if (end == std::string::npos || begin > text.size() ||
        !interfaces::parse_number(text.substr(begin, end - begin), &numbers[i]) || !std::isfinite(numbers[i]))
      return core::invalid_input("--against " + text +
                                 ": give absence, alternative, or a pose as X,Y,Z,ROLL,PITCH,YAW in metres and degrees "
                                 "or as JSON");
    begin = end + 1;
  }
  return Json{{"position", {numbers[0], numbers[1], numbers[2]}},
              {"rotation", {{"euler_deg", {numbers[3], numbers[4], numbers[5]}}}}};
}

geometry::ColorImage picture_of_nats(const geometry::Image<float>& nats) {
  const int by = std::max(nats.width(), nats.height()) * kEnlarged <= kLargestSide ? kEnlarged : 1;
  geometry::ColorImage picture(by * nats.width(), by * nats.height());
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const auto value = static_cast<double>(nats(x / by, y / by));
      picture(x, y) = std::isfinite(value) ? interfaces::divergence_color(value / kEndOfScale) : kNotSeen;
    }
  return picture;
}

/// What is written of the comparisons in a file's name: the answer's word, if it is one of ours.
std::string file_word(const Json& comparison) {
  const std::string against = comparison.value("against", "");
  for (const char* known : {"absence", "alternative", "pose"})
    if (against == known) return known;
  return "comparison";
}

}  // namespace

void add_why_options(CLI::App& verb, std::string& against) {
  verb.add_option(
          "--against", against,
          "Of why: what the believed pose is compared with: absence, alternative (the belief's likeliest), or a "
          "pose as X,Y,Z,ROLL,PITCH,YAW (m, degrees) or JSON; default: absence, and an alternative if there is "
          "one")
      ->check(utf8_text());
}

core::Result<Json> why_question(const std::string& object, const std::string& against, std::optional<double> last,
                                std::optional<double> from, std::optional<double> to) {
  if (object.empty()) return core::invalid_input("ask why OBJECT: name the object");
  Json why{{"object", object}};
  if (against == "absence" || against == "alternative") {
    why["against"] = against;
  } else if (!against.empty() && against.front() == '{') {
    auto pose = belief::parse_json(against);
    if (!pose) return pose.status().at("--against");
    why["against"] = *std::move(pose);
  } else if (!against.empty()) {
    PRESCENE_TRY(why["against"], pose_of(against));
  }
  if (last) why["last"] = *last;
  if (from) why["from"] = *from;
  if (to) why["to"] = *to;
  return Json{{"why", std::move(why)}};
}

std::string why_text(const Json& why) {
  std::vector<std::vector<std::string>> rows = {{"frame, s", "seen, %", "hidden by"}};
  const Json& comparisons = why.at("comparisons");
  for (const Json& comparison : comparisons)
    rows.front().push_back("against " + comparison.value("against", "") + ", nats");
  std::size_t number = 0;
  for (const Json& frame : why.at("frames")) {
    std::vector<std::string>& row = rows.emplace_back();
    const double in_view = frame.at("pixels").value("in_view", 0.0);
    std::string hidden;
    for (const Json& by : frame.at("hidden_by"))
      hidden += (hidden.empty() ? "" : ", ") + by.value("object", by.value("kind", ""));
    const std::string camera = frame.value("camera", "");
    row.push_back(fixed_text(frame.value("time", 0.0), 2) + (camera.empty() ? "" : " " + camera));
    row.push_back(in_view > 0.0 ? fixed_text(100.0 * frame.at("pixels").value("seen", 0.0) / in_view, 0) : "none");
    row.push_back(hidden);
    for (const Json& comparison : comparisons)
      row.push_back(fixed_text(comparison.at("frames").at(number).value("tempered", 0.0), 2));
    ++number;
  }
  std::string text = why.value("text", "") + "\n\n" + table(rows);
  for (const std::string& remark : why.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text;
}

core::Status write_why_images(const Json& why, const std::string& folder) {
  try {
    const std::filesystem::path to(folder);
    std::error_code error;
    std::filesystem::create_directories(to, error);
    if (error) return core::unavailable("cannot make the folder '" + folder + "': " + error.message());
    for (const Json& comparison : why.at("comparisons")) {
      std::size_t number = 0;
      for (const Json& image : comparison.at("images")) {
        PRESCENE_TRY(const geometry::Image<float> nats, image_of_answer(image.at("nats"), "nats"));
        const std::string name = file_word(comparison) + "_" + std::to_string(++number) + "_" +
                                 fixed_text(image.value("time", 0.0), 2) + "s.png";
        const geometry::ColorImage picture = picture_of_nats(nats);
        PRESCENE_RETURN_IF_ERROR(interfaces::write_png(to / name, interfaces::ColorView(picture.view())));
      }
    }
    return core::ok_status();
  } catch (const Json::exception&) {
    return core::data_loss("the answer's images are of another form: use the program of the service's version");
  }
}

}  // namespace prescene::service
