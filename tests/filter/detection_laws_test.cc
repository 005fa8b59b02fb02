// SPDX-License-Identifier: Apache-2.0
// Detection in one frame: against poses that are known, and against what its contract says of any frame.
#include "prescene/filter/proposals/detection.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "filter_fixture.h"
#include "prescene/filter/operators/initialise.h"

namespace prescene::filter_tests {
namespace {

using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

SearchTarget target_of_mesh(const geometry::TriangleMesh& mesh) {
  return {rendering::make_render_mesh(mesh), rendering::SurfaceMaterial::opaque({100, 100, 100}), -1};
}

TEST(ClusterStarts, PutTheCentreOnTheRayOfASeenPointAndUpToItsRadiusBehind) {
  // A mesh whose centre is not its origin.
  const SearchTarget target = target_of_mesh(geometry::transformed(
      geometry::make_mesh(geometry::BoxShape{Vector3d(0.1, 0.06, 0.2)}), Pose::from_translation({0.3, -0.1, 0.05})));
  const auto radius = static_cast<double>(target.mesh->radius);
  Cluster cluster;
  cluster.points_C = {{0.1, 0.2, 0.8}, {-0.3, 0.1, 1.2}, {0.0, 0.0, 0.5}, {0.2, -0.4, 1.0}};
  constexpr int kStarts = 2000;
  const std::vector<Pose> starts =
      cluster_starts(cluster, target, Vector3d::UnitZ(), 0.0, kStarts, {3, core::Purpose::kDetection});
  ASSERT_EQ(starts.size(), static_cast<std::size_t>(kStarts));
  std::array<int, 4> of_point{};
  std::array<double, 4> deepest{};
  geometry::Matrix3d mean = geometry::Matrix3d::Zero(), squares = geometry::Matrix3d::Zero();
  for (const Pose& start : starts) {
    const Vector3d centre = start * target.centre();
    int matches = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector3d& seen = cluster.points_C[i];
      const Vector3d ray = seen.normalized();
      const double behind = (centre - seen).dot(ray);
      if ((centre - seen - behind * ray).norm() > 1e-9) continue;
      ++matches;
      ++of_point[i];
      EXPECT_GE(behind, -1e-9);
      EXPECT_LE(behind, radius + 1e-9);
      deepest[i] = std::max(deepest[i], behind);
    }
    EXPECT_EQ(matches, 1);
    const geometry::Matrix3d R = start.rotation.toRotationMatrix();
    mean += R / kStarts;
    squares += R.cwiseProduct(R) / kStarts;
  }
  // 2000 draws: a share of 1/4 is off by 0.0097; entries of uniform rotations have mean 0 and mean square 1/3 with
  // standard deviations of 0.577 and 0.298 a draw. Five of each.
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(of_point[i] / static_cast<double>(kStarts), 0.25, 0.049) << i;
    EXPECT_GT(deepest[i], 0.5 * radius) << i;
  }
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 0.065);
  EXPECT_LT((squares.array() - 1.0 / 3.0).abs().maxCoeff(), 0.034);
  const std::vector<Pose> fewer =
      cluster_starts(cluster, target, Vector3d::UnitZ(), 0.0, 5, {3, core::Purpose::kDetection});
  EXPECT_TRUE(std::equal(fewer.begin(), fewer.end(), starts.begin()));
}

/// Every pixel measured at `depth`.
SampledDepth wall(const geometry::PinholeCamera& camera, float depth) {
  return sample_depth(geometry::DepthImage(camera.width, camera.height, depth), camera, {.target_width = camera.width});
}

int count(const geometry::Image<std::uint8_t>& mask) {
  return static_cast<int>(std::count(mask.data(), mask.data() + mask.size(), std::uint8_t{1}));
}

TEST(ExplainedPixels, AreThoseAtASurfaceOrShortlyBehindIt) {
  const geometry::PinholeCamera camera{40, 30, 36.0, 36.0, 19.5, 14.5};
  const geometry::DepthImage known(40, 30, 1.0f);
  const double tolerance = 0.015;
  for (const double ahead : {0.2, 0.016})
    EXPECT_EQ(count(explained_pixels(wall(camera, static_cast<float>(1.0 - ahead)), known, camera, tolerance)), 0)
        << ahead;
  for (const double behind : {-0.014, 0.0, 0.014, 0.029})
    EXPECT_EQ(count(explained_pixels(wall(camera, static_cast<float>(1.0 + behind)), known, camera, tolerance)),
              40 * 30)
        << behind;
  for (const double behind : {0.031, 0.3})
    EXPECT_EQ(count(explained_pixels(wall(camera, static_cast<float>(1.0 + behind)), known, camera, tolerance)), 0)
        << behind;
}

TEST(ExplainedPixels, AreNoneWithoutAMeasurementOrAKnownSurface) {
  const geometry::PinholeCamera camera{40, 30, 36.0, 36.0, 19.5, 14.5};
  const auto nothing_known = explained_pixels(wall(camera, 1.0f), {}, camera, 0.015);
  EXPECT_EQ(nothing_known.width(), 40);
  EXPECT_EQ(nothing_known.height(), 30);
  EXPECT_EQ(count(nothing_known), 0);
  EXPECT_EQ(count(explained_pixels(wall(camera, 1.0f), geometry::DepthImage(40, 30, 0.0f), camera, 0.015)), 0);
  EXPECT_EQ(count(explained_pixels(wall(camera, 0.0f), geometry::DepthImage(40, 30, 1.0f), camera, 0.015)), 0);
}

TEST(ExplainedPixels, OfACoarserKnownImageReachOnePixelPastItsOutline) {
  // The known image has half the resolution; a pixel's ray is the same in both.
  const geometry::PinholeCamera camera{80, 60, 72.0, 72.0, 39.5, 29.5};
  const geometry::PinholeCamera half{40, 30, 36.0, 36.0, 19.5, 14.5};
  geometry::DepthImage known(40, 30, 0.0f);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 20; ++x) known(x, y) = 1.0f;
  const auto mask = explained_pixels(wall(camera, 1.0f), known, half, 0.015);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) {
      // (x - 39.5) / 72 = (u - 19.5) / 36; known are u <= 19, and 20 is the pixel past the outline.
      const double u = 19.5 + 0.5 * (x - 39.5);
      if (std::abs(u - 20.5) < 0.3) continue;  // rounded either way
      EXPECT_EQ(mask(x, y) != 0, u < 20.5) << x << ", " << y;
    }
}

/// A table, a carton, a box and a can on it, apart from each other; the scene says no more than that they may be there.
class KnownObjects : public ::testing::Test {
 protected:
  KnownObjects()
      : models_{carton_model("carton"), box_model("box", {0.06, 0.10, 0.18}), can_model("can", 0.035, 0.11)},
        poses_{Pose{geometry::exp_rotation({0.0, 0.0, 0.5}), {-0.08, -0.16, 0.11}},
               Pose{geometry::exp_rotation({0.0, 0.0, -0.3}), {0.05, 0.02, 0.09}},
               Pose{geometry::exp_rotation({1.5707963, 0.0, 0.0}), {-0.05, 0.18, 0.035}}} {
    see(models_, poses_);
  }

  void see(const std::vector<belief::ObjectModel>& models, const std::vector<Pose>& poses) {
    sequence_ = still_sequence(models, poses);
    observation_ = sequence_.observe(0, *backends_.renderer);
    scene_ = open_scene(models);
    frame_ = backends_.frame_of(scene_, observation_);
    const DetectionOptions options;
    sampled_ = sample_depth(*observation_.frame.depth, observation_.frame.camera, options.segmentation);
    std::vector<WantedModel> all;
    for (const belief::ObjectModel& model : models) all.push_back(wanted(model));
    surroundings_ =
        surroundings_in(frame_, sampled_, *scene_, all, options.segmentation, {1, core::Purpose::kDetection});
    ASSERT_FALSE(surroundings_.solid.empty());
  }
  WantedModel wanted(const belief::ObjectModel& model, int count = 1) {
    return {target_of(model, frame_, backends_.tools), count};
  }
  std::vector<Detection> found(const std::vector<WantedModel>& models, const DetectionOptions& options = {},
                               const rendering::FrameTerms* terms = nullptr, const geometry::DepthImage& known = {}) {
    return detect(terms ? *terms : frame_.terms, known, sampled_, surroundings_, models, options, backends_.tools,
                  {5, core::Purpose::kDetection});
  }
  double distance(const Detection& detection, const Pose& X_WO, const SearchTarget& target) const {
    return (frame_.X_WC * detection.X_CO * target.centre() - X_WO * target.centre()).norm();
  }
  static std::vector<int> models_of(const std::vector<Detection>& found) {
    std::vector<int> models;
    for (const Detection& detection : found) models.push_back(detection.model);
    return models;
  }

  Backends backends_;
  std::vector<belief::ObjectModel> models_;
  std::vector<Pose> poses_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
  std::shared_ptr<const belief::Scene> scene_;
  FilterFrame frame_;
  SampledDepth sampled_;
  Surroundings surroundings_;
};

TEST_F(KnownObjects, EachIsFoundWhereItIsAndWhatIsNotThereIsNot) {
  const std::vector<WantedModel> models = {wanted(models_[0]), wanted(models_[1]), wanted(models_[2]),
                                           wanted(box_model("brick", {0.20, 0.20, 0.25}))};
  const std::vector<Detection> detections = found(models);
  ASSERT_THAT(models_of(detections), UnorderedElementsAre(0, 1, 2));
  const DetectionOptions options;
  for (const Detection& detection : detections) {
    const auto model = static_cast<std::size_t>(detection.model);
    SCOPED_TRACE(models_[model].name);
    EXPECT_LT(distance(detection, poses_[model], models[model].target), 0.015);
    EXPECT_GT(detection.evidence.log_ratio, options.min_log_ratio);
    EXPECT_GE(detection.evidence.hit_share(), options.min_hit_share);
  }

  // The evidence is that of the pose with the others as known surfaces. The one that was settled last saw all others
  // where they are now.
  rendering::FrameTerms terms = frame_.terms;
  for (std::size_t i = 0; i + 1 < detections.size(); ++i) {
    const auto model = static_cast<std::size_t>(detections[i].model);
    with_known_surfaces(terms, depth_of(models[model].target, detections[i].X_CO, terms.camera, *backends_.renderer),
                        &terms);
  }
  const Detection& last = detections.back();
  const auto pose = hypothesis(models[static_cast<std::size_t>(last.model)].target, last.X_CO);
  rendering::PoseEvidence evidence;
  const auto workspace = backends_.likelihood->make_workspace();
  backends_.likelihood->evaluate(terms, std::span(&pose, 1), *workspace, std::span(&evidence, 1));
  EXPECT_NEAR(evidence.log_ratio, last.evidence.log_ratio, 1e-6 * std::abs(evidence.log_ratio));
  EXPECT_EQ(evidence.visible, last.evidence.visible);
}

TEST_F(KnownObjects, BitsDoNotDependOnThreads) {
  const std::vector<Detection> two = found({wanted(models_[0]), wanted(models_[2])});
  Backends one(1);
  const std::vector<WantedModel> models = {{target_of(models_[0], frame_, one.tools), 1},
                                           {target_of(models_[2], frame_, one.tools), 1}};
  const std::vector<Detection> again =
      detect(frame_.terms, {}, sampled_, surroundings_, models, {}, one.tools, {5, core::Purpose::kDetection});
  ASSERT_EQ(again.size(), two.size());
  for (std::size_t i = 0; i < two.size(); ++i) {
    EXPECT_EQ(again[i].model, two[i].model);
    EXPECT_EQ(again[i].X_CO, two[i].X_CO);
    EXPECT_EQ(again[i].evidence.log_ratio, two[i].evidence.log_ratio);
  }
}

TEST_F(KnownObjects, WhatIsKnownIsNotFoundAgain) {
  const WantedModel box = wanted(models_[1]);
  const geometry::DepthImage known =
      depth_of(box.target, frame_.X_CW * poses_[1], frame_.terms.camera, *backends_.renderer);
  rendering::FrameTerms terms;
  with_known_surfaces(frame_.terms, known, &terms);
  for (const Detection& detection : found({box}, {}, &terms, known))
    EXPECT_GT(distance(detection, poses_[1], box.target), 0.1);
  // Beside it, the others are found as before.
  const std::vector<WantedModel> others = {box, wanted(models_[2])};
  const std::vector<Detection> detections = found(others, {}, &terms, known);
  const auto can = std::ranges::find(detections, 1, &Detection::model);
  ASSERT_NE(can, detections.end());
  EXPECT_LT(distance(*can, poses_[2], others[1].target), 0.015);
}

TEST_F(KnownObjects, NothingIsFoundWhereNothingIsWantedOrGoodEnough) {
  EXPECT_THAT(found({}), IsEmpty());
  EXPECT_THAT(found({wanted(models_[1], 0)}), IsEmpty());
  DetectionOptions strict;
  strict.starts = 16;
  strict.min_log_ratio = 1e9;
  EXPECT_THAT(found({wanted(models_[1])}, strict), IsEmpty());
  strict.min_log_ratio = 40.0;
  strict.min_hit_share = 1.01;
  EXPECT_THAT(found({wanted(models_[1])}, strict), IsEmpty());
}

TEST_F(KnownObjects, AnEmptyTableHoldsNothing) {
  see({models_[1]}, {Pose::from_translation({0.0, 0.0, 5.0})});  // above the camera
  EXPECT_THAT(found({wanted(models_[0]), wanted(models_[1]), wanted(models_[2])}), IsEmpty());
}

TEST_F(KnownObjects, AsManyOfAKindAreFoundAsMayBe) {
  const belief::ObjectModel first = box_model("first", {0.06, 0.10, 0.18});
  belief::ObjectModel second = first;
  second.name = "second";
  const std::array<Pose, 2> X_WO = {Pose{geometry::exp_rotation({0.0, 0.0, 0.2}), {0.0, -0.15, 0.09}},
                                    Pose{geometry::exp_rotation({0.0, 0.0, -0.6}), {0.03, 0.15, 0.09}}};
  see({first, second}, {X_WO[0], X_WO[1]});
  const SearchTarget target = wanted(first).target;
  const auto places = [&](int most) {
    std::array<int, 2> at{};
    for (const Detection& detection : found({{target, most}}))
      for (std::size_t i = 0; i < 2; ++i) at[i] += distance(detection, X_WO[i], target) < 0.015;
    return at;
  };
  const std::array<int, 2> one = places(1);
  EXPECT_EQ(one[0] + one[1], 1);
  EXPECT_EQ(places(2), (std::array<int, 2>{1, 1}));
  EXPECT_EQ(places(3), (std::array<int, 2>{1, 1}));
}

TEST(ProbabilityRight, GrowsWithTheEvidenceAndWithWhatIsThereOfTheExpected) {
  rendering::PoseEvidence evidence;
  evidence.visible = 40;
  evidence.log_ratio = evidence.visible_log_ratio = 200.0;
  const double matched = probability_right(evidence, 5.0);
  EXPECT_GT(matched, 0.5);
  EXPECT_LT(matched, 1.0);
  // More than expected is no better than as expected.
  EXPECT_EQ(probability_right(evidence, 2.5), matched);
  EXPECT_LT(probability_right(evidence, 6.0), matched);
  EXPECT_LT(probability_right(evidence, 10.0), 0.1);
  evidence.visible = 400;
  evidence.log_ratio = evidence.visible_log_ratio = 2000.0;
  EXPECT_GT(probability_right(evidence, 5.0), matched);
  // Where what to expect is not known, the evidence alone says it.
  EXPECT_EQ(probability_right(evidence, std::numeric_limits<double>::infinity()), probability_right(evidence, 5.0));
  evidence.log_ratio = -1.0;
  EXPECT_EQ(probability_right(evidence, 5.0), 0.0);
}

}  // namespace
}  // namespace prescene::filter_tests
