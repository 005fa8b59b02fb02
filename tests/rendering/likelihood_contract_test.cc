// SPDX-License-Identifier: Apache-2.0
// What every LikelihoodBatch must do, checked against the reference renderer and the sensor model pixel by pixel.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "prescene/core/parallel.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/rendering/simd/simd_likelihood.h"
#include "scenes.h"
#include "tests/support/allocations.h"

namespace prescene::rendering {
namespace {

using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector3d;
using geometry::Vector6d;
using tests::camera_of_width;

using MadeBatch = core::Result<std::unique_ptr<LikelihoodBatch>>;

struct Backend {
  const char* name;
  std::function<MadeBatch()> make;
  double log_ratio_tolerance;  ///< Of the sum, beside 1e-4 of it: what single precision costs.
};

MadeBatch on_device() {
  PRESCENE_TRY(auto batch, make_compute_likelihood_batch(make_simd_likelihood_batch(), {}));
  return std::unique_ptr<LikelihoodBatch>(std::move(batch));
}

const Backend kBackends[] = {{"reference", [] { return MadeBatch(make_reference_likelihood_batch()); }, 0.02},
                             {"simd", [] { return MadeBatch(make_simd_likelihood_batch()); }, 0.02},
                             {"compute", on_device, 0.02}};

/// A frame of a carton before a wall, seen by a simulated camera.
class LikelihoodContract : public testing::TestWithParam<Backend> {
 protected:
  LikelihoodContract() {
    camera_ = camera_of_width(320);
    X_CO_.rotation = Eigen::AngleAxisd(2.0, Vector3d(0.4, -1.0, 0.3).normalized());
    X_CO_.translation = {0.03, -0.02, 0.85};
    mesh_ = make_render_mesh(geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23));
    wall_.plane_C = {Vector3d(0.1, 0.3, -1.0).normalized(), 0.0};
    wall_.plane_C.offset = -wall_.plane_C.normal.dot(Vector3d(0.0, 0.0, 1.1));
    scene_.instances = {{mesh_, X_CO_, material_}, {wall_mesh(), Pose::identity(), material_}};
    renderer_ = make_reference_renderer();
    RenderOptions options;
    options.normals = true;
    EXPECT_TRUE(renderer_->render(scene_, camera_, Pose::identity(), options, &view_).ok());
  }

  void SetUp() override {
    auto made = GetParam().make();
    if (!made) {
      ASSERT_EQ(made.status().code(), core::StatusCode::kUnavailable) << made.status().message();
      GTEST_SKIP() << made.status().message();
    }
    batch_ = *std::move(made);
    workspace_ = batch_->make_workspace();
  }

  void TearDown() override {
    const auto* compute = dynamic_cast<const ComputeLikelihoodBatch*>(batch_.get());
    if (compute == nullptr) return;
    const ComputeHealth health = compute->health();
    EXPECT_TRUE(health.last_failure.ok()) << health.last_failure.message();
    EXPECT_EQ(health.lost, 0u);
    if (IsSkipped()) return;
    EXPECT_GT(health.on_device + health.on_processor, 0u);
  }

  MeshHandle wall_mesh() const {
    const auto corner = [&](double u, double v) {
      const Vector3d ray = camera_.unproject(u, v, 1.0);
      return Vector3d(ray * (-wall_.plane_C.offset / wall_.plane_C.normal.dot(ray)));
    };
    geometry::TriangleMesh mesh;
    mesh.vertices = {corner(-20, -20), corner(340, -20), corner(340, 260), corner(-20, 260)};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return make_render_mesh(mesh);
  }

  /// Terms of the scene as the simulated camera sees it.
  FrameTerms noisy_terms(int target_width, std::span<const ColorModel> colors = {}) {
    const SimulatedCamera simulated(SensorModel{}, {});
    geometry::DepthImage depth;
    geometry::ColorImage color;
    simulated.sample(scene_, view_, nullptr, camera_, Pose::identity(),
                     core::RandomStream(3, core::Purpose::kSensorNoise), 0, &depth, &color);
    return terms_of(depth, color, target_width, colors);
  }

  FrameTerms terms_of(const geometry::DepthImage& depth, const geometry::ColorImage& color, int target_width,
                      std::span<const ColorModel> colors = {}) {
    FrameTermsInput input;
    input.camera = camera_;
    input.depth = depth.view();
    if (!colors.empty()) input.color = color.view();
    input.supports = std::span(&wall_, 1);
    input.color_models = colors;
    FrameTermsOptions options;
    options.target_width = target_width;
    FrameTerms terms;
    const core::Status status = make_frame_terms(input, options, SensorModel{}, &terms);
    EXPECT_TRUE(status.ok()) << status.message();
    return terms;
  }

  PoseHypothesis hypothesis(const Pose& X_CO) const { return {mesh_.get(), X_CO, &material_}; }

  PoseEvidence evaluate(const FrameTerms& frame, const PoseHypothesis& h) {
    PoseEvidence evidence;
    batch_->evaluate(frame, std::span(&h, 1), *workspace_, std::span(&evidence, 1));
    return evidence;
  }

  PoseLinearisation linearise(const FrameTerms& frame, const PoseHypothesis& h, const LineariseOptions& options) {
    PoseLinearisation linearisation;
    batch_->linearise(frame, std::span(&h, 1), options, *workspace_, std::span(&linearisation, 1));
    return linearisation;
  }

  Pose disturbed(double shift, double turn, core::RandomStream& stream) const {
    Vector6d d;
    d << turn * geometry::normal_vector(stream), shift * geometry::normal_vector(stream);
    return geometry::box_plus(X_CO_, d);
  }

  std::unique_ptr<LikelihoodBatch> batch_;
  std::unique_ptr<LikelihoodWorkspace> workspace_;
  std::unique_ptr<Renderer> renderer_;
  geometry::PinholeCamera camera_;
  Pose X_CO_;
  MeshHandle mesh_;
  SurfaceMaterial material_;
  SupportRegion wall_;
  RenderScene scene_;
  RenderedView view_;
};

/// The same sums from the reference renderer's images and the sensor model's own functions.
PoseEvidence evidence_by_pixels(const FrameTerms& frame, Renderer& renderer, const PoseHypothesis& h,
                                const MeshHandle& mesh) {
  const SensorModel& model = frame.model;
  RenderScene scene;
  scene.instances = {{mesh, h.X_CO, *h.material}};
  RenderOptions options;
  options.near_depth = model.options().min_depth + 1e-4;
  options.far_depth = model.options().max_depth;
  options.normals = true;
  RenderedView view;
  EXPECT_TRUE(renderer.render(scene, frame.camera, Pose::identity(), options, &view).ok());
  PoseEvidence sum;
  for (int y = 0; y < frame.camera.height; ++y) {
    for (int x = 0; x < frame.camera.width; ++x) {
      const double depth = view.depth(x, y);
      if (depth == 0.0) continue;
      ++sum.in_view;
      if (frame.known(x, y) > 0.0f && frame.known(x, y) < depth) continue;
      ++sum.covered;
      bool outline = false;
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        if (x + dx < 0 || x + dx >= frame.camera.width || y + dy < 0 || y + dy >= frame.camera.height) continue;
        outline = outline || view.depth(x + dx, y + dy) == 0.0f;
      }
      PixelGeometry pixel;
      pixel.depth = depth;
      pixel.cosine = std::abs(frame.camera.unproject(x, y, 1.0).normalized().dot(view.normals(x, y).cast<double>()));
      if (outline) pixel.outline_px = 0.5 * frame.step;
      const PixelMixture mixture = model.mixture(*h.material, pixel);
      AbsentMixture absent;
      absent.missing = frame.absent_missing(x, y);
      absent.peak_depth = frame.absent_peak(x, y);
      if (absent.peak_depth > 0.0) {
        absent.peak_sigma = model.options().support_sigma;
        absent.peak_weight = model.options().support_weight;
      }
      const double z = frame.depth(x, y);
      const double color = h.color_model >= 0 ? frame.color_ratio[static_cast<std::size_t>(h.color_model)](x, y) : 1.0;
      const double log_ratio = model.log_ratio(mixture, z, absent, color);
      sum.log_ratio += log_ratio;
      if (z == 0.0) continue;
      ++sum.measured;
      if (z < depth - 3.0 * mixture.sigma) continue;
      ++sum.visible;
      sum.visible_log_ratio += log_ratio;
      if (z <= depth + 3.0 * mixture.sigma) ++sum.hits;
    }
  }
  return sum;
}

TEST_P(LikelihoodContract, ItsPixelsAddUp) {
  const FrameTerms frame = noisy_terms(160);
  core::RandomStream stream(8, core::Purpose::kTest);
  for (int i = 0; i < 50; ++i) {
    const PoseHypothesis h = hypothesis(disturbed(0.02, 0.2, stream));
    const PoseEvidence evidence = evaluate(frame, h);
    const geometry::Image<float> map = log_ratio_map(frame, h);
    double sum = 0.0;
    int covered = 0;
    for (std::size_t k = 0; k < map.size(); ++k) {
      if (std::isnan(map.data()[k])) continue;
      sum += static_cast<double>(map.data()[k]);
      ++covered;
    }
    EXPECT_EQ(covered, evidence.covered);
    EXPECT_NEAR(sum, evidence.log_ratio,
                1e-4 * std::max(1.0, std::abs(evidence.log_ratio)) + GetParam().log_ratio_tolerance);
  }
}

TEST_P(LikelihoodContract, IsTheSensorModelSummedOverPixels) {
  std::vector<ColorModel> colors(1);
  for (std::size_t bin = 0; bin < colors[0].log_ratio.size(); ++bin)
    colors[0].log_ratio[bin] = static_cast<float>(std::sin(static_cast<double>(bin)));
  core::RandomStream stream(5, core::Purpose::kTest);
  int same_pixels = 0;
  for (const int width : {40, 80, 320}) {
    const FrameTerms frame = noisy_terms(width, colors);
    for (int i = 0; i < 40; ++i) {
      PoseHypothesis h = hypothesis(disturbed(0.04, 0.4, stream));
      const SurfaceMaterial transparent = SurfaceMaterial::transparent();
      if (i % 3 == 1) h.material = &transparent;
      if (i % 2 == 1) h.color_model = 0;
      const PoseEvidence expected = evidence_by_pixels(frame, *renderer_, h, mesh_);
      const PoseEvidence actual = evaluate(frame, h);
      // Single and double precision may disagree about a pixel centre on the silhouette.
      EXPECT_NEAR(actual.in_view, expected.in_view, 2);
      EXPECT_NEAR(actual.visible, expected.visible, 2);
      if (actual.in_view != expected.in_view) continue;
      ++same_pixels;
      EXPECT_EQ(actual.covered, expected.covered);
      EXPECT_EQ(actual.measured, expected.measured);
      const double tolerance = GetParam().log_ratio_tolerance + 1e-4 * std::abs(expected.log_ratio);
      EXPECT_NEAR(actual.log_ratio, expected.log_ratio, tolerance);
      if (actual.visible == expected.visible) {
        EXPECT_NEAR(actual.visible_log_ratio, expected.visible_log_ratio, tolerance);
      }
    }
  }
  EXPECT_GT(same_pixels, 110);
}

TEST_P(LikelihoodContract, PrefersTheTruth) {
  const FrameTerms frame = noisy_terms(80);
  const PoseEvidence truth = evaluate(frame, hypothesis(X_CO_));
  EXPECT_GT(truth.log_ratio, 100.0);
  EXPECT_GT(truth.hit_share(), 0.9);
  const double share = tempering(frame.tempering.weight, truth.measured, frame.step);
  EXPECT_LT(share, 0.2);
  EXPECT_NEAR(truth.tempered, share * truth.log_ratio, 1e-9 * truth.log_ratio);
  core::RandomStream stream(6, core::Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    const PoseEvidence other = evaluate(frame, hypothesis(disturbed(0.03, 0.3, stream)));
    EXPECT_LT(other.log_ratio, truth.log_ratio);
  }
}

TEST_P(LikelihoodContract, SaysNothingAboutWhatKnownSurfacesHide) {
  FrameTerms frame = noisy_terms(80);
  with_known_surfaces(frame, geometry::DepthImage(frame.camera.width, frame.camera.height, 0.5f), &frame);
  const PoseEvidence evidence = evaluate(frame, hypothesis(X_CO_));
  EXPECT_GT(evidence.in_view, 100);
  EXPECT_EQ(evidence.covered, 0);
  EXPECT_EQ(evidence.log_ratio, 0.0);
  EXPECT_EQ(evidence.tempered, 0.0);
  EXPECT_EQ(evidence.log_ratio_per_visible_pixel(), 0.0);
}

TEST_P(LikelihoodContract, CountsAKnownSurfaceBehindAsBackground) {
  const FrameTerms frame = noisy_terms(80);
  // Something known just where the object's pixels were measured: the camera would have seen that anyhow.
  FrameTerms explained;
  with_known_surfaces(frame, frame.depth, &explained);
  const PoseHypothesis nearer = hypothesis(Pose{X_CO_.rotation, X_CO_.translation * 0.9});
  const PoseEvidence against = evaluate(explained, nearer);
  EXPECT_LT(against.log_ratio, evaluate(frame, nearer).log_ratio);
  EXPECT_LT(against.log_ratio, 0.0);
}

TEST_P(LikelihoodContract, SaysNothingAboutWhatIsOutOfView) {
  const FrameTerms frame = noisy_terms(80);
  for (const Vector3d& p_CO :
       {Vector3d(3.0, 0.0, 1.0), Vector3d(0.0, 0.0, -1.0), Vector3d(0.0, 0.0, 0.15), Vector3d(0.0, 0.0, 4.0)}) {
    const PoseEvidence evidence = evaluate(frame, hypothesis(Pose{X_CO_.rotation, p_CO}));
    EXPECT_EQ(evidence.in_view, 0) << p_CO.transpose();
    EXPECT_EQ(evidence.log_ratio, 0.0) << p_CO.transpose();
  }
}

TEST_P(LikelihoodContract, LinearisesTheDistancesToTheRenderedFaces) {
  const FrameTerms frame = noisy_terms(80);
  core::RandomStream stream(7, core::Purpose::kTest);
  LineariseOptions options;
  options.gate = 0.03;
  for (int i = 0; i < 20; ++i) {
    const Pose X_CO = disturbed(0.008, 0.08, stream);
    const PoseLinearisation actual = linearise(frame, hypothesis(X_CO), options);

    RenderScene scene;
    scene.instances = {{mesh_, X_CO, material_}};
    RenderOptions render_options;
    render_options.normals = true;
    RenderedView view;
    ASSERT_TRUE(renderer_->render(scene, frame.camera, Pose::identity(), render_options, &view).ok());
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    int pixels = 0;
    for (int y = 0; y < frame.camera.height; ++y) {
      for (int x = 0; x < frame.camera.width; ++x) {
        if (view.depth(x, y) == 0.0f || frame.depth(x, y) == 0.0f) continue;
        const Vector3d normal = view.normals(x, y).cast<double>();
        const Vector3d rendered = frame.camera.unproject(x, y, view.depth(x, y));
        const Vector3d measured = frame.camera.unproject(x, y, frame.depth(x, y));
        if (std::abs(normal.dot(rendered.normalized())) < options.min_cosine) continue;
        // Along the normal as it is now, from the rendered point of the body as it moves.
        const Vector3d point_O = X_CO.inverse() * rendered;
        const auto residual = [&](const Vector6d& d) {
          return normal.dot(measured - geometry::box_plus(X_CO, d) * point_O);
        };
        const double r = residual(Vector6d::Zero());
        Vector6d J;
        for (int k = 0; k < 6; ++k) {
          const Vector6d step = 1e-6 * Vector6d::Unit(k);
          J[k] = -(residual(step) - residual(-step)) / 2e-6;
        }
        const double sigma = frame.model.options().sigma_per_depth_squared * view.depth(x, y) * view.depth(x, y);
        const double scaled = 2.0 * r / options.gate;
        const double weight = std::pow(1.0 + scaled * scaled, -2.0) / (sigma * sigma);
        H += weight * J * J.transpose();
        g += weight * r * J;
        ++pixels;
      }
    }
    EXPECT_NEAR(actual.pixels, pixels, 2);
    if (actual.pixels != pixels) continue;
    EXPECT_LT((actual.H - H).norm(), 2e-3 * H.norm());
    EXPECT_LT((actual.g - g).norm(), 2e-3 * g.norm());
    EXPECT_EQ(actual.H, actual.H.transpose());
  }
}

TEST_P(LikelihoodContract, GaussNewtonStepsFindTheTruth) {
  // Without noise, so that the minimum is the truth up to the robust weights' and the silhouettes' part.
  const FrameTerms frame = terms_of(view_.depth, {}, 160);
  core::RandomStream stream(8, core::Purpose::kTest);
  for (int i = 0; i < 20; ++i) {
    Pose X_CO = disturbed(0.002, 0.02, stream);
    LineariseOptions options;
    options.gate = 0.03;
    options.with_evidence = true;
    PoseLinearisation linearisation;
    for (int step = 0; step < 25; ++step) {
      linearisation = linearise(frame, hypothesis(X_CO), options);
      Matrix6d damped = linearisation.H;
      damped.diagonal() *= 1.001;
      X_CO = geometry::box_plus(X_CO, geometry::solve_symmetric_6(damped, linearisation.g));
      options.gate = std::max(0.004, 0.85 * options.gate);
    }
    EXPECT_LT(geometry::box_minus(X_CO, X_CO_).tail<3>().norm(), 0.002);
    EXPECT_LT(geometry::angle_between(X_CO.rotation, X_CO_.rotation), 0.02);
    EXPECT_GT(linearisation.evidence.hit_share(), 0.98);
  }
}

TEST_P(LikelihoodContract, EvidenceWithEquationsIsTheSame) {
  const FrameTerms frame = noisy_terms(80);
  LineariseOptions options;
  options.with_evidence = true;
  const PoseEvidence alone = evaluate(frame, hypothesis(X_CO_));
  const PoseEvidence together = linearise(frame, hypothesis(X_CO_), options).evidence;
  EXPECT_EQ(alone.log_ratio, together.log_ratio);
  EXPECT_EQ(alone.hits, together.hits);
  EXPECT_EQ(alone.in_view, together.in_view);
}

TEST_P(LikelihoodContract, GivesTheSameBitsInAnyBatchAndOnAnyThreads) {
  if (!batch_->info().deterministic_bits) GTEST_SKIP() << GetParam().name << " promises a tolerance only";
  const FrameTerms frame = noisy_terms(80);
  core::RandomStream stream(9, core::Purpose::kTest);
  std::vector<PoseHypothesis> hypotheses;
  for (int i = 0; i < 150; ++i) hypotheses.push_back(hypothesis(disturbed(0.2, 1.0, stream)));
  std::vector<PoseEvidence> expected;
  for (const PoseHypothesis& h : hypotheses) expected.push_back(evaluate(frame, h));
  for (const int threads : {1, 2, 3, 8}) {
    core::ThreadPool pool(threads);
    WorkspacePool workspaces(*batch_);
    std::vector<PoseEvidence> actual(hypotheses.size());
    pool.for_blocks(hypotheses.size(), 16, [&](std::size_t begin, std::size_t end) {
      const WorkspacePool::Loan workspace(workspaces);
      batch_->evaluate(frame, std::span(hypotheses).subspan(begin, end - begin), *workspace,
                       std::span(actual).subspan(begin, end - begin));
    });
    for (std::size_t i = 0; i < actual.size(); ++i) {
      EXPECT_EQ(actual[i].log_ratio, expected[i].log_ratio);
      EXPECT_EQ(actual[i].visible, expected[i].visible);
    }
  }
}

TEST_P(LikelihoodContract, SaysWhatTheReferenceSaysOfTenThousandHypotheses) {
  const auto reference = make_reference_likelihood_batch();
  const auto its_workspace = reference->make_workspace();
  ColorModel colors;
  core::RandomStream of_colors(3, core::Purpose::kTest);
  for (float& ratio : colors.log_ratio) ratio = static_cast<float>(of_colors.uniform(-3.0, 3.0));
  // Round, open and with faces from less than a pixel to more than the image.
  const MeshHandle meshes[] = {
      mesh_, make_render_mesh(geometry::make_mesh(geometry::Sphere{0.09}, 48)),
      make_render_mesh(geometry::make_open_bin({0.2, 0.15, 0.1}, 0.008)), wall_mesh(),
      make_render_mesh(geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.05, 0.1}, {0.045, 0.1}, {0.03, 0.01}}, 24))};
  const SurfaceMaterial materials[] = {SurfaceMaterial::opaque(), SurfaceMaterial::transparent(),
                                       SurfaceMaterial::mirror()};
  for (const int width : {40, 80, 160, 320}) {
    const FrameTerms frame = noisy_terms(width, std::span(&colors, 1));
    core::RandomStream stream(11, core::Purpose::kTest);
    std::vector<PoseHypothesis> hypotheses;
    for (int i = 0; i < 2500; ++i) {
      // Some partly out of view, some cut by the near plane, some behind the camera.
      PoseHypothesis h = hypothesis(disturbed(i % 10 == 0 ? 0.5 : 0.05, 0.5, stream));
      h.X_CO.rotation = geometry::uniform_rotation(stream);
      h.mesh = meshes[i % 5].get();
      h.material = &materials[i % 3];
      h.color_model = i % 2 - 1;
      hypotheses.push_back(h);
    }
    std::vector<PoseEvidence> evidences(hypotheses.size()), expected(hypotheses.size());
    batch_->evaluate(frame, hypotheses, *workspace_, evidences);
    reference->evaluate(frame, hypotheses, *its_workspace, expected);
    std::vector<PoseLinearisation> equations(hypotheses.size()), their_equations(hypotheses.size());
    batch_->linearise(frame, hypotheses, {}, *workspace_, equations);
    reference->linearise(frame, hypotheses, {}, *its_workspace, their_equations);
    int seen = 0;
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-4 * std::max(1.0, std::abs(b)); };
      ASSERT_PRED2(near, evidences[i].log_ratio, expected[i].log_ratio) << width << " " << i;
      ASSERT_PRED2(near, evidences[i].visible_log_ratio, expected[i].visible_log_ratio) << width << " " << i;
      ASSERT_PRED2(near, evidences[i].tempered, expected[i].tempered) << width << " " << i;
      ASSERT_EQ(evidences[i].in_view, expected[i].in_view) << width << " " << i;
      ASSERT_EQ(evidences[i].covered, expected[i].covered) << width << " " << i;
      ASSERT_EQ(evidences[i].measured, expected[i].measured) << width << " " << i;
      ASSERT_EQ(evidences[i].visible, expected[i].visible) << width << " " << i;
      ASSERT_EQ(evidences[i].hits, expected[i].hits) << width << " " << i;
      ASSERT_EQ(equations[i].pixels, their_equations[i].pixels) << width << " " << i;
      ASSERT_LE((equations[i].H - their_equations[i].H).norm(), 1e-4 * their_equations[i].H.norm()) << i;
      ASSERT_LE((equations[i].g - their_equations[i].g).norm(), 1e-4 * their_equations[i].g.norm() + 1e-3) << i;
      seen += expected[i].covered > 0 ? 1 : 0;
    }
    EXPECT_GT(seen, 1500);
    EXPECT_LT(seen, 2490);
  }
}

TEST_P(LikelihoodContract, AllocatesNothingOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations can't be counted under sanitizers";
  const FrameTerms frame = noisy_terms(80);
  core::RandomStream stream(10, core::Purpose::kTest);
  std::vector<PoseHypothesis> hypotheses;
  for (int i = 0; i < 100; ++i) hypotheses.push_back(hypothesis(disturbed(0.3, 2.0, stream)));
  std::vector<PoseEvidence> evidences(hypotheses.size());
  std::vector<PoseLinearisation> linearisations(hypotheses.size());
  batch_->evaluate(frame, std::span(hypotheses).first(1), *workspace_, std::span(evidences).first(1));
  batch_->linearise(frame, std::span(hypotheses).first(1), {}, *workspace_, std::span(linearisations).first(1));
  const std::uint64_t before = tests::allocation_count();
  batch_->evaluate(frame, hypotheses, *workspace_, evidences);
  batch_->linearise(frame, hypotheses, {}, *workspace_, linearisations);
  EXPECT_EQ(tests::allocation_count(), before);
  const std::vector<int> proof(3);
  EXPECT_GT(tests::allocation_count(), before) << "the counter is not linked in";
}

INSTANTIATE_TEST_SUITE_P(Backends, LikelihoodContract, testing::ValuesIn(kBackends),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace prescene::rendering
