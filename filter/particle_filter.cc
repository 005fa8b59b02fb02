// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/particle_filter.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "frame_step.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/core/check.h"
#include "prescene/filter/operators/hold_joints.h"
#include "prescene/filter/operators/learn_colors.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/filter/operators/wander.h"
#include "prescene/filter/proposals/frame_sampling.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

using belief::Belief;
using belief::ObjectBelief;
using belief::Particle;
using belief::TrackState;

constexpr double kIslandGap = 0.005;  // m; objects nearer than this form an island
// A support that was found in a frame is the average of what the first frames show of it, and follows later frames at
// this rate. Chosen.
constexpr double kLeastSupportGain = 0.1;
constexpr std::uint64_t kLookForSupport =
    10;                             // frames, after which one is looked for again where there is none; chosen
constexpr double kOnePlace = 0.05;  // m

/// Whether two poses differ by how the object is turned rather than by where it is.
bool is_turned_in_place(const Pose& a, const Pose& b, const SearchTarget& target,
                        const geometry::SymmetryGroup& symmetry) {
  return (a * target.centre() - b * target.centre()).norm() < kOnePlace &&
         geometry::symmetric_angle(a, b, symmetry) >= kRivalTurn;
}

/// Whether new objects are looked for in a frame of this number: in the first frame of all, and every so many after it.
bool looks_for_more(const AugmentOptions& options, std::uint64_t frame_number) {
  return options.new_objects && (frame_number - 1) % static_cast<std::uint64_t>(std::max(1, options.new_every)) == 0;
}

/// Height of the lowest surface of a frame, against gravity from W's origin: that above which 98 % of the measured
/// points lie, as some single ones are always wrong.
std::optional<double> lowest_surface(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& gravity_W) {
  if (!(gravity_W.norm() > 0.0)) return std::nullopt;
  const Vector3d up_W = -gravity_W.normalized();
  const Vector3d up_C = X_WC.rotation.conjugate() * up_W;
  const double height_of_camera = up_W.dot(X_WC.translation);
  std::vector<double> heights;
  heights.reserve(sampled.points_C.size());
  for (std::size_t i = 0; i < sampled.points_C.size(); ++i)
    if (sampled.depth.data()[i] > 0.0F) heights.push_back(up_C.dot(sampled.points_C[i]) + height_of_camera);
  if (heights.empty()) return std::nullopt;
  const auto at = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 50);
  std::nth_element(heights.begin(), at, heights.end());
  return *at;
}

/// Of the scene's robot bodies. A scene's timeline runs on another clock than the frames: a body that is not named
/// stands where it was last, or where its timeline begins.
std::vector<Pose> robot_poses(const Belief& belief, const belief::Observation& observation, std::uint32_t* degraded) {
  const belief::Scene& scene = *belief.scene;
  std::vector<Pose> X_WG;
  for (std::size_t i = 0; i < scene.robot.size(); ++i) {
    const auto named = observation.robot.find(scene.robot[i].name);
    if (named != observation.robot.end()) {
      X_WG.push_back(named->second);
    } else {
      const Pose X_WG_start = belief::pose_at(scene.robot[i], 0.0);
      X_WG.push_back(i < belief.robot.size() ? belief.robot[i] : X_WG_start);
      // A body that stands still is where it stands, named or not.
      if (scene.robot[i].timeline.size() > 1 || X_WG.back() != X_WG_start) *degraded |= kRobotPoseAssumed;
    }
  }
  return X_WG;
}

/// By object: a frame of a camera that does not see what another one sees tells nothing of whether it rests or moves.
std::vector<bool> seen_by_others(const Belief& belief, int camera) {
  std::vector<bool> by_others;
  for (const ObjectBelief& object : belief.objects) {
    const bool is_believed = object.state == TrackState::kTracked || object.state == TrackState::kDoubtful;
    by_others.push_back(!belief.cameras.empty() && is_believed && was_unseen_by(object, camera));
  }
  return by_others;
}

}  // namespace

std::string degraded_text(std::uint32_t bits) {
  static constexpr std::pair<Degraded, const char*> kNames[] = {{kFrameRejected, "frame rejected"},
                                                                {kClockWentBack, "clock went back"},
                                                                {kLongGap, "long gap"},
                                                                {kNoSupportFound, "no support found"},
                                                                {kObjectsMissing, "objects missing"},
                                                                {kImpossibleWeights, "impossible weights"},
                                                                {kRobotPoseAssumed, "robot pose assumed"},
                                                                {kPhysicsFailed, "physics failed"},
                                                                {kRenderingFailed, "rendering failed"},
                                                                {kLearningFailed, "learning failed"}};
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if ((bits & bit) == 0) continue;
    if (!text.empty()) text += ", ";
    text += name;
  }
  return text;
}

ParticleFilter::ParticleFilter(const rendering::LikelihoodBatch& likelihood, rendering::Renderer& renderer,
                               core::ThreadPool& threads, FilterSettings settings,
                               simulation::SimulatorFactory simulators)
    : settings_(std::move(settings)),
      simulators_(std::move(simulators)),
      search_(likelihood, threads),
      renderer_(renderer),
      tools_{&search_, &renderer_, &meshes_, settings_.learned.get()} {}

void ParticleFilter::prepare(const belief::Scene& scene) {
  for (const belief::ObjectModel& model : scene.models)
    for (const MeshDetail detail : {MeshDetail::kFine, MeshDetail::kLikelihood}) {
      const rendering::MeshHandle mesh = meshes_.get(model.visual, model.collision, detail);
      meshes_.facet_lever(*mesh);
      meshes_.resting_shape(*mesh);
    }
  const std::vector<belief::Pose> X_WG(scene.robot.size());
  for (const MeshDetail detail : {MeshDetail::kSurroundings, MeshDetail::kLikelihood})
    known_surroundings(scene, X_WG, detail, meshes_);
  // What can't be simulated is said by the step that wants to.
  belief::Scene alone = scene;
  alone.actions.clear();
  alone.outcomes.clear();
  alone.exclusive_outcomes.clear();
  alone.joints.clear();
  for (const belief::SceneObject& object : scene.objects) {
    alone.objects = {object};
    alone.objects.front().held_by.reset();
    if (simulators_) static_cast<void>(simulators_(alone, 1.0));
  }
}

Belief ParticleFilter::start(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed) const {
  return belief_from_priors(std::move(scene), seed, 0, settings_.initialise);
}

void ParticleFilter::note_failed_rendering(StepResult& result) {
  RenderFailures failures = renderer_.take_failures();
  if (failures.count == 0) return;
  result.degraded |= kRenderingFailed;
  result.counters.not_drawn = failures.count;
  result.rendering_failure = std::move(failures.first);
}

void ParticleFilter::follow_supports(const belief::Observation& observation, StepResult& result) {
  Belief& belief = result.belief;
  const SampledDepth sampled =
      sample_depth(*observation.frame.depth, observation.frame.camera, settings_.initialise.detection.segmentation);
  const bool first = belief.step == 1;
  const bool searches = first && std::any_of(belief.scene->objects.begin(), belief.scene->objects.end(),
                                             [](const auto& o) { return has_wide_prior(o); });
  const bool has_none =
      belief.scene->supports.empty() && (first || frames_of(belief, observation.camera) % kLookForSupport == 0);
  if (settings_.initialise.add_support && (has_none || searches)) {
    const core::RandomStream stream(belief.seed, core::Purpose::kDetection, 1);
    const std::vector<belief::Support> found =
        supports_from_frame(sampled, observation.X_WC, *belief.scene, settings_.initialise, meshes_, stream);
    if (!found.empty()) {
      auto scene = std::make_shared<belief::Scene>(*belief.scene);
      scene->supports.insert(scene->supports.end(), found.begin(), found.end());
      belief.scene = std::move(scene);
    }
  }
  if (const auto lowest = lowest_surface(sampled, observation.X_WC, belief.scene->gravity_W))
    belief.lowest_seen = std::min(*lowest, belief.lowest_seen.value_or(*lowest));
  std::shared_ptr<belief::Scene> corrected;  // a copy for all supports, made for the first
  for (std::size_t i = 0; i < belief.scene->supports.size(); ++i) {
    const bool follows = is_found_support(belief.scene->supports[i].name);
    if (!follows && !reports_supports_) continue;
    auto measured = measure_support(sampled, observation.X_WC, belief.scene->supports[i]);
    if (!measured) continue;
    if (follows) {
      const double gain = std::max(1.0 / static_cast<double>(belief.step), kLeastSupportGain);
      if (!corrected) corrected = std::make_shared<belief::Scene>(*belief.scene);
      correct_support(*measured, gain, corrected->supports[i]);
    }
    result.supports.push_back(*std::move(measured));
  }
  if (corrected) belief.scene = std::move(corrected);
}

void ParticleFilter::first_look(FrameStep& step, FindWhich which) {
  StepResult& result = step.result;
  const core::RandomStream stream(result.belief.seed, core::Purpose::kDetection, 0,
                                  static_cast<std::uint32_t>(step.observation.camera));
  const FindReport report =
      find_in_frame(step.frame, step.observation, settings_.initialise, tools_, stream, result.belief, which);
  result.counters.found = report.found;
  if (report.no_support) result.degraded |= kNoSupportFound;
  if (report.found < report.looked_for) result.degraded |= kObjectsMissing;
}

void ParticleFilter::recover_all(FrameStep& step) {
  const FilterFrame& frame = step.frame;
  StepCounters& counters = step.result.counters;
  Belief& belief = step.belief();
  const core::RandomStream stream(belief.seed, core::Purpose::kRecovery);
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    ObjectBelief& object = belief.objects[i];
    const bool is_believed = object.state == TrackState::kTracked || object.state == TrackState::kDoubtful;
    if (is_believed && !step.shows(i)) continue;  // another camera sees it
    if (is_believed) weigh_turns(step, i);
    // The first frame was searched by first_look(), which asks more of a find.
    const bool is_first = belief.step == 1 && has_wide_prior(belief.scene->objects[i]);
    const bool look = !is_first && wants_recovery(settings_.augment, object, step.reports[i].expected_evidence,
                                                  step.frame_number() + i);
    const bool is_unseen = object.state == TrackState::kUnseen;
    if (!look && !is_unseen && object.frames_refuted == 0) continue;
    const SearchTarget target = target_in(step, i);
    const rendering::FrameTerms terms = terms_in(step, i, target);
    const WeightReport& report = step.reports[i];
    const rendering::PoseEvidence current = report.particles[static_cast<std::size_t>(report.heaviest)].evidence;
    const core::RandomStream mine = stream.at(belief.step, static_cast<std::uint32_t>(i));
    const std::optional<ObjectBelief> before = look ? std::optional(object) : std::nullopt;
    if (!look || !recover(frame, terms, target, current, settings_.augment, settings_.weight, settings_.initialise,
                          tools_, mine, object)) {
      if (is_unseen) {
        wander_unseen(frame, terms, target, current, step.dt, settings_.weight, settings_.initialise, tools_, mine,
                      object);
      }
      if (object.frames_refuted > 0) {
        propose_hidden(frame, terms, target, belief.scene->gravity_W, settings_.augment, settings_.weight,
                       settings_.initialise, tools_, mine, object);
      }
      continue;
    }
    const Pose X_WO_before = belief::heaviest(before->particles).X_WO;
    if (object.state == TrackState::kTracked &&
        is_turned_in_place(X_WO_before, step.heaviest(i).X_WO, target, model_of(belief, i).symmetry)) {
      object = *before;  // rivals of what is followed are weighed over frames
      continue;
    }
    ++counters.recoveries;
    if (object.state != TrackState::kTracked) object.state = TrackState::kDoubtful;  // the next frame decides
    object.existence = std::max(object.existence, 0.5);
    object.frames_unseen = 0;
    object.frames_refuted = 0;
    mark_found(step.by(), object);
    look_at_turns_of(step, i, RivalPrior::kFound, 1.0);
    weigh_print_of(step, i, true);
    step.depths[i] = depth_in(step, i);
  }
}

std::vector<Island> ParticleFilter::join_islands(Belief& belief, double dt) {
  if (!settings_.worlds.joint) return {};
  std::vector<Island> islands = islands_that_change(belief, dt, settings_.worlds, touch_, search_.threads());
  const core::RandomStream stream(belief.seed, core::Purpose::kStartBelief);
  for (const Island& island : islands) join_worlds(island, settings_.resample, stream, belief);
  return islands;
}

void ParticleFilter::resample_all(FrameStep& step) {
  Belief& belief = step.belief();
  const core::RandomStream stream(belief.seed, core::Purpose::kResample);
  std::vector<bool> in_worlds(belief.objects.size(), false);
  for (const Island& island : step.islands) {
    if (!are_worlds(belief, island)) continue;  // a member was looked at by itself meanwhile
    for (const std::size_t member : island) in_worlds[member] = true;
    const core::RandomStream mine = stream.at(belief.step, static_cast<std::uint32_t>(island.front()));
    resample_worlds(island, settings_.resample, mine, belief);
  }
  for (std::size_t i = 0; i < belief.objects.size(); ++i)
    if (!in_worlds[i])
      resample_within_turns(settings_.resample, stream.at(belief.step, static_cast<std::uint32_t>(i)),
                            model_of(belief, i).symmetry, belief.objects[i].particles);
}

void ParticleFilter::look_for_more(FrameStep& step) {
  const AugmentOptions& options = settings_.augment;
  Belief& belief = step.belief();
  if (!options.new_objects) return;
  if (!looks_for_more(options, step.frame_number())) {
    step.result.counters.forgotten_objects = forget_unknown_objects(belief);
    return;
  }
  geometry::DepthImage known = step.frame.robot;
  for (std::size_t i = 0; i < step.depths.size(); ++i)
    if (hides_others(belief.objects[i])) merge_nearest(step.depths[i], &known);
  const core::RandomStream stream(belief.seed, core::Purpose::kDetection, belief.step);
  const std::size_t before = belief.objects.size();
  filter::new_objects(step.frame, step.observation, known, options, settings_.initialise, tools_, stream, belief);
  for (std::size_t i = before; i < belief.objects.size(); ++i) merge_nearest(depth_in(step, i), &known);
  add_unknown_objects(step.frame, step.observation, known, options, settings_.initialise, tools_, stream, belief);
  step.result.counters.new_objects = static_cast<int>(belief.objects.size() - before);
  step.result.counters.forgotten_objects = forget_unknown_objects(belief);
}

void ParticleFilter::note(const char* stage, StepResult& result) const {
  if (traces_stages_) result.trace.emplace_back(stage, belief::content_hash(result.belief));
}

StepResult ParticleFilter::step(const Belief& previous, const belief::Observation& observation,
                                const belief::Control& control) {
  PRESCENE_CHECK(previous.scene != nullptr);
  PRESCENE_CHECK(previous.objects.size() == previous.scene->objects.size());
  PRESCENE_CHECK(observation.camera >= 0 && observation.camera < belief::camera_count(*previous.scene));
  StepResult result;
  result.belief = previous;
  Belief& belief = result.belief;
  const bool first = previous.step == 0;
  const double elapsed = first ? 0.0 : 1e-9 * static_cast<double>(observation.stamp_ns - previous.stamp_ns);
  // Cameras that are triggered together take frames at one instant.
  const bool is_at_once =
      !first && elapsed == 0.0 && !belief.cameras.empty() &&
      previous.cameras[static_cast<std::size_t>(observation.camera)].stamp_ns < observation.stamp_ns;
  if (!first && !(elapsed > 0.0) && !is_at_once) {
    result.degraded |= kClockWentBack;
    return result;
  }
  if (elapsed > settings_.max_gap) result.degraded |= kLongGap;
  const double dt = std::min(elapsed, settings_.max_gap);
  ++belief.step;
  belief.stamp_ns = observation.stamp_ns;
  if (first)
    for (ObjectBelief& object : belief.objects) object.last_seen_ns = observation.stamp_ns;

  const bool has_depth = observation.frame.depth && !observation.frame.depth->empty() &&
                         observation.frame.depth->width() == observation.frame.camera.width &&
                         observation.frame.depth->height() == observation.frame.camera.height &&
                         geometry::validate_sensor(observation.frame.camera).ok();
  if (has_depth && observation.X_WC.is_finite()) follow_supports(observation, result);

  const std::vector<Pose> X_WG = robot_poses(belief, observation, &result.degraded);
  std::vector<Island> islands;
  if (!first && !is_at_once) {
    islands = join_islands(belief, dt);
    const core::RandomStream stream(belief.seed, core::Purpose::kProcessNoise);
    const PredictTools tools{simulators_, robot_bounds_, stream, search_.threads()};
    PredictReport report = predict(belief, control, X_WG, dt, settings_.predict, tools, islands,
                                   seen_by_others(belief, observation.camera));
    result.counters.simulated = report.simulated;
    result.counters.not_simulated = report.not_simulated;
    result.physics_failure = std::move(report.failure);
    if (report.not_simulated > 0) result.degraded |= kPhysicsFailed;
    hold_joints(belief);
  }
  belief.robot = X_WG;
  note("predict", result);

  FilterFrame frame;
  const std::uint64_t number = frames_of(previous, observation.camera) + 1;
  // A search of the whole frame asks so and so many nats of the frame as it usually is.
  const bool is_searched = number == 1 || looks_for_more(settings_.augment, number);
  const FrameSampling sampling = is_searched ? FrameSampling{.terms = settings_.frame.terms}
                                             : sampled_for(belief, observation, settings_.frame, meshes_);
  frame_caches_.resize(static_cast<std::size_t>(belief::camera_count(*belief.scene)));
  smears_.resize(frame_caches_.size());
  result.frame_status = prepare_frame(
      belief.scene, observation, X_WG,
      {settings_.colors, learned_models(belief, settings_.frame.colors, observation.camera)}, settings_.frame, tools_,
      frame_caches_[static_cast<std::size_t>(observation.camera)], &frame, &sampling);
  if (!result.frame_status.ok()) {
    result.degraded |= kFrameRejected;
    if (first) belief.step = 0;  // the first look is still to be taken
    for (ObjectBelief& object : belief.objects)
      mark_unseen({belief.cameras, observation.camera, observation.stamp_ns}, settings_.track, object);
    note_failed_rendering(result);
    return result;
  }
  if (observation.camera == 0) belief.X_WC = observation.X_WC;
  note_frame(observation, belief);
  FrameStep current{frame, observation, result, dt};
  current.islands = std::move(islands);
  if (first || current.frame_number() == 1) first_look(current, first ? FindWhich::kAll : FindWhich::kLost);
  note("initialise", result);

  weigh_all(current, first ? settings_.max_gap : dt);
  for (std::size_t i = 0; i < belief.objects.size(); ++i)
    weigh_print_of(current, i, first && has_wide_prior(belief.scene->objects[i]));
  note("weight", result);
  exchange_all(current);
  hold_joints(belief);
  learn_colors(frame, observation, current.reports, settings_.frame.colors, tools_, belief);
  result.counters.inferred_releases = infer_releases(settings_.predict, belief);
  LearnReport learned = learn_physics(belief, settings_.learn_physics, simulators_, search_.threads());
  if (!learned.failure.empty()) result.degraded |= kLearningFailed;
  result.learning_failure = std::move(learned.failure);

  resample_all(current);
  note("filter", result);

  if (settings_.recover) {
    recover_all(current);
    if (result.counters.recoveries > 0) hold_joints(belief);
  }
  look_for_more(current);
  number_islands(kIslandGap, meshes_, belief);
  note_failed_rendering(result);
  note("augment", result);
  return result;
}

}  // namespace prescene::filter
