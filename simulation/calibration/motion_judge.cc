// SPDX-License-Identifier: Apache-2.0
#include "motion_judge.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "motion_starts.h"
#include "prescene/core/sobol.h"

namespace prescene::simulation {
namespace {

using geometry::Vector3d;

// Distances below this share of the radius of gyration count by their size, larger ones by their logarithm.
constexpr double kScoreWidth = 0.02;

/// A pose as a place in a space of twelve dimensions, in which distances are those of motion_calibration.h.
constexpr Eigen::Index kPointSize = 12;
using PosePoint = Eigen::Matrix<double, kPointSize, 1>;
PosePoint point_of(const geometry::Pose& X_WO, const Vector3d& center_of_mass, double gyration) {
  PosePoint point;
  const geometry::Matrix3d R = X_WO.rotation.toRotationMatrix();
  point.head<3>() = X_WO * center_of_mass;
  // |R - R'|_F^2 = 8 sin^2(angle / 2), about twice the squared angle.
  point.tail<9>() = (gyration / std::sqrt(2.0)) * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(R.data());
  return point;
}

geometry::Pose pose_at(const std::vector<TimedPose>& frames, double time) {
  const auto after = std::ranges::lower_bound(frames, time, {}, &TimedPose::time);
  if (after == frames.begin()) return frames.front().X_WO;
  if (after == frames.end()) return frames.back().X_WO;
  const TimedPose& before = *(after - 1);
  return geometry::interpolate(before.X_WO, after->X_WO, (time - before.time) / (after->time - before.time));
}

/// The same for all hypotheses, so that their scores compare.
Vector3d center_of(const belief::ObjectModel& model) {
  const belief::Vector3Distribution& center = model.center_of_mass;
  return {belief::mean(center.x), belief::mean(center.y), belief::mean(center.z)};
}

}  // namespace

double radius_of_gyration(const belief::ObjectModel& model) { return std::sqrt(0.5 * model.unit_inertia.trace()); }

MotionJudge::MotionJudge(const belief::Scene& scene, const SimulatorFactory& make_simulator,
                         const core::RandomStream& stream, core::ThreadPool& pool,
                         const MotionCalibrationOptions& options, const core::Cancellation* cancellation)
    : scene_(scene),
      model_(static_cast<std::size_t>(scene.objects[0].model)),
      gyration_(radius_of_gyration(scene.models[model_])),
      make_simulator_(make_simulator),
      stream_(stream),
      pool_(pool),
      options_(options),
      cancellation_(cancellation) {
  observations_.samples = options.samples;
  observations_.width = kScoreWidth * gyration_;
}

core::Status MotionJudge::add(const RecordedMotion& motion) {
  const auto wrong = [&](const std::string& what) { return core::invalid_input(motion.name + ": " + what); };
  const bool slides = motion.beginning == MotionBeginning::kSlide;
  if (motion.first_frames < (slides ? 5 : 3) || motion.first_frames >= motion.frames.size())
    return wrong(slides ? "it takes five frames of free sliding and some after them"
                        : "it takes three frames of flight and some after them");
  for (std::size_t i = 0; i < motion.frames.size(); ++i) {
    if (!std::isfinite(motion.frames[i].time) || !motion.frames[i].X_WO.is_finite())
      return wrong("frame " + std::to_string(i) + " is not finite");
    if (i > 0 && !(motion.frames[i].time > motion.frames[i - 1].time))
      return wrong("the times do not ascend at frame " + std::to_string(i));
  }
  Case made;
  const std::size_t used = std::min(motion.first_frames, static_cast<std::size_t>(options_.fit_frames));
  made.beginning = std::span(motion.frames).subspan(motion.first_frames - used, used);
  made.slides = slides;
  const double start = made.beginning.back().time;
  std::vector<PosePoint> points;
  for (int j = 1; j <= options_.checkpoints; ++j) {
    const double time = start + j * checkpoint_step();
    if (time > motion.frames.back().time) break;
    points.push_back(point_of(pose_at(motion.frames, time), center_of(scene_.models[model_]), gyration_));
  }
  if (points.empty())
    return wrong("it ends before the first checkpoint, " + std::to_string(checkpoint_step()) +
                 " s after its beginning");
  made.views = points.size();
  const Eigen::Index before = observations_.points.cols();
  observations_.points.conservativeResize(kPointSize, before + static_cast<Eigen::Index>(points.size()));
  for (std::size_t j = 0; j < points.size(); ++j) {
    observations_.points.col(before + static_cast<Eigen::Index>(j)) = points[j];
    observations_.recordings.push_back(static_cast<int>(cases_.size()));
  }
  cases_.push_back(made);
  return core::ok_status();
}

core::Result<Eigen::MatrixXd> MotionJudge::simulated(const MotionHypothesis& hypothesis) const {
  if (cancellation_ != nullptr && cancellation_->requested()) return core::cancelled("the calibration was stopped");
  belief::Scene scene = scene_;
  belief::ObjectModel& model = scene.models[model_];
  model.unit_inertia *= std::exp(hypothesis[MotionParameter::kInertiaSize]);
  model.contact.edge_radius = hypothesis[MotionParameter::kEdgeRadius];
  PRESCENE_TRY(const std::unique_ptr<Simulator> simulator, make_simulator_(scene, 1.0));
  std::vector<belief::WorldState> starts;
  std::vector<std::size_t> sliding;
  for (std::size_t i = 0; i < cases_.size(); ++i) {
    PRESCENE_RETURN_IF_ERROR(add_starts(i, hypothesis, &starts));
    if (cases_[i].slides)
      for (std::size_t k = 0; k < samples(); ++k) sliding.push_back(i * samples() + k);
  }
  // Of the time between two checkpoints: slides are one ahead once they have landed.
  const auto parts = static_cast<std::size_t>(std::ceil(checkpoint_step() / kLanding));
  const double part = checkpoint_step() / static_cast<double>(parts);
  land(*simulator, sliding, part, stream_, pool_, starts, cancellation_);
  RunRequest request;
  request.stop.duration = options_.checkpoints * checkpoint_step();
  request.sample_interval = part;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator->run(starts, request, stream_, 0, pool_, runs, cancellation_);
  if (cancellation_ != nullptr && cancellation_->requested()) return core::cancelled("the calibration was stopped");

  Eigen::MatrixXd points(kPointSize, observations_.points.cols() * options_.samples);
  const Vector3d center = center_of(scene_.models[model_]);
  Eigen::Index view = 0;
  for (std::size_t i = 0; i < cases_.size(); ++i) {
    for (std::size_t j = 0; j < cases_[i].views; ++j, ++view) {
      for (std::size_t k = 0; k < samples(); ++k) {
        const std::vector<belief::WorldState>& states = runs[i * samples() + k].states;
        // What came to rest before stays there.
        const std::size_t at = parts * (j + 1) - (cases_[i].slides ? 1 : 0);
        const belief::WorldState& state = states[std::min(at, states.size() - 1)];
        points.col(view * options_.samples + static_cast<Eigen::Index>(k)) =
            point_of(state.objects[0].X_WO, center, gyration_);
      }
    }
  }
  return points;
}

core::Status MotionJudge::add_starts(std::size_t i, const MotionHypothesis& hypothesis,
                                     std::vector<belief::WorldState>* starts) const {
  PRESCENE_TRY(const MotionStart beginning,
               fit_motion_start(cases_[i].beginning, cases_[i].slides, hypothesis.center_of_mass(), scene_.gravity_W));
  const ThrowScatter scatter{hypothesis.start_noise * options_.position_noise,
                             hypothesis.start_noise * options_.rotation_noise, hypothesis.friction_scatter};
  const belief::WorldState mean = belief::mean_start(scene_);
  belief::PhysicalParameters physical = mean.objects[0].physical;
  physical.center_of_mass = hypothesis.center_of_mass();
  physical.friction = hypothesis[MotionParameter::kFriction];
  physical.impact_friction = hypothesis[MotionParameter::kImpactFriction];
  physical.restitution = hypothesis[MotionParameter::kRestitution];
  core::RandomStream own = stream_.at(i);
  const core::SobolNet net(kStartDimensions, own.next_u64());
  std::array<double, kStartDimensions> uniform{};
  for (std::size_t k = 0; k < samples(); ++k) {
    net.point(k, uniform);
    belief::WorldState start = mean;
    start.objects[0] = drawn_start(beginning, scatter, physical, uniform);
    starts->push_back(std::move(start));
  }
  return core::ok_status();
}

}  // namespace prescene::simulation
