// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/pose_search.h"

#include <gtest/gtest.h>

#include "filter_fixture.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter_tests {
namespace {

Pose some_pose(std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  Pose X;
  X.rotation = geometry::uniform_rotation(stream);
  X.translation = geometry::normal_vector(stream);
  return X;
}

TEST(MovedAbout, TurnsAboutThePointAndMovesIt) {
  const Pose X = some_pose(1);
  const Vector3d p_OQ(0.3, -0.2, 0.7);
  Vector6d d;
  d << 0.3, -0.4, 0.2, 0.05, -0.02, 0.01;
  const Pose moved = moved_about(X, p_OQ, d);
  EXPECT_LT((moved * p_OQ - (X * p_OQ + d.tail<3>())).norm(), 1e-12);
  EXPECT_LT((geometry::log_rotation(X.rotation.conjugate() * moved.rotation) - d.head<3>()).norm(), 1e-12);
}

TEST(FromPointCoordinates, IsTheDerivativeOfTurningAboutThePoint) {
  const Pose X = some_pose(2);
  const Vector3d p_OQ(0.3, -0.2, 0.7);
  const Matrix6d A = from_point_coordinates(X.rotation, p_OQ);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = kStep * Vector6d::Unit(i);
    const Vector6d moved = geometry::box_minus(moved_about(X, p_OQ, d), X) / kStep;
    EXPECT_LT((moved - A.col(i)).norm(), 1e-5) << "coordinate " << i;
  }
}

TEST(DisturbedStarts, BeginWithThePoseItself) {
  const Pose X = some_pose(3);
  const auto starts = disturbed_starts(X, {0.1, 0.0, 0.0}, 0.03, 0.3, 200, {5, core::Purpose::kTest});
  ASSERT_EQ(starts.size(), 200u);
  EXPECT_LT(geometry::box_minus(starts[0], X).norm(), 1e-12);
  double squares = 0.0;
  for (const Pose& start : starts)
    squares += (start * Vector3d(0.1, 0.0, 0.0) - X * Vector3d(0.1, 0.0, 0.0)).squaredNorm();
  // Three axes of variance 0.03^2; 199 draws: 5 standard deviations of the sum are 20 %.
  EXPECT_NEAR(squares / 199 / 3 / (0.03 * 0.03), 1.0, 0.2);
}

class Search : public ::testing::Test {
 protected:
  Search()
      : X_WO_{Pose{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}}},
        sequence_(still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {X_WO_})),
        frame_(backends_.frame_of(sequence_.scene, sequence_.observe(0, *backends_.renderer))),
        target_(target_of(sequence_.scene->models[0], frame_, backends_.tools)) {}

  std::vector<Pose> starts(int count) const {
    Vector6d off;
    off << 0.3, 0.0, 0.4, 0.03, -0.03, 0.02;
    return disturbed_starts(moved_about(frame_.X_CW * X_WO_, target_.centre(), off), target_.centre(), 0.03, 0.3, count,
                            {1, core::Purpose::kProposal});
  }

  Backends backends_;
  Pose X_WO_;
  SimulatedSequence sequence_;
  FilterFrame frame_;
  SearchTarget target_;
};

TEST_F(Search, FindsTheBoxFromFiveCentimetresAndHalfARadianOff) {
  const auto found = backends_.search.run(frame_.terms, target_, starts(32), {}, {2, core::Purpose::kProposal});
  const Pose X_WO = frame_.X_WC * found.front().X_CO;
  EXPECT_LT((X_WO.translation - X_WO_.translation).norm(), 0.004);
  const geometry::SymmetryGroup symmetry = geometry::SymmetryGroup::cuboid();
  EXPECT_LT(geometry::symmetric_angle(X_WO, X_WO_, symmetry), 0.05);
  for (std::size_t i = 1; i < found.size(); ++i)
    EXPECT_GE(found[i - 1].evidence.log_ratio, found[i].evidence.log_ratio) << i;
}

TEST_F(Search, PolishNeverLosesEvidence) {
  SearchOptions rough;
  rough.polish_candidates = 0;
  const core::RandomStream stream(2, core::Purpose::kProposal);
  const auto plain = backends_.search.run(frame_.terms, target_, starts(16), rough, stream);
  const auto polished = backends_.search.run(frame_.terms, target_, starts(16), {}, stream);
  EXPECT_GE(polished.front().evidence.log_ratio, plain.front().evidence.log_ratio);
}

TEST_F(Search, SameBitsForAnyNumberOfThreadsAndForTheSerialForm) {
  const core::RandomStream stream(2, core::Purpose::kProposal);
  const std::vector<Pose> from = starts(13);
  const rendering::WorkspacePool::Loan workspace(backends_.search.workspaces());
  const auto serial = backends_.search.run_serial(frame_.terms, target_, from, {}, stream, *workspace);
  for (const int count : {1, 2, 5}) {
    core::ThreadPool threads(count);
    PoseSearch search(*backends_.likelihood, threads);
    const auto found = search.run(frame_.terms, target_, from, {}, stream);
    ASSERT_EQ(found.size(), serial.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].X_CO, serial[i].X_CO) << count << " threads, candidate " << i;
      EXPECT_EQ(found[i].evidence.log_ratio, serial[i].evidence.log_ratio);
    }
  }
}

TEST_F(Search, StopsWhereThereIsNothingToSee) {
  std::vector<Pose> behind = {Pose::from_translation({0.0, 0.0, -1.0})};
  const auto found = backends_.search.run(frame_.terms, target_, behind, {}, {2, core::Purpose::kProposal});
  EXPECT_EQ(found.front().evidence.covered, 0);
  EXPECT_EQ(found.front().evidence.log_ratio, 0.0);
}

}  // namespace
}  // namespace prescene::filter_tests
