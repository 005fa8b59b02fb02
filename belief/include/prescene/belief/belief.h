// SPDX-License-Identifier: Apache-2.0
// The belief: weighted hypotheses of where each object is and how it moves, and the estimates read off it.
//
// Each object has its own particle set (objects that touch share an island and are sampled one given the other). A
// particle carries a Gaussian over pose and twist about its mean: what is sampled and what is integrated is the
// Rao-Blackwell split.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/motion_record.h"
#include "prescene/belief/physical_belief.h"
#include "prescene/belief/scene.h"
#include "prescene/core/clock.h"

namespace prescene::belief {

using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// One hypothesis of one object: mean pose and twist in W and the covariance about them. Order of the 12 error
/// coordinates: pose as geometry::box_plus (rotation, translation), then twist (angular, linear).
struct Particle {
  double log_weight = 0.0;  ///< Normalised: the weights of a set sum to one.
  Pose X_WO;
  Twist V_WO;
  Matrix12d covariance = Matrix12d::Zero();
  MotionMode mode = MotionMode::kMoving;
  friend bool operator==(const Particle&, const Particle&) = default;
};

enum class TrackState {
  kTracked,   ///< Seen, and the evidence supports the pose.
  kDoubtful,  ///< Seen, but the evidence is weak.
  kUnseen,    ///< Hidden, out of view or without depth: predicted only.
  kLost,      ///< The evidence speaks against the pose, or it was unseen for too long.
};
std::string to_string(TrackState state);
std::string to_string(MotionMode mode);

/// Bins of LearnedColors: 16 each of red, green and blue; bin = (r / 16 * 16 + g / 16) * 16 + b / 16.
inline constexpr int kColorCells = 16 * 16 * 16;

/// How often a colour was seen on an object and on everything else.
struct ColorShare {
  int bin = 0;          ///< In [0, kColorCells).
  double object = 0.0;  ///< Share of the object's pixels, [0, 1].
  double rest = 0.0;    ///< Of all others.
  friend bool operator==(const ColorShare&, const ColorShare&) = default;
};

/// What the frames showed of an object's colours. The table is shared by copies and never changed.
struct LearnedColors {
  int frames = 0;  ///< That it was learned from; 0 = none, then there is no table.
  /// Bins seen on either, ascending; null = none.
  std::shared_ptr<const std::vector<ColorShare>> shares;
};
/// Tables compare by content.
bool operator==(const LearnedColors& a, const LearnedColors& b);

/// What the newest frame of one of several cameras showed of an object.
struct CameraView {
  bool sees = false;                ///< It was neither hidden nor out of view.
  double evidence_per_pixel = 0.0;  ///< As ObjectBelief's, of that camera's frames alone.
  double evidence_scale = 1.0;      ///< Share of the limits of evidence that its pose has to reach, (0, 1].
  double visible_share = 0.0;
  int visible_pixels = 0;
  LearnedColors colors;  ///< As this camera shows them; those of the first camera are ObjectBelief's.
  friend bool operator==(const CameraView&, const CameraView&) = default;
};

struct ObjectBelief {
  std::string name;  ///< Unique within a belief.
  int model = 0;     ///< Index into the context's models.
  std::vector<Particle> particles;
  double existence = 1.0;  ///< Probability that there is such an object at all.
  TrackState state = TrackState::kTracked;
  /// Evidence of the last frame: nats per visible pixel in favour of the pose against the object's absence; 0 = none.
  /// Where one frame says little (transparent and thin things), of the last ones. (With several cameras: of the newest
  /// frames of those that see it.)
  double evidence_per_pixel = 0.0;
  /// Share of its pixels that were neither hidden by known occluders nor missing; of the camera that sees most of it.
  double visible_share = 0.0;
  int frames_unseen = 0;   ///< Since it was tracked last.
  int frames_refuted = 0;  ///< Since the evidence last did not speak against the pose.
  core::TimeNs last_seen_ns = 0;
  int island = 0;  ///< Objects of equal number touch each other.
  LearnedColors colors;
  PhysicalBelief physics;  ///< Of its model's parameters, apart from the poses.
  MotionRecord motion;
  GripRecord grip;
  std::vector<CameraView> views;  ///< By camera; empty where one camera sees the scene.
  friend bool operator==(const ObjectBelief&, const ObjectBelief&) = default;
};

/// The frames that one of several cameras has given.
struct CameraRecord {
  std::uint64_t frames = 0;    ///< That were used, since the belief began.
  core::TimeNs stamp_ns = 0;   ///< Of the newest; 0 = there is none.
  core::TimeNs period_ns = 0;  ///< Between the two newest; 0 = there are no two.
  Pose X_WC;                   ///< At the newest.
  friend bool operator==(const CameraRecord&, const CameraRecord&) = default;
};

struct Belief {
  std::uint64_t step = 0;
  std::uint64_t seed = 0;
  core::TimeNs stamp_ns = 0;
  /// The context: models, supports, robot, camera, gravity. Shared, never changed by a step.
  std::shared_ptr<const Scene> scene;
  std::vector<ObjectBelief> objects;
  /// Robot body poses used by the last step, in the order of Scene::robot.
  std::vector<Pose> robot;
  Pose X_WC;  ///< Of the first camera, at its newest frame.
  /// Height, against gravity from W's origin, of the lowest surface that any frame showed, m: what falls out of sight
  /// falls no further if nothing else is known to be there.
  std::optional<double> lowest_seen;
  /// Pushes that controls began and that go on at `stamp_ns`, with times from then, s (so at most 0).
  std::vector<Action> pushes;
  std::vector<CameraRecord> cameras;  ///< By camera; empty where one camera sees the scene.
};
/// Scenes compare by content.
bool operator==(const Belief& a, const Belief& b);

/// What a user wants to know of one object.
struct ObjectEstimate {
  Pose mean;  ///< Weighted mean about the heaviest particle, up to symmetry.
  /// Of the whole mixture, order (rotation, translation) as geometry::box_plus.
  Matrix6d covariance = Matrix6d::Zero();
  Twist twist;
  Pose mode;  ///< The heaviest particle's pose.
  MotionMode motion = MotionMode::kMoving;
  /// Probability that the object exists and is where the mean says, within 2 cm and, up to its symmetry, 15 degrees; 0
  /// when the track is lost.
  double confidence = 0.0;
  double effective_sample_size = 0.0;

  friend bool operator==(const ObjectEstimate&, const ObjectEstimate&) = default;
};
/// `symmetry`: of the object's model. Particles count as the equivalent that is nearest to the heaviest one, so that
/// the mean of poses that look alike is one of them.
ObjectEstimate estimate(const ObjectBelief& object,
                        const geometry::SymmetryGroup& symmetry = geometry::SymmetryGroup::none());
/// The same with the symmetry of the model that the belief's scene gives it.
ObjectEstimate estimate(const Belief& belief, const ObjectBelief& object);
std::optional<int> find_object(const Belief& belief, const std::string& name);
double effective_sample_size(const std::vector<Particle>& particles);

/// The particle of the largest weight, the first of several. At least one particle (checked).
const Particle& heaviest(const std::vector<Particle>& particles);
/// Normalises log weights; false when all are -inf or NaN (then they are made equal).
bool normalize(std::vector<Particle>& particles);
/// The model of an object of the belief. The belief has a scene (checked).
const ObjectModel& model_of(const Belief& belief, const ObjectBelief& object);
/// The world state of the heaviest particle of each object, with the means of its physical parameters.
WorldState most_likely_state(const Belief& belief);
/// Draws world states from a belief; prepared once, as the square roots of the covariances cost more than a draw.
class BeliefSampler {
 public:
  /// Every object needs at least one particle (checked). The belief must outlive the sampler.
  explicit BeliefSampler(const Belief& belief);
  /// How many uniform numbers a draw takes: one an object for the choice of its particle (if it has several), those of
  /// its physical parameters, and the largest rank of its covariances; and what is open of the joints.
  int dimensions() const { return dimensions_; }
  /// One world state, objects in the belief's order, drawn as if each existed; uniforms.size() == dimensions(). First
  /// come the choices of the particles, then the physical parameters, then the widest direction of each object, the
  /// next widest, ...
  WorldState draw(std::span<const double> uniforms) const;

 private:
  struct Prepared {
    const ObjectBelief* belief;
    PhysicalSampler physics;
    std::vector<Eigen::MatrixXd> roots;  // of the particles' covariances
    Eigen::Index rank = 0;
  };
  std::vector<Prepared> objects_;
  std::vector<Joint> joints_;
  Eigen::Index largest_rank_ = 0;
  int dimensions_ = 0;
};
/// A hash over all bits, for determinism checks.
std::uint64_t content_hash(const Belief& belief);

}  // namespace prescene::belief
