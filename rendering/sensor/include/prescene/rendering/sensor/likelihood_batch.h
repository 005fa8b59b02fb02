// SPDX-License-Identifier: Apache-2.0
// How likely an RGB-D frame is under many poses of known objects: log ratios against "the object is not there", and the
// Gauss-Newton equations that improve a pose. No images come out.
//
//   FrameTerms terms;
//   make_frame_terms(input, options, model, &terms);            // once a frame
//   with_known_surfaces(terms, known_depth, &terms_of_object);  // optional: what other known things explain
//   batch->evaluate(terms_of_object, hypotheses, *workspace, evidences);
#pragma once

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/plane.h"
#include "prescene/geometry/pose.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/sensor/color_model.h"
#include "prescene/rendering/sensor/sensor_model.h"

namespace prescene::rendering {

/// A part of the background that is known: a plane, in C, with the convex outline of its known part.
struct SupportRegion {
  geometry::Plane plane_C;
  /// Corners on the plane, in C, in order around it (either way); empty = the plane has no end.
  std::vector<geometry::Vector3d> outline_C;
};

/// One frame and what is known about its background. Views must outlive the call only.
struct FrameTermsInput {
  geometry::PinholeCamera camera;
  geometry::ImageView<const float> depth;          ///< z in C, metres, 0 or not finite = missing; the camera's size.
  geometry::ImageView<const geometry::Rgb> color;  ///< Registered to the depth; empty = no colour.
  std::span<const SupportRegion> supports;
  /// Depth of the same view without the objects (an earlier or the empty scene); empty = not known. 0 = it had no
  /// return.
  geometry::ImageView<const float> background;
  std::span<const ColorModel> color_models;  ///< Hypotheses name one by its index here; ignored without a colour image.
};

struct FrameTermsOptions {
  /// pixels. The image is sampled (never averaged: flying pixels) every round(width / target_width) pixels. 80 is
  /// enough for near objects. Range 16 to 4096. Measured: docs/studies/likelihood.md.
  int target_width = 80;
  TemperingOptions tempering;
};

/// Everything about a frame that does not depend on the pose, at the reduced resolution. Values; any number of threads
/// may read. Make it again in place to reuse its memory.
struct FrameTerms {
  SensorModel model;
  TemperingOptions tempering;
  geometry::PinholeCamera camera;          ///< Of the reduced images.
  int step = 1;                            ///< Full-image pixels between two sampled ones.
  geometry::DepthImage depth;              ///< Measured, cut to the model's range; 0 = missing.
  geometry::Image<float> inverse_ray;      ///< 1 / length of the ray through the pixel that has z = 1.
  geometry::Image<float> inverse_absent;   ///< 1 / p(z | object absent), m; 0 where missing.
  geometry::Image<float> absent_peak;      ///< Depth that the absent model expects, 0 = none.
  geometry::Image<float> absent_missing;   ///< Probability of no return when absent; negative = not known.
  geometry::Image<float> inverse_returns;  ///< 1 / (1 - that); without meaning where it is not known.
  geometry::DepthImage known;  ///< Nearest other known surface, 0 = none; what lies behind it carries no evidence.
  std::vector<geometry::Image<float>> color_ratio;  ///< One a colour model: (p(c|object) / p(c|rest))^beta.
};

/// Fails with kInvalidInput when camera, depth, colour and background differ in size.
core::Status make_frame_terms(const FrameTermsInput& input, const FrameTermsOptions& options, const SensorModel& model,
                              FrameTerms* terms);

/// `frame` with other known things put in (robot links, neighbours whose poses are believed): `known_depth` is their
/// rendering in frame.camera, 0 = nothing. A pixel where one is nearer than the hypothesis carries no evidence; where
/// one is behind the hypothesis, it is what the camera would see were the object absent. Aborts when the sizes differ.
void with_known_surfaces(const FrameTerms& frame, const geometry::DepthImage& known_depth, FrameTerms* terms);

/// Nearest of both at each pixel, 0 = nothing: joins the renderings of several known things. Aborts when sizes differ.
void merge_nearest(const geometry::DepthImage& other, geometry::DepthImage* depth);

/// What a frame says of an object that is there and seen, over what the camera may return of it. nats per visible
/// pixel; 0 where nothing of it can be seen.
struct ExpectedEvidence {
  double of_all = 0.0;      ///< Expectation of log_ratio over that of the number of visible pixels.
  double of_visible = 0.0;  ///< The same of visible_log_ratio, without missing returns and what is in front.
  /// Standard deviation of log_ratio_per_visible_pixel() from frame to frame, at most: pixels within the area that
  /// errors are correlated over (tempering.weight) count as one.
  double deviation = 0.0;
};

/// `depth` and `normals`: the object alone, drawn in frame.camera, 0 = not covered; their size is the camera's
/// (checked). A thin thing on a known surface and a transparent one say less than others even at their true pose. The
/// expectation is taken by quadrature: three nodes of a hit, of what is behind, and of an outlier.
ExpectedEvidence expected_evidence(const FrameTerms& frame, const SurfaceMaterial& material,
                                   const geometry::DepthImage& depth, const geometry::Image<Vector3f>& normals);

/// One object at one pose. Pointers must outlive the call only.
struct PoseHypothesis {
  const RenderMesh* mesh = nullptr;
  geometry::Pose X_CO;  ///< Of the mesh's frame.
  const SurfaceMaterial* material = nullptr;
  int color_model = -1;           ///< Index into the frame's, -1 = no colour.
  double tempering_pixels = 0.0;  ///< Pixels that `tempered` is tempered by; 0 = those measured under this hypothesis.
                                  ///< Compare hypotheses of one object under one number.
};

/// What the frame says about one hypothesis. Counts are of reduced pixels.
struct PoseEvidence {
  /// Sum over pixels of log p(frame | object there) - log p(frame | absent). 0: nothing to see.
  double log_ratio = 0.0;
  double tempered = 0.0;           ///< tempering(frame.tempering.weight, tempering pixels, frame.step) * log_ratio.
  int in_view = 0;                 ///< Pixels that the object covers, known surfaces in front or not.
  int covered = 0;                 ///< Of these, not hidden by a known surface.
  int measured = 0;                ///< Of these, with a measurement.
  int visible = 0;                 ///< Of these, measured no nearer than 3 sigma in front of the object: not occluded.
  int hits = 0;                    ///< Of these, measured within 3 sigma of the object's surface.
  double visible_log_ratio = 0.0;  ///< The part of log_ratio from visible pixels.

  /// Confidence statistic: nats per visible pixel, 0 when none is.
  double log_ratio_per_visible_pixel() const { return visible > 0 ? visible_log_ratio / visible : 0.0; }
  /// Share of visible pixels that match, 0 when none is.
  double hit_share() const { return visible > 0 ? static_cast<double>(hits) / visible : 0.0; }
  /// Share of the covered pixels that are visible, of those with a measurement.
  double visible_share() const { return measured > 0 ? static_cast<double>(visible) / measured : 0.0; }
};

/// Fills `evidence->tempered` from the rest of it.
void temper(const FrameTerms& frame, const PoseHypothesis& hypothesis, PoseEvidence* evidence);

struct LineariseOptions {
  double gate = 0.012;         ///< m; residuals beyond about half of it lose their weight.
  double min_cosine = 0.1;     ///< Pixels seen at a smaller |n . ray| are left out.
  bool with_evidence = false;  ///< Also fill `evidence`, from the same rendering.
};

/// Gauss-Newton equations of the depth residuals about a pose: minimise 1/2 d'Hd - g'd over d, then
/// X_CO <- box_plus(X_CO, d). In the error coordinates of geometry::box_plus: rotation (rad) in the body frame, then
/// translation (m) in C. In units of information, not tempered: add a prior's, with H and g times
/// tempering(frame.tempering.information, pixels, frame.step).
struct PoseLinearisation {
  geometry::Matrix6d H = geometry::Matrix6d::Zero();
  geometry::Vector6d g = geometry::Vector6d::Zero();
  int pixels = 0;         ///< That took part.
  double weight = 0.0;    ///< Sum of their robust weights, <= pixels.
  double squares = 0.0;   ///< Sum of weight * residual^2, m^2.
  PoseEvidence evidence;  ///< Filled on request.
};

/// Scratch memory of one caller; made by the batch that uses it, grows to the largest task and then stays.
class LikelihoodWorkspace {
 public:
  virtual ~LikelihoodWorkspace() = default;

 protected:
  LikelihoodWorkspace() = default;
};

/// What a batch is and promises.
struct LikelihoodBatchInfo {
  const char* name = "";            ///< "reference", ...
  bool deterministic_bits = false;  ///< Results depend on nothing but the arguments, bit for bit.
  std::size_t good_call = 1;        ///< Hypotheses a call from which on it is at its best.
};

/// Scores hypotheses. Immutable: any number of threads may call, each with a workspace of its own. Each hypothesis's
/// result depends on that hypothesis and the frame alone, whatever it is batched with. Nothing is allocated once a
/// workspace has seen the largest frame and mesh.
class LikelihoodBatch {
 public:
  virtual ~LikelihoodBatch() = default;
  virtual LikelihoodBatchInfo info() const = 0;
  virtual std::unique_ptr<LikelihoodWorkspace> make_workspace() const = 0;

  /// evidences[i] of hypotheses[i]. Triangles nearer than the model's min_depth are not seen.
  virtual void evaluate(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses,
                        LikelihoodWorkspace& workspace, std::span<PoseEvidence> evidences) const = 0;

  /// linearisations[i] of hypotheses[i]: point-to-plane residuals r = n . (p_measured - p_rendered) at each covered
  /// pixel [Chen & Medioni 1992], variance (s d^2)^2, robust weight (1 + (2r / gate)^2)^-2.
  virtual void linearise(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses,
                         const LineariseOptions& options, LikelihoodWorkspace& workspace,
                         std::span<PoseLinearisation> linearisations) const = 0;

  LikelihoodBatch(const LikelihoodBatch&) = delete;
  LikelihoodBatch& operator=(const LikelihoodBatch&) = delete;

 protected:
  LikelihoodBatch() = default;
};

/// Workspaces lent to whoever works now, for parallel loops.
class WorkspacePool {
 public:
  explicit WorkspacePool(const LikelihoodBatch& batch) : batch_(&batch) {}

  /// A workspace that goes back when the loan ends.
  class Loan {
   public:
    explicit Loan(WorkspacePool& pool) : pool_(&pool), workspace_(pool.take()) {}
    ~Loan() { pool_->put(std::move(workspace_)); }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    LikelihoodWorkspace& operator*() const { return *workspace_; }

   private:
    WorkspacePool* pool_;
    std::unique_ptr<LikelihoodWorkspace> workspace_;
  };

 private:
  std::unique_ptr<LikelihoodWorkspace> take();
  void put(std::unique_ptr<LikelihoodWorkspace> workspace);

  const LikelihoodBatch* batch_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<LikelihoodWorkspace>> free_;
};

}  // namespace prescene::rendering
