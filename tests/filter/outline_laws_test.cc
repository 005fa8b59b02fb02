// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/outline.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "filter_fixture.h"
#include "prescene/filter/proposals/facets.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/primitives.h"

namespace prescene::filter_tests {
namespace {

class OutlineOfAThing : public ::testing::Test {
 protected:
  void see(const belief::ObjectModel& model, const Pose& X_WO) {
    sequence_ = still_sequence({model}, {X_WO});
    observation_ = sequence_.observe(30, *backends_.renderer);
    frame_ = backends_.frame_of(sequence_.scene, observation_);
    target_ = target_of(sequence_.scene->models[0], frame_, backends_.tools);
    X_CO_ = frame_.X_CW * X_WO;
  }

  OutlineEquations equations_at(const Pose& X_CO) const {
    Outline outline(target_, X_CO, observation_.frame.camera, *backends_.renderer);
    const geometry::ColorImage* color = observation_.frame.color.get();
    if (color != nullptr) outline.see_colors(X_CO, *observation_.frame.depth, *color, frame_.terms);
    return outline.linearise(X_CO, *observation_.frame.depth, frame_.terms, color);
  }

  void see_no_colors() { observation_.frame.color.reset(); }
  void see_no_depth() {
    observation_.frame.depth =
        std::make_shared<const geometry::DepthImage>(observation_.frame.camera.width, observation_.frame.camera.height);
  }
  /// Gives the picture one colour where the object is, another elsewhere, and noise.
  void paint(const geometry::Rgb& object, const geometry::Rgb& around) {
    const geometry::PinholeCamera& camera = observation_.frame.camera;
    const geometry::DepthImage drawn = depth_of(target_, X_CO_, camera, *backends_.renderer);
    geometry::ColorImage color(camera.width, camera.height);
    core::RandomStream stream(3, core::Purpose::kTest);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        for (std::size_t c = 0; c < 3; ++c) {
          const double mean = (drawn(x, y) > 0.0F ? object : around)[c];
          color(x, y)[c] = static_cast<std::uint8_t>(std::clamp(mean + 6.0 * stream.normal(), 0.0, 255.0));
        }
    observation_.frame.color = std::make_shared<const geometry::ColorImage>(std::move(color));
  }

  /// Some Gauss-Newton steps across the line of sight on the outline alone.
  Pose followed(Pose X_CO) const {
    for (int step = 0; step < 8; ++step) {
      const OutlineEquations e = equations_at(X_CO);
      const Eigen::Matrix2d H = e.H.block<2, 2>(3, 3) + 100.0 * Eigen::Matrix2d::Identity();  // a prior of 0.1 m
      X_CO.translation.head<2>() += H.llt().solve(e.g.segment<2>(3));
    }
    return X_CO;
  }

  Backends backends_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
  FilterFrame frame_;
  SearchTarget target_;
  Pose X_CO_;
};

TEST_F(OutlineOfAThing, BringsBackWhatSlidAlongItsFaces) {
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}};
  see(box_model("box", {0.06, 0.10, 0.18}), X_WO);
  see_no_colors();
  // Across the line of sight.
  for (const Vector3d& shift : {Vector3d(0.010, 0.0, 0.0), Vector3d(-0.010, 0.0, 0.0), Vector3d(0.0, -0.010, 0.0)}) {
    Pose off = X_CO_;
    off.translation += shift;
    const Pose back = followed(off);
    EXPECT_LT((back.translation - X_CO_.translation).head<2>().norm(), 0.004) << shift.transpose();
  }
  EXPECT_GT(equations_at(X_CO_).points, 10);
}

TEST_F(OutlineOfAThing, LeavesATruePoseWhereItIs) {
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, -0.3}), {0.0, 0.02, 0.09}};
  see(box_model("box", {0.06, 0.10, 0.18}), X_WO);
  const Pose stays = followed(X_CO_);
  EXPECT_LT((stays.translation - X_CO_.translation).norm(), 0.003);
}

TEST_F(OutlineOfAThing, SaysNothingOfATurnAboutACansAxisAndMuchOfItsTilt) {
  see(can_model("can", 0.035, 0.12), {geometry::Quaterniond::Identity(), {0.0, 0.0, 0.06}});
  const OutlineEquations e = equations_at(X_CO_);
  ASSERT_GT(e.points, 5);
  EXPECT_LT(e.H(2, 2), 0.1 * std::max(e.H(0, 0), e.H(1, 1)));
}

TEST_F(OutlineOfAThing, ColoursAloneBringBackWhatSlid) {
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}};
  see(box_model("box", {0.06, 0.10, 0.18}), X_WO);
  paint({150, 60, 60}, {110, 90, 70});
  see_no_depth();
  for (const Vector3d& shift : {Vector3d(0.010, 0.0, 0.0), Vector3d(-0.010, 0.0, 0.0), Vector3d(0.0, -0.010, 0.0)}) {
    Pose off = X_CO_;
    off.translation += shift;
    const Pose back = followed(off);
    EXPECT_LT((back.translation - X_CO_.translation).head<2>().norm(), 0.002) << shift.transpose();
  }
}

TEST_F(OutlineOfAThing, ColoursThatAreAlikeSayNothing) {
  see(box_model("box", {0.06, 0.10, 0.18}), {geometry::Quaterniond::Identity(), {0.0, 0.0, 0.09}});
  see_no_depth();
  paint({150, 60, 60}, {110, 90, 70});
  const double with_colors = equations_at(X_CO_).H.trace();
  paint({110, 90, 70}, {110, 90, 70});
  EXPECT_LT(equations_at(X_CO_).H.trace(), 0.05 * with_colors);
}

// Whose edges are not the object's.
TEST_F(OutlineOfAThing, ColoursOfSomethingNearerDoNotCount) {
  see(box_model("box", {0.06, 0.10, 0.18}), {geometry::Quaterniond::Identity(), {0.0, 0.0, 0.09}});
  paint({150, 60, 60}, {110, 90, 70});
  observation_.frame.depth = std::make_shared<const geometry::DepthImage>(observation_.frame.camera.width,
                                                                          observation_.frame.camera.height, 0.2F);
  EXPECT_TRUE(equations_at(X_CO_).H.isZero());
}

TEST_F(OutlineOfAThing, SeesNoEdgeInAnEmptyImage) {
  see(box_model("box", {0.06, 0.10, 0.18}), {geometry::Quaterniond::Identity(), {0.0, 0.0, 0.09}});
  see_no_colors();
  see_no_depth();
  const OutlineEquations e = equations_at(X_CO_);
  EXPECT_EQ(e.points, 0);
  EXPECT_TRUE(e.H.isZero());
}

TEST_F(OutlineOfAThing, IsEmptyBehindTheCamera) {
  see(box_model("box", {0.06, 0.10, 0.18}), {geometry::Quaterniond::Identity(), {0.0, 0.0, 0.09}});
  const Pose behind = Pose::from_translation({0.0, 0.0, -0.5});
  EXPECT_TRUE(Outline(target_, behind, observation_.frame.camera, *backends_.renderer).empty());
}

TEST(FacetLever, IsThatOfTheFlatsOfARoundThing) {
  const auto box = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.1, 0.06, 0.2}}));
  EXPECT_EQ(facet_lever(*box), 0.0);
  for (const int segments : {16, 32, 64}) {
    const auto can = rendering::make_render_mesh(geometry::make_mesh(geometry::Cylinder{0.035, 0.12}, segments));
    const double width = 2.0 * 0.035 * std::sin(std::numbers::pi / segments);
    EXPECT_NEAR(facet_lever(*can), width / std::sqrt(12.0), 0.02 * width) << segments;
  }
}

/// What is known of a turn about z while everything else may follow it.
double information_of_turn(const Matrix6d& H) {
  const Matrix6d covariance = geometry::inverse_6(H + 1e-9 * H.trace() * Matrix6d::Identity());
  return 1.0 / covariance(2, 2);
}

/// A can of pixels on its wall, each on a facet: rows of information as depth residuals have them.
void add_can(double lever, Matrix6d& H, Vector6d& g) {
  for (int i = 0; i < 4000; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 4000.0;
    const double error =
        lever * std::sqrt(12.0) * ((i % 100 + 0.5) / 100.0 - 0.5);  // uniform, of this root mean square
    const Vector3d n(std::cos(angle), std::sin(angle), 0.0), along(-n.y(), n.x(), 0.0);
    const Vector3d p = 0.035 * n + error * along + Vector3d(0.0, 0.0, 0.05 * std::sin(7.0 * angle));
    Vector6d row;
    row << p.cross(n), n;
    H += row * row.transpose();
    g += 0.001 * row;
  }
}

TEST(WithoutFacets, TakesTheSquareOfTheLeverAndNoMore) {
  const double lever = 0.002;
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  add_can(lever, H, g);
  Matrix6d corrected = H;
  without_facets(lever, geometry::Quaterniond::Identity(), Vector3d::Zero(), corrected, g);
  EXPECT_LT(corrected(2, 2), 0.02 * H(2, 2));
  EXPECT_GT(corrected(0, 0), 0.98 * H(0, 0));
  EXPECT_NEAR(corrected(3, 3), H(3, 3), 1e-9 * H(3, 3));
  const Vector6d values = geometry::symmetric_eigenvalues_6(corrected);
  EXPECT_GT(values.minCoeff(), -1e-9 * values.maxCoeff());
}

TEST(WithoutFacets, DoesNotDependOnWhereTheAxisIs) {
  // A mug's middle is beside the axis of its round part: a turn about it moves that part.
  const double lever = 0.002;
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  add_can(lever, H, g);
  for (const double beside : {0.0, 0.014, -0.05}) {
    Matrix6d corrected = H;
    Vector6d g_corrected = g;
    without_facets(lever, geometry::Quaterniond::Identity(), Vector3d(beside, 0.0, 0.0), corrected, g_corrected);
    EXPECT_LT(information_of_turn(corrected), 0.02 * information_of_turn(H)) << beside;
    EXPECT_NEAR(corrected(3, 3), H(3, 3), 1e-9 * H(3, 3));
  }
}

TEST(WithoutFacets, LeavesTheStepThatTheEquationsAskFor) {
  const double lever = 0.002;
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  add_can(lever, H, g);
  // A handle that says how it is turned, and more than facets do.
  for (int i = 0; i < 200; ++i) {
    Vector6d row;
    row << Vector3d(0.055, 0.0, 0.002 * (i % 20)).cross(Vector3d::UnitY()), Vector3d::UnitY();
    H += row * row.transpose();
    g += 0.002 * row;
  }
  const Vector6d step = geometry::solve_symmetric_6(H, g);
  without_facets(lever, geometry::Quaterniond::Identity(), Vector3d(0.014, 0.0, 0.0), H, g);
  EXPECT_NEAR((geometry::solve_symmetric_6(H, g) - step).norm(), 0.0, 1e-6 * step.norm());
}

}  // namespace
}  // namespace prescene::filter_tests
