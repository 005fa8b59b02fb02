// SPDX-License-Identifier: Apache-2.0
// Reference backends and one frame of a simulated scene, ready for the operators.
#pragma once

#include <memory>

#include "prescene/core/check.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "simulated_sequence.h"

namespace prescene::filter_tests {

struct Backends {
  explicit Backends(int threads_wanted = 2)
      : threads(threads_wanted),
        likelihood(rendering::make_reference_likelihood_batch()),
        renderer(rendering::make_reference_renderer()),
        search(*likelihood, threads),
        tools{&search, renderer.get(), &meshes} {}

  core::ThreadPool threads;
  std::unique_ptr<rendering::LikelihoodBatch> likelihood;
  std::unique_ptr<rendering::Renderer> renderer;
  MeshCache meshes;
  PoseSearch search;
  FilterTools tools;

  ParticleFilter make_filter(FilterSettings settings = {}, simulation::SimulatorFactory simulators = {}) {
    return ParticleFilter(*likelihood, *renderer, threads, std::move(settings), std::move(simulators));
  }

  FilterFrame frame_of(const std::shared_ptr<const belief::Scene>& scene, const belief::Observation& observation,
                       std::span<const Pose> X_WG = {}) {
    FilterFrame frame;
    FrameCache cache;
    const core::Status status = prepare_frame(scene, observation, X_WG, {}, {}, tools, cache, &frame);
    PRESCENE_CHECK_MSG(status.ok(), status.message());
    return frame;
  }
};

/// A still scene of these models at these poses.
inline SimulatedSequence still_sequence(std::vector<belief::ObjectModel> models, const std::vector<Pose>& X_WO,
                                        double shift = 0.005, double turn = 0.05) {
  SimulatedSequence sequence;
  sequence.scene = table_scene(std::move(models), X_WO, shift, turn);
  sequence.camera = test_camera();
  sequence.X_WC = test_camera_pose();
  for (const Pose& pose : X_WO) sequence.objects.push_back(fixed(pose));
  return sequence;
}

}  // namespace prescene::filter_tests
