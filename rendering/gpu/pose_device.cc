// SPDX-License-Identifier: Apache-2.0
#include "pose_device.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>

#include "arithmetic_probe.h"
#include "prescene/core/check.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

constexpr std::size_t kWord = 4;
/// Mesa's software renderers end all loops of a thread after 65535 turns in all, and graphics cards none.
constexpr int kTurnsOfSoftware = 50000;
constexpr int kTurnsOfHardware = 1 << 30;

DeviceMaterial device_material(const PixelClasses& classes) {
  DeviceMaterial material{};
  for (std::size_t i = 0; i < 3; ++i) material.bounds[i] = classes.bounds()[i];
  const PixelClass& constant = classes.of_incidence(0, false);
  material.hit = constant.hit;
  material.occluder = constant.occluder;
  material.behind = constant.behind;
  material.outlier_density = constant.outlier_density;
  for (std::size_t i = 0; i < PixelClasses::kIncidences; ++i) {
    for (const bool outline : {false, true}) {
      const PixelClass& c = classes.of_incidence(i, outline);
      material.classes[2 * i + (outline ? 1 : 0)] = {c.missing, c.returned, c.returned_ratio, c.missing_ratio};
    }
  }
  return material;
}

std::size_t limit(GLenum name) {
  GLint64 value = 0;
  glGetInteger64v(name, &value);
  return static_cast<std::size_t>(std::max<GLint64>(0, value));
}

}  // namespace

PoseTasks::PoseTasks() {
  hypotheses_.reserve(kMost);
  meshes_.reserve(kMost);
  materials_.reserve(kMostMaterials);
  classes_.reserve(kMostMaterials);
}

void PoseTasks::clear() {
  hypotheses_.clear();
  meshes_.clear();
  materials_.clear();
  classes_.clear();
  scratch_words_ = 0;
}

std::optional<std::uint32_t> PoseTasks::material_index(const FrameTerms& frame, const SurfaceMaterial& material) {
  // Nearly always the last one's again.
  for (std::size_t i = materials_.size(); i-- > 0;)
    if (materials_[i] == material) return static_cast<std::uint32_t>(i);
  if (materials_.size() == kMostMaterials) return std::nullopt;
  materials_.push_back(material);
  classes_.push_back(device_material(PixelClasses(frame.model, material, frame.step)));
  return static_cast<std::uint32_t>(materials_.size() - 1);
}

bool PoseTasks::add(const FrameTerms& frame, const PoseHypothesis& hypothesis) {
  if (hypotheses_.size() == kMost) return false;
  const auto material = material_index(frame, *hypothesis.material);
  if (!material) return false;
  const RenderMesh& mesh = *hypothesis.mesh;
  DeviceHypothesis task{};
  const geometry::Matrix3d R = hypothesis.X_CO.rotation.toRotationMatrix();
  const geometry::Vector3d p_O = hypothesis.X_CO.rotation.conjugate() * hypothesis.X_CO.translation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) task.rotation[3 * row + column] = static_cast<float>(R(row, column));
    task.translation[row] = static_cast<float>(hypothesis.X_CO.translation[row]);
    task.from_camera_O[row] = static_cast<float>(p_O[row]);
  }
  task.vertices = static_cast<std::uint32_t>(mesh.vertices.size());
  task.faces = static_cast<std::uint32_t>(mesh.triangles.size());
  task.closed = mesh.closed ? 1 : 0;
  task.material = *material;
  task.color = -1;
  if (hypothesis.color_model >= 0 && !frame.color_ratio.empty()) {
    PRESCENE_CHECK(static_cast<std::size_t>(hypothesis.color_model) < frame.color_ratio.size());
    task.color = kPlainLayers + hypothesis.color_model;
  }
  hypotheses_.push_back(task);
  meshes_.push_back(&mesh);
  scratch_words_ = std::max(scratch_words_, scratch_words(mesh.vertices.size(), mesh.triangles.size()));
  return true;
}

core::Result<std::unique_ptr<PoseDevice>> PoseDevice::make(const ComputeOptions& options) {
  PRESCENE_TRY(auto context, EglContext::make({4, 3}, options.device, "likelihood in compute shaders"));
  std::unique_ptr<PoseDevice> device(new PoseDevice(std::move(context)));
  {
    const EglContext::Turn turn(*device->context_);
    PRESCENE_RETURN_IF_ERROR(turn.status());
    PRESCENE_RETURN_IF_ERROR(device->set_up(options));
  }
  return device;
}

PoseDevice::~PoseDevice() {
  const EglContext::Turn turn(*context_);
  results_.reset();
  scratch_.reset();
  materials_.reset();
  frame_terms_.reset();
  hypotheses_.reset();
  meshes_.reset();
  programs_.reset();
}

core::Status PoseDevice::set_up(const ComputeOptions& options) {
  constexpr std::size_t kSharedBytes = std::size_t{32} << 10;
  if (limit(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE) < kSharedBytes ||
      limit(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS) < kThreads)
    return device_failure("work groups have too little memory or too few threads");
  PRESCENE_RETURN_IF_ERROR(probe_arithmetic(options.division_error));
  programs_ = std::make_unique<GlProgram[]>(4);
  for (const PoseWork& work : {PoseWork{true, false}, PoseWork{false, true}, PoseWork{true, true}})
    PRESCENE_RETURN_IF_ERROR(program(work).compile(pose_program(work, options.division_error)));
  // The programs count words in 32 bits.
  constexpr std::size_t kCountable = std::size_t{1} << 33;
  largest_buffer_ = std::min(limit(GL_MAX_SHADER_STORAGE_BLOCK_SIZE), kCountable);
  GLint groups = 0;
  glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &groups);
  most_groups_ = static_cast<std::size_t>(std::max(groups, 1));
  scratch_bytes_ = std::min(options.scratch_mib << 20, largest_buffer_);
  meshes_ = std::make_unique<DeviceMeshes>(largest_buffer_);
  for (std::unique_ptr<GlBuffer>* buffer : {&hypotheses_, &frame_terms_, &materials_, &scratch_, &results_})
    *buffer = std::make_unique<GlBuffer>();
  hypotheses_->reserve(PoseTasks::kMost * sizeof(DeviceHypothesis));
  materials_->reserve(PoseTasks::kMostMaterials * sizeof(DeviceMaterial));
  results_->reserve(PoseTasks::kMost * sizeof(DeviceResult));
  return gl_errors();
}

bool PoseDevice::takes_frame(const FrameTerms& frame, const PoseWork& work) const {
  const std::size_t layers = kPlainLayers + frame.color_ratio.size();
  // The rows of faces are packed into 16 bits.
  return frame.camera.width >= kNarrowestImage && frame.camera.width <= widest_image(work) &&
         frame.camera.height <= 65535 &&
         sizeof(DeviceFrame) + layers * frame.depth.size() * sizeof(float) <= largest_buffer_;
}

void PoseDevice::set_frame(const FrameTerms& frame, const LineariseOptions& options) {
  const geometry::PinholeCamera& camera = frame.camera;
  const SensorModelOptions& model = frame.model.options();
  frame_.width = camera.width;
  frame_.height = camera.height;
  frame_.fx = static_cast<float>(camera.fx);
  frame_.fy = static_cast<float>(camera.fy);
  frame_.cx = static_cast<float>(camera.cx);
  frame_.cy = static_cast<float>(camera.cy);
  frame_.inverse_fx = static_cast<float>(1.0 / camera.fx);
  frame_.inverse_fy = static_cast<float>(1.0 / camera.fy);
  frame_.max_depth = static_cast<float>(model.max_depth);
  frame_.min_depth = static_cast<float>(model.min_depth);
  const HitPrecision precision(model);
  frame_.precision_scale = precision.scale;
  frame_.precision_per_cosine = precision.per_cosine;
  frame_.least_precision = precision.least;
  frame_.two_over_gate = static_cast<float>(2.0 / options.gate);
  frame_.most_turns = context_->software() ? kTurnsOfSoftware : kTurnsOfHardware;
  frame_.min_cosine = static_cast<float>(options.min_cosine);
  const std::size_t layer = frame.depth.size() * sizeof(float);
  std::size_t at = sizeof(DeviceFrame);
  frame_terms_->reserve(at + (kPlainLayers + frame.color_ratio.size()) * layer);
  frame_terms_->discard();
  const auto send = [&](const geometry::Image<float>& image) {
    PRESCENE_CHECK(image.size() * sizeof(float) == layer);
    frame_terms_->write(at, image.data(), layer);
    at += layer;
  };
  send(frame.depth);
  send(frame.inverse_absent);
  send(frame.absent_missing);
  send(frame.known);
  send(frame.inverse_returns);
  send(frame.inverse_ray);
  for (const geometry::Image<float>& ratio : frame.color_ratio) send(ratio);
}

core::Status PoseDevice::place_meshes(PoseTasks& tasks) {
  const auto too_large = [] {
    return core::resource_exhausted(
        "likelihood in compute shaders: the meshes of one call are more than the device holds: use the processor");
  };
  if (tasks.scratch_words_ * kWord > scratch_bytes_) return too_large();
  const std::size_t turns_before = tasks.scratch_words_ / (2 * kThreads);
  if (turns_before > static_cast<std::size_t>(frame_.most_turns) / 8)
    return core::resource_exhausted(
        "likelihood in compute shaders: a mesh has more vertices and faces than this device's loops have turns: use "
        "the processor");
  // Twice the buffer each time until all are in it, or it is as large as it may be.
  constexpr int kTries = 16;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    std::size_t i = 0;
    for (; i < tasks.size(); ++i) {
      const DeviceMeshes::Place* place = meshes_->find(*tasks.meshes_[i]);
      if (place == nullptr) break;
      tasks.hypotheses_[i].vertices_at = place->vertices_at;
      tasks.hypotheses_[i].faces_at = place->faces_at;
    }
    if (i == tasks.size()) return core::ok_status();
    meshes_->begin_again();
  }
  return too_large();
}

std::size_t PoseDevice::groups_at_once(const PoseTasks& tasks) const {
  const std::size_t one = std::max<std::size_t>(1, tasks.scratch_words_) * kWord;
  return std::clamp<std::size_t>(scratch_bytes_ / one, 1, std::min(most_groups_, PoseTasks::kMost));
}

core::Result<std::span<const DeviceResult>> PoseDevice::dispatch(const PoseTasks& tasks, std::size_t begin,
                                                                 std::size_t count, const PoseWork& work) {
  hypotheses_->write(0, tasks.hypotheses_.data() + begin, count * sizeof(DeviceHypothesis));
  materials_->write(0, tasks.classes_.data(), tasks.classes_.size() * sizeof(DeviceMaterial));
  frame_.scratch_stride = static_cast<std::uint32_t>(tasks.scratch_words_);
  frame_terms_->write(0, &frame_, sizeof(frame_));
  scratch_->reserve(count * std::max<std::size_t>(1, tasks.scratch_words_) * kWord);
  hypotheses_->bind(kHypotheses);
  meshes_->bind(kMeshes);
  frame_terms_->bind(kFrame);
  materials_->bind(kMaterials);
  scratch_->bind(kScratch);
  results_->bind(kResults);
  program(work).dispatch(count);
  ++dispatches_;
  PRESCENE_RETURN_IF_ERROR(gl_errors());
  const auto* results = static_cast<const DeviceResult*>(results_->map(count * sizeof(DeviceResult)));
  if (results == nullptr) return device_failure("what the device computed can't be read");
  return std::span(results, count);
}

}  // namespace prescene::rendering
