// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/object_calibration.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "prescene/core/order_statistics.h"
#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/service/calibration/motion_units.h"
#include "prescene/simulation/calibration/find_beginning.h"
#include "prescene/simulation/calibration/free_fall.h"
#include "prescene/simulation/calibration/keep_prior.h"
#include "prescene/simulation/calibration/sliding_fit.h"

namespace prescene::service {
namespace {

using simulation::FlightCalibration;
using simulation::FlightParameter;
using simulation::MotionBeginning;
using simulation::MotionParameter;
using simulation::RecordedMotion;

constexpr std::size_t kLeastFlights = 3;
// A tracker that claims to be better than that is a simulation.
constexpr double kLeastPositionNoise = 1e-5;  // m
constexpr double kLeastRotationNoise = 1e-4;  // rad
// Share of the prior's deviation that is left where little was told.
constexpr double kLittle = 0.6;
// A tracker's metre is worth a remark when it is off by so much, and by three standard errors.
constexpr double kScaleRemark = 0.003;
// And no metre at all when gravity is off by such a share, and by so many errors.
constexpr double kScaleRefused = 0.1;
constexpr double kScaleErrors = 4.0;
// s of a flight in which its fall is measured: a contact that comes earlier than simulated is seldom among them.
constexpr double kFallSeconds = 0.1;
// Of the recordings, that may be left out, and how many of them a refusal names.
constexpr double kMostLeftOut = 0.25;
constexpr std::size_t kMostNamed = 3;
// Times as uncertain as frames show, that starts may be before the fit is called poor.
constexpr double kPoorFit = 10.0;
// Nothing that a lab throws or pushes has less friction.
constexpr double kNoFriction = 0.02;
constexpr double kLeastFrameRate = 100.0;  // Hz
// m: twice the gap at which things still count as touching, and more.
constexpr double kNoisySlide = 5e-4;

std::size_t place_of(MotionParameter parameter) { return static_cast<std::size_t>(parameter); }

const char* what_tells(MotionParameter parameter) {
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

/// What of the recordings can be used; what cannot is left out with a remark, unless too little remains.
core::Result<std::vector<RecordedMotion>> beginnings(const MotionDataset& dataset, std::size_t least,
                                                     Backends& backends, std::vector<std::string>* remarks) {
  PRESCENE_TRY(const auto simulator, backends.make_simulator(*dataset.scene));
  std::vector<std::span<const simulation::TimedPose>> frames;
  for (const MotionRecording& recording : dataset.recordings) frames.emplace_back(recording.frames);
  const double noise = simulation::position_noise_of(frames);
  std::vector<RecordedMotion> motions;
  std::vector<std::string> refused;
  for (const MotionRecording& recording : dataset.recordings) {
    auto motion = simulation::find_beginning(recording.name, recording.frames, *dataset.scene, *simulator,
                                             backends.pool(), noise);
    if (motion)
      motions.push_back(*std::move(motion));
    else
      refused.push_back(motion.status().message());
  }
  const double share = static_cast<double>(refused.size()) / static_cast<double>(dataset.recordings.size());
  if (refused.empty() || (motions.size() >= least && share <= kMostLeftOut)) {
    for (const std::string& reason : refused) remarks->push_back("left out: " + reason);
    return motions;
  }
  std::string text =
      std::to_string(refused.size()) + " of " + std::to_string(dataset.recordings.size()) + " recordings can't be used";
  for (std::size_t i = 0; i < std::min(refused.size(), kMostNamed); ++i) text += (i == 0 ? ": " : "; ") + refused[i];
  if (refused.size() > kMostNamed) text += "; ...";
  return core::invalid_input(dataset.table_file().string() + ": " + text);
}

/// What flights tell becomes the prior of what contacts, which come later, are asked.
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

core::Result<FlightCalibration> fly(const std::vector<RecordedMotion>& motions, const simulation::FlightPrior& prior) {
  std::vector<std::span<const simulation::TimedPose>> flights;
  for (const RecordedMotion& motion : motions) {
    if (motion.beginning == MotionBeginning::kFlight)
      flights.push_back(std::span(motion.frames).first(motion.first_frames));
  }
  return simulation::calibrate_flights(flights, prior);
}

std::string unit_guess(double ratio) {
  struct Unit {
    const char* name;
    double metres;
  };
  for (const Unit& unit : {Unit{"feet", 0.3048}, Unit{"inches", 0.0254}, Unit{"decimetres", 0.1}}) {
    const double off = ratio * unit.metres;
    if (off > 1.0 - kScaleRefused && off < 1.0 + kScaleRefused)
      return std::string("; if they are in ") + unit.name + " multiply them by " + core::rounded_text(unit.metres);
  }
  return {};
}

/// By how flights fall before they touch anything, whatever the fit of the model makes of it.
core::Status check_gravity(const MotionDataset& dataset, const std::vector<RecordedMotion>& motions) {
  const belief::Scene& scene = *dataset.scene;
  const geometry::Vector3d center = belief::mean(scene.model_of(scene.objects[0]).center_of_mass);
  std::vector<std::span<const simulation::TimedPose>> flights;
  for (const RecordedMotion& motion : motions) {
    if (motion.beginning != MotionBeginning::kFlight) continue;
    std::size_t count = std::min(simulation::kLeastFallFrames, motion.first_frames);
    while (count < motion.first_frames && motion.frames[count].time - motion.frames[0].time <= kFallSeconds) ++count;
    flights.push_back(std::span(motion.frames).first(count));
  }
  if (flights.empty()) return core::ok_status();
  const double noise = simulation::position_noise_of(flights);
  std::vector<double> falls;
  double variance = 0.0;
  for (const auto& flight : flights) {
    const simulation::FreeFall fall = simulation::measure_whole_fall(flight, center, scene.gravity_W, noise);
    falls.push_back(fall.acceleration);
    variance += fall.error * fall.error;
  }
  const auto n = static_cast<double>(falls.size());
  const double fall = core::upper_median(falls);
  std::vector<double> deviations;
  for (const double each : falls) deviations.push_back(std::abs(each - fall));
  // Of a median of normal numbers.
  const double error =
      1.2533 * std::max(std::sqrt(variance / n), 1.4826 * core::upper_median(deviations)) / std::sqrt(n);
  const double given = scene.gravity_W.norm();
  if (std::abs(fall - given) <= std::max(kScaleRefused * given, kScaleErrors * error)) return core::ok_status();
  return core::invalid_input(dataset.table_file().string() + ": flights fall with " + core::rounded_text(fall) +
                             " +- " + core::rounded_text(error) + " m/s^2, the scene's gravity is " +
                             core::rounded_text(given) + ": x, y, z must be in metres and t in seconds" +
                             unit_guess(fall / given));
}

/// Noise of the tracker, from slides where there are no flights.
core::Status measure_noise(const std::vector<RecordedMotion>& motions, simulation::MotionCalibrationOptions* options) {
  std::vector<double> positions;
  std::vector<double> rotations;
  for (const RecordedMotion& motion : motions) {
    if (motion.beginning != MotionBeginning::kSlide) continue;
    const auto fit = simulation::fit_sliding(std::span(motion.frames).first(motion.first_frames));
    if (!fit) return fit.status().at(motion.name);
    const auto n = static_cast<double>(motion.first_frames);
    // Two numbers a coordinate are fitted, three along the motion.
    const double freedom = 3.0 * n / (3.0 * n - 7.0);
    positions.push_back(fit->state.position_rms * std::sqrt(freedom));
    rotations.push_back(fit->state.rotation_rms * std::sqrt(freedom));
  }
  if (positions.empty()) return core::ok_status();
  options->position_noise = core::upper_median(std::move(positions));
  options->rotation_noise = core::upper_median(std::move(rotations));
  return core::ok_status();
}

void add_remarks(const MotionDataset& dataset, ObjectCalibration* found) {
  for (const simulation::CalibratedParameter& p : found->motion.parameters) {
    if (p.left_of_prior < kLittle) continue;
    found->remarks.push_back("these recordings say " +
                             std::string(p.left_of_prior >= simulation::kUnidentifiable ? "nothing" : "little") +
                             " about " + words(p.parameter) + ": " + what_tells(p.parameter));
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

}  // namespace

core::Result<ObjectCalibration> calibrate_object(const MotionDataset& dataset, Backends& backends,
                                                 const ObjectCalibrationOptions& options,
                                                 const core::ProgressSink& progress,
                                                 const core::Cancellation* cancellation) {
  if (core::Status status = check_units(dataset.recordings, dataset.scene->gravity_W.norm()); !status.ok())
    return status.at(dataset.table_file().string());
  ObjectCalibration found;
  belief::Scene scene = *dataset.scene;
  const belief::ObjectModel& model = scene.model_of(scene.objects[0]);
  found.prior = simulation::motion_prior(model);
  for (std::size_t i = 0; i < simulation::kMotionParameters; ++i) {
    const std::string name = to_string(static_cast<MotionParameter>(i));
    if (std::ranges::find(options.keep, name) != options.keep.end()) found.prior[i].deviation = 0.0;
  }

  const auto free = static_cast<std::size_t>(std::ranges::count_if(
      found.prior, [](const simulation::MotionBelief& belief) { return belief.deviation > 0.0; }));
  PRESCENE_TRY(const std::vector<RecordedMotion> motions,
               beginnings(dataset, simulation::least_recordings(free), backends, &found.remarks));
  PRESCENE_RETURN_IF_ERROR(check_gravity(dataset, motions));
  for (const RecordedMotion& motion : motions)
    ++(motion.beginning == MotionBeginning::kFlight ? found.flights : found.slides);
  simulation::MotionPrior prior = found.prior;
  simulation::MotionCalibrationOptions motion;
  motion.max_evaluations = options.max_evaluations;
  motion.samples = options.samples;
  if (found.flights >= static_cast<int>(kLeastFlights)) {
    simulation::FlightPrior flight;
    const simulation::MotionBelief& x = found.prior[place_of(MotionParameter::kCenterOfMassX)];
    flight.center_of_mass = {x.mean, found.prior[place_of(MotionParameter::kCenterOfMassY)].mean,
                             found.prior[place_of(MotionParameter::kCenterOfMassZ)].mean};
    if (x.deviation > 0.0) flight.center_of_mass_deviation = x.deviation;
    flight.gravity_W = scene.gravity_W;
    flight.unit_inertia = model.unit_inertia;
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
  PRESCENE_TRY(found.motion, calibrate_motions(motions, scene, prior, backends.simulator_factory(),
                                               core::RandomStream(options.seed, core::Purpose::kEvaluation),
                                               backends.pool(), motion, progress, cancellation));
  for (simulation::CalibratedParameter& p : found.motion.parameters) {
    const simulation::MotionBelief& before = found.prior[place_of(p.parameter)];
    // What flights tell was the prior; their frames also begin the simulated motions.
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
  found.model = calibrated_model(model, found.motion);
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
  return interfaces::fitted_model_yaml(dataset.scene_file(), dataset.scene->model_of(dataset.scene->objects[0]).name,
                                       found.model, folder, remarks);
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
