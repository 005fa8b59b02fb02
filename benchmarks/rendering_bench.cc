// SPDX-License-Identifier: Apache-2.0
// What a pose hypothesis costs at 80 x 60, against the baseline of casting one ray by Embree at each pixel that the
// object covers, and what a full image costs on either backend.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/egl/egl_renderer.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/simulated_camera.h"
#include "prescene/tests/peers/ray_caster.h"

namespace prescene {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using namespace rendering;

/// A bottle of some 400 triangles before a wall, as a simulated camera sees it, and scattered poses near the truth.
struct Scene {
  geometry::PinholeCamera camera = {640, 480, 600.0, 600.0, 319.5, 239.5};
  geometry::TriangleMesh triangles = geometry::make_lathe({{0.03, 0.0},
                                                           {0.035, 0.02},
                                                           {0.035, 0.06},
                                                           {0.035, 0.10},
                                                           {0.033, 0.13},
                                                           {0.02, 0.16},
                                                           {0.013, 0.18},
                                                           {0.013, 0.21}},
                                                          25);
  MeshHandle mesh = make_render_mesh(triangles);
  Pose X_CO = Pose::from_translation({0.0, 0.0, 0.9});
  RenderScene scene;
  SurfaceMaterial material;
  FrameTerms frame;
  std::vector<PoseHypothesis> hypotheses;

  Scene() {
    X_CO.rotation = geometry::exp_rotation({1.2, 0.3, 0.2});
    const MeshHandle wall = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{3.0, 3.0, 0.1}}));
    scene.instances = {{mesh, X_CO, material, false}, {wall, Pose::from_translation({0, 0, 1.2}), material, false}};
    RenderOptions options;
    options.normals = true;
    RenderedView view;
    if (!make_reference_renderer()->render(scene, camera, Pose::identity(), options, &view).ok()) std::abort();
    geometry::DepthImage depth;
    SimulatedCamera(SensorModel{}, {})
        .sample(scene, view, nullptr, camera, Pose::identity(), core::RandomStream(1, core::Purpose::kSensorNoise), 0,
                &depth, nullptr);
    const SupportRegion support = {{Vector3d(0, 0, -1), 1.15}, {}};
    FrameTermsInput input;
    input.camera = camera;
    input.depth = depth.view();
    input.supports = std::span(&support, 1);
    if (!make_frame_terms(input, {}, SensorModel{}, &frame).ok()) std::abort();
    core::RandomStream stream(2, core::Purpose::kTest);
    for (int i = 0; i < 500; ++i) {
      geometry::Vector6d d;
      d << 0.3 * geometry::normal_vector(stream), 0.03 * geometry::normal_vector(stream);
      hypotheses.push_back({mesh.get(), geometry::box_plus(X_CO, d), &material});
    }
  }
};

const Scene& scene() {
  static const Scene kScene;
  return kScene;
}

void set_counters(benchmark::State& state) {
  state.counters["triangles"] = static_cast<double>(scene().mesh->triangles.size());
  state.counters["us_per_pose"] =
      benchmark::Counter(static_cast<double>(scene().hypotheses.size()) * 1e-6,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void evaluate(benchmark::State& state) {
  const auto batch = make_reference_likelihood_batch();
  const auto workspace = batch->make_workspace();
  std::vector<PoseEvidence> evidences(scene().hypotheses.size());
  for (auto _ : state) batch->evaluate(scene().frame, scene().hypotheses, *workspace, evidences);
  double pixels = 0.0;
  for (const PoseEvidence& evidence : evidences) pixels += evidence.in_view;
  set_counters(state);
  state.counters["pixels_per_pose"] = pixels / static_cast<double>(evidences.size());
}
BENCHMARK(evaluate)->Unit(benchmark::kMillisecond);

void linearise(benchmark::State& state) {
  const auto batch = make_reference_likelihood_batch();
  const auto workspace = batch->make_workspace();
  std::vector<PoseLinearisation> linearisations(scene().hypotheses.size());
  for (auto _ : state) batch->linearise(scene().frame, scene().hypotheses, {}, *workspace, linearisations);
  set_counters(state);
}
BENCHMARK(linearise)->Unit(benchmark::kMillisecond);

/// The baseline: only the rays, through the bounding box of what the object covers; no likelihood.
void cast_rays(benchmark::State& state) {
  tests::RayCaster rays;
  rays.add(scene().triangles);
  const geometry::PinholeCamera& camera = scene().frame.camera;
  for (auto _ : state) {
    for (const PoseHypothesis& h : scene().hypotheses) {
      Eigen::AlignedBox2d box;
      for (const Vector3d& p : scene().triangles.vertices) box.extend(camera.project(h.X_CO * p));
      const Pose X_OC = h.X_CO.inverse();
      const auto x_end = static_cast<int>(std::min<double>(camera.width - 1, box.max().x()));
      const auto y_end = static_cast<int>(std::min<double>(camera.height - 1, box.max().y()));
      for (int y = static_cast<int>(std::max(0.0, std::ceil(box.min().y()))); y <= y_end; ++y)
        for (int x = static_cast<int>(std::max(0.0, std::ceil(box.min().x()))); x <= x_end; ++x)
          benchmark::DoNotOptimize(rays.cast(X_OC.translation, X_OC.rotation * camera.unproject(x, y, 1.0), 0.3, 2.5));
    }
  }
  set_counters(state);
}
BENCHMARK(cast_rays)->Unit(benchmark::kMillisecond);

void full_image(benchmark::State& state, Renderer& renderer) {
  RenderedView view;
  for (auto _ : state)
    if (!renderer.render(scene().scene, scene().camera, Pose::identity(), {}, &view).ok()) std::abort();
}

void reference_image(benchmark::State& state) {
  const auto renderer = make_reference_renderer();
  full_image(state, *renderer);
}
BENCHMARK(reference_image)->Unit(benchmark::kMillisecond);

void egl_image(benchmark::State& state) {
  const auto renderer = make_egl_renderer();
  if (!renderer) {
    state.SkipWithError(renderer.status().message().c_str());
    return;
  }
  full_image(state, **renderer);
}
BENCHMARK(egl_image)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace prescene

BENCHMARK_MAIN();
