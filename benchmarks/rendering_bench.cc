// SPDX-License-Identifier: Apache-2.0
// What a pose hypothesis costs: weights and Gauss-Newton steps in vector instructions, against the reference backend
// and against a draw and a read-back of the graphics library; and in compute shaders on every device that EGL lists.
// One thread, scattered poses near the truth.
//
//   bench_rendering [--quick] [--benchmark_out=PATH]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/arguments.h"
#include "benchmarks/processor_time.h"
#include "benchmarks/report.h"
#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/gpu/egl_renderer.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/rendering/simd/simd_likelihood.h"
#include "rendering_tracking.h"
#include "tests/peers/ray_packets.h"
#include "tests/support/target_test.h"

namespace prescene::benchmarks {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using namespace rendering;

constexpr int kHypotheses = 500;

/// A vase of `rings` times `segments` times two triangles.
geometry::TriangleMesh vase(int rings, int segments, double size) {
  std::vector<Eigen::Vector2d> profile = {{0.0, 0.0}};
  for (int i = 0; i < rings; ++i) {
    const double t = static_cast<double>(i) / (rings - 1);
    profile.emplace_back(size * (0.175 + 0.05 * std::sin(3.0 * t)), size * t);
  }
  profile.emplace_back(0.0, size);
  return geometry::make_lathe(profile, segments);
}

/// The vase before a wall, as a simulated camera of 640 x 480 sees it.
struct Scene {
  Scene(const geometry::TriangleMesh& triangles, double size, double distance, int width)
      : mesh(make_render_mesh(triangles)) {
    X_CO.rotation = geometry::exp_rotation({1.2, 0.3, 0.2});
    X_CO.translation = Vector3d(0.0, 0.0, distance) - X_CO.rotation * Vector3d(0.0, 0.0, 0.5 * size);
    const MeshHandle wall = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{4.0, 4.0, 0.1}}));
    scene.instances = {{mesh, X_CO, material}, {wall, Pose::from_translation({0.0, 0.0, distance + 0.6}), material}};
    RenderOptions options;
    options.normals = true;
    RenderedView view;
    PRESCENE_CHECK(make_reference_renderer()->render(scene, camera, Pose::identity(), options, &view).ok());
    SimulatedCamera(SensorModel{}, {})
        .sample(scene, view, nullptr, camera, Pose::identity(), core::RandomStream(1, core::Purpose::kSensorNoise), 0,
                &depth, nullptr);
    support = {{Vector3d(0.0, 0.0, -1.0), distance + 0.55}, {}};
    make_terms(width);
    core::RandomStream stream(2, core::Purpose::kTest);
    for (int i = 0; i < kHypotheses; ++i) {
      geometry::Vector6d d;
      d << 0.1 * geometry::normal_vector(stream), 0.01 * geometry::normal_vector(stream);
      hypotheses.push_back({mesh.get(), geometry::box_plus(X_CO, d), &material});
    }
  }

  void make_terms(int width) {
    FrameTermsInput input;
    input.camera = camera;
    input.depth = depth.view();
    input.supports = std::span(&support, 1);
    FrameTermsOptions options;
    options.target_width = width;
    PRESCENE_CHECK(make_frame_terms(input, options, SensorModel{}, &frame).ok());
  }

  geometry::PinholeCamera camera = {640, 480, 600.0, 600.0, 319.5, 239.5};
  MeshHandle mesh;
  Pose X_CO;
  SurfaceMaterial material;
  RenderScene scene;
  geometry::DepthImage depth;
  SupportRegion support;
  FrameTerms frame;
  std::vector<PoseHypothesis> hypotheses;
};

struct Costs {
  double weight = 0.0;  ///< s a hypothesis
  double step = 0.0;
  double pixels = 0.0;  ///< That it covers.
};

Costs costs_of(const LikelihoodBatch& batch, const Scene& scene, int rounds) {
  const auto workspace = batch.make_workspace();
  std::vector<PoseEvidence> evidences(scene.hypotheses.size());
  std::vector<PoseLinearisation> equations(scene.hypotheses.size());
  Costs costs;
  costs.weight =
      cost_of([&] { batch.evaluate(scene.frame, scene.hypotheses, *workspace, evidences); }, rounds) / kHypotheses;
  costs.step =
      cost_of([&] { batch.linearise(scene.frame, scene.hypotheses, {}, *workspace, equations); }, rounds) / kHypotheses;
  for (const PoseEvidence& evidence : evidences) costs.pixels += evidence.in_view;
  costs.pixels /= kHypotheses;
  return costs;
}

/// One draw and read-back of the reduced image on the graphics library, s; nothing where there is none.
std::optional<double> drawn_and_read(const Scene& scene, std::string* device) {
  // The software renderer alone on this thread.
  setenv("LP_NUM_THREADS", "0", 1);
  const auto renderer = make_egl_renderer();
  if (!renderer) return std::nullopt;
  *device = (*renderer)->info().device;
  RenderScene alone;
  alone.instances = {scene.scene.instances[0]};
  RenderedView view;
  return cost_of(
      [&] { PRESCENE_CHECK((*renderer)->render(alone, scene.frame.camera, Pose::identity(), {}, &view).ok()); }, 2);
}

/// What hypotheses cost on one graphics device.
struct DeviceCosts {
  GraphicsDevice device;
  std::string name;       ///< The driver's.
  std::size_t calls = 0;  ///< Hypotheses a call.
  double weight = 0.0;    ///< s a hypothesis, by the clock: the least of the rounds.
  double step = 0.0;
  double on_device = 0.0;  ///< Share; the rest went to the processor.
};

/// Each device that EGL lists and that has compute shaders. `why_not` of the others.
std::vector<DeviceCosts> costs_on_devices(const Scene& scene, int rounds, std::string* why_not) {
  std::vector<DeviceCosts> all;
  for (const GraphicsDevice& device : graphics_devices()) {
    ComputeOptions options;
    options.device.device = device.index;
    const auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options);
    if (!batch) {
      *why_not += batch.status().message() + "; ";
      continue;
    }
    DeviceCosts costs{device, (*batch)->health().device};
    // Enough to fill a card; the software renderer has the processor's number.
    const std::size_t copies = device.software ? 1 : 16;
    std::vector<PoseHypothesis> hypotheses;
    for (std::size_t i = 0; i < copies; ++i)
      hypotheses.insert(hypotheses.end(), scene.hypotheses.begin(), scene.hypotheses.end());
    costs.calls = hypotheses.size();
    const auto workspace = (*batch)->make_workspace();
    std::vector<PoseEvidence> evidences(hypotheses.size());
    std::vector<PoseLinearisation> equations(hypotheses.size());
    const auto least_of = [&](const std::function<void()>& work) {
      work();
      double least = 1e30;
      for (int round = 0; round < (device.software ? 1 : rounds); ++round) {
        const core::Stopwatch watch;
        work();
        least = std::min(least, watch.seconds());
      }
      return least / static_cast<double>(hypotheses.size());
    };
    costs.weight = least_of([&] { (*batch)->evaluate(scene.frame, hypotheses, *workspace, evidences); });
    costs.step = least_of([&] { (*batch)->linearise(scene.frame, hypotheses, {}, *workspace, equations); });
    const ComputeHealth health = (*batch)->health();
    costs.on_device =
        static_cast<double>(health.on_device) / static_cast<double>(health.on_device + health.on_processor);
    all.push_back(costs);
  }
  return all;
}

/// Rays of a hypothesis through the pixels of its bounding box, s: the mean over all. No likelihood.
double cast_as_rays(const Scene& scene, const geometry::TriangleMesh& mesh) {
  const tests::RayPackets rays(mesh);
  const auto renderer = make_reference_renderer();
  std::vector<tests::PixelWindow> windows;
  RenderScene alone;
  for (const PoseHypothesis& hypothesis : scene.hypotheses) {
    alone.instances = {{scene.mesh, hypothesis.X_CO, scene.material}};
    RenderedView view;
    PRESCENE_CHECK(renderer->render(alone, scene.frame.camera, Pose::identity(), {}, &view).ok());
    tests::PixelWindow window{view.depth.width(), view.depth.height(), -1, -1};
    for (int y = 0; y < view.depth.height(); ++y) {
      for (int x = 0; x < view.depth.width(); ++x) {
        if (view.depth(x, y) == 0.0f) continue;
        window = {std::min(window.x_first, x), std::min(window.y_first, y), std::max(window.x_last, x),
                  std::max(window.y_last, y)};
      }
    }
    windows.push_back(window);
  }
  geometry::DepthImage depth(scene.frame.camera.width, scene.frame.camera.height);
  return cost_of(
             [&] {
               for (std::size_t i = 0; i < windows.size(); ++i)
                 rays.depths(scene.frame.camera, scene.hypotheses[i].X_CO, windows[i], &depth);
             },
             2) /
         kHypotheses;
}

Target rate(const std::string& work, double must, double aim, double seconds) {
  Target target;
  target.work = work;
  target.must = at_least(must);
  target.aim = at_least(aim);
  target.reached = 1.0 / seconds;
  target.unit = "1/s";
  target.n = kHypotheses;
  target.baseline = "none, one thread";
  return target;
}

Target open(const std::string& work, std::optional<double> must, double aim, const std::string& why) {
  Target target;
  target.work = work;
  if (must) target.must = at_least(*must);
  target.aim = at_least(aim);
  target.unit = "x";
  target.why = why;
  return target;
}

int run(int rounds, const std::string& out) {
  Report report("rendering", best_simd_target());
  report.note("A vase before a wall, simulated camera; 500 poses of 6 degrees and 1 cm of scatter, one thread.");
  Table table{"costs", {"scene", "backend", "triangles", "pixels", "weight us", "Gauss-Newton us"}, {}};
  const auto measured = [&](const std::string& name, const std::string& backend, const Scene& scene,
                            const LikelihoodBatch& batch) {
    const Costs costs = costs_of(batch, scene, rounds);
    table.rows.push_back({name, backend, static_cast<std::int64_t>(scene.mesh->triangles.size()), costs.pixels,
                          1e6 * costs.weight, 1e6 * costs.step});
    return costs;
  };
  const auto reference = make_reference_likelihood_batch();
  const auto simd = make_simd_likelihood_batch();
  const bool wide = best_simd_target().starts_with("AVX3");
  const std::string best = "simd, " + best_simd_target();

  const geometry::TriangleMesh large_mesh = vase(51, 100, 0.55);
  Scene large(large_mesh, 0.55, 0.8, 160);
  const Costs of_large = measured("10k triangles, 160 x 120", best, large, *simd);
  const Costs slow = measured("10k triangles, 160 x 120", "reference", large, *reference);
  std::string device = "none";
  const std::optional<double> drawn = drawn_and_read(large, &device);
  Target against_draws = open("10k triangles: one draw and read-back a hypothesis", 40, 80, "no EGL device here");
  if (drawn) {
    against_draws.reached = *drawn / of_large.weight;
    against_draws.n = kHypotheses;
    against_draws.baseline = device + ", one thread, depth and labels read back, no likelihood";
    against_draws.why.clear();
  }
  report.add(std::move(against_draws));
  Target against_rays = open("10k triangles: rays of Embree", 8, 15, "");
  against_rays.reached = cast_as_rays(large, large_mesh) / of_large.weight;
  against_rays.n = kHypotheses;
  against_rays.baseline =
      "Embree 3, coherent packets of 16, one thread, pixels of the bounding box; the likelihood is not counted";
  report.add(std::move(against_rays));
  report.add(rate("10k triangles, 160 x 120, hypotheses, " + best_simd_target(), wide ? 25e3 : 15e3, wide ? 60e3 : 30e3,
                  of_large.weight));
  if (wide) {
    const collision::UseTarget narrower(HWY_AVX2);
    report.add(rate("10k triangles, 160 x 120, hypotheses, AVX2", 15e3, 30e3,
                    measured("10k triangles, 160 x 120", "simd, AVX2", large, *simd).weight));
  }
  Scene middle(vase(15, 50, 0.3), 0.3, 1.0, 160);
  measured("1500 triangles, 160 x 120", "reference", middle, *reference);
  report.add(rate("1500 triangles, 40 x 40 pixels, hypotheses", 150e3, 400e3,
                  measured("1500 triangles, 160 x 120", best, middle, *simd).weight));
  Scene small(vase(7, 25, 0.2), 0.2, 1.0, 80);
  measured("400 triangles, 80 x 60", "reference", small, *reference);
  const Costs of_small = measured("400 triangles, 80 x 60", best, small, *simd);
  report.add(rate("400 triangles, 80 x 60, hypotheses", 250e3, 600e3, of_small.weight));
  report.add(rate("400 triangles, 80 x 60, Gauss-Newton steps", 100e3, 300e3, of_small.step));
  const TrackingCosts of_tracking = tracking_costs(*simd, rounds);
  Target tracking;
  tracking.work = "5 objects of 10k triangles at 30 Hz, share of a core";
  tracking.better = Better::kLower;
  tracking.must = at_most(0.6);
  tracking.aim = at_most(0.25);
  tracking.reached = of_tracking.share(30.0);
  tracking.unit = "";
  tracking.n = of_tracking.objects * of_tracking.hypotheses;
  tracking.baseline = "none, one thread; frame terms, known layers and weights";
  report.add(std::move(tracking));
  Table stages{
      "5 objects, us a frame",
      {"triangles", "drawn", "pixels", "frame terms", "layers", "weights", "all", "weights by full meshes"},
      {{of_tracking.triangles, of_tracking.drawn, of_tracking.pixels, 1e6 * of_tracking.terms, 1e6 * of_tracking.layers,
        1e6 * of_tracking.weights, 1e6 * of_tracking.whole, 1e6 * of_tracking.full_weights}}};
  Target terms;
  terms.work = "frame terms, 640 x 480 to 160 x 120";
  terms.better = Better::kLower;
  terms.must = at_most(1.0);
  terms.aim = at_most(0.3);
  terms.reached = 1e3 * cost_of([&] { large.make_terms(160); }, rounds);
  terms.unit = "ms";
  terms.n = rounds;
  terms.baseline = "none, one thread";
  report.add(std::move(terms));
  Table on_devices{"compute shaders, by the clock",
                   {"scene", "device", "hypotheses a call", "weight us", "Gauss-Newton us", "share on the device"},
                   {}};
  std::string why_not;
  Target on_card = open("10k triangles on a graphics card, hypotheses", std::nullopt, 500e3, "");
  on_card.unit = "1/s";
  const auto device_rows = [&](const std::string& name, const Scene& scene) {
    std::vector<DeviceCosts> all = costs_on_devices(scene, rounds, &why_not);
    for (const DeviceCosts& costs : all)
      on_devices.rows.push_back({name, costs.name, static_cast<std::int64_t>(costs.calls), 1e6 * costs.weight,
                                 1e6 * costs.step, costs.on_device});
    return all;
  };
  for (const DeviceCosts& costs : device_rows("10k triangles, 160 x 120", large)) {
    if (costs.device.software || on_card.reached) continue;
    on_card.reached = 1.0 / costs.weight;
    on_card.n = static_cast<int>(costs.calls);
    on_card.baseline = "none; " + costs.name + ", by the clock";
  }
  device_rows("1500 triangles, 160 x 120", middle);
  device_rows("400 triangles, 80 x 60", small);
  if (!on_card.reached) on_card.why = "no graphics card here, software renderers alone. " + why_not;
  report.add(std::move(on_card));
  Target against_reference;
  against_reference.work = "10k triangles: the reference backend";
  against_reference.reached = slow.weight / of_large.weight;
  against_reference.unit = "x";
  against_reference.n = kHypotheses;
  against_reference.baseline = "rendering/reference, one thread";
  report.add(std::move(against_reference));
  std::fputs(report.text().c_str(), stdout);
  std::printf("%s\n", text_of(table).c_str());
  std::printf("%s\n", text_of(on_devices).c_str());
  std::printf("%s\n", text_of(stages).c_str());
  report.add(std::move(table));
  report.add(std::move(on_devices));
  report.add(std::move(stages));
  return report.finish(out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  std::string out;
  int rounds = 5;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] { rounds = 1; });
  arguments.text("benchmark_out", "PATH", &out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(rounds, out) : 2;
}
