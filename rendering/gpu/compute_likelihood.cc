// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/compute_likelihood.h"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "pose_device.h"
#include "prescene/core/check.h"
#include "prescene/rendering/portable_math.h"
#include "prescene/rendering/sensor/camera_equations.h"
#include "prescene/rendering/sensor/near_plane.h"

namespace prescene::rendering {
namespace {

constexpr int kFailuresInARow = 3;

class ComputeWorkspace final : public LikelihoodWorkspace {
 public:
  explicit ComputeWorkspace(std::unique_ptr<LikelihoodWorkspace> of_processor) : processor(std::move(of_processor)) {
    waiting.reserve(PoseTasks::kMost);
    cut.reserve(PoseTasks::kMost);
  }

  PoseTasks tasks;
  std::vector<std::size_t> waiting;  ///< Which hypotheses the tasks are.
  std::vector<std::size_t> cut;      ///< Hypotheses that the device did not finish.
  std::unique_ptr<LikelihoodWorkspace> processor;
  // The largest that the processor's workspace has seen.
  std::size_t pixels = 0, vertices = 0, faces = 0;
};

PoseEvidence evidence_of(const DeviceResult& result, const FrameTerms& frame, const PoseHypothesis& hypothesis) {
  const auto log_of = [&](int kind) {
    return portable_log(result.products[kind]) + static_cast<double>(result.exponents[kind]) * 0.6931471805599453;
  };
  PoseEvidence evidence;
  evidence.in_view = result.in_view;
  evidence.covered = result.covered;
  evidence.measured = result.measured;
  evidence.visible = result.visible;
  evidence.hits = result.hits;
  evidence.visible_log_ratio = log_of(0);
  evidence.log_ratio = evidence.visible_log_ratio + log_of(1) + log_of(2);
  temper(frame, hypothesis, &evidence);
  return evidence;
}

PoseLinearisation linearisation_of(const DeviceResult& result, const PoseHypothesis& hypothesis) {
  CameraEquations sums;
  std::copy(result.sums, result.sums + 21, sums.H);
  std::copy(result.sums + 21, result.sums + 27, sums.g);
  sums.pixels = result.equation_pixels;
  sums.weight = result.sums[27];
  sums.squares = result.sums[28];
  return in_body_axes(sums, hypothesis.X_CO);
}

class ComputeLikelihood final : public ComputeLikelihoodBatch {
 public:
  ComputeLikelihood(std::unique_ptr<LikelihoodBatch> processor, const ComputeOptions& options,
                    std::unique_ptr<PoseDevice> device)
      : processor_(std::move(processor)), options_(options), device_(std::move(device)) {
    health_.device = device_->context().device();
    health_.software = device_->context().software();
  }

  LikelihoodBatchInfo info() const override {
    return {"compute", processor_->info().deterministic_bits, options_.least_hypotheses};
  }

  ComputeHealth health() const override {
    const std::lock_guard lock(mutex_);
    return health_;
  }

  std::unique_ptr<LikelihoodWorkspace> make_workspace() const override {
    return std::make_unique<ComputeWorkspace>(processor_->make_workspace());
  }

  void evaluate(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, LikelihoodWorkspace& workspace,
                std::span<PoseEvidence> evidences) const override {
    PRESCENE_CHECK(hypotheses.size() == evidences.size());
    auto& scratch = static_cast<ComputeWorkspace&>(workspace);
    share_out(
        frame, hypotheses, {true, false}, {}, scratch, [&](std::size_t i) { evidences[i] = PoseEvidence{}; },
        [&](std::size_t i, std::size_t count) {
          processor_->evaluate(frame, hypotheses.subspan(i, count), *scratch.processor, evidences.subspan(i, count));
        },
        [&](std::size_t i, const DeviceResult& result) { evidences[i] = evidence_of(result, frame, hypotheses[i]); });
  }

  void linearise(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, const LineariseOptions& options,
                 LikelihoodWorkspace& workspace, std::span<PoseLinearisation> linearisations) const override {
    PRESCENE_CHECK(hypotheses.size() == linearisations.size());
    PRESCENE_CHECK(options.gate > 0.0);
    auto& scratch = static_cast<ComputeWorkspace&>(workspace);
    share_out(
        frame, hypotheses, {options.with_evidence, true}, options, scratch,
        [&](std::size_t i) { linearisations[i] = PoseLinearisation{}; },
        [&](std::size_t i, std::size_t count) {
          processor_->linearise(frame, hypotheses.subspan(i, count), options, *scratch.processor,
                                linearisations.subspan(i, count));
        },
        [&](std::size_t i, const DeviceResult& result) {
          linearisations[i] = linearisation_of(result, hypotheses[i]);
          if (options.with_evidence) linearisations[i].evidence = evidence_of(result, frame, hypotheses[i]);
        });
  }

 private:
  /// Calls unseen(i), processor(i, count) or device(i, result) for each hypothesis.
  template <class Unseen, class Processor, class Device>
  void share_out(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, const PoseWork& work,
                 const LineariseOptions& options, ComputeWorkspace& scratch, const Unseen& unseen,
                 const Processor& processor, const Device& device) const {
    std::size_t done = 0;
    if (hypotheses.size() >= options_.least_hypotheses && !hypotheses.empty()) {
      warm(frame, hypotheses, scratch);
      std::size_t on_processor = 0;
      for (std::size_t i = 0; i < hypotheses.size(); ++i) {
        const NearPlane plane = near_plane(hypotheses[i], frame.model.options());
        if (plane == NearPlane::kLeavesNothing) unseen(i);
        // Cutting faces is rare, and much code.
        if (plane != NearPlane::kMayCut) continue;
        processor(i, 1);
        ++on_processor;
      }
      const std::lock_guard lock(mutex_);
      // A second try on a context made anew.
      for (int attempt = 0; attempt < 2 && has_device() && device_->takes_frame(frame, work); ++attempt) {
        const core::Status status = on_device(frame, hypotheses, work, options, scratch, processor, device, &done);
        if (status.ok()) {
          failures_ = 0;
          health_.on_processor += on_processor;
          return;
        }
        if (!failed(status)) break;
      }
      health_.on_processor += hypotheses.size() - done;
    } else {
      const std::lock_guard lock(mutex_);
      health_.on_processor += hypotheses.size();
    }
    if (done < hypotheses.size()) processor(done, hypotheses.size() - done);
  }

  /// Shows the processor whatever is larger than before: its memory has to be there when the device fails.
  void warm(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, ComputeWorkspace& scratch) const {
    for (const PoseHypothesis& h : hypotheses) {
      if (frame.depth.size() <= scratch.pixels && h.mesh->vertices.size() <= scratch.vertices &&
          h.mesh->triangles.size() <= scratch.faces)
        continue;
      scratch.pixels = std::max(scratch.pixels, frame.depth.size());
      scratch.vertices = std::max(scratch.vertices, h.mesh->vertices.size());
      scratch.faces = std::max(scratch.faces, h.mesh->triangles.size());
      PoseEvidence ignored;
      processor_->evaluate(frame, std::span(&h, 1), *scratch.processor, std::span(&ignored, 1));
    }
  }

  /// `done` counts the hypotheses, from the first on, that need no second try.
  template <class Processor, class Device>
  core::Status on_device(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, const PoseWork& work,
                         const LineariseOptions& options, ComputeWorkspace& scratch, const Processor& processor,
                         const Device& device, std::size_t* done) const {
    const EglContext::Turn turn(device_->context());
    PRESCENE_RETURN_IF_ERROR(turn.status());
    device_->set_frame(frame, options);
    for (std::size_t next = *done; next < hypotheses.size();) {
      scratch.tasks.clear();
      scratch.waiting.clear();
      for (; next < hypotheses.size(); ++next) {
        if (near_plane(hypotheses[next], frame.model.options()) != NearPlane::kLeavesAll) continue;
        if (!scratch.tasks.add(frame, hypotheses[next])) break;
        scratch.waiting.push_back(next);
      }
      const std::uint64_t dispatches = device_->dispatches();
      scratch.cut.clear();
      PRESCENE_RETURN_IF_ERROR(device_->run(scratch.tasks, work, [&](std::size_t task, const DeviceResult& result) {
        if (result.complete == 0) {
          scratch.cut.push_back(scratch.waiting[task]);
        } else {
          device(scratch.waiting[task], result);
        }
      }));
      PRESCENE_RETURN_IF_ERROR(turn.reset_status());
      for (const std::size_t i : scratch.cut) processor(i, 1);
      health_.dispatches += device_->dispatches() - dispatches;
      health_.on_device += scratch.tasks.size() - scratch.cut.size();
      health_.on_processor += scratch.cut.size();
      *done = next;
    }
    return core::ok_status();
  }

  /// Makes a device when there is none.
  bool has_device() const {
    if (device_ != nullptr) return true;
    if (health_.given_up) return false;
    auto made = PoseDevice::make(options_);
    if (!made) {
      failed(made.status());
      return false;
    }
    device_ = *std::move(made);
    health_.device = device_->context().device();
    health_.software = device_->context().software();
    return true;
  }
  /// Whether another try makes sense.
  bool failed(const core::Status& status) const {
    health_.last_failure = status;
    if (status.code() == core::StatusCode::kResourceExhausted) return false;  // the device is well
    if (device_ != nullptr) ++health_.lost;
    device_.reset();
    health_.given_up = ++failures_ >= kFailuresInARow;
    return true;
  }

  std::unique_ptr<LikelihoodBatch> processor_;
  ComputeOptions options_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::unique_ptr<PoseDevice> device_;
  mutable ComputeHealth health_;
  mutable int failures_ = 0;  ///< In a row.
};

}  // namespace

bool compute_compiled_in() { return true; }

core::Result<std::unique_ptr<ComputeLikelihoodBatch>> make_compute_likelihood_batch(
    std::unique_ptr<LikelihoodBatch> processor, const ComputeOptions& options) {
  PRESCENE_CHECK(processor != nullptr);
  PRESCENE_TRY(auto device, PoseDevice::make(options));
  return std::unique_ptr<ComputeLikelihoodBatch>(
      std::make_unique<ComputeLikelihood>(std::move(processor), options, std::move(device)));
}

}  // namespace prescene::rendering
