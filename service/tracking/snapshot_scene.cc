// SPDX-License-Identifier: Apache-2.0
#include "snapshot_scene.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::service {
namespace {

using belief::Scene;
using geometry::Pose;
using geometry::Vector3d;
using nlohmann::ordered_json;

/// As it is, without being normalised: read again, it has the same bits.
ordered_json pose_numbers(const Pose& pose) {
  const auto& q = pose.rotation;
  const Vector3d& p = pose.translation;
  return {q.w(), q.x(), q.y(), q.z(), p.x(), p.y(), p.z()};
}

/// So many finite numbers under that key.
std::optional<std::vector<double>> numbers_of(const ordered_json& row, const char* key, std::size_t count) {
  if (!row.contains(key) || !row[key].is_array() || row[key].size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const ordered_json& number : row[key]) {
    if (!number.is_number() || !std::isfinite(number.get<double>())) return std::nullopt;
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

std::optional<Pose> pose_of(const ordered_json& row) {
  const auto n = numbers_of(row, "pose", 7);
  if (!n) return std::nullopt;
  const Pose pose{{(*n)[0], (*n)[1], (*n)[2], (*n)[3]}, {(*n)[4], (*n)[5], (*n)[6]}};
  constexpr double kOfUnitLength = 1e-9;
  if (!(std::abs(pose.rotation.norm() - 1.0) <= kOfUnitLength)) return std::nullopt;
  return pose;
}

/// The lengths, m, of a thing that a camera can see.
std::optional<std::vector<double>> lengths_of(const ordered_json& row, const char* key, std::size_t count) {
  constexpr double kLeast = 1e-4, kMost = 1e3;
  auto lengths = numbers_of(row, key, count);
  if (!lengths || std::any_of(lengths->begin(), lengths->end(), [](double l) { return l < kLeast || l > kMost; }))
    return std::nullopt;
  return lengths;
}

ordered_json box_json(const geometry::BoxShape& box) { return {box.size.x(), box.size.y(), box.size.z()}; }

std::optional<geometry::BoxShape> box_of(const ordered_json& row) {
  const auto sizes = lengths_of(row, "box", 3);
  if (!sizes) return std::nullopt;
  return geometry::BoxShape{{(*sizes)[0], (*sizes)[1], (*sizes)[2]}};
}

const belief::ObjectModel* find_model(const Scene& scene, const std::string& name) {
  const auto found = std::find_if(scene.models.begin(), scene.models.end(),
                                  [&name](const belief::ObjectModel& model) { return model.name == name; });
  return found == scene.models.end() ? nullptr : &*found;
}

/// The only shape, if it is of this kind.
template <class Shape>
const Shape* shape_as(const std::vector<belief::CollisionShape>& collision) {
  const auto* primitive = collision.size() == 1 ? std::get_if<belief::PrimitiveShape>(&collision.front()) : nullptr;
  return primitive == nullptr ? nullptr : std::get_if<Shape>(&primitive->primitive);
}

ordered_json support_row(const belief::Support& support, const Scene& given) {
  ordered_json row = {{"name", support.name}};
  if (!filter::is_found_support(support.name)) return row;
  row["pose"] = pose_numbers(support.X_WS);  // It follows what frames show.
  if (const auto* box = shape_as<geometry::BoxShape>(support.collision);
      box != nullptr && !belief::find_support(given, support.name))
    row["box"] = box_json(*box);
  return row;
}

std::optional<belief::Support> support_from(const ordered_json& row, const std::string& name, const Scene& given) {
  belief::Support support;
  if (const auto number = belief::find_support(given, name)) {
    support = given.supports[static_cast<std::size_t>(*number)];
  } else {
    const auto box = box_of(row);
    if (!box || !filter::is_found_support(name)) return std::nullopt;
    support.name = name;
    support.collision.push_back(belief::PrimitiveShape{*box, Pose::identity()});
  }
  if (!filter::is_found_support(name)) return support;
  const auto X_WS = pose_of(row);
  if (!X_WS) return std::nullopt;
  support.X_WS = *X_WS;
  return support;
}

ordered_json model_row(const belief::ObjectModel& model, const Scene& given) {
  ordered_json row = {{"name", model.name}};
  if (find_model(given, model.name) != nullptr) return row;
  if (const auto* box = shape_as<geometry::BoxShape>(model.collision)) row["box"] = box_json(*box);
  if (const auto* cylinder = shape_as<geometry::Cylinder>(model.collision))
    row["cylinder"] = {cylinder->radius, cylinder->length};
  return row;
}

std::optional<belief::ObjectModel> model_from(const ordered_json& row, const std::string& name, const Scene& given) {
  if (const belief::ObjectModel* known = find_model(given, name)) return *known;
  if (!filter::is_unknown_object(name)) return std::nullopt;
  filter::UnknownShape shape;
  if (const auto cylinder = lengths_of(row, "cylinder", 2)) {
    shape = geometry::Cylinder{(*cylinder)[0], (*cylinder)[1]};
  } else if (const auto box = box_of(row)) {
    shape = *box;
  } else {
    return std::nullopt;
  }
  auto model = filter::unknown_object_model(shape);
  if (!model) return std::nullopt;
  model->name = name;
  if (!belief::validate(*model).ok()) return std::nullopt;
  return *std::move(model);
}

ordered_json object_row(const belief::SceneObject& object, const Scene& scene, const Scene& given) {
  ordered_json row = {{"name", object.name}};
  if (object.held_by) row["held_by"] = *object.held_by;
  if (belief::find_object(given, object.name)) return row;
  row["model"] = scene.model_of(object).name;
  if (const auto* fixed = std::get_if<belief::FixedPose>(&object.pose)) row["pose"] = pose_numbers(fixed->X_WO);
  return row;
}

std::optional<belief::SceneObject> object_from(const ordered_json& row, const std::string& name, const Scene& read,
                                               const Scene& given) {
  belief::SceneObject object;
  if (const auto number = belief::find_object(given, name)) {
    object = given.objects[static_cast<std::size_t>(*number)];
    object.held_by.reset();
  } else {
    const auto X_WO = pose_of(row);
    if (!X_WO || !row.contains("model") || !row["model"].is_string()) return std::nullopt;
    const belief::ObjectModel* model = find_model(read, row["model"].get<std::string>());
    if (model == nullptr) return std::nullopt;
    object.name = name;
    object.model = static_cast<int>(model - read.models.data());
    object.pose = belief::FixedPose{*X_WO};
  }
  if (row.contains("held_by")) {
    if (!row["held_by"].is_string()) return std::nullopt;
    object.held_by = row["held_by"].get<std::string>();
    if (!belief::find_robot_body(given, *object.held_by)) return std::nullopt;
  }
  return object;
}

/// Each row of the list under that key by `one(row, name)`; false where any is none, or two have one name.
template <class Value, class One>
bool read_rows(const ordered_json& json, const char* key, const One& one, std::vector<Value>& values) {
  constexpr std::size_t kMost = 10'000;
  if (!json.contains(key) || !json[key].is_array() || json[key].size() > kMost) return false;
  values.clear();
  std::set<std::string> names;
  for (const ordered_json& row : json[key]) {
    if (!row.is_object() || !row.contains("name") || !row["name"].is_string()) return false;
    const auto name = row["name"].get<std::string>();
    if (!names.insert(name).second) return false;
    std::optional<Value> value = one(row, name);
    if (!value) return false;
    values.push_back(*std::move(value));
  }
  return true;
}

template <class Value, class Row>
ordered_json rows_of(const std::vector<Value>& values, const Row& row_of) {
  ordered_json rows = ordered_json::array();
  for (const Value& value : values) rows.push_back(row_of(value));
  return rows;
}

}  // namespace

ordered_json scene_json(const Scene& scene, const Scene& given) {
  return {{"supports", rows_of(scene.supports, [&](const auto& support) { return support_row(support, given); })},
          {"models", rows_of(scene.models, [&](const auto& model) { return model_row(model, given); })},
          {"objects", rows_of(scene.objects, [&](const auto& object) { return object_row(object, scene, given); })},
          {"joints", rows_of(scene.joints, [](const auto& joint) {
             return ordered_json{{"name", joint.name}};
           })}};
}

std::shared_ptr<const Scene> scene_from(const ordered_json& json, const std::shared_ptr<const Scene>& given) {
  auto read = std::make_shared<Scene>(*given);
  const auto support = [&](const auto& row, const auto& name) { return support_from(row, name, *given); };
  const auto model = [&](const auto& row, const auto& name) { return model_from(row, name, *given); };
  const auto object = [&](const auto& row, const auto& name) { return object_from(row, name, *read, *given); };
  const auto joint = [&](const auto&, const auto& name) -> std::optional<belief::Joint> {
    const auto number = belief::find_joint(*given, name);
    if (!number) return std::nullopt;
    return given->joints[static_cast<std::size_t>(*number)];
  };
  if (!json.is_object() || !read_rows(json, "supports", support, read->supports) ||
      !read_rows(json, "models", model, read->models) || !read_rows(json, "objects", object, read->objects) ||
      !read_rows(json, "joints", joint, read->joints))
    return nullptr;
  if (*read == *given) return given;
  return read;
}

}  // namespace prescene::service
