// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/object_calibration.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/service/calibration/motion_units.h"
#include "prescene/simulation/calibration/keep_prior.h"
#include "usable_motions.h"

namespace prescene::service {
namespace {

using simulation::FlightCalibration;
using simulation::FlightParameter;
using simulation::MotionBeginning;
using simulation::MotionParameter;
using simulation::RecordedMotion;

// A tracker that claims to be better than that is a simulation.
constexpr double kLeastPositionNoise = 1e-5;  // m
constexpr double kLeastRotationNoise = 1e-4;  // rad
// Share of the prior's deviation that is left where recordings say little.
constexpr double kLittle = 0.6;
// A tracker's metre is worth a remark when it is off by so much, and by three standard errors.
constexpr double kScaleRemark = 0.003;
// Times as uncertain as frames show, that starts may be before the fit is called poor.
constexpr double kPoorFit = 10.0;
// Nothing that a lab throws or pushes has less friction.
constexpr double kNoFriction = 0.02;
constexpr double kLeastFrameRate = 100.0;  // Hz
// m: twice the gap at which things still count as touching, and more.
constexpr double kNoisySlide = 5e-4;
// Parts of the recordings, each of which is forecast by what the others say.
constexpr int kFolds = 5;
// Simulated starts: of a recording, and of all of them at most as long as each has the least.
constexpr std::size_t kSamples = 16;
constexpr std::size_t kLeastSamples = 8;
constexpr std::size_t kMostStarts = 2000;
// Of random numbers: the parts, and the held-out forecasts.
constexpr std::uint32_t kFoldDraws = 3;
constexpr std::uint32_t kHeldOutDraws = 4;

int samples_for(std::size_t recordings) {
  return static_cast<int>(std::clamp(kMostStarts / recordings, kLeastSamples, kSamples));
}

std::size_t place_of(MotionParameter parameter) { return static_cast<std::size_t>(parameter); }

const char* what_shows(MotionParameter parameter) {
  switch (parameter) {
    case MotionParameter::kFriction:
      return "record slides, or tosses that end in a slide";
    case MotionParameter::kImpactFriction:
      return "record tosses that hit at a slant";
    case MotionParameter::kRestitution:
      return "record bounces";
    case MotionParameter::kInertiaSize:
      return "record tosses that hit with a corner or an edge";
    case MotionParameter::kEdgeRadius:
      return "record tosses that hit with corners and edges";
    default:
      return "record tosses that spin about several axes";
  }
}

std::string words(MotionParameter parameter) {
  std::string text = to_string(parameter);
  std::ranges::replace(text, '_', ' ');
  return text;
}

simulation::MotionPrior kept_prior(const belief::Scene& scene, const std::vector<std::string>& keep) {
  simulation::MotionPrior prior = simulation::motion_prior(scene.model_of(scene.objects[0]));
  for (std::size_t i = 0; i < simulation::kMotionParameters; ++i) {
    const std::string name = to_string(static_cast<MotionParameter>(i));
    if (std::ranges::find(keep, name) != keep.end()) prior[i].deviation = 0.0;
  }
  return prior;
}

/// What flights say becomes the prior of what contacts, which come later, are asked.
void use_flights(const FlightCalibration& flight, const simulation::FlightPrior& before, belief::Scene* scene,
                 simulation::MotionPrior* prior) {
  scene->models[static_cast<std::size_t>(scene->objects[0].model)].unit_inertia = flight.unit_inertia(before);
  scene->gravity_W = flight.gravity_W;
  constexpr std::array kCenter = {MotionParameter::kCenterOfMassX, MotionParameter::kCenterOfMassY,
                                  MotionParameter::kCenterOfMassZ};
  for (int i = 0; i < 3; ++i) {
    simulation::MotionBelief& belief = (*prior)[place_of(kCenter[static_cast<std::size_t>(i)])];
    if (belief.deviation > 0.0)
      belief = {flight.center_of_mass[i], std::max(flight.standard_error(static_cast<FlightParameter>(i)),
                                                   simulation::least_center_error(flight.position_noise))};
  }
}

void add_remarks(const MotionDataset& dataset, ObjectCalibration* found) {
  for (const simulation::CalibratedParameter& p : found->motion.parameters) {
    if (p.left_of_prior < kLittle) continue;
    found->remarks.push_back("these recordings say " +
                             std::string(p.left_of_prior >= simulation::kUnidentifiable ? "nothing" : "little") +
                             " about " + words(p.parameter) + ": " + what_shows(p.parameter));
  }
  for (const simulation::CalibratedParameter& p : found->motion.parameters) {
    const bool friction = p.parameter == simulation::MotionParameter::kFriction ||
                          p.parameter == simulation::MotionParameter::kImpactFriction;
    if (!friction || p.left_of_prior >= kLittle || p.value > kNoFriction) continue;
    found->remarks.push_back(words(p.parameter) +
                             " came out as next to nothing: something that is not in the scene moves the object, as a "
                             "hand that still pushes it; cut recordings to where it moves by itself");
  }
  if (!found->motion.search_settled)
    found->remarks.emplace_back("the search had not settled when it ended: values may be wrong; give more " +
                                std::string("--max-evaluations"));
  if (!found->motion.estimate_settled)
    found->remarks.emplace_back(
        "the estimate did not settle: errors may be too small; record more, or --keep what the "
        "recordings cannot identify");
  if (found->motion.start_noise > kPoorFit) {
    found->remarks.push_back("the fit is poor: recordings differ from what the model does as if their starts were " +
                             core::fixed_text(found->motion.start_noise, 0) +
                             " times as uncertain as their frames show; values may be off by more than their errors: "
                             "check shape, size and supports, and that nothing else touches the object");
  }
  if (found->position_noise < kLeastPositionNoise && found->rotation_noise < kLeastRotationNoise) {
    found->remarks.push_back("the frames show next to no noise (" + core::fixed_text(1e3 * found->position_noise, 2) +
                             " mm, " + core::fixed_text(1e3 * found->rotation_noise, 2) +
                             " mrad): they are simulated, or smoothed by the tracker, and errors may be too small");
  }
  if (found->slides > 0 && found->position_noise > kNoisySlide) {
    found->remarks.push_back(
        "a position noise of " + core::fixed_text(1e3 * found->position_noise, 1) +
        " mm is much for slides: simulated ones hop at their start, and friction may come out low");
  }
  if (const double rate = frame_rate(dataset.recordings); rate < kLeastFrameRate) {
    found->remarks.push_back("recordings have " + core::fixed_text(rate, 0) +
                             " frames a second: starts and contacts show better at 100 Hz or more");
  }
  if (found->flights < static_cast<int>(kLeastFlights))
    found->remarks.emplace_back("there are fewer than three flights: the centre of mass comes from contacts alone");
  if (!found->flight) return;
  const double given = dataset.scene->gravity_W.norm();
  const double scale = found->flight->gravity_W.norm() / given;
  const double error = found->flight->standard_error(FlightParameter::kGravityZ) / given;
  if (std::abs(scale - 1.0) > std::max(kScaleRemark, 3.0 * error)) {
    found->remarks.push_back("flights fall as if gravity were " + core::fixed_text(scale, 3) + " +- " +
                             core::fixed_text(error, 3) +
                             " of the scene's: the recordings' metre or second is off; describe the object in the " +
                             "recordings' metres, which the fit takes it to be in");
  }
}

/// How throws differ, from recordings that parameters were not fitted to. `scene` as the fit had it.
core::Status hold_out(const UsableMotions& usable, const std::vector<int>& folds, const belief::Scene& scene,
                      Backends& backends, const core::RandomStream& stream, const core::ProgressSink& progress,
                      const core::Cancellation* cancellation, ObjectCalibration* found) {
  std::vector<belief::Scene> scenes;
  for (const std::vector<double>& values : found->motion.without) {
    simulation::MotionCalibration without = found->motion;
    for (std::size_t i = 0; i < values.size(); ++i) without.parameters[i].value = values[i];
    belief::Scene& with = scenes.emplace_back(scene);
    belief::ObjectModel& model = with.models[static_cast<std::size_t>(with.objects[0].model)];
    model = calibrated_model(model, without);
  }
  const std::vector<HeldOutMotion> motions = usable.held_out(folds);
  PRESCENE_TRY(found->held_out,
               held_out_scatter(motions, scenes, found->throws, backends, stream, progress, cancellation));
  if (found->held_out) {
    found->throws = found->held_out->scatter;
  } else {
    found->remarks.push_back("only " + std::to_string(motions.size()) +
                             " recordings come to rest: how throws differ is as the fit has it, not checked against "
                             "recordings that it did not see; it takes " +
                             std::to_string(kLeastHeldOut));
  }
  return core::ok_status();
}

/// Progress as a part of a whole.
core::ProgressSink part_of(const core::ProgressSink& progress, double begin, double end) {
  if (!progress) return {};
  return [progress, begin, end](const core::Progress& now) {
    progress({begin + (end - begin) * now.fraction, std::nullopt, now.text});
  };
}

}  // namespace

core::Result<ObjectCalibration> calibrate_object(const MotionDataset& dataset, Backends& backends,
                                                 const ObjectCalibrationOptions& options,
                                                 const core::ProgressSink& progress,
                                                 const core::Cancellation* cancellation) {
  if (core::Status status = check_units(dataset.recordings, dataset.scene->gravity_W.norm()); !status.ok())
    return status.at(dataset.table_file().string());
  const belief::Scene& scene = *dataset.scene;
  const simulation::MotionPrior prior = kept_prior(scene, options.keep);
  const auto free = static_cast<std::size_t>(
      std::ranges::count_if(prior, [](const simulation::MotionBelief& belief) { return belief.deviation > 0.0; }));
  PRESCENE_TRY(const UsableMotions usable, usable_motions(dataset, simulation::least_recordings(free), backends));
  return calibrate_usable(dataset, usable, backends, options, progress, cancellation);
}

core::Result<ObjectCalibration> calibrate_usable(const MotionDataset& dataset, const UsableMotions& all,
                                                 Backends& backends, const ObjectCalibrationOptions& options,
                                                 const core::ProgressSink& progress,
                                                 const core::Cancellation* cancellation) {
  ObjectCalibration found;
  found.remarks = all.remarks;
  // A twin says nothing that the other does not.
  const UsableMotions usable = all.without_twins();
  const std::vector<RecordedMotion>& motions = usable.motions;
  belief::Scene scene = *dataset.scene;
  const belief::ObjectModel& model = scene.model_of(scene.objects[0]);
  found.prior = kept_prior(scene, options.keep);
  PRESCENE_RETURN_IF_ERROR(check_gravity(dataset, motions));
  for (const RecordedMotion& motion : motions)
    ++(motion.beginning == MotionBeginning::kFlight ? found.flights : found.slides);
  simulation::MotionPrior prior = found.prior;
  simulation::MotionCalibrationOptions motion;
  motion.max_evaluations = options.max_evaluations;
  motion.samples = options.samples > 0 ? options.samples : samples_for(motions.size());
  const core::RandomStream stream(options.seed, core::Purpose::kEvaluation);
  const int folds = static_cast<int>(std::min<std::size_t>(kFolds, motions.size()));
  motion.estimate.folds = folds_of(usable.groups, folds, stream.at(0, kFoldDraws));
  if (found.flights >= static_cast<int>(kLeastFlights)) {
    const simulation::FlightPrior flight = flight_prior(scene, found.prior);
    PRESCENE_TRY(found.flight, fly(motions, flight));
    use_flights(*found.flight, flight, &scene, &prior);
    motion.position_noise = found.flight->position_noise;
    motion.rotation_noise = found.flight->rotation_noise;
  } else {
    PRESCENE_RETURN_IF_ERROR(measure_noise(motions, &motion));
  }
  found.position_noise = motion.position_noise;
  found.rotation_noise = motion.rotation_noise;
  motion.position_noise = std::max(motion.position_noise, kLeastPositionNoise);
  motion.rotation_noise = std::max(motion.rotation_noise, kLeastRotationNoise);
  PRESCENE_TRY(found.motion, calibrate_motions(motions, scene, prior, backends.simulator_factory(), stream,
                                               backends.pool(), motion, part_of(progress, 0.0, 0.8), cancellation));
  for (simulation::CalibratedParameter& p : found.motion.parameters) {
    const simulation::MotionBelief& before = found.prior[place_of(p.parameter)];
    // What flights say was the prior; their frames also begin the simulated motions.
    const double flown = prior[place_of(p.parameter)].deviation;
    if (found.flight && flown < before.deviation)
      p.standard_error = simulation::error_of_shared_frames(flown, p.standard_error);
    if (p.standard_error >= simulation::kUnidentifiable * before.deviation) {
      p.value = before.mean;
      p.standard_error = before.deviation;
    }
    p.left_of_prior = p.standard_error / before.deviation;
  }
  if (std::ranges::all_of(found.motion.parameters, [](const simulation::CalibratedParameter& p) {
        return p.left_of_prior >= simulation::kUnidentifiable;
      }))
    return core::invalid_input(
        dataset.table_file().string() +
        ": these recordings say nothing about any parameter; record tosses that bounce and spin, "
        "and long slides");
  found.throws = {found.motion.start_noise * motion.position_noise, found.motion.start_noise * motion.rotation_noise,
                  found.motion.friction_scatter};
  found.model = calibrated_model(model, found.motion);
  PRESCENE_RETURN_IF_ERROR(hold_out(usable, motion.estimate.folds, scene, backends, stream.at(0, kHeldOutDraws),
                                    part_of(progress, 0.8, 1.0), cancellation, &found));
  add_remarks(dataset, &found);
  return found;
}

core::Result<std::string> calibrated_yaml(const MotionDataset& dataset, const ObjectCalibration& found,
                                          const std::filesystem::path& folder) {
  std::vector<std::string> remarks = {"fitted to " + std::to_string(found.flights + found.slides) +
                                      " recordings by prescene calibrate; +- is one standard error"};
  for (const simulation::CalibratedParameter& p : found.motion.parameters) {
    // A model file has no place for these two's.
    if (p.parameter == MotionParameter::kInertiaSize)
      remarks.push_back("size of the inertia: +- " + core::fixed_text(100.0 * p.standard_error, 1) + " %");
    if (p.parameter == MotionParameter::kEdgeRadius)
      remarks.push_back("edge radius: +- " + core::fixed_text(1e3 * p.standard_error, 2) + " mm");
  }
  remarks.insert(remarks.end(), found.remarks.begin(), found.remarks.end());
  if (found.held_out)
    remarks.push_back("throws: as wide as " + std::to_string(found.held_out->scores.n) +
                      " recordings need that the parameters were not fitted to");
  PRESCENE_TRY(
      const std::string yaml,
      interfaces::fitted_model_yaml(dataset.scene_file(), dataset.scene->model_of(dataset.scene->objects[0]).name,
                                    found.model, folder, remarks));
  return yaml + interfaces::throws_yaml({found.throws.position, found.throws.rotation, found.throws.friction});
}

interfaces::LearnedFile with_calibrated(interfaces::LearnedFile earlier, const MotionDataset& dataset,
                                        const ObjectCalibration& found) {
  const belief::SceneObject& object = dataset.scene->objects[0];
  interfaces::LearnedModel model = interfaces::learned_model(found.model);
  model.name = dataset.scene->model_of(object).name;
  std::erase_if(earlier.models, [&](const auto& other) { return other.name == model.name; });
  std::erase_if(earlier.objects, [&](const auto& other) { return other.name == object.name; });
  earlier.models.push_back(std::move(model));
  return earlier;
}

nlohmann::ordered_json to_json(const ObjectCalibration& found) {
  nlohmann::ordered_json json;
  json["recordings"] = found.flights + found.slides;
  json["flights"] = found.flights;
  json["slides"] = found.slides;
  json["evaluations"] = found.motion.evaluations;
  json["settled"] = found.motion.settled();
  json["score"] = {{"prior", found.motion.start_cost}, {"found", found.motion.cost}};
  json["start_noise"] = found.motion.start_noise;
  json["friction_scatter"] = found.motion.friction_scatter;
  json["throws"] = {{"position_noise", found.throws.position},
                    {"rotation_noise", found.throws.rotation},
                    {"friction_scatter", found.throws.friction}};
  if (found.held_out)
    json["held_out"] = {{"factor", found.held_out->factor}, {"scores", to_json(found.held_out->scores)}};
  if (found.flight) {
    const FlightCalibration& flight = *found.flight;
    json["flight"] = {{"gravity", {flight.gravity_W.x(), flight.gravity_W.y(), flight.gravity_W.z()}},
                      {"gravity_error", flight.standard_error(FlightParameter::kGravityZ)},
                      {"position_noise", flight.position_noise},
                      {"rotation_noise", flight.rotation_noise},
                      {"frames", flight.frames}};
  }
  json["parameters"] = nlohmann::ordered_json::array();
  for (const simulation::CalibratedParameter& p : found.motion.parameters) {
    const simulation::MotionBelief& prior = found.prior[place_of(p.parameter)];
    json["parameters"].push_back({{"name", to_string(p.parameter)},
                                  {"value", p.value},
                                  {"standard_error", p.standard_error},
                                  {"prior", {{"mean", prior.mean}, {"deviation", prior.deviation}}},
                                  {"left_of_prior", p.left_of_prior}});
  }
  json["remarks"] = found.remarks;
  return json;
}

}  // namespace prescene::service
