// SPDX-License-Identifier: Apache-2.0
#include "json_values.h"

#include <array>

#include "prescene/belief/json.h"
#include "prescene/belief/validation.h"

namespace prescene::belief {
namespace {

constexpr std::size_t kDeepest = 64;
constexpr int kMostKeys = 1024;

/// Fails where brackets outside of texts are open deeper than kDeepest, or an object has more than kMostKeys keys.
core::Status check_structure(std::string_view text) {
  std::array<int, kDeepest + 1> keys{};  // by depth, of what is open there
  std::size_t depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
      continue;
    }
    if (c == '"') quoted = true;
    if (c == '[' || c == '{') {
      if (depth == kDeepest)
        return core::invalid_input("byte " + std::to_string(i) + ": nested deeper than " + std::to_string(kDeepest) +
                                   " lists and objects: this is not meant for Prescene");
      keys[++depth] = 0;
    }
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (c == ':' && ++keys[depth] > kMostKeys)
      return core::invalid_input("byte " + std::to_string(i) + ": an object of more than " + std::to_string(kMostKeys) +
                                 " keys: this is not meant for Prescene");
  }
  return {};
}

}  // namespace

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json vector_json(const Vector3d& vector) {
  return Json::array({number_json(vector.x()), number_json(vector.y()), number_json(vector.z())});
}

Vector3d vector_from(const JsonAt& at) {
  const std::vector<double> numbers = at.numbers(3);
  return {numbers[0], numbers[1], numbers[2]};
}

Json axis_json(const Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) == 1.0) return std::string(axis[i] < 0.0 ? "-" : "") + "xyz"[i];
  return vector_json(axis);
}

// Directions are made unit vectors; those that are already keep their bits.
Vector3d axis_from(const JsonAt& at) {
  static const std::vector<std::pair<std::string, Vector3d>> kAxes{
      {"x", Vector3d::UnitX()},   {"-x", -Vector3d::UnitX()}, {"y", Vector3d::UnitY()},
      {"-y", -Vector3d::UnitY()}, {"z", Vector3d::UnitZ()},   {"-z", -Vector3d::UnitZ()}};
  if (at.value.is_string()) return at.word(kAxes);
  const Vector3d direction = vector_from(at);
  const double length = direction.norm();
  if (!(length > 1e-9)) {
    at.fail("a direction of some length is needed");
    return Vector3d::UnitZ();
  }
  return std::abs(length - 1.0) < 1e-9 ? direction : Vector3d(direction / length);
}

Json matrix_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(number_json(matrix(i, j)));
    rows.push_back(std::move(row));
  }
  return rows;
}

Eigen::MatrixXd matrix_from(const JsonAt& at, Eigen::Index size) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  const std::vector<JsonAt> rows = at.items(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<double> row = rows[i].numbers(static_cast<std::size_t>(size));
    for (std::size_t j = 0; j < row.size(); ++j)
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
  }
  return matrix;
}

Json scalar_json(const ScalarDistribution& distribution) {
  if (const auto* fixed = std::get_if<FixedScalar>(&distribution)) return number_json(fixed->value);
  if (const auto* uniform = std::get_if<UniformScalar>(&distribution))
    return {{"uniform", {uniform->low, uniform->high}}};
  if (const auto* sampled = std::get_if<SampledScalar>(&distribution)) return {{"samples", sampled->samples}};
  const auto& normal = std::get<NormalScalar>(distribution);
  Json json{{"normal", {normal.mean, normal.standard_deviation}}};
  if (std::isfinite(normal.low)) json["min"] = normal.low;
  if (std::isfinite(normal.high)) json["max"] = normal.high;
  return json;
}

// What fails is read as a fixed value: callers ask distributions for their mean before anybody looks at the errors.
ScalarDistribution scalar_from(const JsonAt& at) {
  if (!at.value.is_object()) return FixedScalar{at.number()};
  const auto failed = [](const JsonAt& where, const char* why) -> ScalarDistribution {
    where.fail(why);
    return FixedScalar{};
  };
  JsonObject object(at);
  const auto form = object.one_of({"normal", "uniform", "samples"});
  if (!form) return FixedScalar{};
  if (form->first == "uniform") {
    const std::vector<double> ends = form->second.numbers(2);
    if (ends[0] > ends[1]) return failed(form->second, "the interval runs backwards: give [lowest, highest]");
    return UniformScalar{ends[0], ends[1]};
  }
  if (form->first == "samples") {
    SampledScalar sampled;
    for (const JsonAt& item : form->second.items()) sampled.samples.push_back(item.number());
    if (sampled.samples.empty()) return failed(form->second, "at least one sample is needed");
    return sampled;
  }
  const std::vector<double> moments = form->second.numbers(2);
  NormalScalar normal{moments[0], moments[1]};
  if (normal.standard_deviation < 0.0) return failed(form->second, "the standard deviation is negative");
  if (const auto low = object.find("min")) normal.low = low->number();
  if (const auto high = object.find("max")) normal.high = high->number();
  if (normal.low > normal.high) return failed(form->second, "min is above max");
  return normal;
}

Json vector_distribution_json(const Vector3Distribution& distribution) {
  return Json::array({scalar_json(distribution.x), scalar_json(distribution.y), scalar_json(distribution.z)});
}

Vector3Distribution vector_distribution_from(const JsonAt& at) {
  if (at.value.is_object()) {
    JsonObject object(at);
    const auto uniform = object.require("uniform");
    if (!uniform) return Vector3Distribution::fixed(Vector3d::Zero());
    JsonObject box(*uniform);
    const auto from_at = box.require("from"), to_at = box.require("to");
    if (!from_at || !to_at) return Vector3Distribution::fixed(Vector3d::Zero());
    const Vector3d from = vector_from(*from_at), to = vector_from(*to_at);
    if ((from.array() > to.array()).any()) uniform->fail("the box runs backwards: give the lower corner as 'from'");
    return {UniformScalar{from.x(), to.x()}, UniformScalar{from.y(), to.y()}, UniformScalar{from.z(), to.z()}};
  }
  const std::vector<JsonAt> items = at.items(3);
  if (items.size() != 3) return Vector3Distribution::fixed(Vector3d::Zero());
  return {scalar_from(items[0]), scalar_from(items[1]), scalar_from(items[2])};
}

Json to_json(const Twist& twist) {
  return {{"angular", vector_json(twist.angular)}, {"linear", vector_json(twist.linear)}};
}

Twist twist_from(const JsonAt& at) {
  Twist twist;
  JsonObject object(at);
  if (const auto angular = object.require("angular")) twist.angular = vector_from(*angular);
  if (const auto linear = object.require("linear")) twist.linear = vector_from(*linear);
  return twist;
}

const std::vector<std::pair<std::string, MotionMode>>& motion_mode_words() {
  static const std::vector<std::pair<std::string, MotionMode>> kWords{
      {"resting", MotionMode::kResting}, {"held", MotionMode::kHeld}, {"moving", MotionMode::kMoving}};
  return kWords;
}

const std::vector<std::pair<std::string, TrackState>>& track_state_words() {
  static const std::vector<std::pair<std::string, TrackState>> kWords{{"tracked", TrackState::kTracked},
                                                                      {"doubtful", TrackState::kDoubtful},
                                                                      {"unseen", TrackState::kUnseen},
                                                                      {"lost", TrackState::kLost}};
  return kWords;
}

const std::vector<std::pair<std::string, When>>& when_words() {
  static const std::vector<std::pair<std::string, When>> kWords{
      {"at_end", When::kAtEnd}, {"ever", When::kEver}, {"always", When::kAlways}};
  return kWords;
}

std::string json_text(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

std::optional<double> read_number(JsonObject& fields, const std::string& key, const ScalarRange& range) {
  const auto at = fields.find(key);
  if (!at) return std::nullopt;
  const double number = at->number();
  const core::Status in_range = check_number(number, range);
  if (!in_range.ok()) at->fail(in_range.message());
  return number;
}

core::Result<Json> parse_json(std::string_view text, std::size_t max_bytes) {
  if (text.size() > max_bytes)
    return core::resource_exhausted("the text has " + std::to_string(text.size()) + " bytes, at most " +
                                    std::to_string(max_bytes) + " are read: make it smaller");
  PRESCENE_RETURN_IF_ERROR(check_structure(text));
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    return core::invalid_input("byte " + std::to_string(error.byte) +
                               (std::string_view(error.what()).find("surrogate") != std::string_view::npos
                                    ? ": half of a character: \\ud800 to \\udfff stand for one in pairs only"
                                    : ": this is not JSON: check quotes, commas and brackets there"));
  } catch (const Json::out_of_range&) {
    return core::invalid_input("this is not JSON that can be read: a number is out of range, give one up to 1.8e308");
  } catch (const std::exception&) {
    return core::invalid_input("this is not JSON that can be read: check for numbers that are too large");
  }
}

}  // namespace prescene::belief
