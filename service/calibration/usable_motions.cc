// SPDX-License-Identifier: Apache-2.0
#include "usable_motions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/service/calibration/motion_units.h"
#include "prescene/simulation/calibration/clearance.h"
#include "prescene/simulation/calibration/find_beginning.h"
#include "prescene/simulation/calibration/free_fall.h"
#include "prescene/simulation/calibration/sliding_fit.h"

namespace prescene::service {
namespace {

using simulation::FlightCalibration;
using simulation::MotionBeginning;
using simulation::RecordedMotion;
using simulation::RecordedRest;
using simulation::TimedPose;

// And no metre at all when gravity is off by such a share, and by so many errors.
constexpr double kScaleRefused = 0.1;
constexpr double kScaleErrors = 4.0;
// s of a flight in which its fall is measured: a contact that comes earlier than simulated is seldom among them.
constexpr double kFallSeconds = 0.1;
// Of the recordings, that may be left out, and how many of them a refusal names.
constexpr double kMostLeftOut = 0.25;
constexpr std::size_t kMostNamed = 3;

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

std::string millimetres_text(double metres) { return core::fixed_text(1e3 * metres, 0) + " mm"; }

/// What is named of a recording that is used up to where it was touched.
std::string touched_text(const MotionRecording& recording, const RecordedRest& rest) {
  const auto time = [&](std::size_t frame) {
    return core::fixed_text(recording.frames[frame].time - recording.frames.front().time, 2) + " s";
  };
  return recording.name + " was touched after its rest: it lay still " + time(rest.first) +
         " after its beginning, and from " + time(*rest.moves_again) + " on it moved by " +
         millimetres_text(rest.moved) + " and " + core::fixed_text(rest.turned * 180.0 / std::numbers::pi, 0) +
         " degrees; it is used up to there";
}

/// What is named of a scene whose object would hang in the air where the recorded ones lie; "" where it lies there.
std::string hanging_text(const UsableMotions& usable, const belief::Scene& scene,
                         const simulation::Simulator& simulator, core::ThreadPool& pool, double noise) {
  const double mismatch = simulation::mismatch_of(scene, noise);
  std::vector<double> gaps;
  std::size_t resting = 0;
  for (std::size_t i = 0; i < usable.motions.size(); ++i) {
    if (!usable.rests[i]) continue;
    ++resting;
    const std::size_t middle = usable.rests[i]->first + (usable.rests[i]->last - usable.rests[i]->first) / 2;
    const std::optional<double> gap =
        simulation::clearance_of(usable.motions[i].frames[middle].X_WO, scene, simulator, pool);
    if (gap && *gap > mismatch) gaps.push_back(*gap);
  }
  if (2 * gaps.size() <= resting) return {};
  const std::size_t hanging = gaps.size();
  return std::to_string(hanging) + " of " + std::to_string(resting) + " recordings rest where the scene's object is " +
         millimetres_text(core::upper_median(std::move(gaps))) +
         " above a support: check its shape's size and where the supports are, in the recordings' metres";
}

core::Status check_stamps(const MotionRecording& recording, const std::optional<RecordedRest>& rest) {
  const std::span<const TimedPose> moving =
      std::span(recording.frames).first(rest ? rest->first + 1 : recording.frames.size());
  const std::optional<std::size_t> jump = simulation::find_stamp_jump(moving);
  if (!jump) return core::ok_status();
  return core::invalid_input(recording.name + ": its stamps jump by " +
                             core::rounded_text(moving[*jump].time - moving[*jump - 1].time) +
                             " s at t = " + core::rounded_text(moving[*jump].time) +
                             ", before it rests: give recordings without gaps, or each part under a name of its own");
}

}  // namespace

core::Result<UsableMotions> usable_motions(const MotionDataset& dataset, std::size_t least, Backends& backends) {
  PRESCENE_TRY(const auto simulator, backends.make_simulator(*dataset.scene));
  std::vector<std::span<const TimedPose>> frames;
  for (const MotionRecording& recording : dataset.recordings) frames.emplace_back(recording.frames);
  const double noise = simulation::position_noise_of(frames);
  const double rotation_noise = simulation::rotation_noise_of(frames);
  const std::vector<std::size_t> twins = simulation::find_twins(frames);
  UsableMotions usable;
  std::vector<std::size_t> place(dataset.recordings.size(), dataset.recordings.size());
  std::vector<std::string> refused;
  for (std::size_t i = 0; i < dataset.recordings.size(); ++i) {
    const MotionRecording& recording = dataset.recordings[i];
    const std::optional<RecordedRest> rest = simulation::find_rest(recording.frames, noise, rotation_noise);
    std::vector<TimedPose> used = recording.frames;
    if (rest && rest->moves_again) used.resize(rest->last + 1);
    core::Status stamps = check_stamps(recording, rest);
    auto motion = stamps.ok() ? simulation::find_beginning(recording.name, std::move(used), *dataset.scene, *simulator,
                                                           backends.pool(), noise)
                              : core::Result<RecordedMotion>(stamps);
    if (!motion) {
      refused.push_back(motion.status().message());
      continue;
    }
    if (rest && rest->moves_again) usable.remarks.push_back(touched_text(recording, *rest));
    if (twins[i] != i)
      usable.remarks.push_back(recording.name + " is a twin of " + dataset.recordings[twins[i]].name +
                               ": the same motion, turned about the vertical and shifted");
    // The first of its twins, or this one where no other could be used.
    if (place[twins[i]] == dataset.recordings.size()) place[twins[i]] = usable.motions.size();
    usable.groups.push_back(place[twins[i]]);
    usable.motions.push_back(*std::move(motion));
    usable.numbers.push_back(i);
    usable.rests.push_back(rest);
  }
  const std::size_t independent = usable.independent();
  const double share = static_cast<double>(refused.size()) / static_cast<double>(dataset.recordings.size());
  if (!refused.empty() && (independent < least || share > kMostLeftOut)) {
    std::string text = std::to_string(refused.size()) + " of " + std::to_string(dataset.recordings.size()) +
                       " recordings can't be used";
    for (std::size_t i = 0; i < std::min(refused.size(), kMostNamed); ++i) text += (i == 0 ? ": " : "; ") + refused[i];
    if (refused.size() > kMostNamed) text += "; ...";
    return core::invalid_input(dataset.table_file().string() + ": " + text);
  }
  if (independent < least && independent < usable.motions.size()) {
    return core::invalid_input(
        dataset.table_file().string() + ": only " + std::to_string(independent) + " of " +
        std::to_string(usable.motions.size()) +
        " recordings are motions of their own, the others are twins of them; it takes at least " +
        std::to_string(least) + ": record more, or keep parameters as they are (--keep)");
  }
  for (const std::string& reason : refused) usable.remarks.push_back("left out: " + reason);
  if (std::string hanging = hanging_text(usable, *dataset.scene, *simulator, backends.pool(), noise); !hanging.empty())
    usable.remarks.push_back(std::move(hanging));
  return usable;
}

std::size_t UsableMotions::independent() const { return std::set<std::size_t>(groups.begin(), groups.end()).size(); }

UsableMotions UsableMotions::subset(const std::vector<std::size_t>& places) const {
  UsableMotions chosen;
  std::vector<std::size_t> now(motions.size(), motions.size());
  for (const std::size_t i : places) {
    now[i] = chosen.motions.size();
    chosen.groups.push_back(std::min(now[groups[i]], now[i]));
    chosen.motions.push_back(motions[i]);
    chosen.numbers.push_back(numbers[i]);
    chosen.rests.push_back(rests[i]);
  }
  return chosen;
}

UsableMotions UsableMotions::without_twins() const {
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < motions.size(); ++i)
    if (groups[i] == i) first.push_back(i);
  return subset(first);
}

std::vector<HeldOutMotion> UsableMotions::held_out(const std::vector<int>& scene_of) const {
  std::vector<HeldOutMotion> resting;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    if (rests[i] && scene_of[i] >= 0)
      resting.push_back({motions[i], *rests[i], numbers[i], groups[i], static_cast<std::size_t>(scene_of[i])});
  }
  return resting;
}

std::vector<int> folds_of(const std::vector<std::size_t>& groups, int folds, core::RandomStream stream) {
  std::vector<std::size_t> firsts;
  for (std::size_t i = 0; i < groups.size(); ++i)
    if (groups[i] == i) firsts.push_back(i);
  stream.shuffle(std::span(firsts));
  std::vector<int> fold(groups.size(), 0);
  for (std::size_t i = 0; i < firsts.size(); ++i)
    fold[firsts[i]] = static_cast<int>(i % static_cast<std::size_t>(folds));
  for (std::size_t i = 0; i < groups.size(); ++i) fold[i] = fold[groups[i]];
  return fold;
}

core::Result<FlightCalibration> fly(const std::vector<RecordedMotion>& motions, const simulation::FlightPrior& prior) {
  std::vector<std::span<const simulation::TimedPose>> flights;
  for (const RecordedMotion& motion : motions) {
    if (motion.beginning == MotionBeginning::kFlight)
      flights.push_back(std::span(motion.frames).first(motion.first_frames));
  }
  return simulation::calibrate_flights(flights, prior);
}

simulation::FlightPrior flight_prior(const belief::Scene& scene, const simulation::MotionPrior& prior) {
  const auto of = [&](simulation::MotionParameter parameter) { return prior[static_cast<std::size_t>(parameter)]; };
  const simulation::MotionBelief x = of(simulation::MotionParameter::kCenterOfMassX);
  simulation::FlightPrior flight;
  flight.center_of_mass = {x.mean, of(simulation::MotionParameter::kCenterOfMassY).mean,
                           of(simulation::MotionParameter::kCenterOfMassZ).mean};
  if (x.deviation > 0.0) flight.center_of_mass_deviation = x.deviation;
  flight.gravity_W = scene.gravity_W;
  flight.unit_inertia = scene.model_of(scene.objects[0]).unit_inertia;
  return flight;
}

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

}  // namespace prescene::service
