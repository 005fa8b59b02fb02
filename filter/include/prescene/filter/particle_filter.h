// SPDX-License-Identifier: Apache-2.0
// The particle filter: its operators in a row (predict, weight, resample, augment; in the first frame initialise), one
// frame after the other.
//
//   ParticleFilter filter(likelihood, renderer, threads, settings);
//   belief::Belief belief = filter.start(scene, seed);
//   for (;;) {
//     StepResult result = filter.step(belief, observation, control);
//     belief = std::move(result.belief);
//   }
//
// Frames may come from several cameras of the scene (Observation::camera), in the order of their stamps: each is
// weighed with its camera's pose, intrinsics, depth noise and learned colours. Frames of different cameras may have one
// stamp.
//
// A belief is all that is carried from frame to frame, but for how sharp each camera was when that was last measured: a
// filter may be thrown away and made anew between two steps, which then goes on as one that measures cameras anew. The
// same belief, observation, control and settings give the same bits, for any number of threads, if likelihood and
// renderer promise theirs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/operators/augment.h"
#include "prescene/filter/operators/infer_release.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/learn_physics.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/resample.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/filter/operators/watched_renderer.h"
#include "prescene/filter/operators/weigh_print.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/operators/worlds.h"
#include "prescene/filter/proposals/edge_smear.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::filter {

struct WorldTerms;

using LearnedModels = std::shared_ptr<const LearnedProposals>;

struct FilterSettings {
  FrameOptions frame;
  InitialiseOptions initialise;
  PredictOptions predict;
  AugmentOptions augment;
  WeightOptions weight;
  WeighPrintOptions print;
  LearnPhysicsOptions learn_physics;
  ResampleOptions resample;
  TrackStateOptions track;
  WorldsOptions worlds;
  /// What training learned of the scene's models (service/training); null = nothing. Finding uses it.
  LearnedModels learned;
  /// By model name. What an object's colours were learned to be (frame.colors) takes precedence.
  ColorModels colors;
  /// switch. Objects that are not tracked are looked for in the frame. Range true or false. Measured:
  /// docs/studies/tracking.md.
  bool recover = true;
  /// s. A longer pause between two frames is predicted as if it had lasted this long. Range 0.1 to 10. Chosen.
  double max_gap = 1.0;
};

/// Bits of StepResult::degraded.
enum Degraded : std::uint32_t {
  kFrameRejected = 1u << 0,      ///< The frame could not be used (see frame_status): predicted only.
  kClockWentBack = 1u << 1,      ///< The stamp is not after the belief's (or that of its camera): nothing was done.
  kLongGap = 1u << 2,            ///< More than max_gap since the last frame.
  kNoSupportFound = 1u << 3,     ///< Objects had to be looked for, but nothing that they could stand on was seen.
  kObjectsMissing = 1u << 4,     ///< Some that were looked for at the start were not found.
  kImpossibleWeights = 1u << 5,  ///< A set's weights were all zero or not finite and were made equal.
  kRobotPoseAssumed = 1u << 6,   ///< A robot body was not named: it was taken to stand where it was last.
  kPhysicsFailed = 1u << 7,      ///< Particles went on at constant velocity in place of physics (see physics_failure).
  kRenderingFailed = 1u << 8,    ///< A picture was not drawn (see rendering_failure): what it was to show hid nothing.
  kLearningFailed = 1u << 9,     ///< Motion was not learned from (see learning_failure).
};
std::string degraded_text(std::uint32_t bits);

struct StepCounters {
  int simulated = 0;      ///< Particles that physics moved, or found to stay where they rest.
  int not_simulated = 0;  ///< That it was to move and could not: they went on at constant velocity.
  int not_drawn = 0;      ///< Calls of the renderer that failed.
  int recoveries = 0;     ///< Searches for an object that moved it.
  int new_objects = 0;
  int forgotten_objects = 0;  ///< Lost things that the scene does not name.
  int inferred_releases = 0;  ///< Objects that were seen to have left their hand.
  int turned_by_print = 0;    ///< Objects moved to a pose that depth takes for the same.
  int joint_islands = 0;      ///< Whose particles were worlds in this step.
  int found = 0;              ///< At the start.
};

/// A hash of the belief after each stage, for finding where two runs part.
using HashTrace = std::vector<std::pair<std::string, std::uint64_t>>;

struct StepResult {
  belief::Belief belief;
  std::uint32_t degraded = 0;
  core::Status frame_status;       ///< Why the frame was rejected; ok otherwise.
  std::string physics_failure;     ///< Why physics could not move the first of not_simulated; "" = it moved all.
  std::string learning_failure;    ///< Why an episode of motion could not be simulated; "" = all could.
  core::Status rendering_failure;  ///< Why the first of not_drawn failed; ok otherwise.
  StepCounters counters;
  HashTrace trace;  ///< Empty unless ParticleFilter::trace_stages() asks for it.
  /// Flat supports that the frame shows, against the belief before it: those that were found in frames and follow them,
  /// and the others if ParticleFilter::report_supports() asks for them.
  std::vector<SupportMeasurement> supports;
};

class ParticleFilter {
 public:
  /// Likelihood, renderer and threads must outlive the filter. Without `simulators` what moves goes on at constant
  /// velocity, and nothing is learned from motion.
  ParticleFilter(const rendering::LikelihoodBatch& likelihood, rendering::Renderer& renderer, core::ThreadPool& threads,
                 FilterSettings settings, simulation::SimulatorFactory simulators = {});

  const FilterSettings& settings() const { return settings_; }
  /// Whether the next steps look for things that the scene does not name (AugmentOptions::new_objects). Those that were
  /// found stay.
  void look_for_new_objects(bool looks) { settings_.augment.new_objects = looks; }
  /// Whether StepResult::trace is made; it is not where nobody asks, as it takes five hashes of the whole belief.
  void trace_stages(bool traces) { traces_stages_ = traces; }
  /// Whether StepResult::supports holds all that the frame shows, or only those that follow the frames.
  void report_supports(bool reports) { reports_supports_ = reports; }
  MeshCache& meshes() { return meshes_; }
  /// Forgets what is measured of the cameras only now and then (how sharp they are), as a filter that is made anew: the
  /// next steps then depend on the belief alone.
  void measure_cameras_anew() { smears_.clear(); }

  /// Makes at once what steps else make of the scene's meshes when they first take it, and then keep: coarser meshes,
  /// shapes that collide. Of scans of 100,000 triangles that takes seconds. Changes no belief.
  void prepare(const belief::Scene& scene);

  /// The belief before any frame: the scene's priors, step 0.
  belief::Belief start(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed) const;

  /// The next belief. The first step (belief.step == 0) looks for what the scene's priors leave open. The observation's
  /// camera is one of the scene's (checked).
  StepResult step(const belief::Belief& belief, const belief::Observation& observation, const belief::Control& control);

 private:
  /// What the operators of one step share.
  struct FrameStep;

  void note(const char* stage, StepResult& result) const;
  void note_failed_rendering(StepResult& result);
  void follow_supports(const belief::Observation& observation, StepResult& result);
  void first_look(FrameStep& step, FindWhich which);
  std::vector<Island> join_islands(belief::Belief& belief, double dt);
  void weigh_one(FrameStep& step, std::size_t object, double dt, const WorldTerms* worlds);
  void weigh_worlds(FrameStep& step, const Island& island, double dt);
  void weigh_all(FrameStep& step, double dt);
  void resample_all(FrameStep& step);
  void weigh_print_of(FrameStep& step, std::size_t object, bool found);
  void recover_all(FrameStep& step);
  void weigh_turns(FrameStep& step, std::size_t object);
  void look_at_turns_of(FrameStep& step, std::size_t object, RivalPrior prior, double gain);
  void exchange_all(FrameStep& step);
  void look_for_more(FrameStep& step);
  SearchTarget target_in(const FrameStep& step, std::size_t object) const;
  /// As its heaviest particle is seen.
  geometry::DepthImage depth_in(const FrameStep& step, std::size_t object) const;
  rendering::FrameTerms terms_in(const FrameStep& step, std::size_t object, const SearchTarget& target) const;
  /// Whether the camera was sharp when that was last measured, so that turns are looked at in its fine image.
  bool is_sharp(int camera) const { return smears_[static_cast<std::size_t>(camera)].is_sharp(); }

  FilterSettings settings_;
  simulation::SimulatorFactory simulators_;
  MeshCache meshes_;
  PoseSearch search_;
  WatchedRenderer renderer_;
  FilterTools tools_;
  RobotBounds robot_bounds_;
  std::vector<FrameCache> frame_caches_;  // by camera
  std::vector<EdgeSmear> smears_;         // by camera, as last measured
  PrintCache prints_;
  TouchTest touch_;
  bool traces_stages_ = false;
  bool reports_supports_ = false;
};

/// Numbers the islands: objects whose surfaces are nearer than `gap` share the number of the first of them.
void number_islands(double gap, MeshCache& meshes, belief::Belief& belief);

}  // namespace prescene::filter
