// SPDX-License-Identifier: Apache-2.0
#include "stability_margin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "basis.h"
#include "foresee.h"
#include "prescene/belief/body_names.h"
#include "prescene/belief/scene_size.h"
#include "prescene/geometry/angles.h"
#include "prescene/queries/confidence_sequence.h"

namespace prescene::queries {
namespace {

using belief::WorldState;
using geometry::Vector3d;

constexpr double kFallTilt = 30.0 * geometry::kDegree, kFallDrop = 0.05;  // rad, m: see StabilityMargin
constexpr double kLeastSpeed = 0.01, kMostSpeed = 10.0;                   // m/s: what knocks are looked for between
constexpr int kHalvings = 8;                                              // of the logarithm of that range: to 2.7 %
constexpr int kRoughHalvings = 5;                                         // to 24 %
constexpr std::size_t kDirections = 8;                                    // around the vertical
constexpr std::uint32_t kRoughStarts = 12;                                // for each direction
constexpr std::uint32_t kStarts = 128, kStartsAtOnce = 32;  // in the weakest direction: 5 % is the sixth of them
constexpr std::uint32_t kRemovalStarts = 256;
constexpr double kRemovedBy = 100.0;  // m: beyond the world's end, where nothing is simulated
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Simulates starts that are drawn one by one, each by its number, and then changed.
class Trials {
 public:
  Trials(const Prior& prior, const belief::StabilityQuery& query, const QueryContext& context,
         const simulation::Simulator& simulator)
      : prior_(prior), context_(context), simulator_(simulator) {
    request_.stop.duration = query.duration;
    request_.stop.stop_at_rest = true;
    request_.stop.world_radius = belief::world_radius(*prior.scene);
  }

  WorldState start(std::uint32_t number) const {
    core::RandomStream random = prior_.stream.for_purpose(core::Purpose::kNearbyStart).at(4, number);
    const simulation::StartComponent& component = prior_.starts.chosen_by(random.uniform());
    std::vector<double> uniforms(static_cast<std::size_t>(component.dimensions));
    for (double& uniform : uniforms) uniform = random.uniform();
    return component.draw(uniforms);
  }

  /// Nothing when the time ran out.
  std::optional<std::vector<belief::Trajectory>> run(const std::vector<WorldState>& starts,
                                                     const std::vector<std::uint32_t>& numbers) {
    std::vector<belief::Trajectory> runs(starts.size());
    const core::Cancellation until = end_of_simulating(context_);
    simulator_.run(starts, request_, prior_.stream, std::span<const std::uint32_t>(numbers), *context_.pool, runs,
                   &until);
    for (const belief::Trajectory& run : runs)
      if (run.end == belief::TrajectoryEnd::kCancelled) return std::nullopt;
    instances_ += static_cast<int>(runs.size());
    for (const belief::Trajectory& run : runs) failed_ += run.end == belief::TrajectoryEnd::kDiverged;
    return runs;
  }

  int instances() const { return instances_; }
  int failed() const { return failed_; }
  const belief::Scene& scene() const { return *prior_.scene; }
  core::ThreadPool& pool() const { return *context_.pool; }

 private:
  const Prior& prior_;
  const QueryContext& context_;
  const simulation::Simulator& simulator_;
  simulation::RunRequest request_;
  int instances_ = 0, failed_ = 0;
};

/// How far the direction that pointed up has tilted; what turns about an axis of its symmetry has not.
double tilt_between(const belief::Pose& from, const belief::Pose& to, const geometry::SymmetryGroup& symmetry,
                    const Vector3d& up) {
  if (symmetry.ball) return 0.0;
  geometry::SymmetryGroup turns;  // those by which it rolls without falling; a cube on its next face has fallen
  turns.axis = symmetry.axis;
  turns.p_BoC = symmetry.p_BoC;
  const geometry::Quaterniond R = geometry::closest_equivalent(to, from, turns).rotation * from.rotation.conjugate();
  return std::acos(std::clamp(up.dot(R * up), -1.0, 1.0));
}

bool falls(const belief::Scene& scene, std::size_t object, const WorldState& start, const belief::Trajectory& run) {
  if (run.end == belief::TrajectoryEnd::kDiverged) return true;
  const Vector3d up = belief::up_of(scene);
  const belief::Pose& X_end = run.states.back().objects[object].X_WO;
  const belief::Pose& X_start = start.objects[object].X_WO;
  return up.dot(X_start.translation - X_end.translation) > kFallDrop ||
         tilt_between(X_start, X_end, scene.model_of(scene.objects[object]).symmetry, up) > kFallTilt;
}

/// Of each of some starts the least impulse, N s along `direction`, that makes the object fall: 0 = it falls by itself,
/// kNever = at no speed up to kMostSpeed. Found by halving, so where a harder knock would leave it standing again, one
/// of the places where it begins to fall.
std::optional<std::vector<double>> fall_impulses(Trials& trials, std::size_t object, const Vector3d& direction,
                                                 std::uint32_t first, std::uint32_t count, int halvings) {
  const std::size_t n = count;
  std::vector<WorldState> starts(n);
  trials.pool().for_each_index(n,
                               [&](std::size_t i) { starts[i] = trials.start(first + static_cast<std::uint32_t>(i)); });
  std::vector<double> stands(n, 0.0), falls_at(n, kNever);
  for (int round = -2; round < halvings; ++round) {
    std::vector<std::size_t> open;
    std::vector<double> speeds;
    std::vector<WorldState> knocked;
    std::vector<std::uint32_t> numbers;
    for (std::size_t i = 0; i < n; ++i) {
      if (round > -2 && falls_at[i] == 0.0) continue;
      if (round > -1 && falls_at[i] == kNever) continue;
      const double speed = round == -2   ? 0.0
                           : round == -1 ? kMostSpeed
                                         : std::sqrt(std::max(stands[i], kLeastSpeed) * falls_at[i]);
      open.push_back(i);
      speeds.push_back(speed);
      numbers.push_back(first + static_cast<std::uint32_t>(i));
      WorldState state = starts[i];
      state.objects[object].mode = belief::MotionMode::kMoving;
      state.objects[object].V_WO.linear += speed * direction;
      knocked.push_back(std::move(state));
    }
    if (open.empty()) break;
    const auto runs = trials.run(knocked, numbers);
    if (!runs) return std::nullopt;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const std::size_t i = open[k];
      (falls(trials.scene(), object, starts[i], (*runs)[k]) ? falls_at[i] : stands[i]) = speeds[k];
    }
  }
  for (std::size_t i = 0; i < n; ++i) falls_at[i] *= starts[i].objects[object].physical.mass;
  return falls_at;
}

std::optional<double> or_none(double impulse) { return impulse < kNever ? std::optional(impulse) : std::nullopt; }

std::optional<belief::StabilityMargin> margin_of(Trials& trials, std::size_t object, double confidence) {
  belief::StabilityMargin margin;
  margin.most_speed = kMostSpeed;
  const Vector3d up = belief::up_of(trials.scene());
  const Vector3d side = up.unitOrthogonal();
  const Vector3d x_flat = Vector3d::UnitX() - up * up.x();
  const Vector3d x = x_flat.norm() > 1e-6 ? Vector3d(x_flat.normalized()) : side;
  double least = kNever, finite_share = -1.0;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double azimuth = 2.0 * std::numbers::pi * static_cast<double>(d) / kDirections;
    Vector3d direction = std::cos(azimuth) * x + std::sin(azimuth) * up.cross(x);
    for (double& share : direction)
      if (std::abs(share) < 1e-12) share = 0.0;
    auto impulses = fall_impulses(trials, object, direction, 0, kRoughStarts, kRoughHalvings);
    if (!impulses) return std::nullopt;
    std::sort(impulses->begin(), impulses->end());
    const double median = (*impulses)[impulses->size() / 2];
    const auto finite = static_cast<double>(
        std::count_if(impulses->begin(), impulses->end(), [](double impulse) { return impulse < kNever; }));
    margin.directions.push_back({direction, or_none(median)});
    if (median < least || (median == kNever && least == kNever && finite > finite_share)) {
      least = median;
      finite_share = finite;
      margin.weakest_W = direction;
    }
  }
  // Fresh starts: the direction was chosen for its low numbers.
  std::vector<double> impulses;
  for (std::uint32_t first = 0; first < kStarts; first += kStartsAtOnce) {
    const auto more = fall_impulses(trials, object, margin.weakest_W, kRoughStarts + first, kStartsAtOnce, kHalvings);
    if (!more) break;
    impulses.insert(impulses.end(), more->begin(), more->end());
  }
  if (impulses.empty()) return std::nullopt;
  std::sort(impulses.begin(), impulses.end());
  for (double share : {0.05, 0.5}) {
    const QuantileInterval quantile = quantile_interval(impulses, share, 1.0 - confidence);
    margin.falls.push_back(
        {share, or_none(quantile.value), or_none(std::max(0.0, quantile.low)), or_none(quantile.high)});
  }
  margin.starts = static_cast<int>(impulses.size());
  margin.instances = trials.instances();
  return margin;
}

std::optional<belief::Removal> removal_of(Trials& trials, std::size_t object, const belief::StabilityQuery& query) {
  const belief::Scene& scene = trials.scene();
  const Vector3d up = belief::up_of(scene);
  std::vector<WorldState> starts(kRemovalStarts);
  std::vector<std::uint32_t> numbers(kRemovalStarts);
  trials.pool().for_each_index(kRemovalStarts, [&](std::size_t i) {
    numbers[i] = static_cast<std::uint32_t>(i);
    starts[i] = trials.start(numbers[i]);
    belief::ObjectState& taken = starts[i].objects[object];
    taken.mode = belief::MotionMode::kMoving;
    taken.X_WO.translation += kRemovedBy * up;
    // What lay on it or leaned on it is not asleep.
    for (belief::ObjectState& other : starts[i].objects)
      if (other.mode == belief::MotionMode::kResting) other.mode = belief::MotionMode::kMoving;
  });
  const int before = trials.instances();
  const auto runs = trials.run(starts, numbers);
  if (!runs) return std::nullopt;
  const std::size_t objects = scene.objects.size();
  std::vector<int> moved(objects, 0);
  int all_stay = 0;
  for (std::size_t i = 0; i < runs->size(); ++i) {
    const belief::Trajectory& run = (*runs)[i];
    bool stay = true;
    for (std::size_t o = 0; o < objects; ++o) {
      if (o == object || starts[i].objects[o].mode == belief::MotionMode::kHeld) continue;
      const belief::Pose& X_start = starts[i].objects[o].X_WO;
      const belief::Pose& X_end = run.states.back().objects[o].X_WO;
      const bool stays =
          run.end != belief::TrajectoryEnd::kDiverged &&
          (X_end.translation - X_start.translation).norm() <= query.max_move &&
          geometry::symmetric_angle(X_start, X_end, scene.model_of(scene.objects[o]).symmetry) <= query.max_turn;
      moved[o] += stays ? 0 : 1;
      stay = stay && stays;
    }
    all_stay += stay ? 1 : 0;
  }
  const auto share_of = [&](const std::string& name, int count) {
    const int n = static_cast<int>(runs->size());
    const ShareInterval interval = clopper_pearson(count, n, 1.0 - query.effort.confidence);
    return belief::OutcomeProbability{name, "", static_cast<double>(count) / n, interval.low, interval.high};
  };
  belief::Removal removal;
  removal.others_stay = share_of("others_stay", all_stay);
  for (std::size_t o = 0; o < objects; ++o)
    if (o != object) removal.moves.push_back(share_of(scene.objects[o].name, moved[o]));
  removal.instances = trials.instances() - before;
  return removal;
}

}  // namespace

core::Status add_stability_detail(const Prior& prior, std::size_t object, const belief::StabilityQuery& query,
                                  const QueryContext& context, belief::StabilityAnswer& answer) {
  if (!query.detail.margin && !query.detail.removal) return core::ok_status();
  const belief::SceneObject& asked = prior.scene->objects[object];
  if (query.detail.margin && asked.held_by)
    return core::invalid_input("detail: '" + asked.name + "' is held by '" + *asked.held_by +
                               "', so it has no margin: leave 'margin' out, or ask of what stands by itself");
  if (query.detail.removal && std::ranges::any_of(prior.scene->joints, [&](const belief::Joint& joint) {
        return joint.child == asked.name || joint.parent == asked.name;
      }))
    return core::invalid_input("detail: '" + asked.name +
                               "' is on a joint, so it can't be taken away: leave 'removal' out, or ask of another");
  if (!context.make_simulator) return core::unavailable("no simulator: this service was set up without one");
  PRESCENE_TRY(const auto simulator, context.make_simulator(*prior.scene, 1.0));
  Trials trials(prior, query, context, *simulator);
  std::vector<std::string> missing;
  if (query.detail.removal) {
    answer.removal = removal_of(trials, object, query);
    if (!answer.removal) missing.emplace_back("removal");
  }
  if (query.detail.margin) {
    Trials of_margin(prior, query, context, *simulator);
    answer.margin = margin_of(of_margin, object, query.effort.confidence);
    if (!answer.margin) missing.emplace_back("margin");
    if (of_margin.failed() > 0)
      answer.remarks.push_back(std::to_string(of_margin.failed()) + " of " + std::to_string(of_margin.instances()) +
                               " instances of the margin failed in the simulator and count as falls.");
  }
  if (trials.failed() > 0)
    answer.remarks.push_back(std::to_string(trials.failed()) + " of " + std::to_string(trials.instances()) +
                             " instances of the removal failed in the simulator and count as moved.");
  if (!missing.empty()) answer.remarks.push_back(missing_text(missing));
  return core::ok_status();
}

}  // namespace prescene::queries
