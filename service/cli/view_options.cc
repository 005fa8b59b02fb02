// SPDX-License-Identifier: Apache-2.0
#include "view_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/png.h"
#include "verb.h"

namespace prescene::service {
namespace {

using Json = nlohmann::ordered_json;
using core::fixed_text;
using geometry::Vector3d;

core::Result<Vector3d> point_of(const char* option, const std::string& text) {
  Vector3d point;
  std::size_t begin = 0;
  for (int i = 0; i < 3; ++i) {
    const std::size_t end = i < 2 ? text.find(',', begin) : text.size();
    double number = 0.0;
    if (end == std::string::npos || begin > text.size() ||
        !interfaces::parse_number(text.substr(begin, end - begin), &number) || !std::isfinite(number))
      return core::invalid_input(std::string(option) + " " + text + ": give a point in metres, as 0.5,0,0.4");
    point[i] = number;
    begin = end + 1;
  }
  return point;
}

/// The camera at a point, level where it can be, with another point in the middle of its image.
core::Result<geometry::Pose> looking(const ViewQuestionOptions& options, const std::string& from) {
  constexpr double kLeastDistance = 1e-6, kNearlyVertical = 1e-3;
  PRESCENE_TRY(const Vector3d p_WC, point_of("--look-from", from));
  PRESCENE_TRY(const Vector3d p_WT, point_of("--look-at", options.look_at));
  const Vector3d way = p_WT - p_WC;
  if (way.norm() < kLeastDistance) return core::invalid_input("--look-from and --look-at are one point: give two");
  geometry::Matrix3d R_WC;
  R_WC.col(2) = way.normalized();
  const Vector3d right = R_WC.col(2).cross(Vector3d::UnitZ());
  R_WC.col(0) = right.norm() > kNearlyVertical
                    ? right.normalized()
                    : Vector3d(Vector3d::UnitX() - R_WC.col(2).x() * R_WC.col(2)).normalized();
  R_WC.col(1) = R_WC.col(2).cross(R_WC.col(0));
  return geometry::Pose{geometry::Quaterniond(R_WC).normalized(), p_WC};
}

/// nullopt for what is not base64 of just so many bytes.
std::optional<std::vector<std::uint8_t>> decoded(const std::string& text, std::size_t bytes) {
  if (text.size() != (bytes + 2) / 3 * 4) return std::nullopt;
  const auto value_of = [](char c) -> int {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
  };
  std::vector<std::uint8_t> result;
  result.reserve(bytes + 2);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    std::uint32_t word = 0;
    for (std::size_t j = i; j < i + 4; ++j) {
      const bool is_padding = text[j] == '=' && j + 2 >= text.size();
      const int value = is_padding ? 0 : value_of(text[j]);
      if (value < 0) return std::nullopt;
      word = word << 6 | static_cast<std::uint32_t>(value);
    }
    for (const int shift : {16, 8, 0}) result.push_back(static_cast<std::uint8_t>(word >> shift));
  }
  result.resize(bytes);
  return result;
}

core::Status not_an_image(const std::string& name) {
  return core::data_loss("the answer's image '" + name +
                         "' is of another form: use the program of the service's version");
}

std::size_t pixel_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Whole numbers of `unit`; more than the largest is the largest.
template <class Pixel>
core::Status write_scaled(const Json& answer, const std::string& name, double unit, const std::filesystem::path& path) {
  PRESCENE_TRY(const geometry::Image<float> image, image_of_answer(answer, name));
  geometry::Image<Pixel> whole(image.width(), image.height());
  constexpr double kLargest = std::numeric_limits<Pixel>::max();
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double value = image.data()[i] / unit;
    whole.data()[i] = static_cast<Pixel>(std::lround(value > 0.0 ? std::min(value, kLargest) : 0.0));
  }
  return interfaces::write_png(path, geometry::ImageView<const Pixel>(whole.view()));
}

core::Status write_color(const Json& image, const std::filesystem::path& path) {
  constexpr int kMostSide = 16384;
  const int width = image.value("width", 0), height = image.value("height", 0);
  if (image.value("encoding", "") != "rgb8" || width < 1 || height < 1 || width > kMostSide || height > kMostSide)
    return not_an_image("color");
  const auto bytes = decoded(image.value("base64", ""), pixel_count(width, height) * 3);
  if (!bytes) return not_an_image("color");
  geometry::ColorImage color(width, height);
  for (std::size_t i = 0; i < color.size(); ++i)
    color.data()[i] = {(*bytes)[3 * i], (*bytes)[3 * i + 1], (*bytes)[3 * i + 2]};
  return interfaces::write_png(path, interfaces::ColorView(color.view()));
}

}  // namespace

core::Result<geometry::Image<float>> image_of_answer(const Json& image, const std::string& name) {
  constexpr int kMostSide = 16384;
  const int width = image.value("width", 0), height = image.value("height", 0);
  const std::string encoding = image.value("encoding", "");
  const std::size_t size = encoding == "32FC1" ? 4 : encoding == "16UC1" ? 2 : encoding == "mono8" ? 1 : 0;
  if (size == 0 || width < 1 || height < 1 || width > kMostSide || height > kMostSide) return not_an_image(name);
  // Before the image, whose size is the answer's word only.
  const auto bytes = decoded(image.value("base64", ""), pixel_count(width, height) * size);
  if (!bytes) return not_an_image(name);
  geometry::Image<float> result(width, height);
  const double scale = image.value("scale", 1.0);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::uint8_t* const at = bytes->data() + i * size;
    float number = 0.0F;
    if (size == 4)
      std::memcpy(&number, at, sizeof number);
    else
      number = static_cast<float>(size == 2 ? at[0] | at[1] << 8 : at[0]);
    result.data()[i] = static_cast<float>(number * scale);
  }
  return result;
}

void add_view_question_options(CLI::App& verb, ViewQuestionOptions& options) {
  verb.add_option(
          "--look-from", options.look_from,
          "Of view and next_view: where the camera is, as 0.5,0,0.4 (m); of next_view repeatable, one candidate "
          "each")
      ->allow_extra_args(false)
      ->check(utf8_text());
  verb.add_option("--look-at", options.look_at, "Of view and next_view: the point in the middle of the image")
      ->check(utf8_text());
  verb.add_option("--about", options.about,
                  "Of next_view: what is to be learned: place (which alternative pose), pose or existence; default: "
                  "place")
      ->check(utf8_text());
  verb.add_option("--images", options.images, "Of view and why: write the answer's images to this folder, as PNG files")
      ->check(file_name());
}

core::Result<Json> view_question(const ViewQuestionOptions& options) {
  if (!options.about.empty()) return core::invalid_input("--about is of 'ask next_view': leave it out");
  if (options.look_from.size() > 1) return core::invalid_input("--look-from: a view is from one point: give one");
  if (options.look_from.empty() != options.look_at.empty())
    return core::invalid_input("--look-from and --look-at need each other: give both, or none");
  Json view{{"time", 0.0}, {"detail", Json::array({"spread", "objects", "color"})}, {"compact", true}};
  if (!options.look_from.empty()) {
    PRESCENE_TRY(const geometry::Pose X_WC, looking(options, options.look_from.front()));
    view["pose"] = belief::to_json(X_WC);
  }
  return Json{{"view", std::move(view)}};
}

core::Result<Json> next_view_question(const std::string& object, const ViewQuestionOptions& options) {
  if (!options.images.empty()) return core::invalid_input("--images is of 'ask view' and 'ask why': leave it out");
  if (object.empty()) return core::invalid_input("ask next_view OBJECT: name the object");
  if (options.look_from.empty() || options.look_at.empty())
    return core::invalid_input(
        "ask next_view needs camera poses to choose from: give --look-from X,Y,Z, once for each, and --look-at X,Y,Z");
  Json next{{"object", object}};
  if (!options.about.empty()) next["about"] = options.about;
  next["views"] = Json::array();
  for (const std::string& from : options.look_from) {
    PRESCENE_TRY(const geometry::Pose X_WC, looking(options, from));
    next["views"].push_back({{"name", from}, {"pose", belief::to_json(X_WC)}});
  }
  return Json{{"next_view", std::move(next)}};
}

std::string view_text(const Json& answer) {
  const Json& depth = answer.at("depth");
  std::string text = "images of " + std::to_string(depth.value("width", 0)) + " x " +
                     std::to_string(depth.value("height", 0)) + " pixels; --images FOLDER writes them\n";
  std::string unknown;
  for (const Json& source : answer.value("color_sources", Json::array()))
    if (!source.at("from").is_string()) unknown += (unknown.empty() ? "" : ", ") + source.value("name", "");
  if (!unknown.empty()) text += "colour not known of: " + unknown + "\n";
  for (const std::string& remark : answer.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text;
}

std::string next_view_text(const Json& answer) {
  std::vector<std::vector<std::string>> rows = {{"look from", "tells, nats", "from", "to"}};
  for (const Json& view : answer.at("views")) {
    const std::string name = view.value("name", "");
    rows.push_back({name.empty() ? "candidate " + std::to_string(view.value("index", 0) + 1) : name,
                    fixed_text(view.value("reduction", 0.0), 3), fixed_text(view.at("interval").at(0).get<double>(), 3),
                    fixed_text(view.at("interval").at(1).get<double>(), 3)});
  }
  std::string text = table(rows) + "of " + fixed_text(answer.value("entropy", 0.0), 3) +
                     " nats that are open now, from " +
                     counted(answer.value("draws", std::size_t{0}), "simulated image") + " each\n";
  if (answer.value("any_tells", false) && !answer.value("best_is_clear", false))
    text += "The first is not clearly better than the second.\n";
  for (const std::string& remark : answer.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text;
}

core::Status write_view_images(const Json& answer, const std::string& folder) {
  constexpr double kMillimetre = 1e-3, kTenth = 1e-4, kProbability = 1.0 / 255.0;
  try {
    const std::filesystem::path to(folder);
    std::error_code error;
    std::filesystem::create_directories(to, error);
    if (error) return core::unavailable("cannot make the folder '" + folder + "': " + error.message());
    PRESCENE_RETURN_IF_ERROR(write_scaled<std::uint16_t>(answer.at("depth"), "depth", kMillimetre, to / "depth.png"));
    PRESCENE_RETURN_IF_ERROR(
        write_scaled<std::uint8_t>(answer.at("presence"), "presence", kProbability, to / "presence.png"));
    if (answer.contains("mean_depth"))
      PRESCENE_RETURN_IF_ERROR(
          write_scaled<std::uint16_t>(answer.at("mean_depth"), "mean_depth", kMillimetre, to / "mean_depth.png"));
    if (answer.contains("depth_deviation"))
      PRESCENE_RETURN_IF_ERROR(write_scaled<std::uint16_t>(answer.at("depth_deviation"), "depth_deviation", kTenth,
                                                           to / "depth_deviation.png"));
    // Names come from outside: files are numbered.
    std::size_t number = 0;
    for (const Json& object : answer.value("objects", Json::array()))
      PRESCENE_RETURN_IF_ERROR(write_scaled<std::uint8_t>(object.at("probability"), "probability", kProbability,
                                                          to / ("object_" + std::to_string(++number) + ".png")));
    if (answer.contains("color") && answer.at("color").is_object())
      PRESCENE_RETURN_IF_ERROR(write_color(answer.at("color"), to / "color.png"));
    return core::ok_status();
  } catch (const Json::exception&) {
    return not_an_image("view");
  }
}

}  // namespace prescene::service
