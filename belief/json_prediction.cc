// SPDX-License-Identifier: Apache-2.0
// JSON of predictions.
#include "json_values.h"
#include "prescene/belief/json.h"
#include "prescene/belief/prediction.h"

namespace prescene::belief {

std::string to_string(FlightEnd end) {
  switch (end) {
    case FlightEnd::kMayTouch:
      return "may_touch";
    case FlightEnd::kPush:
      return "push";
    case FlightEnd::kNotFollowed:
      return "not_followed";
    case FlightEnd::kRunEnds:
      return "run_ends";
  }
  return "unknown";
}

namespace {

Json final_poses_json(const FinalPoses& poses) {
  Json components = Json::array();
  for (const PoseComponent& component : poses.components)
    components.push_back({{"weight", component.weight},
                          {"outcome", component.outcome},
                          {"mean", to_json(component.mean)},
                          {"covariance", matrix_json(component.covariance)}});
  const HeatMap& map = poses.heat_map;
  return {{"object", poses.object},
          {"mean_position", vector_json(poses.mean_position)},
          {"position_covariance", matrix_json(poses.position_covariance)},
          {"components", std::move(components)},
          {"heat_map",
           {{"cell", map.cell}, {"x0", map.x0}, {"y0", map.y0}, {"nx", map.nx}, {"ny", map.ny}, {"mass", map.mass}}}};
}

Json history_json(const std::vector<ProbabilityStage>& history) {
  Json json = Json::array();
  for (const ProbabilityStage& stage : history) {
    Json probability = Json::array(), interval = Json::array();
    for (const ProbabilityStage::Share& share : stage.outcomes) {
      probability.push_back(share.probability);
      interval.push_back({share.low, share.high});
    }
    json.push_back(
        {{"instances", stage.instances}, {"probability", std::move(probability)}, {"interval", std::move(interval)}});
  }
  return json;
}

Json inputs_json(const std::vector<DecidingInputs>& all) {
  Json json = Json::array();
  for (const DecidingInputs& one : all) {
    Json inputs = Json::array();
    for (const InputShare& input : one.inputs) {
      Json effects = Json::array();
      for (const InputShare::Effect& effect : input.effects)
        effects.push_back(
            {{"outcome", effect.outcome}, {"low_fifth", effect.low_fifth}, {"high_fifth", effect.high_fifth}});
      inputs.push_back({{"input", input.input},
                        {"share", input.share},
                        {"standard_error", input.standard_error},
                        {"effects", std::move(effects)}});
    }
    Json item{{"about", one.about}, {"explained_by_single", one.explained_by_single}};
    if (one.by_several) item["by_several"] = *one.by_several;
    item["inputs"] = std::move(inputs);
    json.push_back(std::move(item));
  }
  return json;
}

Json chaos_json(const std::vector<ChaosCheck>& checks) {
  Json json = Json::array();
  for (const ChaosCheck& check : checks)
    json.push_back({{"about", check.about},
                    {"pairs", check.pairs},
                    {"displacement", check.displacement},
                    {"changed", check.changed},
                    {"interval", {check.low, check.high}},
                    {"chaotic", check.chaotic}});
  return json;
}

Json contacts_json(const PredictAnswer& predict) {
  Json pairs = Json::array();
  for (const ContactForecast& contact : predict.contacts)
    pairs.push_back({{"first", contact.first},
                     {"second", contact.second},
                     {"probability", contact.probability},
                     {"interval", {contact.low, contact.high}},
                     {"first_touch", contact.first_touch},
                     {"impulse", contact.impulse},
                     {"touching", contact.touching}});
  return {{"times", predict.contact_times}, {"pairs", std::move(pairs)}};
}

Json model_error_json(const ModelError& error) {
  Json variants = Json::array();
  for (const ModelError::Variant& variant : error.variants) {
    Json shifts = Json::array();
    for (const ModelError::Shift& shift : variant.shifts) {
      Json item{{"outcome", shift.outcome}};
      if (!shift.group.empty()) item["group"] = shift.group;
      item["shift"] = shift.shift;
      item["interval"] = {shift.low, shift.high};
      shifts.push_back(std::move(item));
    }
    variants.push_back({{"kind", variant.kind == ModelError::Kind::kStep ? "step" : "prior"},
                        {"what", variant.what},
                        {"shifts", std::move(shifts)}});
  }
  return {{"instances", error.instances}, {"variants", std::move(variants)}};
}

Json flight_json(const FlightForecast& flight) {
  Json pairs = Json::array();
  for (const FlightForecast::Pair& pair : flight.may_touch)
    pairs.push_back(
        {{"first", pair.first}, {"second", pair.second}, {"probability", pair.probability}, {"error", pair.error}});
  return {{"apart_until", flight.apart_until}, {"ended_by", to_string(flight.end)}, {"may_touch", std::move(pairs)}};
}

Json paths_json(const std::vector<ObjectPath>& paths) {
  Json json = Json::array();
  for (const ObjectPath& path : paths) {
    Json points = Json::array();
    for (const Vector3d& point : path.points) points.push_back(vector_json(point));
    json.push_back({{"object", path.object}, {"outcome", path.outcome}, {"points", std::move(points)}});
  }
  return json;
}

Json joints_json(const std::vector<JointForecast>& joints) {
  Json json = Json::array();
  for (const JointForecast& joint : joints)
    json.push_back({{"joint", joint.joint},
                    {"type", to_string(joint.type)},
                    {"unit", unit_of(joint.type)},
                    {"mean", joint.mean},
                    {"standard_deviation", joint.standard_deviation},
                    {"quantiles", {joint.low, joint.middle, joint.high}}});
  return json;
}

Json stepper_json(const Basis& basis) {
  Json json{{"name", basis.stepper}};
  if (!basis.not_lockstep.empty()) json["not_lockstep"] = basis.not_lockstep;
  if (basis.hull_error > 0.0) json["hull_error"] = basis.hull_error;
  return json;
}

Json certificates_json(const CertificateSummary& use) {
  if (!use.used) return {{"used", false}};
  return {{"used", true},
          {"certified", use.certified},
          {"audited", use.audited},
          {"mismatches", use.mismatches},
          {"switched_off", use.switched_off}};
}

}  // namespace

Json outcome_probability_json(const OutcomeProbability& outcome) {
  Json json{{"name", outcome.name}};
  if (!outcome.group.empty()) json["group"] = outcome.group;
  json["probability"] = outcome.probability;
  json["interval"] = {outcome.low, outcome.high};
  return json;
}

void add_basis(const Basis& basis, Json& json) {
  json["converged"] = basis.converged;
  json["stopped"] = basis.stopped;
  json["instances"] = basis.instances;
  json["failed_instances"] = basis.failed_instances;
  json["simulated_seconds"] = basis.simulated_seconds;
  json["flown_seconds"] = basis.flown_seconds;
  json["step"] = basis.step;
  json["certificates"] = certificates_json(basis.certificates);
  json["overlaps"] = {{"share", basis.overlapping_share}, {"deepest", basis.deepest_overlap}};
  json["dropped_contacts"] = {{"instances", basis.crowded_instances}, {"contacts", basis.dropped_contacts}};
  json["wall_seconds"] = basis.wall_seconds;
  json["cpu_seconds"] = basis.cpu_seconds;
  json["remarks"] = basis.remarks;
  if (!basis.stepper.empty()) json["stepper"] = stepper_json(basis);
}

Json prediction_json(const PredictAnswer& predict) {
  Json outcomes = Json::array(), poses = Json::array(), runs = Json::array();
  for (const OutcomeProbability& outcome : predict.outcomes) outcomes.push_back(outcome_probability_json(outcome));
  for (const FinalPoses& final_poses : predict.final_poses) poses.push_back(final_poses_json(final_poses));
  for (const TypicalRun& run : predict.typical_runs)
    runs.push_back({{"outcome", run.outcome},
                    {"group", run.group},
                    {"share", run.share},
                    {"timeline", to_json(run.timeline)},
                    {"trajectory", to_json(run.trajectory)}});
  Json json{{"outcomes", std::move(outcomes)}};
  add_basis(predict, json);
  json["history"] = history_json(predict.history);
  json["final_poses"] = std::move(poses);
  json["typical_runs"] = std::move(runs);
  json["left_out"] = predict.left_out;
  if (!predict.joints.empty()) json["joints"] = joints_json(predict.joints);
  if (!predict.inputs.empty()) json["inputs"] = inputs_json(predict.inputs);
  if (!predict.chaos.empty()) json["chaos"] = chaos_json(predict.chaos);
  if (!predict.contact_times.empty()) json["contacts"] = contacts_json(predict);
  if (predict.flight) json["flight"] = flight_json(*predict.flight);
  if (predict.model_error) json["model_error"] = model_error_json(*predict.model_error);
  if (!predict.paths.empty()) json["paths"] = paths_json(predict.paths);
  return json;
}

}  // namespace prescene::belief
