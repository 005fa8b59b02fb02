// SPDX-License-Identifier: Apache-2.0
// How probable the frames of a window are, given where each object was in each of them.
//
// A frame's log ratio against the empty scene is the sum of the objects' log ratios, each given those before it: what
// an object hides, or stands before, is known then (rendering::with_known_surfaces). Objects that are where all
// hypotheses have them come first and are worked out once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "prescene/filter/proposals/frame.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/path_error.h"
#include "prescene/queries/telling_frames.h"

namespace prescene::queries {

/// Share of an object's pixels in view below which it is out of sight.
inline constexpr double kOutOfSight = 0.05;

/// Of one object, by frame; empty = it is not there.
using ObjectPath = std::vector<std::optional<belief::Pose>>;

/// What one instance says of all objects.
struct ScenePath {
  std::vector<std::size_t> moved;  ///< Objects that are not where the base has them, ascending.
  std::vector<ObjectPath> paths;   ///< Of these.
  bool impossible = false;
  bool simulated = false;  ///< Then true paths may be off by a share of the motion (PathError).
  /// From this frame on, what moves is where somebody put it: anywhere, which is then where frames see it, or, if not
  /// `put_anywhere`, nearly where the path has it.
  std::optional<std::size_t> put_down_from;
  bool put_anywhere = false;

  /// Of an object that moves; else nullptr.
  const ObjectPath* of(std::size_t object) const {
    const auto at = std::lower_bound(moved.begin(), moved.end(), object);
    if (at == moved.end() || *at != object) return nullptr;
    return &paths[static_cast<std::size_t>(at - moved.begin())];
  }
};

/// Of one object, which is at these poses.
inline ScenePath path_of(std::size_t object, ObjectPath poses) {
  ScenePath path;
  path.moved = {object};
  path.paths = {std::move(poses)};
  return path;
}

/// Where an object may be in a frame, given those up to it, if a path is nearly the true one.
struct NearPath {
  double weight;           ///< All of a path sum to one.
  geometry::Vector6d off;  ///< The mean, from the path's pose: coordinates as those of FramePeak.
  PathError error;         ///< Has the covariance.
};

/// What the log ratio of one of `frames` (>= 1) frames counts: tempered by its pixels, as a frame by itself is, and by
/// a further 1 / (1 + c (frames - 1)), since frames average out only errors that differ between them.
double window_tempering(const rendering::Tempering& tempering, double pixels, int step, std::size_t frames);

class WindowLikelihood {
 public:
  /// `objects`: names and models of the scene's objects, in the order of paths. All must outlive it.
  WindowLikelihood(const belief::Belief& start, std::span<const belief::SceneObject> objects,
                   std::span<const WindowFrame> frames, const ExplainContext& context,
                   const filter::FilterTools& tools);
  /// Errors of filter::prepare_frame.
  core::Status prepare();

  std::size_t frames() const { return stamps_.size(); }
  core::TimeNs stamp(std::size_t frame) const { return stamps_[frame]; }
  /// Which of the scene's cameras it is of.
  int camera(std::size_t frame) const { return window_[frame].observation.camera; }
  /// The last of each camera.
  std::vector<std::size_t> last_frames() const { return last_of_cameras(window_); }

  /// Where objects are if nothing is said of them.
  void set_base(std::vector<ObjectPath> base);
  const std::vector<ObjectPath>& base() const { return base_; }

  /// Where frames say that an object is, by frame: paths near them are weighed by these, others by the image.
  void set_peaks(std::size_t object, std::vector<FramePeak> peaks);
  /// Empty = none were set.
  const std::vector<FramePeak>& peaks(std::size_t object) const { return peaks_[object]; }

  /// log_ratios[i * frames() + k]: tempered, of paths[i] in frame k, given the frames before.
  void evaluate(std::span<const ScenePath> paths, std::span<double> log_ratios);
  /// The same of one object at many poses in one frame, all others as the base has them.
  void evaluate(std::size_t frame, std::size_t object, std::span<const belief::Pose> X_WO,
                std::span<double> log_ratios);
  /// Of a frame in which an object of its own is where `error` has it, all others as the base has them; `error` learns.
  double stays(std::size_t frame, std::size_t object, PathError& error);
  /// How well an object's pose at the start is known, in the coordinates of PathError.
  const geometry::Matrix6d& start_error(std::size_t object) const { return start_errors_[object]; }
  /// Sets the poses of what was put down anywhere to those that the frames see.
  void settle(ScenePath& path) const;
  /// Of an object that the path moves, in a frame in which it is there; else empty.
  std::vector<NearPath> near(const ScenePath& path, std::size_t object, std::size_t frame);
  /// What the image of a frame says of a path as it is, tempered.
  double log_ratio(const ScenePath& path, std::size_t frame);
  /// Share of the pixels of an object, as the path has it, that known things do not hide in the frame.
  double visible_share(const ScenePath& path, std::size_t frame, std::size_t object);

 private:
  /// A frame with the objects that do not move in it.
  struct Background {
    double log_ratio = 0.0;
    geometry::DepthImage depth;   // robot and these objects
    rendering::FrameTerms terms;  // with them known
  };
  const Background& background(std::size_t frame, const std::vector<std::size_t>& moved);
  rendering::FrameTerms terms_with(std::size_t frame, const geometry::DepthImage& known) const;
  geometry::DepthImage depth_of(std::size_t frame, std::size_t object, const belief::Pose& X_WO) const;
  rendering::PoseEvidence evidence(std::size_t frame, const rendering::FrameTerms& terms, std::size_t object,
                                   const belief::Pose& X_WO) const;
  /// At a pose, of the m-th object that a path moves, given those before it; `known`: the background of the path's
  /// frame.
  double log_ratio(const ScenePath& path, std::size_t frame, std::size_t m, const belief::Pose& X_WO,
                   const Background& known) const;
  /// What a frame says of a path that is off by `error`, which learns from it. `direct`: what the image says at a pose,
  /// tempered.
  template <class Direct>
  double weigh(std::size_t object, const FramePeak* peak, PathError& error, const Direct& direct) const;
  /// As many frames as there are `log_ratios`; `near`, where given, gets where the object `of` is in the last of them.
  void follow(const ScenePath& path, std::span<double> log_ratios, std::size_t of = 0,
              std::vector<NearPath>* near = nullptr);

  const belief::Belief& start_;
  std::span<const belief::SceneObject> objects_;
  std::span<const WindowFrame> window_;
  const ExplainContext& context_;
  const filter::FilterTools& tools_;
  std::vector<core::TimeNs> stamps_;
  std::vector<filter::FilterFrame> frames_;
  std::vector<std::vector<filter::SearchTarget>> targets_;  // by frame, by object
  std::vector<ObjectPath> base_;
  std::vector<std::vector<FramePeak>> peaks_;     // by object, by frame
  std::vector<std::vector<PeakShape>> shapes_;    // of these
  std::vector<geometry::Matrix6d> start_errors_;  // by object, coordinates of PathError
  double share_ = 1.0;                            // of tempering
  std::mutex mutex_;
  std::map<std::pair<std::size_t, std::vector<std::size_t>>, std::unique_ptr<const Background>> backgrounds_;
};

}  // namespace prescene::queries
