// SPDX-License-Identifier: Apache-2.0
#include "rendering_tracking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "benchmarks/processor_time.h"
#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::benchmarks {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using namespace rendering;

constexpr int kObjects = 5;
constexpr int kTrackedHypotheses = 200;
constexpr double kDistance = 1.1;  // m
constexpr int kSimplifiedTriangles = 1400;

/// Turned on a lathe, standing on z = 0: 10,200 triangles.
geometry::TriangleMesh turned(int kind) {
  constexpr int kRings = 51;
  const double height = std::array{0.20, 0.24, 0.09, 0.12, 0.16}[static_cast<std::size_t>(kind)];
  const double radius = std::array{0.040, 0.035, 0.070, 0.045, 0.050}[static_cast<std::size_t>(kind)];
  std::vector<Eigen::Vector2d> profile = {{0.0, 0.0}};
  for (int i = 0; i < kRings; ++i) {
    const double t = static_cast<double>(i) / (kRings - 1);
    profile.emplace_back(radius * (0.8 + 0.2 * std::sin((2.0 + kind) * t)), height * t);
  }
  profile.emplace_back(0.0, height);
  return geometry::make_lathe(profile, 100);
}

class Tracking {
 public:
  explicit Tracking(const LikelihoodBatch& batch) : batch_(batch), workspace_(batch.make_workspace()) {
    // The camera looks down on the table by 35 degrees.
    constexpr double kDown = 35.0 * std::numbers::pi / 180.0;
    X_CW_.rotation = geometry::exp_rotation({std::numbers::pi / 2.0 + kDown, 0.0, 0.0});
    X_CW_.translation = Vector3d(0.0, 0.0, kDistance);
    support_.plane_C = geometry::transformed({Vector3d::UnitZ(), 0.0}, X_CW_);
    for (int i = 0; i < kObjects; ++i) {
      const geometry::TriangleMesh mesh = turned(i);
      full_.push_back(make_render_mesh(mesh));
      simplified_.push_back(make_render_mesh(geometry::simplified(mesh, kSimplifiedTriangles)));
      const double angle = 2.0 * std::numbers::pi * i / kObjects;
      Pose X_WO = Pose::from_translation({0.16 * std::cos(angle), 0.13 * std::sin(angle), 0.0});
      X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 1.0 * i});
      X_CO_.push_back(X_CW_ * X_WO);
    }
    see();
    core::RandomStream stream(2, core::Purpose::kTest);
    for (const Pose& X_CO : X_CO_) {
      std::vector<PoseHypothesis> mine;
      for (int k = 0; k < kTrackedHypotheses; ++k) {
        geometry::Vector6d d;
        d << 0.1 * geometry::normal_vector(stream), 0.01 * geometry::normal_vector(stream);
        mine.push_back({nullptr, geometry::box_plus(X_CO, d), &material_});
      }
      hypotheses_.push_back(std::move(mine));
    }
    evidences_.resize(kTrackedHypotheses);
    terms_of_.resize(kObjects);
    make_terms();
    choose(true);
    draw_layers();
  }

  void make_terms() {
    FrameTermsInput input;
    input.camera = camera_;
    input.depth = depth_.view();
    input.supports = std::span(&support_, 1);
    FrameTermsOptions options;
    options.target_width = 160;
    PRESCENE_CHECK(make_frame_terms(input, options, SensorModel{}, &terms_).ok());
  }

  /// The simplified mesh of each thing, or its full one.
  void choose(bool coarse) {
    for (std::size_t i = 0; i < kObjects; ++i) {
      chosen_[i] = coarse ? simplified_[i] : full_[i];
      for (PoseHypothesis& hypothesis : hypotheses_[i]) hypothesis.mesh = chosen_[i].get();
    }
  }

  /// Each thing once, and the terms of each that know the others.
  void draw_layers() {
    for (std::size_t i = 0; i < kObjects; ++i) {
      layer_.instances = {{chosen_[i], X_CO_[i], material_}};
      PRESCENE_CHECK(renderer_->render(layer_, terms_.camera, Pose::identity(), {}, &layers_[i]).ok());
    }
    for (std::size_t i = 0; i < kObjects; ++i) {
      std::fill_n(others_.data(), others_.size(), 0.0f);
      for (std::size_t j = 0; j < kObjects; ++j)
        if (j != i) merge_nearest(layers_[j].depth, &others_);
      with_known_surfaces(terms_, others_, &terms_of_[i]);
    }
  }

  void weigh() {
    for (std::size_t i = 0; i < kObjects; ++i) batch_.evaluate(terms_of_[i], hypotheses_[i], *workspace_, evidences_);
  }

  TrackingCosts costs(int rounds) {
    TrackingCosts costs;
    costs.objects = kObjects;
    costs.hypotheses = kTrackedHypotheses;
    for (std::size_t i = 0; i < kObjects; ++i) {
      costs.triangles += static_cast<double>(full_[i]->triangles.size()) / kObjects;
      costs.drawn += static_cast<double>(chosen_[i]->triangles.size()) / kObjects;
      batch_.evaluate(terms_of_[i], hypotheses_[i], *workspace_, evidences_);
      for (const PoseEvidence& evidence : evidences_)
        costs.pixels += static_cast<double>(evidence.in_view) / (kObjects * kTrackedHypotheses);
    }
    costs.terms = cost_of([&] { make_terms(); }, rounds);
    costs.layers = cost_of([&] { draw_layers(); }, rounds);
    costs.weights = cost_of([&] { weigh(); }, rounds);
    costs.whole = cost_of(
        [&] {
          make_terms();
          draw_layers();
          weigh();
        },
        rounds);
    choose(false);
    costs.full_weights = cost_of([&] { weigh(); }, rounds);
    return costs;
  }

 private:
  /// What the camera returns of the table with everything on it.
  void see() {
    RenderScene scene;
    geometry::TriangleMesh table;
    table.vertices = {{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}};
    table.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.instances = {{make_render_mesh(table), X_CW_, material_}};
    for (std::size_t i = 0; i < kObjects; ++i) scene.instances.push_back({full_[i], X_CO_[i], material_});
    RenderOptions options;
    options.normals = true;
    RenderedView view;
    PRESCENE_CHECK(renderer_->render(scene, camera_, Pose::identity(), options, &view).ok());
    SimulatedCamera(SensorModel{}, {})
        .sample(scene, view, nullptr, camera_, Pose::identity(), core::RandomStream(1, core::Purpose::kSensorNoise), 0,
                &depth_, nullptr);
  }

  const LikelihoodBatch& batch_;
  std::unique_ptr<LikelihoodWorkspace> workspace_;
  std::unique_ptr<Renderer> renderer_ = make_reference_renderer();
  geometry::PinholeCamera camera_ = {640, 480, 600.0, 600.0, 319.5, 239.5};
  Pose X_CW_;
  SupportRegion support_;
  SurfaceMaterial material_;
  std::vector<MeshHandle> full_;
  std::vector<MeshHandle> simplified_;
  std::vector<Pose> X_CO_;
  geometry::DepthImage depth_;
  std::vector<std::vector<PoseHypothesis>> hypotheses_;
  std::vector<PoseEvidence> evidences_;
  FrameTerms terms_;
  std::vector<FrameTerms> terms_of_;
  std::array<MeshHandle, kObjects> chosen_;
  std::array<RenderedView, kObjects> layers_;
  RenderScene layer_;
  geometry::DepthImage others_ = geometry::DepthImage(160, 120);
};

}  // namespace

TrackingCosts tracking_costs(const LikelihoodBatch& batch, int rounds) { return Tracking(batch).costs(rounds); }

}  // namespace prescene::benchmarks
