// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/learned_file.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/belief/validation.h"
#include "prescene/core/check.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"
#include "value_texts.h"

namespace prescene::interfaces {
namespace {

using belief::PhysicalDraw;
using belief::PhysicalPrior;

constexpr std::size_t kMostDraws = 4096;
constexpr double kWeightError = 1e-6;  // of the sum of weights that were written by hand or rounded
constexpr NumberRange kLeverArm{0.0, 0.5, "give metres between 0 and 0.5", "m"};
constexpr NumberRange kCell{0.0, 1.0, "give the width of a draw, between 0 and 1"};

/// The parameters of belief::physical_priors in its order; a model need not have the last.
struct ParameterRange {
  const char* name;
  NumberRange range;
};
constexpr ParameterRange kParameters[] = {
    {"friction", kFriction},         {"restitution", kRestitution},   {"mass", kMass},
    {"center_of_mass_x", kPosition}, {"center_of_mass_y", kPosition}, {"center_of_mass_z", kPosition},
    {"impact_friction", kFriction}};
constexpr const char* kOptional = "impact_friction";

std::vector<PhysicalPrior> read_priors(const LocatedValue& value, Problems& problems) {
  std::vector<PhysicalPrior> priors;
  Binder binder(value, problems);
  for (const ParameterRange& parameter : kParameters) {
    const LocatedValue* at = std::string_view(parameter.name) == kOptional
                                 ? binder.find(parameter.name)
                                 : binder.require(parameter.name, "give what it was before anything was learned");
    // Not cut: what was written has its limits.
    if (at) priors.push_back({parameter.name, read_scalar(*at, problems, parameter.range)});
  }
  return priors;
}

PhysicalDraw read_draw(const LocatedValue& value, Problems& problems, std::size_t size) {
  PhysicalDraw draw;
  if (value.kind != LocatedValue::Kind::kList || value.items.size() != size + 1) {
    report_type(value, problems,
                "give the logarithm of the weight and then " + std::to_string(size) +
                    " numbers between 0 and 1, one for each uncertain prior");
    return draw;
  }
  const LocatedValue& weight = value.items.front();
  if (weight.kind == LocatedValue::Kind::kScalar && !weight.quoted && weight.text == "-inf")
    draw.log_weight = -std::numeric_limits<double>::infinity();
  else
    draw.log_weight =
        read_number(weight, problems, {-1e9, 1e-9, "give the logarithm of a weight, at most 0"}).value_or(0.0);
  for (std::size_t i = 1; i < value.items.size(); ++i) {
    const LocatedValue& item = value.items[i];
    const double u = read_number(item, problems, {0.0, 1.0, "give a number between 0 and 1"}).value_or(0.5);
    if (u == 0.0 || u == 1.0)
      problems.add(item.place, item.path, number_text(u) + " is an end of the interval", "give a number between them");
    draw.uniforms.push_back(u);
  }
  return draw;
}

belief::PhysicalBelief read_physics(Binder& binder, const LocatedValue& draws_at, std::size_t size) {
  Problems& problems = binder.problems();
  belief::PhysicalBelief physics;
  binder.read("lessons", physics.lessons, 1, std::numeric_limits<int>::max(), "give how many motions it rests on");
  if (const LocatedValue* at = binder.find("last_ns"))
    physics.learned_ns =
        read_integer(*at, problems, 0, std::numeric_limits<long long>::max(), "give the stamp of the last of them, ns")
            .value_or(0);
  binder.read("cell", physics.cell, kCell);
  if (draws_at.kind != LocatedValue::Kind::kList || draws_at.items.empty() || draws_at.items.size() > kMostDraws) {
    report_type(draws_at, problems, "give a list of 1 to " + std::to_string(kMostDraws) + " draws");
    return physics;
  }
  const std::size_t before = problems.errors().size();
  std::vector<PhysicalDraw> draws;
  double sum = 0.0;
  for (const LocatedValue& item : draws_at.items) {
    draws.push_back(read_draw(item, problems, size));
    sum += std::exp(draws.back().log_weight);
  }
  if (problems.errors().size() == before && std::abs(sum - 1.0) > kWeightError)
    problems.add(draws_at.place, draws_at.path, "the weights sum to " + core::rounded_text(sum) + ", not to 1",
                 "restore the file, or remove the object from it: it is learned anew");
  physics.draws = std::make_shared<const std::vector<PhysicalDraw>>(std::move(draws));
  return physics;
}

LearnedObject read_learned_object(const LocatedValue& value, const LocatedValue::Key& key, Problems& problems) {
  LearnedObject object;
  object.name = key.name;
  object.place = key.place;
  Binder binder(value, problems);
  if (const LocatedValue* at = binder.require("priors", "give the priors that the draws are of"))
    object.priors = read_priors(*at, problems);
  std::size_t size = 0;
  for (const PhysicalPrior& prior : object.priors) size += static_cast<std::size_t>(dimensions(prior.prior));
  binder.require("lessons", "give how many motions it rests on");
  if (const LocatedValue* at = binder.require("draws", "remove the object: it is learned anew"))
    object.physics = read_physics(binder, *at, size);
  for (const char* known : {"last_ns", "cell"}) binder.note_known(known);
  return object;
}

LearnedModel read_learned_model(const LocatedValue& value, const LocatedValue::Key& key, Problems& problems) {
  LearnedModel model;
  model.name = key.name;
  model.place = key.place;
  Binder binder(value, problems);
  const auto scalar = [&](const char* name, const NumberRange& range, auto& to) {
    if (const LocatedValue* at = binder.find(name)) to = read_scalar(*at, problems, range, true, true);
  };
  scalar("mass", kMass, model.mass);
  scalar("friction", kFriction, model.friction);
  scalar("impact_friction", kFriction, model.impact_friction);
  scalar("restitution", kRestitution, model.restitution);
  if (const LocatedValue* at = binder.find("center_of_mass"))
    model.center_of_mass = read_vector_distribution(*at, problems, kPosition);
  if (const LocatedValue* at = binder.find("unit_inertia")) model.unit_inertia = read_unit_inertia(*at, problems);
  binder.read("rolling_friction", model.rolling_friction, kLeverArm);
  binder.read("edge_radius", model.edge_radius, kLeverArm);
  return model;
}

/// Calls read(value, key) for each entry of a map of names.
template <class Read>
void for_each_entry(const LocatedValue* map, Problems& problems, const Read& read) {
  if (!map) return;
  if (map->kind != LocatedValue::Kind::kMap) {
    if (map->kind != LocatedValue::Kind::kNothing)
      report_type(*map, problems, "give a map of names, each with a map of its keys");
    return;
  }
  for (std::size_t i = 0; i < map->keys.size(); ++i) {
    if (!belief::check_name(map->keys[i].name).ok())
      problems.add(map->keys[i].place, map->items[i].path, "no scene has that name",
                   "use letters, digits, '_', '-' and '.', at most 128");
    read(map->items[i], map->keys[i]);
  }
}

std::string draw_text(const PhysicalDraw& draw) {
  std::vector<std::string> numbers = {number_text(draw.log_weight)};
  for (const double u : draw.uniforms) numbers.push_back(number_text(u));
  return flow_list(numbers);
}

std::string text_of(const LearnedModel& model) {
  std::string text = "    " + model.name + ":\n";
  const auto line = [&](const char* key, const std::string& value) {
    text.append("      ").append(key).append(": ").append(value).append("\n");
  };
  const auto maybe = [&](const char* key, const auto& value, const char* unit = "") {
    if (value) line(key, value_text(*value) + unit);
  };
  maybe("mass", model.mass, "  # kg");
  maybe("friction", model.friction);
  maybe("impact_friction", model.impact_friction);
  maybe("restitution", model.restitution);
  maybe("center_of_mass", model.center_of_mass, "  # m");
  maybe("unit_inertia", model.unit_inertia, "  # m^2, of 1 kg about the centre of mass");
  if (model.rolling_friction) line("rolling_friction", number_text(*model.rolling_friction) + "  # m");
  if (model.edge_radius) line("edge_radius", number_text(*model.edge_radius) + "  # m");
  return text;
}

/// A model of these priors and no shape.
belief::ObjectModel model_of(const std::vector<PhysicalPrior>& priors) {
  belief::ObjectModel model;
  for (const auto& [name, prior] : priors) {
    if (name == "friction") model.contact.friction = prior;
    if (name == "restitution") model.contact.restitution = prior;
    if (name == "mass") model.mass = prior;
    if (name == "center_of_mass_x") model.center_of_mass.x = prior;
    if (name == "center_of_mass_y") model.center_of_mass.y = prior;
    if (name == "center_of_mass_z") model.center_of_mass.z = prior;
    if (name == "impact_friction") model.contact.impact_friction = prior;
  }
  return model;
}

/// For people; nothing reads it.
std::string summary_lines(const LearnedObject& object) {
  std::string text;
  const belief::ObjectModel model = model_of(object.priors);
  for (const belief::ParameterEstimate& estimate : belief::parameter_estimates(model, object.physics))
    text += "      # " + estimate.name + ": " + core::rounded_text(estimate.mean) + " +- " +
            core::rounded_text(estimate.standard_deviation) + " (90 %: " + core::rounded_text(estimate.low) + " to " +
            core::rounded_text(estimate.high) + ")\n";
  return text;
}

std::string text_of(const LearnedObject& object) {
  PRESCENE_CHECK(object.physics.draws != nullptr);
  std::string text = "    " + object.name + ":\n" + summary_lines(object);
  text += "      lessons: " + std::to_string(object.physics.lessons) + "\n";
  text += "      last_ns: " + std::to_string(object.physics.learned_ns) + "\n";
  text += "      cell: " + number_text(object.physics.cell) + "\n      priors: {";
  std::string order;
  for (const PhysicalPrior& prior : object.priors) {
    text.append(&prior == &object.priors.front() ? "" : ", ").append(prior.name).append(": ");
    text += value_text(prior.prior);
    if (dimensions(prior.prior) > 0) order.append(order.empty() ? "" : ", ").append(prior.name);
  }
  text += "}\n      draws:  # each the logarithm of its weight, then where it lies in the prior of " + order + "\n";
  for (const PhysicalDraw& draw : *object.physics.draws) text += "        - " + draw_text(draw) + "\n";
  return text;
}

}  // namespace

LearnedModel learned_model(const belief::ObjectModel& fitted) {
  const belief::ContactProperties& contact = fitted.contact;
  LearnedModel model;
  model.name = fitted.name;
  model.friction = contact.friction;
  model.impact_friction = contact.impact_friction;
  model.restitution = contact.restitution;
  model.center_of_mass = fitted.center_of_mass;
  model.unit_inertia = fitted.unit_inertia;
  model.rolling_friction = contact.rolling_friction;
  model.edge_radius = contact.edge_radius;
  return model;
}

core::Result<LearnedFile> parse_learned(std::string_view text, const std::string& file, FileReport* report,
                                        const YamlLimits& limits) {
  Problems problems;
  const core::Result<LocatedValue> document = parse_yaml(text, file, limits, &problems);
  if (!document) {
    if (report) *report = unread_report(file, document.status(), problems);
    return document.status();
  }
  LearnedFile learned;
  {
    Binder root(*document, problems);
    if (const LocatedValue* at =
            root.require("learned", "a learned file holds one key 'learned' with 'models', 'objects' or both")) {
      Binder binder(*at, problems);
      for_each_entry(binder.find("models"), problems, [&](const LocatedValue& value, const LocatedValue::Key& key) {
        learned.models.push_back(read_learned_model(value, key, problems));
      });
      for_each_entry(binder.find("objects"), problems, [&](const LocatedValue& value, const LocatedValue::Key& key) {
        learned.objects.push_back(read_learned_object(value, key, problems));
      });
    }
  }
  if (report) *report = {problems.errors(), problems.warnings(), {}};
  if (!problems.empty()) return problems.status();
  return learned;
}

std::string learned_yaml(const LearnedFile& file) {
  std::string text = "# What Prescene learned of physical parameters; see docs/reference/scene_files.md.\nlearned:\n";
  text += file.models.empty() ? "  models: {}\n" : "  models:\n";
  for (const LearnedModel& model : file.models) text += text_of(model);
  text += file.objects.empty() ? "  objects: {}\n" : "  objects:\n";
  for (const LearnedObject& object : file.objects) text += text_of(object);
  return text;
}

core::Result<belief::Scene> with_learned_models(belief::Scene scene, const LearnedFile& file) {
  Problems problems;
  for (const LearnedModel& learned : file.models) {
    const auto model = std::find_if(scene.models.begin(), scene.models.end(),
                                    [&](const belief::ObjectModel& m) { return m.name == learned.name; });
    if (model == scene.models.end()) continue;
    belief::ContactProperties& contact = model->contact;
    if (learned.mass) model->mass = *learned.mass;
    if (learned.friction) contact.friction = *learned.friction;
    if (learned.impact_friction) contact.impact_friction = learned.impact_friction;
    if (learned.restitution) contact.restitution = *learned.restitution;
    if (learned.center_of_mass) model->center_of_mass = *learned.center_of_mass;
    if (learned.unit_inertia) model->unit_inertia = *learned.unit_inertia;
    if (learned.rolling_friction) contact.rolling_friction = *learned.rolling_friction;
    if (learned.edge_radius) contact.edge_radius = *learned.edge_radius;
    if (const core::Status valid = belief::validate(*model); !valid.ok())
      problems.add(learned.place, "learned.models." + learned.name, valid.message(), "correct it, or remove the model");
  }
  if (!problems.empty()) return problems.status();
  return scene;
}

core::Result<std::vector<belief::PhysicalBelief>> learned_physics(const belief::Scene& scene, const LearnedFile& file) {
  Problems problems;
  std::vector<belief::PhysicalBelief> physics(scene.objects.size());
  for (const LearnedObject& learned : file.objects) {
    const auto index = belief::find_object(scene, learned.name);
    if (!index) continue;
    const auto i = static_cast<std::size_t>(*index);
    const std::vector<PhysicalPrior> now = belief::physical_priors(scene.model_of(scene.objects[i]));
    const std::string key = "learned.objects." + learned.name;
    const std::string remedy = "remove it from this file to learn it anew, or restore the scene";
    for (const PhysicalPrior& prior : now) {
      const auto was = std::find_if(learned.priors.begin(), learned.priors.end(),
                                    [&](const PhysicalPrior& other) { return other.name == prior.name; });
      if (was == learned.priors.end())
        problems.add(learned.place, key,
                     "the scene gives it a prior of " + prior.name + ", with which it was not learned", remedy);
      else if (was->prior != prior.prior)
        problems.add(learned.place, key,
                     "it was learned from " + prior.name + ": " + value_text(was->prior) + ", the scene says " +
                         value_text(prior.prior),
                     remedy);
    }
    if (now.size() < learned.priors.size())
      problems.add(learned.place, key, "it was learned with a prior of impact_friction, which the scene does not give",
                   remedy);
    physics[i] = learned.physics;
  }
  if (!problems.empty()) return problems.status();
  return physics;
}

LearnedFile with_learned(LearnedFile file, const belief::Scene& scene, std::span<const belief::ObjectBelief> objects) {
  for (const belief::ObjectBelief& object : objects) {
    if (!object.physics.draws || !belief::find_object(scene, object.name)) continue;
    const auto known = std::find_if(file.objects.begin(), file.objects.end(),
                                    [&](const LearnedObject& other) { return other.name == object.name; });
    LearnedObject& learned = known == file.objects.end() ? file.objects.emplace_back() : *known;
    learned = {object.name, belief::physical_priors(scene.models[static_cast<std::size_t>(object.model)]),
               object.physics, learned.place};
  }
  return file;
}

}  // namespace prescene::interfaces
