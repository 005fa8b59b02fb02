// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/model_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/mesh_use.h"
#include "read_scene_parts.h"
#include "value_texts.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;

// In double quotes, with what YAML takes as something else escaped.
std::string quoted_yaml(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (c >= ' ' || c < 0) result += c;
  }
  return result + "\"";
}

// A value in flow style, on one line. Files that it names are found from `folder`.
std::string flow_text(const LocatedValue& value, const std::string& key, const std::filesystem::path& folder) {
  std::string text;
  switch (value.kind) {
    case LocatedValue::Kind::kNothing:
      return "null";
    case LocatedValue::Kind::kScalar: {
      if (key == "file") {
        const std::filesystem::path path =
            std::filesystem::absolute(std::filesystem::path(*value.place.file).parent_path() / value.text)
                .lexically_normal();
        // The folder of "model.yaml" is the empty path, of which there is no absolute one.
        const std::filesystem::path relative = path.lexically_relative(
            folder.empty() ? std::filesystem::current_path() : std::filesystem::absolute(folder));
        return quoted_yaml((relative.empty() ? path : relative).generic_string());
      }
      const bool plain =
          !value.quoted && !value.text.empty() && value.text.find_first_of(",[]{}#:&*!|>'\"%@`\n") == std::string::npos;
      return plain ? value.text : quoted_yaml(value.text);
    }
    case LocatedValue::Kind::kList:
      for (const LocatedValue& item : value.items)
        text.append(text.empty() ? "" : ", ").append(flow_text(item, "", folder));
      return "[" + text + "]";
    case LocatedValue::Kind::kMap:
      for (std::size_t i = 0; i < value.items.size(); ++i) {
        const std::string& name = value.keys[i].name;
        text.append(text.empty() ? "" : ", ").append(name).append(": ").append(flow_text(value.items[i], name, folder));
      }
      return "{" + text + "}";
  }
  return text;
}

// The keys of a model with those of the file that it names under them.
core::Result<LocatedValue> whole_description(const LocatedValue& model, const YamlLimits& limits) {
  const LocatedValue* file = model.find("file");
  if (!file) return model;
  PRESCENE_TRY(const LocatedValue document,
               read_yaml(std::filesystem::path(*file->place.file).parent_path() / file->text, limits));
  const LocatedValue* under = document.find("model");
  if (!under) return core::invalid_input(file->text + ": a model file holds one key 'model' with the model's keys");
  LocatedValue whole;
  whole.kind = LocatedValue::Kind::kMap;
  for (const LocatedValue* from : {&model, under}) {
    for (std::size_t i = 0; i < from->items.size(); ++i) {
      if (from->keys[i].name == "file" || whole.find(from->keys[i].name)) continue;
      whole.keys.push_back(from->keys[i]);
      whole.items.push_back(from->items[i]);
    }
  }
  return whole;
}

// Of a remark only what fits into a comment.
std::string comment(const std::string& text) {
  std::string line = "# " + text;
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line + "\n";
}

std::string key_line(const char* key, const std::string& value) {
  return std::string("  ") + key + ": " + value + "\n";
}

// What recordings of its motion say about an object.
std::string fitted_lines(const belief::ObjectModel& model) {
  const belief::ContactProperties& contact = model.contact;
  std::string text = key_line("center_of_mass", value_text(model.center_of_mass) + "  # m");
  text += key_line("unit_inertia", value_text(model.unit_inertia) + "  # m^2, of 1 kg about the centre of mass");
  text += key_line("friction", value_text(contact.friction));
  if (contact.impact_friction) text += key_line("impact_friction", value_text(*contact.impact_friction));
  text += key_line("restitution", value_text(contact.restitution));
  if (contact.rolling_friction != 0.0)
    text += key_line("rolling_friction", number_text(contact.rolling_friction) + "  # m");
  if (contact.edge_radius != 0.0) text += key_line("edge_radius", number_text(contact.edge_radius) + "  # m");
  return text;
}

}  // namespace

std::string model_yaml(const ModelFile& file) {
  const belief::ObjectModel& model = file.model;
  std::string text;
  for (const std::string& remark : file.remarks) text += comment(remark);
  text += "model:\n";
  const auto line = [&](const char* key, const std::string& value) { text += key_line(key, value); };
  line("mesh", "{file: " + quoted_yaml(file.mesh_file) + ", scale: " + number_text(file.scale) +
                   ", up: " + (file.y_up ? "y" : "z") + (file.use ? ", use: " + word_of(*file.use) : "") + "}");
  line("mass", value_text(model.mass) + "  # kg");
  text += fitted_lines(model);
  line("symmetry", value_text(model.symmetry));
  line("color", value_text(Vector3d(model.color.r, model.color.g, model.color.b)));
  if (model.surface != belief::SurfaceKind::kOpaque)
    line("surface", model.surface == belief::SurfaceKind::kMirror ? "mirror" : "transparent");
  if (model.learn_colors) line("learn_colors", "true");
  if (model.hollow)
    line("hollow", "{size: " + value_text(model.hollow->size) +
                       ", position: " + value_text(model.hollow->X_OV.translation) +
                       ", rotation: " + value_text(model.hollow->X_OV.rotation) + "}");
  return text;
}

core::Result<std::string> fitted_model_yaml(const std::filesystem::path& scene, const std::string& name,
                                            const belief::ObjectModel& fitted, const std::filesystem::path& folder,
                                            const std::vector<std::string>& remarks, const YamlLimits& limits) {
  PRESCENE_TRY(const LocatedValue document, read_yaml(scene, limits));
  const LocatedValue* models = document.find("models");
  const LocatedValue* described = models ? models->find(name) : nullptr;
  if (!described) return core::not_found(scene.string() + ": it has no model '" + name + "'");
  PRESCENE_TRY(const LocatedValue whole, whole_description(*described, limits));
  std::string text;
  for (const std::string& remark : remarks) text += comment(remark);
  text += "model:\n";
  for (std::size_t i = 0; i < whole.items.size(); ++i) {
    const std::string& key = whole.keys[i].name;
    constexpr std::array kFitted = {"center_of_mass",  "unit_inertia", "inertia",          "friction",
                                    "impact_friction", "restitution",  "rolling_friction", "edge_radius"};
    if (std::ranges::find(kFitted, key) != kFitted.end()) continue;
    text += "  " + key + ": " + flow_text(whole.items[i], key, folder) + "\n";
  }
  return text + fitted_lines(fitted);
}

ModelThrows read_model_throws(const LocatedValue& value, Problems& problems) {
  ModelThrows throws;
  Binder binder(value, problems);
  binder.read("position_noise", throws.position_noise, {0.0, 1.0, "give metres between 0 and 1", "m"});
  binder.read("rotation_noise", throws.rotation_noise, {0.0, 3.0, "give radians between 0 and 3", "rad"});
  binder.read("friction_scatter", throws.friction_scatter,
              {0.0, 3.0, "give a share between 0 and 3: 0.05 is 5 % from throw to throw"});
  return throws;
}

std::string throws_yaml(const ModelThrows& throws) {
  return "throws:\n" + key_line("position_noise", number_text(throws.position_noise) + "  # m") +
         key_line("rotation_noise", number_text(throws.rotation_noise) + "  # rad") +
         key_line("friction_scatter", number_text(throws.friction_scatter));
}

core::Status write_model(const std::filesystem::path& path, const ModelFile& file) {
  return write_file(path, std::string_view(model_yaml(file)));
}

namespace {

/// `problems`: those that the document was read with.
core::Result<belief::ObjectModel> model_of(const core::Result<LocatedValue>& document, Problems problems,
                                           const std::string& file, const std::string& name,
                                           const SceneFileOptions& options, FileReport* report,
                                           std::optional<ModelThrows>* throws) {
  if (!document) {
    if (report) *report = unread_report(file, document.status(), problems);
    return document.status();
  }
  belief::Scene scene;
  SceneContext context{problems, options, scene, {}, {}, {}, {}, {}};
  belief::ObjectModel model;
  {
    Binder binder(*document, problems);
    if (const LocatedValue* value = binder.require("model", "a model file holds one key 'model' with the model's keys"))
      model = read_object_model(*value, name, context);
    std::optional<ModelThrows> read;
    if (const LocatedValue* value = binder.find("throws")) read = read_model_throws(*value, problems);
    if (throws) *throws = read;
  }
  if (problems.empty())
    if (const core::Status status = belief::validate(model); !status.ok())
      add_invalid(document->find("model")->place, "model", status, problems);
  if (report) *report = {problems.errors(), problems.warnings(), problems.remarks()};
  if (!problems.empty()) return problems.status();
  return model;
}

}  // namespace

core::Result<belief::ObjectModel> read_model(const std::filesystem::path& path, const std::string& name,
                                             const SceneFileOptions& options, FileReport* report,
                                             std::optional<ModelThrows>* throws) {
  Problems problems;
  const core::Result<LocatedValue> document = read_yaml(path, options.limits, &problems);
  return model_of(document, std::move(problems), path.string(), name, options, report, throws);
}

core::Result<belief::ObjectModel> parse_model(std::string_view text, const std::string& file, const std::string& name,
                                              const SceneFileOptions& options, FileReport* report,
                                              std::optional<ModelThrows>* throws) {
  Problems problems;
  const core::Result<LocatedValue> document = parse_yaml(text, file, options.limits, &problems);
  return model_of(document, std::move(problems), file, name, options, report, throws);
}

}  // namespace prescene::interfaces
