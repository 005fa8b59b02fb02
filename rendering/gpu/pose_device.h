// SPDX-License-Identifier: Apache-2.0
// The device's side of the likelihood: a context, its programs and its memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "device_meshes.h"
#include "gl_buffer.h"
#include "pose_shader.h"
#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/gpu/egl_context.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {

/// Hypotheses of one dispatch as they are sent; reserved once.
class PoseTasks {
 public:
  static constexpr std::size_t kMost = 4096;
  static constexpr std::size_t kMostMaterials = 256;

  PoseTasks();

  void clear();
  std::size_t size() const { return hypotheses_.size(); }
  /// False when it is full; it then has to be run first.
  bool add(const FrameTerms& frame, const PoseHypothesis& hypothesis);

 private:
  friend class PoseDevice;

  std::optional<std::uint32_t> material_index(const FrameTerms& frame, const SurfaceMaterial& material);

  std::vector<DeviceHypothesis> hypotheses_;
  std::vector<const RenderMesh*> meshes_;  ///< One a hypothesis.
  std::vector<SurfaceMaterial> materials_;
  std::vector<DeviceMaterial> classes_;
  std::size_t scratch_words_ = 0;  ///< Of the hypothesis that needs most.
};

/// One device. Turns at the context are taken by the caller.
class PoseDevice {
 public:
  static core::Result<std::unique_ptr<PoseDevice>> make(const ComputeOptions& options);
  ~PoseDevice();
  PoseDevice(const PoseDevice&) = delete;
  PoseDevice& operator=(const PoseDevice&) = delete;

  EglContext& context() { return *context_; }

  /// Whether images of this size can be worked on.
  bool takes_frame(const FrameTerms& frame, const PoseWork& work) const;
  /// Sends what is common to the tasks that follow.
  void set_frame(const FrameTerms& frame, const LineariseOptions& options);

  /// Runs the tasks, in as many dispatches as memory asks for, and calls take(i, result) for each. kResourceExhausted
  /// when meshes are larger than the device's memory; other failures mean that the context is lost.
  template <class Take>
  core::Status run(PoseTasks& tasks, const PoseWork& work, const Take& take) {
    PRESCENE_RETURN_IF_ERROR(place_meshes(tasks));
    for (std::size_t begin = 0; begin < tasks.size();) {
      const std::size_t count = std::min(tasks.size() - begin, groups_at_once(tasks));
      PRESCENE_TRY(const std::span<const DeviceResult> results, dispatch(tasks, begin, count, work));
      for (std::size_t i = 0; i < count; ++i) take(begin + i, results[i]);
      if (!results_->unmap()) return device_failure("what the device computed was lost while it was read");
      begin += count;
    }
    return core::ok_status();
  }
  std::uint64_t dispatches() const { return dispatches_; }

 private:
  explicit PoseDevice(std::unique_ptr<EglContext> context) : context_(std::move(context)) {}
  core::Status set_up(const ComputeOptions& options);
  core::Status place_meshes(PoseTasks& tasks);
  std::size_t groups_at_once(const PoseTasks& tasks) const;
  core::Result<std::span<const DeviceResult>> dispatch(const PoseTasks& tasks, std::size_t begin, std::size_t count,
                                                       const PoseWork& work);
  GlProgram& program(const PoseWork& work) { return programs_[(work.evidence ? 1 : 0) + (work.equations ? 2 : 0)]; }

  std::unique_ptr<EglContext> context_;
  std::size_t largest_buffer_ = 0;  ///< Bytes.
  std::size_t most_groups_ = 0;
  std::size_t scratch_bytes_ = 0;
  DeviceFrame frame_{};
  std::uint64_t dispatches_ = 0;
  // Made and freed while the context is current.
  std::unique_ptr<GlProgram[]> programs_;
  std::unique_ptr<DeviceMeshes> meshes_;
  std::unique_ptr<GlBuffer> hypotheses_, frame_terms_, materials_, scratch_, results_;
};

}  // namespace prescene::rendering
