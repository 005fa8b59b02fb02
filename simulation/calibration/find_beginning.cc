// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/find_beginning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/simulation/calibration/clearance.h"
#include "prescene/simulation/calibration/free_fall.h"

namespace prescene::simulation {
namespace {

// s of flight that are looked at.
constexpr double kLongestFlight = 2.0;
// What touches before so many frames does so from the beginning.
constexpr std::size_t kTouchingFrames = 2;
// Frames of a slide that its start is fitted to.
constexpr std::size_t kMostSliding = 10;
// Of gravity: what falls with less is held up.
constexpr double kHeldUp = 0.5;
// In the noise of a coordinate: how far a frame may be off.
constexpr double kFarOff = 6.0;
// s of a recording that are looked at for frames inside of supports, and how many are too many.
constexpr double kLookedAt = 1.0;
constexpr std::size_t kMostInside = 5;
// What moves less than both does not move: m (beside the noise) and rad.
constexpr double kStill = 1e-3;
constexpr double kStillTurn = 0.03;

core::Status check(const std::vector<TimedPose>& frames) {
  if (frames.size() < kLeastBeginning + 2)
    return core::invalid_input("has " + std::to_string(frames.size()) + " frames; it takes at least " +
                               std::to_string(kLeastBeginning + 2));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!std::isfinite(frames[i].time) || !frames[i].X_WO.is_finite())
      return core::invalid_input("frame " + std::to_string(i) + " is not finite");
    if (i > 0 && !(frames[i].time > frames[i - 1].time))
      return core::invalid_input("the times do not ascend at frame " + std::to_string(i));
  }
  return core::ok_status();
}

std::string millimetres(double metres) { return core::fixed_text(1e3 * metres, metres < 0.0095 ? 1 : 0) + " mm"; }

class BeginningFit {
 public:
  BeginningFit(const std::vector<TimedPose>& frames, const belief::Scene& scene, const Simulator& simulator,
               core::ThreadPool& pool, double position_noise)
      : frames_(frames),
        scene_(scene),
        simulator_(simulator),
        pool_(pool),
        noise_(position_noise),
        center_(belief::mean(scene.model_of(scene.objects[0]).center_of_mass)),
        mismatch_(mismatch_of(scene, position_noise)) {}

  core::Result<std::pair<MotionBeginning, std::size_t>> find() const {
    PRESCENE_RETURN_IF_ERROR(check_motion());
    const std::size_t sliding = std::clamp(frames_.size() / 4, kLeastBeginning, kMostSliding);
    const std::optional<double> first = clearance(0);
    const bool falls =
        measure_fall(frames_, center_, scene_.gravity_W, noise_).acceleration >= kHeldUp * scene_.gravity_W.norm();
    const bool begins_near = is_near(first);
    if (!falls && begins_near && is_near(clearance(sliding - 1))) return std::pair(MotionBeginning::kSlide, sliding);
    if (first && *first < -mismatch_) return wrong("it begins", first);
    PRESCENE_RETURN_IF_ERROR(check_inside());
    PRESCENE_TRY(const std::size_t before, frames_of_flight());
    if (falls && before > kLeastBeginning) return std::pair(MotionBeginning::kFlight, before - 1);
    if (before <= kTouchingFrames && begins_near) return std::pair(MotionBeginning::kSlide, sliding);
    if (!falls && before > kLeastBeginning) return wrong("it does not fall, and yet it begins", first);
    return core::invalid_input("it begins " + place_text(first) + ", " + std::to_string(before) +
                               " frames before it first touches one; it takes " + std::to_string(kLeastBeginning + 1) +
                               ", or none (a slide): leave the frames before the contact out");
  }

 private:
  static std::string place_text(const std::optional<double>& clearance) {
    if (!clearance) return "far from every support";
    return "about " + millimetres(std::abs(*clearance)) +
           (*clearance < 0.0 ? " inside of a support or below it (overlap)" : " above a support");
  }
  static core::Status wrong(const std::string& what, const std::optional<double>& clearance) {
    return core::invalid_input(what + " " + place_text(clearance) +
                               ": check its shape's size and where the supports are, in the recordings' metres");
  }

  std::optional<double> clearance(std::size_t frame) const {
    return clearance_of(frames_[frame].X_WO, scene_, simulator_, pool_);
  }
  bool is_near(const std::optional<double>& clearance) const { return clearance && std::abs(*clearance) <= mismatch_; }

  core::Status check_motion() const {
    double way = 0.0, turn = 0.0;
    for (const TimedPose& frame : frames_) {
      way = std::max(way, (frame.X_WO.translation - frames_.front().X_WO.translation).norm());
      turn = std::max(turn, geometry::angle_between(frame.X_WO.rotation, frames_.front().X_WO.rotation));
    }
    if (way > kStill + std::numbers::sqrt2 * kFarOff * noise_ || turn > kStillTurn) return core::ok_status();
    return core::invalid_input("it does not move: give recordings of tosses and slides");
  }

  // A few frames may be, in an impact or where the tracker slipped.
  core::Status check_inside() const {
    const auto end = std::ranges::upper_bound(frames_, frames_.front().time + kLookedAt, {}, &TimedPose::time);
    const std::span<const TimedPose> looked_at(frames_.begin(), end);
    const std::size_t inside = frames_inside(looked_at, mismatch_, scene_, simulator_, pool_);
    if (inside <= kMostInside) return core::ok_status();
    return core::invalid_input("it is more than " + millimetres(mismatch_) + " inside of a support (overlap) in " +
                               std::to_string(inside) + " of its first " + std::to_string(looked_at.size()) +
                               " frames: check its shape's size and where the supports are, in the recordings' metres");
  }

  /// Before the first contact, as the first frames let it fly.
  core::Result<std::size_t> frames_of_flight() const {
    PRESCENE_TRY(const BallisticState fit,
                 fit_ballistic(std::span(frames_).first(kLeastBeginning), center_, scene_.gravity_W));
    // Back to the first frame.
    const double back = fit.time - frames_.front().time;
    belief::WorldState start = belief::mean_start(scene_);
    belief::ObjectState& object = start.objects[0];
    object.mode = belief::MotionMode::kMoving;
    object.X_WO = frames_.front().X_WO;
    const geometry::Vector3d arm = fit.X_WO.rotation * center_;
    const geometry::Vector3d velocity = fit.V_WO.linear + fit.V_WO.angular.cross(arm) - back * scene_.gravity_W;
    object.V_WO.angular = fit.V_WO.angular;
    object.V_WO.linear = velocity - fit.V_WO.angular.cross(object.X_WO.rotation * center_);
    RunRequest request;
    request.stop.duration = std::min(kLongestFlight, frames_.back().time - frames_.front().time);
    request.stop.stop_at_rest = false;
    std::vector<belief::Trajectory> run(1);
    simulator_.run(std::span(&start, 1), request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool_, run);
    double touched = request.stop.duration;
    for (const belief::ContactInterval& contact : run[0].contacts) touched = std::min(touched, contact.begin);
    const auto before = static_cast<std::size_t>(
        std::ranges::lower_bound(frames_, frames_.front().time + touched, {}, &TimedPose::time) - frames_.begin());
    if (before >= frames_.size())
      return core::invalid_input("it touches nothing; give frames until after the first contact");
    return before;
  }

  const std::vector<TimedPose>& frames_;
  const belief::Scene& scene_;
  const Simulator& simulator_;
  core::ThreadPool& pool_;
  double noise_;
  geometry::Vector3d center_;
  double mismatch_ = 0.0;
};

}  // namespace

double mismatch_of(const belief::Scene& scene, double position_noise) {
  const double size =
      geometry::bounding_box(belief::collision_mesh(scene.model_of(scene.objects[0]))).diagonal().norm();
  return std::max({kLeastMismatch, kMismatchShare * size, kFarOff * position_noise});
}

core::Result<RecordedMotion> find_beginning(std::string name, std::vector<TimedPose> frames, const belief::Scene& scene,
                                            const Simulator& simulator, core::ThreadPool& pool, double position_noise) {
  if (core::Status status = check(frames); !status.ok()) return status.at(name);
  const auto found = BeginningFit(frames, scene, simulator, pool, position_noise).find();
  if (!found) return found.status().at(name);
  return RecordedMotion{std::move(name), std::move(frames), found->first, found->second};
}

}  // namespace prescene::simulation
