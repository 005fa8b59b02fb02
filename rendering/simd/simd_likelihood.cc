// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/simd/simd_likelihood.h"

#include <optional>

#include "cut_mesh.h"
#include "pose_kernels.h"
#include "prescene/core/check.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/sensor/near_plane.h"

namespace prescene::rendering {
namespace {

/// The classes of the last material, which is nearly always the next one's, too.
class LastClasses {
 public:
  const PixelClasses& of(const SensorModel& model, const SurfaceMaterial& material, int step) {
    if (!classes_ || step != step_ || !(material == material_) || !(model.options() == options_)) {
      classes_.emplace(model, material, step);
      step_ = step;
      material_ = material;
      options_ = model.options();
    }
    return *classes_;
  }

 private:
  std::optional<PixelClasses> classes_;
  SensorModelOptions options_;
  SurfaceMaterial material_;
  int step_ = 0;
};

class SimdWorkspace final : public LikelihoodWorkspace {
 public:
  explicit SimdWorkspace(std::unique_ptr<LikelihoodWorkspace> of_reference) : reference(std::move(of_reference)) {}

  PoseTile tile;
  LastClasses classes;
  std::unique_ptr<LikelihoodWorkspace> reference;
};

class SimdLikelihoodBatch final : public LikelihoodBatch {
 public:
  LikelihoodBatchInfo info() const override { return {"simd", true}; }

  std::unique_ptr<LikelihoodWorkspace> make_workspace() const override {
    return std::make_unique<SimdWorkspace>(reference_->make_workspace());
  }

  void evaluate(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, LikelihoodWorkspace& workspace,
                std::span<PoseEvidence> evidences) const override {
    PRESCENE_CHECK(hypotheses.size() == evidences.size());
    auto& scratch = static_cast<SimdWorkspace&>(workspace);
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      switch (way_of(frame, hypotheses[i])) {
        case Way::kUnseen:
          evidences[i] = PoseEvidence{};
          break;
        case Way::kNarrow:
          reference_->evaluate(frame, hypotheses.subspan(i, 1), *scratch.reference, evidences.subspan(i, 1));
          break;
        case Way::kLanes: {
          const PoseProjection seen = drawn(frame, hypotheses[i], scratch);
          evidences[i] = evidence_of(frame, hypotheses[i], seen, scratch);
          break;
        }
      }
    }
  }

  void linearise(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, const LineariseOptions& options,
                 LikelihoodWorkspace& workspace, std::span<PoseLinearisation> linearisations) const override {
    PRESCENE_CHECK(hypotheses.size() == linearisations.size());
    PRESCENE_CHECK(options.gate > 0.0);
    auto& scratch = static_cast<SimdWorkspace&>(workspace);
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      switch (way_of(frame, hypotheses[i])) {
        case Way::kUnseen:
          linearisations[i] = PoseLinearisation{};
          break;
        case Way::kNarrow:
          reference_->linearise(frame, hypotheses.subspan(i, 1), options, *scratch.reference,
                                linearisations.subspan(i, 1));
          break;
        case Way::kLanes: {
          const PoseProjection seen = drawn(frame, hypotheses[i], scratch);
          CameraEquations sums;
          sum_equations(frame, *hypotheses[i].mesh, seen, scratch.tile, options, &sums);
          linearisations[i] = in_body_axes(sums, hypotheses[i].X_CO);
          if (options.with_evidence) linearisations[i].evidence = evidence_of(frame, hypotheses[i], seen, scratch);
          break;
        }
      }
    }
  }

 private:
  enum class Way { kUnseen, kNarrow, kLanes };

  static Way way_of(const FrameTerms& frame, const PoseHypothesis& hypothesis) {
    if (near_plane(hypothesis, frame.model.options()) == NearPlane::kLeavesNothing) return Way::kUnseen;
    return frame.camera.width < kBlock ? Way::kNarrow : Way::kLanes;
  }

  static PoseProjection drawn(const FrameTerms& frame, const PoseHypothesis& hypothesis, SimdWorkspace& scratch) {
    const RenderMesh& mesh = *hypothesis.mesh;
    const PoseProjection seen(hypothesis.X_CO, frame.camera);
    scratch.tile.reserve(mesh, frame.camera.width, frame.camera.height);
    if (near_plane(hypothesis, frame.model.options()) == NearPlane::kMayCut) {
      draw_cut(mesh, seen, nearest_drawn(frame.model.options()), &scratch.tile);
    } else {
      draw(mesh, seen, &scratch.tile);
    }
    return seen;
  }

  static PoseEvidence evidence_of(const FrameTerms& frame, const PoseHypothesis& hypothesis, const PoseProjection& seen,
                                  SimdWorkspace& scratch) {
    EvidenceTerms terms;
    terms.frame = &frame;
    terms.classes = &scratch.classes.of(frame.model, *hypothesis.material, frame.step);
    if (hypothesis.color_model >= 0 && !frame.color_ratio.empty()) {
      PRESCENE_CHECK(static_cast<std::size_t>(hypothesis.color_model) < frame.color_ratio.size());
      terms.color_ratio = &frame.color_ratio[static_cast<std::size_t>(hypothesis.color_model)];
    }
    PoseEvidence evidence;
    sum_evidence(terms, seen, scratch.tile, &evidence);
    temper(frame, hypothesis, &evidence);
    return evidence;
  }

  std::unique_ptr<LikelihoodBatch> reference_ = make_reference_likelihood_batch();
};

}  // namespace

std::unique_ptr<LikelihoodBatch> make_simd_likelihood_batch() { return std::make_unique<SimdLikelihoodBatch>(); }

}  // namespace prescene::rendering
