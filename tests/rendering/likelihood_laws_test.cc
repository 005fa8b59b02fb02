// SPDX-License-Identifier: Apache-2.0
// Laws of the log ratio, for every backend: over frames without the object the ratio averages to one, what is not there
// says nothing, what hides a part takes its evidence away, and how a surface is cut into triangles does not matter.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "prescene/geometry/sampling.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/simd/simd_likelihood.h"
#include "scenes.h"

namespace prescene::rendering::likelihood_laws_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using tests::camera_of_width;

struct Backend {
  const char* name;
  std::function<std::unique_ptr<LikelihoodBatch>()> make;
};
const Backend kBackends[] = {{"reference", make_reference_likelihood_batch}, {"simd", make_simd_likelihood_batch}};

const SurfaceMaterial kMaterials[] = {SurfaceMaterial::opaque(), SurfaceMaterial::transparent(),
                                      SurfaceMaterial::mirror()};

/// A background at a slant, known as a support plane or as a view without the object, or not known at all.
enum class Background { kUnknown, kPlane, kView };

class LikelihoodLaws : public testing::TestWithParam<Backend> {
 protected:
  LikelihoodLaws() : batch_(GetParam().make()), workspace_(batch_->make_workspace()), camera_(camera_of_width(160)) {
    plane_.plane_C = {Vector3d(0.1, 0.3, -1.0).normalized(), 0.0};
    plane_.plane_C.offset = -plane_.plane_C.normal.dot(Vector3d(0.0, 0.0, 1.1));
  }

  double plane_depth(int x, int y) const {
    return -plane_.plane_C.offset / plane_.plane_C.normal.dot(camera_.unproject(x, y, 1.0));
  }

  FrameTerms terms_of(const geometry::DepthImage& depth, Background background) const {
    FrameTermsInput input;
    input.camera = camera_;
    input.depth = depth.view();
    geometry::DepthImage view(camera_.width, camera_.height);
    if (background == Background::kPlane) input.supports = std::span(&plane_, 1);
    if (background == Background::kView) {
      for (int y = 0; y < camera_.height; ++y)
        for (int x = 0; x < camera_.width; ++x)
          view(x, y) = (x + y) % 3 == 0 ? 0.0f : static_cast<float>(plane_depth(x, y));
      input.background = view.view();
    }
    FrameTermsOptions options;
    options.target_width = camera_.width;
    FrameTerms terms;
    EXPECT_TRUE(make_frame_terms(input, options, SensorModel{}, &terms).ok());
    return terms;
  }

  /// What the absent model of `terms` knows of a pixel, as the sensor model's own type.
  AbsentMixture absent_at(const FrameTerms& terms, Background background, int x, int y) const {
    const SensorModelOptions& options = terms.model.options();
    AbsentMixture absent;
    absent.missing = static_cast<double>(terms.absent_missing(x, y));
    const double peak = static_cast<double>(terms.absent_peak(x, y));
    if (peak == 0.0) return absent;
    const bool plane = background == Background::kPlane;
    absent.peak_depth = peak;
    absent.peak_sigma =
        plane ? options.support_sigma : std::hypot(terms.model.hit_sigma(peak, 1.0), options.support_sigma);
    absent.peak_weight = plane ? options.support_weight : options.background_weight;
    return absent;
  }

  PoseEvidence evaluate(const FrameTerms& frame, const RenderMesh& mesh, const Pose& X_CO,
                        const SurfaceMaterial& material) {
    const PoseHypothesis h{&mesh, X_CO, &material};
    PoseEvidence evidence;
    batch_->evaluate(frame, std::span(&h, 1), *workspace_, std::span(&evidence, 1));
    return evidence;
  }

  std::unique_ptr<LikelihoodBatch> batch_;
  std::unique_ptr<LikelihoodWorkspace> workspace_;
  geometry::PinholeCamera camera_;
  SupportRegion plane_;
};

/// Mean of many numbers with its standard error.
class Mean {
 public:
  void add(double x) {
    n_ += 1.0;
    sum_ += x;
    squares_ += x * x;
  }
  double mean() const { return sum_ / n_; }
  double error() const { return std::sqrt(std::max(0.0, squares_ / n_ - mean() * mean()) / n_); }

 private:
  double n_ = 0.0, sum_ = 0.0, squares_ = 0.0;
};

/// A block that covers a few pixels.
class SmallBlock : public LikelihoodLaws {
 protected:
  static constexpr double kDepth = 0.9;

  void look(Background background) {
    terms_ = terms_of(geometry::DepthImage(camera_.width, camera_.height, 0.0f), background);
    background_ = background;
    if (!pixels_.empty()) return;
    // What it covers, and how likely an opaque thing returns nothing there: of each pixel alone, the rest being hidden
    // by a known surface.
    FrameTerms alone = terms_;
    alone.known = geometry::DepthImage(camera_.width, camera_.height, 0.4f);
    for (int y = 0; y < camera_.height; ++y)
      for (int x = 0; x < camera_.width; ++x) {
        alone.known(x, y) = 0.0f;
        alone.absent_missing(x, y) = 0.5f;
        const PoseEvidence evidence = evaluate(alone, *mesh_, X_CO_, kMaterials[0]);
        alone.known(x, y) = 0.4f;
        if (evidence.covered == 1) pixels_.push_back({x, y, 0.5 * std::exp(evidence.log_ratio)});
      }
  }

  struct Covered {
    int x, y;
    double opaque_missing;
  };

  AbsentMixture absent_at(const Covered& pixel) const {
    AbsentMixture absent = LikelihoodLaws::absent_at(terms_, background_, pixel.x, pixel.y);
    // Where nothing is known of the background's missing returns, the model has an opaque surface's.
    if (absent.missing < 0.0) absent.missing = pixel.opaque_missing;
    return absent;
  }

  void set(const Covered& pixel, const AbsentMixture& absent, double z) {
    terms_.depth(pixel.x, pixel.y) = static_cast<float>(z);
    terms_.inverse_absent(pixel.x, pixel.y) =
        z > 0.0 ? static_cast<float>(1.0 / terms_.model.density(absent, z)) : 0.0f;
  }

  MeshHandle mesh_ = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.012, 0.012, 0.012}}));
  Pose X_CO_{geometry::exp_rotation({0.4, 0.3, 0.2}), {0.021, 0.012, kDepth}};
  FrameTerms terms_;
  Background background_ = Background::kUnknown;
  std::vector<Covered> pixels_;
};

TEST_P(SmallBlock, RatioOfAPixelAveragesToOneOverFramesWithoutTheObject) {
  constexpr int kFrames = 100'000;
  for (const Background background : {Background::kUnknown, Background::kPlane, Background::kView}) {
    look(background);
    ASSERT_GE(pixels_.size(), 2u);
    const Covered pixel = pixels_[pixels_.size() / 2];
    const AbsentMixture absent = absent_at(pixel);
    terms_.known = geometry::DepthImage(camera_.width, camera_.height, 0.4f);
    terms_.known(pixel.x, pixel.y) = 0.0f;
    for (const SurfaceMaterial& material : kMaterials) {
      core::RandomStream stream(61, core::Purpose::kTest, static_cast<std::uint64_t>(background));
      Mean ratio;
      for (int frame = 0; frame < kFrames; ++frame) {
        set(pixel, absent, terms_.model.sample(absent, stream));
        ratio.add(std::exp(evaluate(terms_, *mesh_, X_CO_, material).log_ratio));
      }
      // Five standard errors: 18 such checks fail together once in 100 000 times.
      EXPECT_NEAR(ratio.mean(), 1.0, 5.0 * ratio.error() + 1e-4) << static_cast<int>(background) << " " << material.hit;
      EXPECT_LT(ratio.error(), 0.1);
    }
  }
}

TEST_P(SmallBlock, RatioOfTheObjectAveragesToOneOverFramesWithoutIt) {
  // A return that happens to lie on the surface counts a hundredfold, several at once hundredfolds of that, and hardly
  // ever happen: frames are drawn with more of them, and weighed by how often they happen.
  constexpr int kFrames = 100'000;
  constexpr double kSigma = 0.012;  // m, wider than the surface's noise and the block
  for (const Background background : {Background::kUnknown, Background::kPlane, Background::kView}) {
    look(background);
    ASSERT_GE(pixels_.size(), 4u);
    ASSERT_LE(pixels_.size(), 12u);
    for (const SurfaceMaterial& material : kMaterials) {
      core::RandomStream stream(62, core::Purpose::kTest, static_cast<std::uint64_t>(background));
      Mean ratio;
      for (int frame = 0; frame < kFrames; ++frame) {
        double weight = 1.0;
        for (const Covered& pixel : pixels_) {
          const AbsentMixture absent = absent_at(pixel);
          const double missing = 0.5 * (absent.missing + 0.25);
          AbsentMixture returned = absent;
          returned.missing = 0.0;
          double z = 0.0;
          if (stream.uniform() < missing) {
            weight *= absent.missing / missing;
          } else {
            const double on_surface = stream.normal(kDepth, kSigma);
            const double anywhere = terms_.model.sample(returned, stream);
            z = stream.uniform() < 0.5 ? on_surface : anywhere;
            const double t = (z - kDepth) / kSigma;
            const double surface_density = std::exp(-0.5 * t * t) / (kSigma * std::sqrt(2.0 * M_PI));
            const double density = terms_.model.density(absent, z);
            weight *= (1.0 - absent.missing) * density / ((1.0 - missing) * 0.5 * (surface_density + density));
          }
          set(pixel, absent, z);
        }
        ratio.add(weight * std::exp(evaluate(terms_, *mesh_, X_CO_, material).log_ratio));
      }
      EXPECT_NEAR(ratio.mean(), 1.0, 5.0 * ratio.error() + 1e-3) << static_cast<int>(background) << " " << material.hit;
      EXPECT_LT(ratio.error(), 0.15) << static_cast<int>(background) << " " << material.hit;
    }
  }
}

/// A carton in full view, measured without noise, nothing else in the frame.
class FullView : public LikelihoodLaws {
 protected:
  FullView() {
    RenderScene scene;
    scene.instances.push_back({mesh_, X_CO_, {}});
    RenderedView view;
    EXPECT_TRUE(make_reference_renderer()->render(scene, camera_, Pose::identity(), {}, &view).ok());
    depth_ = view.depth;
  }

  MeshHandle mesh_ = make_render_mesh(geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23));
  Pose X_CO_{geometry::exp_rotation({1.8, 0.4, 0.2}), {0.02, 0.01, 0.85}};
  geometry::DepthImage depth_;
};

TEST_P(FullView, WhatCannotBeSeenHasARatioOfExactlyOne) {
  const FrameTerms frame = terms_of(depth_, Background::kPlane);
  FrameTerms hidden;
  with_known_surfaces(frame, geometry::DepthImage(camera_.width, camera_.height, 0.5f), &hidden);
  const RenderMesh nothing;
  for (const SurfaceMaterial& material : kMaterials) {
    EXPECT_EQ(evaluate(hidden, *mesh_, X_CO_, material).log_ratio, 0.0);
    EXPECT_EQ(evaluate(frame, nothing, X_CO_, material).log_ratio, 0.0);
    for (const Vector3d& p : {Vector3d(0.0, 0.0, -1.0), Vector3d(5.0, 0.0, 0.8), Vector3d(0.0, 0.0, 4.0),
                              Vector3d(0.0, 0.0, 0.1), Vector3d(0.0, 0.0, 0.0)}) {
      const PoseEvidence evidence = evaluate(frame, *mesh_, {X_CO_.rotation, p}, material);
      EXPECT_EQ(evidence.log_ratio, 0.0) << p.transpose();
      EXPECT_EQ(evidence.tempered, 0.0);
      EXPECT_EQ(evidence.covered, 0);
    }
    // Without a frame, missing returns say nothing against opaque things, whatever is hidden.
    if (&material == &kMaterials[0]) {
      const geometry::DepthImage empty(camera_.width, camera_.height, 0.0f);
      EXPECT_EQ(evaluate(terms_of(empty, Background::kUnknown), *mesh_, X_CO_, material).log_ratio, 0.0);
    }
  }
}

TEST_P(FullView, EvidenceFallsAsMoreIsOccluded) {
  for (const Background background : {Background::kUnknown, Background::kPlane, Background::kView}) {
    const FrameTerms frame = terms_of(depth_, background);
    const PoseEvidence seen = evaluate(frame, *mesh_, X_CO_, kMaterials[0]);
    ASSERT_GT(seen.log_ratio, 100.0);
    double measured_nearer = seen.log_ratio, known_nearer = seen.log_ratio;
    int visible = seen.visible, covered = seen.covered;
    geometry::DepthImage occluded = depth_;
    geometry::DepthImage known(camera_.width, camera_.height, 0.0f);
    for (int x = 0; x < camera_.width; ++x) {
      for (int y = 0; y < camera_.height; ++y) {
        if (depth_(x, y) > 0.0f) occluded(x, y) = 0.6f;  // something that nobody knows of
        known(x, y) = 0.6f;                              // a neighbour whose pose is believed
      }
      const PoseEvidence unknown = evaluate(terms_of(occluded, background), *mesh_, X_CO_, kMaterials[0]);
      EXPECT_LE(unknown.log_ratio, measured_nearer) << x;
      EXPECT_LE(unknown.visible, visible) << x;
      measured_nearer = unknown.log_ratio;
      visible = unknown.visible;
      FrameTerms with_neighbour;
      with_known_surfaces(frame, known, &with_neighbour);
      const PoseEvidence hidden = evaluate(with_neighbour, *mesh_, X_CO_, kMaterials[0]);
      EXPECT_LE(hidden.log_ratio, known_nearer) << x;
      EXPECT_LE(hidden.covered, covered) << x;
      known_nearer = hidden.log_ratio;
      covered = hidden.covered;
    }
    EXPECT_EQ(visible, 0);
    // Something nearer than a known background speaks against that background, too, which is all that is left.
    EXPECT_LT(measured_nearer, 0.1 * seen.log_ratio);
    EXPECT_EQ(covered, 0);
    EXPECT_EQ(known_nearer, 0.0);
  }
}

/// The mesh with triangles cut: at a point inside of them (three each), or in two across an edge that both its
/// triangles get the new corner of.
geometry::TriangleMesh cut_inside(const geometry::TriangleMesh& mesh, core::RandomStream& stream) {
  geometry::TriangleMesh cut;
  cut.vertices = mesh.vertices;
  for (const auto& [a, b, c] : mesh.triangles) {
    if (stream.uniform() < 0.4) {
      cut.triangles.push_back({a, b, c});
      continue;
    }
    const double u = stream.uniform(0.1, 0.8);
    const double v = stream.uniform(0.1, 0.9 - u);
    const auto middle = static_cast<std::uint32_t>(cut.vertices.size());
    cut.vertices.push_back(u * mesh.vertices[a] + v * mesh.vertices[b] + (1.0 - u - v) * mesh.vertices[c]);
    cut.triangles.push_back({a, b, middle});
    cut.triangles.push_back({b, c, middle});
    cut.triangles.push_back({c, a, middle});
  }
  return cut;
}

geometry::TriangleMesh cut_edges(const geometry::TriangleMesh& mesh, core::RandomStream& stream) {
  geometry::TriangleMesh cut = mesh;
  for (int round = 0; round < 20; ++round) {
    const auto first = cut.triangles[stream.uniform_below(cut.triangles.size())];
    const auto a = first[0], b = first[1];
    const auto middle = static_cast<std::uint32_t>(cut.vertices.size());
    const double t = stream.uniform(0.2, 0.8);
    cut.vertices.push_back((1.0 - t) * cut.vertices[a] + t * cut.vertices[b]);
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const auto& triangle : cut.triangles) {
      bool whole = true;
      for (std::size_t i = 0; i < 3 && whole; ++i) {
        const auto p = triangle[i], q = triangle[(i + 1) % 3], r = triangle[(i + 2) % 3];
        if (!((p == a && q == b) || (p == b && q == a))) continue;
        triangles.push_back({p, middle, r});
        triangles.push_back({middle, q, r});
        whole = false;
      }
      if (whole) triangles.push_back(triangle);
    }
    cut.triangles = std::move(triangles);
  }
  return cut;
}

TEST_P(FullView, HowTheSurfaceIsCutIntoTrianglesDoesNotMatter) {
  const FrameTerms frame = terms_of(depth_, Background::kPlane);
  const geometry::TriangleMesh meshes[] = {geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23),
                                           geometry::make_open_bin({0.12, 0.1, 0.1}, 0.006),
                                           geometry::make_mesh(geometry::Cylinder{0.05, 0.14}, 16)};
  core::RandomStream stream(63, core::Purpose::kTest);
  int hypotheses = 0, moved_pixels = 0;
  for (const geometry::TriangleMesh& mesh : meshes) {
    const MeshHandle whole = make_render_mesh(mesh);
    for (int i = 0; i < 100; ++i) {
      const bool inside = i % 2 == 0;
      const MeshHandle cut = make_render_mesh(inside ? cut_inside(mesh, stream) : cut_edges(mesh, stream));
      EXPECT_GT(cut->triangles.size(), whole->triangles.size());
      geometry::Vector6d d;
      d << 0.3 * geometry::normal_vector(stream), 0.02 * geometry::normal_vector(stream);
      const Pose X_CO = geometry::box_plus(X_CO_, d);
      const SurfaceMaterial& material = kMaterials[i % 3];
      const PoseEvidence expected = evaluate(frame, *whole, X_CO, material);
      const PoseEvidence actual = evaluate(frame, *cut, X_CO, material);
      ASSERT_GT(expected.covered, 100);
      ++hypotheses;
      if (inside) {
        EXPECT_EQ(actual.in_view, expected.in_view) << i;
        EXPECT_EQ(actual.measured, expected.measured) << i;
      }
      // A corner put on an edge of the outline is snapped to 1/256 pixel and moves it by as much: a pixel whose centre
      // lies on the very edge may change sides.
      moved_pixels += std::abs(actual.in_view - expected.in_view);
      if (actual.in_view == expected.in_view) {
        EXPECT_NEAR(actual.log_ratio, expected.log_ratio, 0.02 + 1e-4 * std::abs(expected.log_ratio)) << i;
      }
    }
  }
  EXPECT_LT(moved_pixels, hypotheses / 4);
}

const auto kName = [](const auto& test) { return std::string(test.param.name); };
INSTANTIATE_TEST_SUITE_P(Backends, SmallBlock, testing::ValuesIn(kBackends), kName);
INSTANTIATE_TEST_SUITE_P(Backends, FullView, testing::ValuesIn(kBackends), kName);

}  // namespace
}  // namespace prescene::rendering::likelihood_laws_test
