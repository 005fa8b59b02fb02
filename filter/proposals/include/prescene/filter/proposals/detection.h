// SPDX-License-Identifier: Apache-2.0
// Finds known objects in a single frame without knowing where they are: clusters of points that no support explains,
// poses proposed per cluster and model, the best explanation accepted first, then another look at what is left.
//
//   std::vector<Detection> found = detect(terms, known, sampled, surroundings, wanted, options, tools, stream);
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "prescene/filter/proposals/fit_judgement.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/frame_surfaces.h"
#include "prescene/filter/proposals/pose_search.h"
#include "prescene/filter/proposals/segmentation.h"

namespace prescene::filter {

struct DetectionOptions {
  SegmentationOptions segmentation;
  /// count. This many random poses are tried for each cluster and model of which nothing was learned, half of them
  /// where finds are judged in the fine image. Range 8 to 1000. Measured: docs/studies/tracking.md.
  int starts = 192;
  SearchOptions search;
  /// count. Only this many clusters are looked at, the largest first. Range 1 to 100. Chosen.
  int max_clusters = 14;
  /// share. At least this share of a find's visible pixels must match. Range 0 to 1. Tuned: docs/studies/tracking.md.
  double min_hit_share = 0.85;
  /// nats. A find must explain the frame better by at least this log ratio (untempered, at the likelihood's
  /// resolution). Range 0 to 10000. Tuned: docs/studies/tracking.md.
  double min_log_ratio = 60.0;
  /// probability. Finds that are less likely than this to be right are left out at the end. Range 0 to 1. Chosen.
  double least_probability = 0.5;
};

/// A model that is looked for, and how many of it may be found.
struct WantedModel {
  SearchTarget target;
  int count = 1;
};

struct Detection {
  int model = 0;  ///< Index into the wanted models.
  Pose X_CO;
  rendering::PoseEvidence evidence;                         ///< With the other detections as known surfaces.
  double outline = 1.0;                                     ///< outline_support, likewise.
  double margin = std::numeric_limits<double>::infinity();  ///< nats less of the best place beside it, if it was asked.
  bool stands = true;                                       ///< On a support or another detection.
  double probability = 1.0;                                 ///< probability_right, or as the learned judge says.
  int cluster = 0;                                          ///< Of those that were looked at, in their order.
  FitNumbers numbers{};                                     ///< What a learned judge saw when it was accepted, ...
  double log_odds = 0.0;                                    ///< ... and made of it.
};

/// What a judge is learned from: all that was judged.
struct DetectionTrace {
  struct Candidate {
    int model = 0;  ///< Index into the wanted models.
    Pose X_CO;
    FitNumbers numbers;
  };
  struct Find {
    int model = 0;
    Pose X_CO;
    FitNumbers numbers;
    double accepted_log_odds = 0.0;
    double final_log_odds = 0.0;
  };
  std::vector<Candidate> candidates;
  std::vector<Find> finds;  ///< All of them, whatever DetectionOptions::least_probability says.
};

/// Probability that a find is right: the more evidence there is in all, and the more of what the sensor model expects
/// of the pose (nats per visible pixel, expected_evidence_of), the higher. Calibrated on simulated rooms.
double probability_right(const rendering::PoseEvidence& evidence, double expected_evidence);

/// Area from which a flat patch is too large to be a face of these models, m^2.
double least_support_area(std::span<const WantedModel> wanted);

/// Objects found, in the order of their acceptance (strongest first). `terms` is the frame with what is known put in;
/// `known` its rendered depth at terms.camera (empty = nothing). No pose reaches into a support or another find, and
/// one that stands on neither must explain more. Where something was learned of all wanted models, the learned judge
/// decides. With a `trace`, nothing is left out for want of probability; without judge, the trace is what one is
/// learned from. The same bits for any number of threads.
std::vector<Detection> detect(const rendering::FrameTerms& terms, const geometry::DepthImage& known,
                              const SampledDepth& sampled, const Surroundings& surroundings,
                              std::span<const WantedModel> wanted, const DetectionOptions& options,
                              const FilterTools& tools, const core::RandomStream& stream,
                              DetectionTrace* trace = nullptr);

/// The measured pixels of `sampled` that a surface of `known` (depth in `camera`) explains, as a mask of the sampled
/// camera's size: less than `tolerance` (m; growing with the squared depth beyond 1.2 m) in front of the surface and
/// less than twice that behind it, where a surface reaches one pixel of `camera` past its outline.
geometry::Image<std::uint8_t> explained_pixels(const SampledDepth& sampled, const geometry::DepthImage& known,
                                               const geometry::PinholeCamera& camera, double tolerance);

/// Random poses with the target's centre near points of a cluster and any rotation; of a share of them a random side of
/// the model's bounding box faces up (`up_C`, unit).
std::vector<Pose> cluster_starts(const Cluster& cluster, const SearchTarget& target, const Vector3d& up_C,
                                 double standing_share, int count, const core::RandomStream& stream);

}  // namespace prescene::filter
