// SPDX-License-Identifier: Apache-2.0
#include "json_values.h"

#include <array>

#include "prescene/belief/json.h"

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

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

Json vector_json(const Vector3d& vector) {
  return Json::array({number_json(vector.x()), number_json(vector.y()), number_json(vector.z())});
}

Vector3d vector_from(const JsonAt& at) {
  const std::vector<double> numbers = at.numbers(3);
  return {numbers[0], numbers[1], numbers[2]};
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

ScalarDistribution scalar_from(const JsonAt& at) {
  if (!at.value.is_object()) return FixedScalar{at.number()};
  JsonObject object(at);
  const auto form = object.one_of({"normal", "uniform", "samples"});
  if (!form) return FixedScalar{};
  if (form->first == "uniform") {
    const std::vector<double> ends = form->second.numbers(2);
    if (ends[0] > ends[1]) form->second.fail("the interval runs backwards: give [lowest, highest]");
    return UniformScalar{ends[0], ends[1]};
  }
  if (form->first == "samples") {
    SampledScalar sampled;
    for (const JsonAt& item : form->second.items()) sampled.samples.push_back(item.number());
    if (sampled.samples.empty()) form->second.fail("at least one sample is needed");
    return sampled;
  }
  const std::vector<double> moments = form->second.numbers(2);
  NormalScalar normal{moments[0], moments[1]};
  if (normal.standard_deviation < 0.0) form->second.fail("the standard deviation is negative");
  if (const auto low = object.find("min")) normal.low = low->number();
  if (const auto high = object.find("max")) normal.high = high->number();
  if (normal.low > normal.high) form->second.fail("min is above max");
  return normal;
}

Json vector_distribution_json(const Vector3Distribution& distribution) {
  return Json::array({scalar_json(distribution.x), scalar_json(distribution.y), scalar_json(distribution.z)});
}

Vector3Distribution vector_distribution_from(const JsonAt& at) {
  const std::vector<JsonAt> items = at.items(3);
  if (items.size() != 3) return Vector3Distribution::fixed(Vector3d::Zero());
  return {scalar_from(items[0]), scalar_from(items[1]), scalar_from(items[2])};
}

Json to_json(const Pose& pose) {
  const geometry::Quaterniond& q = pose.rotation;
  return {{"position", vector_json(pose.translation)},
          {"rotation", {number_json(q.w()), number_json(q.x()), number_json(q.y()), number_json(q.z())}}};
}

Pose pose_from(const JsonAt& at) {
  Pose pose;
  JsonObject object(at);
  if (const auto position = object.require("position")) pose.translation = vector_from(*position);
  if (const auto rotation = object.find("rotation")) {
    const std::vector<double> q = rotation->numbers(4);
    const geometry::Quaterniond read(q[0], q[1], q[2], q[3]);
    const double error = std::abs(read.norm() - 1.0);
    if (error > 0.01)
      rotation->fail("a unit quaternion [w, x, y, z] is needed");
    else  // what we wrote comes back as the same bits; what a person rounded is made a unit quaternion
      pose.rotation = error < 1e-9 ? read : read.normalized();
  }
  return pose;
}

Json pose_distribution_json(const PoseDistribution& distribution) {
  if (const auto* fixed = std::get_if<FixedPose>(&distribution)) return to_json(fixed->X_WO);
  if (const auto* normal = std::get_if<NormalPose>(&distribution))
    return {{"normal", {{"mean", to_json(normal->mean)}, {"covariance", matrix_json(normal->covariance)}}}};
  if (const auto* box = std::get_if<BoxPose>(&distribution)) {
    const geometry::Quaterniond& q = box->rotation;
    return {{"box",
             {{"position", vector_distribution_json(box->position)},
              {"rotation", {q.w(), q.x(), q.y(), q.z()}},
              {"any_rotation", box->any_rotation}}}};
  }
  Json samples = Json::array();
  for (const Pose& sample : std::get<SampledPose>(distribution).samples) samples.push_back(to_json(sample));
  return {{"samples", std::move(samples)}};
}

PoseDistribution pose_distribution_from(const JsonAt& at) {
  if (at.value.is_object() && at.value.contains("position")) return FixedPose{pose_from(at)};
  JsonObject object(at);
  const auto form = object.one_of({"normal", "box", "samples", "position"});
  if (!form) return FixedPose{};
  if (form->first == "samples") {
    SampledPose sampled;
    for (const JsonAt& item : form->second.items()) sampled.samples.push_back(pose_from(item));
    if (sampled.samples.empty()) form->second.fail("at least one sample is needed");
    return sampled;
  }
  JsonObject fields(form->second);
  if (form->first == "normal") {
    NormalPose normal;
    if (const auto mean = fields.require("mean")) normal.mean = pose_from(*mean);
    if (const auto covariance = fields.require("covariance")) normal.covariance = matrix_from(*covariance, 6);
    return normal;
  }
  BoxPose box;
  if (const auto position = fields.require("position")) box.position = vector_distribution_from(*position);
  if (const auto rotation = fields.find("rotation")) {
    // By way of a pose, for the same checks.
    const Json pose{{"position", {0, 0, 0}}, {"rotation", rotation->value}};
    box.rotation = pose_from({pose, form->second.path, at.errors}).rotation;
  }
  if (const auto any = fields.find("any_rotation")) box.any_rotation = any->boolean();
  return box;
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

Json twist_distribution_json(const TwistDistribution& distribution) {
  return {{"angular", vector_distribution_json(distribution.angular)},
          {"linear", vector_distribution_json(distribution.linear)}};
}

TwistDistribution twist_distribution_from(const JsonAt& at) {
  TwistDistribution twist;
  JsonObject object(at);
  if (const auto angular = object.find("angular")) twist.angular = vector_distribution_from(*angular);
  if (const auto linear = object.find("linear")) twist.linear = vector_distribution_from(*linear);
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

core::Result<Pose> pose_from_json(const Json& value) {
  JsonErrors errors;
  const Pose pose = pose_from({value, "", errors});
  if (!errors.ok()) return errors.status();
  return pose;
}

}  // namespace prescene::belief
