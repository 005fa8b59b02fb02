// SPDX-License-Identifier: Apache-2.0
// Finds that are judged in the fine image, and which cameras let them be.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "filter_fixture.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/filter/proposals/fit_judgement.h"
#include "prescene/geometry/primitives.h"

namespace prescene::filter_tests {
namespace {

using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr int kPictureWidth = 160, kPictureHeight = 120;
constexpr int kLeft = 50, kRight = 110, kTop = 40, kBottom = 80;  // of a red thing in front of a grey wall

struct Picture {
  geometry::DepthImage depth{kPictureWidth, kPictureHeight, 1.4F};
  geometry::ColorImage color{kPictureWidth, kPictureHeight, geometry::Rgb{120, 120, 125}};
};

/// A thing 1 m away before a wall at 1.4 m. In depth it reaches `further` pixels past where it ends in colour, and
/// beside that `lost` pixels show nothing.
Picture before_a_wall(int further, int lost) {
  Picture picture;
  for (int y = 0; y < kPictureHeight; ++y)
    for (int x = 0; x < kPictureWidth; ++x) {
      const int outside = std::max({kLeft - x, x - kRight, kTop - y, y - kBottom});
      if (outside <= 0) picture.color(x, y) = {180, 40, 40};
      if (outside <= further)
        picture.depth(x, y) = 1.0F;
      else if (outside <= further + lost)
        picture.depth(x, y) = 0.0F;
    }
  return picture;
}

TEST(EdgeSmear, IsHowFarEdgesInDepthAreFromThoseInColour) {
  for (const int further : {-4, -1, 0, 1, 2, 6}) {
    const Picture picture = before_a_wall(further, 0);
    const EdgeSmear smear = measure_edge_smear(picture.depth, &picture.color);
    EXPECT_GE(smear.edges, kRight - kLeft + kBottom - kTop) << further;
    EXPECT_EQ(smear.pixels, std::abs(further)) << further;
    EXPECT_EQ(smear.is_sharp(), std::abs(further) <= 1) << further;
  }
}

TEST(EdgeSmear, WhatIsLostBesideAnEdgeIsNoSmear) {
  const Picture few = before_a_wall(0, 2), many = before_a_wall(0, 9);
  EXPECT_TRUE(measure_edge_smear(few.depth, &few.color).is_sharp());
  // Where a hole is all that is seen beside an edge, it does not tell.
  EXPECT_EQ(measure_edge_smear(many.depth, &many.color).edges, 0);
}

TEST(EdgeSmear, IsNotKnownWithoutColoursOrEdges) {
  const Picture picture = before_a_wall(0, 0);
  const geometry::ColorImage grey(kPictureWidth, kPictureHeight, geometry::Rgb{120, 120, 120}), small(80, 60);
  const geometry::DepthImage wall(kPictureWidth, kPictureHeight, 1.4F), nothing(kPictureWidth, kPictureHeight, 0.0F);
  for (const EdgeSmear& smear : {measure_edge_smear(picture.depth, nullptr), measure_edge_smear(picture.depth, &grey),
                                 measure_edge_smear(picture.depth, &small), measure_edge_smear(wall, &picture.color),
                                 measure_edge_smear(nothing, &picture.color)}) {
    EXPECT_EQ(smear.edges, 0);
    EXPECT_FALSE(smear.is_sharp());
  }
}

/// As measured of a camera that shows surfaces end where they do.
constexpr EdgeSmear kSharp = {0.0, 1000};

/// A table, a carton, a box and a can on it, apart from each other; the scene says no more than that they may be there.
class FineFinding : public ::testing::Test {
 protected:
  FineFinding()
      : models_{carton_model("carton"), box_model("box", {0.06, 0.10, 0.18}), can_model("can", 0.035, 0.11)},
        poses_{Pose{geometry::exp_rotation({0.0, 0.0, 0.5}), {-0.08, -0.16, 0.11}},
               Pose{geometry::exp_rotation({0.0, 0.0, -0.3}), {0.05, 0.02, 0.09}},
               Pose{geometry::exp_rotation({1.5707963, 0.0, 0.0}), {-0.05, 0.18, 0.035}}} {
    see(models_, poses_);
  }

  void see(const std::vector<belief::ObjectModel>& models, const std::vector<Pose>& poses,
           const std::vector<Occluder>& occluders = {}) {
    sequence_ = still_sequence(models, poses);
    sequence_.occluders = occluders;
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
  /// As a camera that is sharp, or not, lets them be judged.
  std::vector<Detection> found(const std::vector<WantedModel>& models, const EdgeSmear& smear = kSharp) {
    FineFrame fine = fine_frame(frame_, *scene_, observation_, backends_.tools);
    fine.smear = smear;
    return detect(frame_.terms, fine, {}, sampled_, surroundings_, models, {}, backends_.tools,
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

TEST_F(FineFinding, FineTermsAreTheFrameAtAnotherResolution) {
  const rendering::FrameTerms fine = fine_frame(frame_, *scene_, observation_, backends_.tools).terms;
  ASSERT_EQ(fine.camera.width, 320);
  EXPECT_EQ(fine.step, observation_.frame.camera.width / 320);
  EXPECT_GT(frame_.terms.step, fine.step);
  // Each of its pixels is one of the observation, seen along the same ray.
  for (int y = 3; y < fine.camera.height; y += 17)
    for (int x = 3; x < fine.camera.width; x += 17) {
      const Eigen::Vector2d pixel = observation_.frame.camera.project(fine.camera.unproject(x, y, 1.0));
      const float z = (*observation_.frame.depth)(static_cast<int>(std::lround(pixel.x())),
                                                  static_cast<int>(std::lround(pixel.y())));
      EXPECT_LT((pixel.array() - pixel.array().round()).abs().maxCoeff(), 1e-6);
      const auto& range = fine.model.options();
      if (z > 0.0F) {
        EXPECT_FLOAT_EQ(fine.depth(x, y),
                        std::clamp(z, static_cast<float>(range.min_depth), static_cast<float>(range.max_depth)));
      } else {
        EXPECT_EQ(fine.depth(x, y), 0.0F);
      }
    }
}

TEST_F(FineFinding, AnOutlineEndsAtASupportThatTheFrameAloneShows) {
  const rendering::FrameTerms fine = fine_frame(frame_, *scene_, observation_, backends_.tools).terms;
  const rendering::FrameTerms known = with_background(fine, sampled_, surroundings_);
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const geometry::DepthImage depth =
        depth_of(wanted(models_[i]).target, frame_.X_CW * poses_[i], fine.camera, *backends_.renderer);
    const double before = outline_support(fine, depth, 0.02), after = outline_support(known, depth, 0.02);
    EXPECT_GE(after, before) << models_[i].name;
    EXPECT_GT(after, 0.9) << models_[i].name;
  }
}

TEST_F(FineFinding, APartOfALargerThingIsNotFound) {
  // Nobody knows of the crate, whose faces explain those of the box.
  const belief::ObjectModel crate = box_model("crate", {0.14, 0.18, 0.17});
  see({crate}, {Pose{geometry::exp_rotation({0.0, 0.0, 0.3}), {0.0, 0.0, 0.085}}});
  EXPECT_THAT(found({wanted(box_model("box", {0.06, 0.10, 0.12}))}), IsEmpty());
  // The crate itself is found by its own model.
  EXPECT_EQ(found({wanted(crate)}).size(), 1U);
}

TEST_F(FineFinding, AStackIsFoundWhole) {
  // The tray's corners all lie beyond the edges of the box that it lies on, and neither ends but at the other.
  const belief::ObjectModel box = box_model("box", {0.09, 0.11, 0.14}), tray = box_model("tray", {0.12, 0.14, 0.04});
  const std::vector<Pose> poses = {Pose{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.0, 0.0, 0.07}},
                                   Pose{geometry::exp_rotation({0.0, 0.0, -0.2}), {0.01, 0.0, 0.16}}};
  see({box, tray}, poses);
  const std::vector<WantedModel> models = {wanted(box), wanted(tray)};
  const std::vector<Detection> detections = found(models);
  ASSERT_THAT(models_of(detections), UnorderedElementsAre(0, 1));
  for (const Detection& detection : detections) {
    const auto model = static_cast<std::size_t>(detection.model);
    EXPECT_TRUE(detection.stands) << model;
    EXPECT_LT(distance(detection, poses[model], models[model].target), 0.015) << model;
  }
}

TEST_F(FineFinding, IsFoundWhereOneEndIsHiddenAndBelievedLessWhereBothAre) {
  const belief::ObjectModel brick = box_model("brick", {0.06, 0.20, 0.10});
  const Vector3d p_WO(0.0, 0.0, 0.05), towards = (test_camera_pose().translation - p_WO).normalized();
  const Vector3d aside = Vector3d::UnitZ().cross(towards).normalized();
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, std::atan2(-aside.x(), aside.y())}), p_WO};
  const auto post = [&](double side) {
    return Occluder{geometry::make_mesh(geometry::BoxShape{{0.10, 0.25, 0.01}}),
                    fixed({test_camera_pose().rotation, p_WO + 0.2 * towards + side * 0.085 * aside})};
  };
  const auto found_behind = [&](const std::vector<Occluder>& posts) {
    see({brick}, {X_WO}, posts);
    return found({wanted(brick)});
  };
  const std::vector<Detection> seen = found_behind({}), behind_one = found_behind({post(1.0)}),
                               behind_two = found_behind({post(-1.0), post(1.0)});
  const SearchTarget target = wanted(brick).target;
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_LT(distance(seen[0], X_WO, target), 0.01);
  ASSERT_EQ(behind_one.size(), 1U);
  EXPECT_LT(distance(behind_one[0], X_WO, target), 0.02);
  // With both ends hidden, it may be further to either side.
  if (!behind_two.empty()) {
    EXPECT_LT(behind_two[0].probability, behind_one[0].probability);
    EXPECT_LT(behind_two[0].margin, behind_one[0].margin);
  }
}

TEST_F(FineFinding, IsJudgedInTheFineImageOfASharpCameraAlone) {
  const std::vector<WantedModel> models = {wanted(models_[0]), wanted(models_[1]), wanted(models_[2])};
  const std::vector<Detection> sharp = found(models);
  ASSERT_THAT(models_of(sharp), UnorderedElementsAre(0, 1, 2));
  for (const Detection& detection : sharp) {
    const auto model = static_cast<std::size_t>(detection.model);
    EXPECT_LT(distance(detection, poses_[model], models[model].target), 0.01) << model;
    EXPECT_GE(detection.outline, 0.9) << model;
    EXPECT_GE(detection.probability, 0.8) << model;
  }
  const std::vector<Detection> coarse =
      detect(frame_.terms, {}, sampled_, surroundings_, models, {}, backends_.tools, {5, core::Purpose::kDetection});
  for (const EdgeSmear& smear : {EdgeSmear{3.0, 1000}, EdgeSmear{}}) {
    const std::vector<Detection> smeared = found(models, smear);
    ASSERT_EQ(smeared.size(), coarse.size());
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      EXPECT_EQ(smeared[i].X_CO.translation, coarse[i].X_CO.translation);
      EXPECT_EQ(smeared[i].evidence.log_ratio, coarse[i].evidence.log_ratio);
    }
  }
}

TEST(ProbabilityOfFit, FallsWithAllThatSpeaksAgainstAFitAndWithItsRivals) {
  FitNumbers good{};
  good[kFitEvidenceShare] = 1.0F;
  good[kFitOutline] = 1.0F;
  good[kFitResidual] = 0.7F;
  const double best = probability_of_fit(good);
  EXPECT_GT(best, 0.95);
  for (const auto& [which, worse] : {std::pair{kFitEvidenceShare, 0.8F},
                                     {kFitOutline, 0.8F},
                                     {kFitResidual, 1.0F},
                                     {kFitRivalModels, -1.0F},
                                     {kFitRivalPoses, -1.0F}}) {
    FitNumbers numbers = good;
    numbers[which] = worse;
    const double probability = probability_of_fit(numbers);
    EXPECT_GT(probability, 0.0) << which;
    EXPECT_LT(probability, best) << which;
  }
  // More evidence than expected, and rivals that explain next to nothing, count no more than enough.
  FitNumbers more = good;
  more[kFitEvidenceShare] = 1.5F;
  EXPECT_EQ(probability_of_fit(more), best);
  more[kFitRivalModels] = 1.0F;
  const double without_rival = probability_of_fit(more);
  more[kFitRivalModels] = 3.0F;
  EXPECT_EQ(probability_of_fit(more), without_rival);
}

TEST(ProbabilityOfFind, FallsWithTheFitAndWithWhatFitsBesideIt) {
  EXPECT_GT(probability_of_find(0.99, 1.0), 0.99);
  for (const double fit : {0.3, 0.6, 0.95})
    for (const double margin : {0.02, 0.2, 0.9}) {
      EXPECT_LT(probability_of_find(fit, margin), probability_of_find(fit + 0.04, margin));
      EXPECT_LT(probability_of_find(fit, margin), probability_of_find(fit, margin + 0.05));
    }
  // A place beside it that explains more says no more than one that explains the same, and no other place is no rival.
  EXPECT_EQ(probability_of_find(0.9, -0.5), probability_of_find(0.9, 0.0));
  EXPECT_EQ(probability_of_find(0.9, std::numeric_limits<double>::infinity()), probability_of_find(0.9, 1.0));
  EXPECT_LT(probability_of_find(1.0, 0.0), 1.0);
}

}  // namespace
}  // namespace prescene::filter_tests
