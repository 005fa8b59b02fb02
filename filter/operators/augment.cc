// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/augment.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "hidden_places.h"
#include "particle_update.h"
#include "prescene/filter/operators/standing.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;

// Of the starts of a search, this share is near the last pose, with these standard deviations; the others are at
// unexplained pixels.
constexpr double kNearShare = 0.33;
constexpr double kNearShift = 0.08;  // m
constexpr double kNearTurn = 0.8;    // rad
constexpr double kLearnedShare =
    0.33;  // of the starts, at places that look like learned ones, where something was learned
constexpr SearchOptions kRecoverySearch = {.refine = {.steps = 10}, .polish_candidates = 1, .polish_draws = 12};
constexpr double kExplained = 0.015;    // m; measurements so near to a known surface are explained
constexpr double kLeastShown = 0.08;    // share of the pixels in view that must not be hidden for a find to count ...
constexpr double kLeastHits = 0.5;      // ... and share of those that must match
constexpr double kInjectedShare = 0.5;  // of the particles are put at the find, the least probable ones
constexpr int kHiddenDraws = 160;       // places that are tried for what may have gone where it cannot be seen
constexpr double kFurthestFall = 0.3;   // m
constexpr double kHiddenTurn = 0.8;     // rad

constexpr double kTrackedError = 0.003;  // m; scale of the errors of what is tracked
constexpr double kSameShift = 0.01;      // m; a find that is no further than this ...
constexpr double kSameTurn = 0.2;        // rad; ... from where it is tracked is no other place

bool lighter(const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; }

std::vector<Pose> recovery_starts(const Pose& X_CO, const SearchTarget& target, const rendering::FrameTerms& terms,
                                  const Vector3d& up_C, std::span<const Vector3d> points, const AugmentOptions& options,
                                  const core::RandomStream& stream) {
  const int near =
      points.empty() ? options.recover_starts : static_cast<int>(std::lround(kNearShare * options.recover_starts));
  std::vector<Pose> starts = disturbed_starts(X_CO, target.centre(), kNearShift, kNearTurn, near, stream);
  if (target.learned != nullptr && !points.empty()) {
    const auto places = static_cast<int>(std::lround(kLearnedShare * options.recover_starts));
    const std::vector<Pose> learned = learned_starts(*target.learned, terms.depth, terms.camera, points, up_C, places,
                                                     stream.for_purpose(core::Purpose::kSurface));
    starts.insert(starts.end(), learned.begin(), learned.end());
  }
  core::RandomStream draws = stream.for_purpose(core::Purpose::kDetection);
  while (static_cast<int>(starts.size()) < options.recover_starts) {
    const Vector3d& seen = points[draws.uniform_below(points.size())];
    const Vector3d centre =
        seen + draws.uniform(0.0, 0.6) * static_cast<double>(target.mesh->radius) * seen.normalized();
    Pose start;
    // Half of them keep the rotation that it had: things are moved more often than turned over.
    start.rotation = draws.uniform() < 0.5
                         ? (X_CO.rotation * geometry::exp_rotation(0.3 * geometry::normal_vector(draws))).normalized()
                         : geometry::uniform_rotation(draws);
    start.translation = centre - start.rotation * target.centre();
    starts.push_back(start);
  }
  return starts;
}

/// Puts the lightest particles at the find; together they then weigh more than the others.
void inject(const Pose& X_WO, const InitialiseOptions& spread, const core::RandomStream& stream, ObjectBelief& object) {
  std::stable_sort(object.particles.begin(), object.particles.end(), lighter);
  const auto total = static_cast<int>(object.particles.size());
  const int count = std::clamp(static_cast<int>(std::lround(kInjectedShare * total)), 1, total);
  const std::vector<Particle> fresh = particles_about(X_WO, belief::MotionMode::kMoving, count, spread, stream);
  const double share = count == total ? 1.0 : 0.9;
  for (int i = 0; i < total; ++i) {
    Particle& particle = object.particles[static_cast<std::size_t>(i)];
    if (i < count) {
      particle = fresh[static_cast<std::size_t>(i)];
      // The first of them is the find itself.
      const double mine = i == 0 ? 0.5 : 0.5 / std::max(1, count - 1);
      particle.log_weight = std::log(share * (count == 1 ? 1.0 : mine));
    } else {
      particle.log_weight += std::log(1.0 - share);
    }
  }
  belief::normalize(object.particles);
}

/// Whether a pose is about the same as another.
bool is_same_place(const Pose& X_CO, const Pose& other_X_CO, const SearchTarget& target) {
  const double shift = (X_CO * target.centre() - other_X_CO * target.centre()).norm();
  const double turn = geometry::log_rotation(X_CO.rotation.conjugate() * other_X_CO.rotation).norm();
  return shift < kSameShift && turn < kSameTurn;
}

/// nats, tempered, by which a frame must favour a place for what is tracked so far from there: errors of tracked poses
/// have the tails of Student's t distribution with one degree of freedom.
double log_odds_against_jump(double distance) {
  const double scaled = distance / kTrackedError;
  return 2.0 * std::log1p(scaled * scaled);
}

/// Whether what a find must say for each pixel depends on what the frame can say there.
enum class Limit { kScaled, kInFull };

/// Nats per pixel of what is seen at a pose, if it would do as a find there of which `needed` is asked; else nothing.
std::optional<double> evidence_of_find(const Pose& X_CO, const rendering::PoseEvidence& seen, double needed,
                                       Limit limit, double density, const rendering::FrameTerms& terms,
                                       const SearchTarget& target, const AugmentOptions& options,
                                       const WeightOptions& weighting, const FilterTools& tools) {
  if (seen.log_ratio < density * options.accept_log_ratio || seen.hit_share() < kLeastHits) return std::nullopt;
  const double outline = outline_at(terms, target, X_CO, weighting, tools);
  const double scale = limit == Limit::kInFull
                           ? 1.0
                           : evidence_scale(expected_evidence_of(terms, target, X_CO, *tools.renderer).of_visible);
  const double evidence = supported_evidence(seen, outline, weighting);
  return evidence < scale * needed ? std::nullopt : std::optional(evidence);
}

}  // namespace

std::vector<Vector3d> unexplained_points(const FilterFrame& frame, const rendering::FrameTerms& terms,
                                         double tolerance) {
  std::vector<Vector3d> points;
  for (int y = 0; y < terms.camera.height; ++y)
    for (int x = 0; x < terms.camera.width; ++x) {
      const double z = terms.depth(x, y);
      if (z == 0.0 || z >= frame.terms.model.options().max_depth) continue;
      const double expected = terms.absent_peak(x, y);
      if (expected > 0.0 && z > expected - tolerance) continue;
      points.push_back(terms.camera.unproject(x, y, z));
    }
  return points;
}

bool wants_recovery(const AugmentOptions& options, const ObjectBelief& object, double expected_evidence,
                    std::uint64_t frame) {
  const auto is_turn = [&](int every) { return frame % static_cast<std::uint64_t>(std::max(1, every)) == 0; };
  if (object.frames_unseen >= options.recover_after_frames) return is_turn(options.recover_every);
  const bool is_short =
      std::isfinite(expected_evidence) && object.evidence_per_pixel < options.short_share * expected_evidence;
  return (object.visible_share < options.suspicious_share || is_short) && is_turn(options.suspicious_every);
}

bool recover(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
             const rendering::PoseEvidence& current, const AugmentOptions& options, const WeightOptions& weighting,
             const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
             ObjectBelief& object) {
  const Particle& last = belief::heaviest(object.particles);
  const Pose X_CO = frame.X_CW * last.X_WO;
  const std::vector<Vector3d> points = unexplained_points(frame, terms, kExplained);
  const std::vector<Pose> starts =
      recovery_starts(X_CO, target, terms, frame.X_CW.rotation * frame.up_W, points, options, stream);
  const PoseCandidate found = tools.search->run(terms, target, starts, kRecoverySearch, stream).front();

  const rendering::PoseEvidence& e = found.evidence;
  const double shown = e.in_view > 0 ? static_cast<double>(e.visible) / e.in_view : 0.0;
  if (e.log_ratio < current.log_ratio + frame.density * options.min_gain || shown < kLeastShown) return false;
  // Of a tracked object, the particles know that place better than a search of one frame.
  const double distance = (found.X_CO * target.centre() - X_CO * target.centre()).norm();
  const Pose X_WO = frame.X_WC * found.X_CO;
  if (object.state == belief::TrackState::kTracked) {
    const auto log_of = [&](const rendering::PoseEvidence& evidence, const Pose& at) {
      return evidence.tempered + log_sunk(*target.mesh, *frame.surfaces, frame.up_W, at);
    };
    if (is_same_place(found.X_CO, X_CO, target) ||
        log_of(e, X_WO) - log_of(current, last.X_WO) < log_odds_against_jump(distance))
      return false;
  }
  // A support that is a little higher than the scene says looks like the top of something inside it.
  if (frame.surfaces->overlap(*target.mesh, X_WO, weighting.support_tolerance) > kMostInSupport) return false;
  // So does an arm that is not quite where it is said to be. But a hand of a coarse shape may hold a thing within it.
  const auto in_solids = [&](const Pose& pose) {
    return frame.solids.overlap(*target.mesh, pose, weighting.support_tolerance);
  };
  if (in_solids(X_WO) > std::max(kMostInSupport, in_solids(last.X_WO))) return false;
  const auto as_find = [&](const Pose& at, const rendering::PoseEvidence& seen, double needed, Limit limit) {
    return evidence_of_find(at, seen, needed, limit, frame.density, terms, target, options, weighting, tools);
  };
  const double unseen = 1e-9 * static_cast<double>(std::max<core::TimeNs>(0, frame.stamp_ns - object.last_seen_ns));
  const double reach = std::max(0.10, options.reach_speed * unseen);
  const bool far = distance > reach;
  // More of an arm that no scene knows may look like the object than is seen of it in that arm's hand. But what is seen
  // where it is believed to be cannot be out of reach of there.
  if (far && as_find(X_CO, current, options.accept_evidence, Limit::kScaled)) return false;
  // Far from where it was, what is seen has to speak for itself.
  const std::optional<double> evidence =
      far ? as_find(found.X_CO, e, options.accept_evidence + options.far_evidence, Limit::kInFull)
          : as_find(found.X_CO, e, options.accept_evidence, Limit::kScaled);
  if (!evidence) return false;
  object.evidence_per_pixel = *evidence;
  inject(X_WO, spread, stream.for_purpose(core::Purpose::kStartBelief), object);
  return true;
}

bool are_exchanged(const std::array<const rendering::FrameTerms*, 2>& terms,
                   const std::array<const SearchTarget*, 2>& targets, const std::array<Pose, 2>& X_CO,
                   const AugmentOptions& options, const FilterTools& tools) {
  const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
  double gain = 0.0, tempered_gain = 0.0;
  int visible = 0;
  for (std::size_t place = 0; place < 2; ++place) {
    const std::array<rendering::PoseHypothesis, 2> hypotheses = {hypothesis(*targets[place], X_CO[place]),
                                                                 hypothesis(*targets[1 - place], X_CO[place])};
    std::array<rendering::PoseEvidence, 2> evidence;
    tools.search->batch().evaluate(*terms[place], hypotheses, *workspace, evidence);
    gain += evidence[1].visible_log_ratio - evidence[0].visible_log_ratio;
    tempered_gain += evidence[1].tempered - evidence[0].tempered;
    visible += evidence[0].visible;
  }
  return tempered_gain >= options.exchange_gain && gain >= options.exchange_evidence * visible;
}

void exchange(ObjectBelief& first, ObjectBelief& second) {
  std::swap(first.particles, second.particles);
  std::swap(first.state, second.state);
  std::swap(first.evidence_per_pixel, second.evidence_per_pixel);
  std::swap(first.visible_share, second.visible_share);
  std::swap(first.frames_unseen, second.frames_unseen);
  std::swap(first.frames_refuted, second.frames_refuted);
  std::swap(first.last_seen_ns, second.last_seen_ns);
  std::swap(first.island, second.island);
  std::swap(first.views, second.views);
  for (std::size_t i = 0; i < std::min(first.views.size(), second.views.size()); ++i)
    std::swap(first.views[i].colors, second.views[i].colors);
  // How each moved was the other's motion: nothing is learned from it.
  first.motion = second.motion = {};
  first.grip = second.grip = {};
}

int propose_hidden(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                   const Vector3d& gravity_W, const AugmentOptions& options, const WeightOptions& weighting,
                   const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                   ObjectBelief& object) {
  std::stable_sort(object.particles.begin(), object.particles.end(), lighter);
  const Particle last = object.particles.back();
  if (last.mode == belief::MotionMode::kHeld) return 0;
  const double unseen = 1e-9 * static_cast<double>(std::max<core::TimeNs>(0, frame.stamp_ns - object.last_seen_ns));
  const double fall = std::min(kFurthestFall, 0.5 * gravity_W.norm() * unseen * unseen);
  const std::vector<Pose> places =
      hidden_places(frame, terms, target, last.X_WO, {hidden_shift(unseen), kHiddenTurn, fall * gravity_W.normalized()},
                    kHiddenDraws, weighting, tools, stream.for_purpose(core::Purpose::kProposal));
  const int wanted = static_cast<int>(std::lround(options.hidden_share * static_cast<double>(object.particles.size())));
  const int placed = std::min(wanted, static_cast<int>(places.size()));
  for (int i = 0; i < placed; ++i) {
    Particle& particle = object.particles[static_cast<std::size_t>(i)];
    particle =
        particles_about(places[static_cast<std::size_t>(i)], belief::MotionMode::kMoving, 1, spread, stream).front();
    particle.log_weight = weighting.log_hidden - std::log(static_cast<double>(wanted));
  }
  if (placed > 0) belief::normalize(object.particles);
  return placed;
}

void append_object(const std::string& name, int model, const Pose& X_WO, const rendering::PoseEvidence& evidence,
                   core::TimeNs stamp_ns, const InitialiseOptions& spread, const core::RandomStream& stream,
                   belief::Scene& scene, belief::Belief& belief) {
  ObjectBelief object;
  object.name = name;
  object.model = model;
  object.particles = particles_about(X_WO, belief::MotionMode::kResting, spread.particles, spread, stream);
  object.existence = kFoundExistence;
  object.evidence_per_pixel = evidence.log_ratio_per_visible_pixel();
  object.last_seen_ns = stamp_ns;
  object.island = static_cast<int>(belief.objects.size());
  belief::SceneObject in_scene;
  in_scene.name = name;
  in_scene.model = model;
  in_scene.pose = belief::FixedPose{X_WO};
  scene.objects.push_back(std::move(in_scene));
  belief.objects.push_back(std::move(object));
}

int new_objects(const FilterFrame& frame, const belief::Observation& observation, const geometry::DepthImage& known,
                const AugmentOptions& options, const InitialiseOptions& spread, const FilterTools& tools,
                const core::RandomStream& stream, belief::Belief& belief) {
  const SegmentationOptions& segmentation = options.detection.segmentation;
  const SampledDepth sampled = sample_depth(*observation.frame.depth, observation.frame.camera, segmentation);
  std::vector<WantedModel> wanted;
  std::vector<int> model_of_wanted;
  for (std::size_t i = 0; i < belief.scene->models.size(); ++i) {
    const belief::ObjectModel& model = belief.scene->models[i];
    if (is_unknown_object(model.name)) continue;  // made for one thing alone
    wanted.push_back({target_of(model, frame, tools), 1});
    model_of_wanted.push_back(static_cast<int>(i));
  }
  if (wanted.empty()) return 0;
  DetectionOptions detection = options.detection;
  detection.min_log_ratio = std::max(detection.min_log_ratio, options.new_log_ratio);
  rendering::FrameTerms terms;
  with_known_surfaces(frame.terms, known, &terms);
  const Surroundings surroundings = surroundings_in(frame, sampled, *belief.scene, wanted, segmentation, stream);
  FineFrame fine = fine_frame_if_sharp(frame, *belief.scene, observation, tools);
  with_coarse_known(known, frame.terms.camera, fine.terms);
  const std::vector<Detection> found =
      detect(terms, fine, known, sampled, surroundings, wanted, detection, tools, stream);
  if (found.empty()) return 0;
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  for (const Detection& detection_found : found) {
    const int model = model_of_wanted[static_cast<std::size_t>(detection_found.model)];
    std::string name;
    for (int number = 2; name.empty() || belief::find_object(*scene, name); ++number)
      name = scene->models[static_cast<std::size_t>(model)].name + "_" + std::to_string(number);
    append_object(name, model, frame.X_WC * detection_found.X_CO, detection_found.evidence, frame.stamp_ns, spread,
                  stream, *scene, belief);
  }
  belief.scene = std::move(scene);
  return static_cast<int>(found.size());
}

}  // namespace prescene::filter
