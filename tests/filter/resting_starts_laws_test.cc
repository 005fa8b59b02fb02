// SPDX-License-Identifier: Apache-2.0
// Poses that follow from how models lie and from what a cluster shows of their edges; outlines at which colours change.
#include "prescene/filter/proposals/resting_starts.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "filter_fixture.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/geometry/primitives.h"

namespace prescene::filter_tests {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

RestingShape shape_of(const geometry::TriangleMesh& mesh) {
  return resting_shape_of(*rendering::make_render_mesh(mesh));
}

TEST(RestingShape, OfABoxIsThreePairsOfFaces) {
  const Vector3d size(0.06, 0.10, 0.18);
  const RestingShape shape = shape_of(geometry::make_mesh(geometry::BoxShape{size}));
  ASSERT_THAT(shape.rests, SizeIs(3));
  std::vector<double> heights;
  for (const std::vector<Rest>& alike : shape.rests) {
    ASSERT_THAT(alike, SizeIs(2));
    heights.push_back(alike[0].top - alike[0].bottom);
    for (const Rest& rest : alike) {
      EXPECT_NEAR(rest.top, -rest.bottom, 1e-6);
      ASSERT_THAT(rest.sides, SizeIs(4));
      double around = 0.0;
      for (const auto& [from, to] : rest.sides) {
        around += (to - from).norm();
        // Its middle is to the left of each side.
        EXPECT_GT((to - from).x() * (rest.middle - from).y() - (to - from).y() * (rest.middle - from).x(), 0.0);
      }
      EXPECT_NEAR(around, 2.0 * (size.sum() - heights.back()), 1e-5);
      EXPECT_GT(rest.reach, 0.029);
    }
  }
  std::sort(heights.begin(), heights.end());
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(heights[static_cast<std::size_t>(i)], size[i], 1e-6);
  // The largest face down is the likeliest.
  EXPECT_NEAR(shape.rests[0][0].top - shape.rests[0][0].bottom, 0.06, 1e-6);
}

TEST(RestingShape, RoundThingsHaveNoSidesAndOneWayToLieOnThem) {
  const RestingShape can = shape_of(geometry::make_mesh(geometry::Cylinder{0.034, 0.102}, 24));
  ASSERT_THAT(can.rests, SizeIs(2));
  for (const std::vector<Rest>& alike : can.rests)
    for (const Rest& rest : alike) {
      const bool is_upright = rest.top - rest.bottom > 0.1;
      EXPECT_THAT(rest.sides, SizeIs(is_upright ? 0 : 4));
      EXPECT_NEAR(rest.reach, 0.034, 0.001);
    }
  const RestingShape ball = shape_of(geometry::make_mesh(geometry::Sphere{0.045}, 24));
  ASSERT_THAT(ball.rests, SizeIs(1));
  for (const Rest& rest : ball.rests[0]) EXPECT_THAT(rest.sides, IsEmpty());
}

TEST(RestingShape, OfAFlatMeshIsEmpty) {
  geometry::TriangleMesh leaf;
  leaf.vertices = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  leaf.triangles = {{0, 1, 2}};
  EXPECT_THAT(shape_of(leaf).rests, IsEmpty());
}

/// A box on a table, of which a thing that nobody knows of may hide some.
class RestingBox : public ::testing::Test {
 protected:
  void see(const Vector3d& size, const Pose& X_WO, const std::vector<Occluder>& occluders = {}) {
    model_ = box_model("box", size);
    X_WO_ = X_WO;
    SimulatedSequence sequence = still_sequence({model_}, {X_WO});
    sequence.occluders = occluders;
    visible_ = sequence.visible_share(0, 0, *backends_.renderer);
    observation_ = sequence.observe(0, *backends_.renderer);
    scene_ = open_scene({model_});
    frame_ = backends_.frame_of(scene_, observation_);
    const DetectionOptions options;
    sampled_ = sample_depth(*observation_.frame.depth, observation_.frame.camera, options.segmentation);
    target_ = target_of(model_, frame_, backends_.tools);
    const std::vector<WantedModel> wanted = {{target_, 1}};
    surroundings_ =
        surroundings_in(frame_, sampled_, *scene_, wanted, options.segmentation, {1, core::Purpose::kDetection});
    fine_ = fine_frame(frame_, *scene_, observation_, backends_.tools);
    clusters_ = find_clusters(sampled_, surroundings_.background, options.segmentation);
    shapes_ = cluster_shapes(clusters_, sampled_, fine_.terms, surroundings_, {1, core::Purpose::kProposal});
  }
  /// Distance of the nearest start of any cluster from where the box is: that of a corner, whichever way it is turned.
  double nearest(int most) const {
    const RestingShape shape = resting_shape_of(*target_.mesh);
    double least = std::numeric_limits<double>::infinity();
    for (const ClusterShape& seen : shapes_)
      for (const Pose& X_CO :
           resting_starts(seen, shape, fine_.terms, surroundings_, most, {3, core::Purpose::kProposal})) {
        double furthest = 0.0;
        for (const auto& vertex : target_.mesh->vertices) {
          const Vector3d corner = frame_.X_WC * X_CO * vertex.cast<double>();
          double near = std::numeric_limits<double>::infinity();
          for (const auto& other : target_.mesh->vertices)
            near = std::min(near, (X_WO_ * other.cast<double>() - corner).norm());
          furthest = std::max(furthest, near);
        }
        least = std::min(least, furthest);
      }
    return least;
  }

  Backends backends_;
  belief::ObjectModel model_;
  Pose X_WO_;
  belief::Observation observation_;
  std::shared_ptr<const belief::Scene> scene_;
  FilterFrame frame_;
  SampledDepth sampled_;
  SearchTarget target_;
  Surroundings surroundings_;
  FineFrame fine_;
  std::vector<Cluster> clusters_;
  std::vector<ClusterShape> shapes_;
  double visible_ = 0.0;
};

TEST_F(RestingBox, ItsEdgesAndHeightsAreSeen) {
  const double turn = 0.5;
  see({0.06, 0.10, 0.18}, {geometry::exp_rotation({0.0, 0.0, turn}), {0.0, 0.0, 0.09}});
  ASSERT_FALSE(shapes_.empty());
  const ClusterShape& seen = shapes_[0];
  ASSERT_FALSE(seen.tops.empty());
  ASSERT_FALSE(seen.bases.empty());
  EXPECT_NEAR(seen.tops[0], 0.18, 0.006);
  EXPECT_NEAR(seen.bases[0], 0.0, 0.006);
  // Each upright face that is seen has an edge, where the face is.
  int right = 0;
  for (const double angle : {0.0, 0.5, 1.0, 1.5}) {
    const double way = turn + angle * std::numbers::pi;
    const Eigen::Vector2d outwards(std::cos(way), std::sin(way));
    const double offset = angle == std::floor(angle) ? 0.03 : 0.05, half = 0.08 - offset;
    right += std::any_of(seen.edges.begin(), seen.edges.end(), [&](const SeenEdge& edge) {
      return edge.outwards.dot(outwards) > 0.995 && std::abs(edge.offset - offset) < 0.008 &&
             std::abs(edge.first + half) < 0.012 && std::abs(edge.last - half) < 0.012;
    });
  }
  EXPECT_GE(right, 2);
}

TEST_F(RestingBox, IsProposedWhicheverWayItLies) {
  const Vector3d size(0.06, 0.10, 0.18);
  for (int down = 0; down < 3; ++down) {
    const Vector3d axis = Vector3d::Unit((down + 1) % 3);
    const geometry::Quaterniond lying =
        down == 2 ? geometry::Quaterniond::Identity() : geometry::exp_rotation(0.5 * std::numbers::pi * axis);
    const double height = (lying * Vector3d::Unit(0)).cwiseAbs().z() * size.x() +
                          (lying * Vector3d::Unit(1)).cwiseAbs().z() * size.y() +
                          (lying * Vector3d::Unit(2)).cwiseAbs().z() * size.z();
    see(size, {(geometry::exp_rotation({0.0, 0.0, 0.4 + down}) * lying).normalized(), {0.03, -0.05, 0.5 * height}});
    EXPECT_LT(nearest(40), 0.02) << down;
  }
}

TEST_F(RestingBox, IsProposedWhereAThirdOfItIsHidden) {
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, 0.3}), {0.0, 0.0, 0.08}};
  const Vector3d towards = (test_camera_pose().translation - X_WO.translation).normalized();
  const Vector3d aside = Vector3d::UnitZ().cross(towards).normalized();
  for (const double side : {-1.0, 1.0}) {
    const Occluder plate{geometry::make_mesh(geometry::BoxShape{{0.10, 0.10, 0.20}}),
                         fixed({test_camera_pose().rotation, X_WO.translation + 0.2 * towards + side * 0.085 * aside})};
    see({0.06, 0.20, 0.16}, X_WO, {plate});
    EXPECT_GT(visible_, 0.35) << side;
    EXPECT_LT(visible_, 0.8) << side;
    EXPECT_LT(nearest(40), 0.025) << side;
  }
}

TEST_F(RestingBox, StartsAreTheBestFirstAndDifferent) {
  see({0.06, 0.10, 0.18}, {geometry::exp_rotation({0.0, 0.0, 0.5}), {0.0, 0.0, 0.09}});
  const RestingShape shape = resting_shape_of(*target_.mesh);
  const auto starts = [&](int most) {
    return resting_starts(shapes_.at(0), shape, fine_.terms, surroundings_, most, {3, core::Purpose::kProposal});
  };
  const std::vector<Pose> all = starts(40), some = starts(10);
  ASSERT_GE(all.size(), 10U);
  EXPECT_LE(all.size(), 40U);
  ASSERT_THAT(some, SizeIs(10));
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].translation, all[i].translation);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_TRUE((all[i].translation - all[j].translation).norm() > 0.001 ||
                  all[i].rotation.angularDistance(all[j].rotation) > 0.1)
          << i << ' ' << j;
}

/// A wall in which a thing is set flush: depth does not show where it ends.
class FlushThing : public ::testing::Test {
 protected:
  static constexpr int kWidth = 80, kHeight = 60;
  static bool is_inside(int x, int y) { return x >= 30 && x < 50 && y >= 20 && y < 40; }

  FlushThing() {
    rendering::FrameTermsInput input;
    input.camera = {kWidth, kHeight, 70.0, 70.0, 39.5, 29.5};
    const geometry::DepthImage wall(kWidth, kHeight, 1.0F);
    input.depth = wall.view();
    rendering::FrameTermsOptions options;
    options.target_width = kWidth;
    PRESCENE_CHECK(make_frame_terms(input, options, rendering::SensorModel(), &terms_).ok());
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (is_inside(x, y)) thing_(x, y) = 1.0F;
  }
  double support(const std::function<geometry::Rgb(int, int)>& color_at) const {
    geometry::ColorImage color(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) color(x, y) = color_at(x, y);
    return outline_support(terms_, thing_, 0.02, OutlineHoles::kSayNothing, &color);
  }

  rendering::FrameTerms terms_;
  geometry::DepthImage thing_{kWidth, kHeight, 0.0F};
};

constexpr geometry::Rgb kRed = {180, 50, 40}, kBlue = {40, 70, 170}, kDarkRed = {90, 25, 20};

TEST_F(FlushThing, EndsWhereAnotherColourBegins) {
  EXPECT_EQ(outline_support(terms_, thing_, 0.02), 0.0);
  EXPECT_EQ(support([](int x, int y) { return is_inside(x, y) ? kRed : kBlue; }), 1.0);
  // On one side of four.
  EXPECT_NEAR(support([](int x, int) { return x < 50 ? kRed : kBlue; }), 0.25, 0.05);
}

TEST_F(FlushThing, DoesNotEndWhereTheLightChanges) {
  EXPECT_EQ(support([](int, int) { return kRed; }), 0.0);
  EXPECT_EQ(support([](int x, int y) { return is_inside(x, y) ? kRed : kDarkRed; }), 0.0);
}

TEST_F(FlushThing, ColoursThatChangeWithinTellNothing) {
  const auto printed = [](int x, int y) { return (x / 4 + y / 4) % 2 == 0 ? kRed : kBlue; };
  EXPECT_LT(support(printed), 0.05);
  // A print in another colour than what is around.
  const auto framed = [](int x, int y) {
    if (!is_inside(x, y)) return kBlue;
    return x > 36 && x < 44 && y > 26 && y < 34 ? kBlue : kRed;
  };
  EXPECT_GT(support(framed), 0.9);
}

}  // namespace
}  // namespace prescene::filter_tests
