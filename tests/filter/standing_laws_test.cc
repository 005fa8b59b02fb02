// SPDX-License-Identifier: Apache-2.0
// How a thing stands on what carries it, against sampled contacts and what is simulated.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "filter_fixture.h"
#include "prescene/filter/operators/standing.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter_tests {
namespace {

using filter::log_sunk;
using filter::PoseEquations;
using filter::resting_shape_of;
using filter::RestingShape;
using filter::standing_equations;
using filter::support_height;
using filter::SupportHeight;
using geometry::Matrix3d;

using geometry::kDegree;

/// By a frame that shows the object at its pose, to `turn` rad and `shift` m in all directions.
PoseEquations seen_to(double turn, double shift = 0.003) {
  PoseEquations seen;
  seen.information.diagonal() << Vector3d::Constant(1.0 / (turn * turn)), Vector3d::Constant(1.0 / (shift * shift));
  return seen;
}

SupportHeight believed_height(const Vector3d&, const Vector3d&) { return {0.0, 0.0}; }

class StandingOnATable : public testing::Test {
 protected:
  StandingOnATable() { scene_.supports.push_back(table()); }

  void take(const geometry::TriangleMesh& mesh) {
    mesh_ = rendering::make_render_mesh(mesh);
    shape_ = resting_shape_of(*mesh_);
  }
  SupportSurfaces surfaces() { return {scene_, meshes_}; }
  std::optional<PoseEquations> equations(const Pose& X_WO, const PoseEquations& seen) {
    return standing_equations(shape_, *mesh_, surfaces(), Vector3d::UnitZ(), X_WO, believed_height, seen, 0.5);
  }
  double log_odds(const Pose& X_WO, const Pose& other) {
    return filter::StandingOdds(shape_, *mesh_, surfaces(), Vector3d::UnitZ(), other).log_of(X_WO);
  }

  belief::Scene scene_;
  MeshCache meshes_;
  rendering::MeshHandle mesh_;
  RestingShape shape_;
};

const Vector3d kSize(0.06, 0.10, 0.18);
geometry::TriangleMesh block() { return geometry::make_mesh(geometry::BoxShape{kSize}); }

TEST_F(StandingOnATable, ABoxIsBroughtFlushWhicheverFaceItIsOn) {
  take(block());
  for (int axis = 0; axis < 3; ++axis)
    for (const double way : {0.0, std::numbers::pi}) {
      // Each of its six faces down, turned about the vertical, tilted and lifted.
      const geometry::Quaterniond down = geometry::exp_rotation(Vector3d::UnitX() * way) *
                                         geometry::Quaterniond::FromTwoVectors(Vector3d::Unit(axis), Vector3d::UnitZ());
      const Vector3d tilt = 3.0 * kDegree * Vector3d(0.6, -0.8, 0.0);
      const Pose X_WO{geometry::exp_rotation(tilt) * geometry::exp_rotation({0.0, 0.0, 0.7}) * down,
                      {0.1, 0.05, 0.5 * kSize[axis] + 0.002}};
      const auto stands = equations(X_WO, seen_to(0.1));
      ASSERT_TRUE(stands) << axis << ' ' << way;
      Matrix6d ridged = stands->information;
      ridged.diagonal().array() += 1.0;  // of what it says nothing of
      const Vector6d step = geometry::inverse_6(ridged) * stands->gradient;
      const Pose stood = geometry::box_plus(X_WO, step);
      const Vector3d up_O = down.conjugate() * Vector3d::UnitZ();
      EXPECT_NEAR((stood.rotation * up_O).z(), 1.0, 1e-5) << axis << ' ' << way;
      EXPECT_NEAR(stood.translation.z(), 0.5 * kSize[axis], 2e-4) << axis << ' ' << way;
      // Neither the turn about the vertical nor the place on the table is known by it.
      EXPECT_LT(step.tail<3>().head<2>().norm(), 1e-9);
      Vector6d turn = Vector6d::Zero();
      turn.head<3>() = X_WO.rotation.conjugate() * Vector3d::UnitZ();
      const Matrix3d of_turns = stands->information.topLeftCorner<3, 3>();
      EXPECT_LT(turn.dot(stands->information * turn), 0.01 * of_turns.trace());
    }
}

// Points drawn on the border of its base, each a millimetre off, three of which count: the plane through them is the
// table's.
TEST_F(StandingOnATable, APoseIsKnownAsByThreeContacts) {
  take(block());
  const auto stands = equations(Pose::from_translation({0.0, 0.0, 0.09}), seen_to(0.02, 0.001));
  ASSERT_TRUE(stands);
  Matrix6d sampled = Matrix6d::Zero();
  const int samples = 4000;
  const double around = 2.0 * (kSize.x() + kSize.y());
  for (int i = 0; i < samples; ++i) {
    double along = around * (i + 0.5) / samples;
    Vector3d p(-0.5 * kSize.x(), -0.5 * kSize.y(), -0.5 * kSize.z());
    for (const Vector3d& side : {Vector3d(kSize.x(), 0, 0), Vector3d(0, kSize.y(), 0), Vector3d(-kSize.x(), 0, 0),
                                 Vector3d(0, -kSize.y(), 0)}) {
      const double length = std::min(along, side.norm());
      p += length * side.normalized();
      along -= length;
    }
    Vector6d row;
    row << p.cross(Vector3d::UnitZ()), Vector3d::UnitZ();
    sampled += 3.0 / samples / (0.001 * 0.001) * row * row.transpose();
  }
  // About the middle of the base; a support is level to half a degree, too.
  for (const Vector3d& axis : {Vector3d(1.0, 0.0, 0.0), Vector3d(0.0, 1.0, 0.0)}) {
    Vector6d tilt;
    tilt << axis, Vector3d(0.0, 0.0, 0.5 * kSize.z()).cross(axis) * -1.0;
    const double expected = 1.0 / (1.0 / tilt.dot(sampled * tilt) + 0.25 * kDegree * kDegree);
    EXPECT_NEAR(tilt.dot(stands->information * tilt) / expected, 1.0, 0.1) << axis.transpose();
  }
  EXPECT_NEAR(stands->information(5, 5) / sampled(5, 5), 1.0, 0.5);
  EXPECT_LT(stands->information(5, 5), sampled(5, 5));
}

TEST_F(StandingOnATable, NothingIsSaidOfWhatHangsOrStandsOnSomethingElse) {
  take(block());
  const auto at = [&](const Vector3d& p_WO) { return equations(Pose::from_translation(p_WO), seen_to(0.05)); };
  EXPECT_TRUE(at({0.0, 0.0, 0.09}));
  EXPECT_FALSE(at({0.0, 0.0, 0.12}));
  EXPECT_FALSE(at({0.0, 0.0, 0.06}));
  EXPECT_FALSE(at({0.8, 0.0, 0.09}));  // beside the table
}

TEST_F(StandingOnATable, WhatIsSeenToLeanOrToBeLiftedIsLeftSo) {
  take(block());
  const auto information = [&](double tilt, double lifted, const PoseEquations& seen) {
    const auto stands = equations(Pose{geometry::exp_rotation({tilt, 0.0, 0.0}), {0.0, 0.0, 0.09 + lifted}}, seen);
    return stands ? stands->information.trace() : 0.0;
  };
  const double upright = information(0.0, 0.0, seen_to(0.5 * kDegree));
  EXPECT_GT(upright, 0.0);
  EXPECT_LT(information(12.0 * kDegree, 0.0, seen_to(0.5 * kDegree)), 0.05 * upright);
  EXPECT_GT(information(2.0 * kDegree, 0.0, seen_to(4.0 * kDegree)), 0.8 * upright);
  EXPECT_EQ(information(30.0 * kDegree, 0.0, seen_to(0.5 * kDegree)), 0.0);
  EXPECT_LT(information(0.0, 0.012, seen_to(0.5 * kDegree, 0.001)), 0.05 * upright);  // on a thin book
  EXPECT_GT(information(0.0, 0.004, seen_to(4.0 * kDegree, 0.004)), 0.15 * upright);
}

TEST_F(StandingOnATable, ALyingCanMayRoll) {
  take(geometry::make_mesh(geometry::Cylinder{0.034, 0.102}, 32));
  const Pose X_WO{geometry::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitX()), {0.0, 0.0, 0.034}};
  const auto stands = equations(X_WO, seen_to(0.1));
  ASSERT_TRUE(stands);
  // About its axis; its ends lie on the table.
  const Matrix3d of_turns = stands->information.topLeftCorner<3, 3>();
  EXPECT_LT(of_turns(2, 2), 0.03 * of_turns.trace());
  EXPECT_LT(of_turns(2, 2), 1.0 / (6.0 * kDegree * 6.0 * kDegree));
}

TEST_F(StandingOnATable, ASlopeIsWhatItIsFlushWith) {
  const geometry::Quaterniond slope = geometry::exp_rotation({0.5, 0.0, 0.0});
  scene_.supports[0].X_WS = Pose{slope, Vector3d::Zero()} * table().X_WS;
  take(block());
  const auto stands = equations(Pose{slope, slope * Vector3d(0.0, 0.0, 0.09)}, seen_to(0.05));
  ASSERT_TRUE(stands);
  EXPECT_NEAR(stands->gradient.norm(), 0.0, 1e-6 * stands->information.trace());
}

// A bottle stands on its bottom more often than on its neck, and never on an edge.
TEST_F(StandingOnATable, ThingsStandOnTheFacesThatTheyComeToLieOn) {
  take(geometry::make_lathe({{0.030, 0.0}, {0.032, 0.113}, {0.013, 0.160}, {0.013, 0.188}}, 32));
  const Pose upright = Pose::from_translation({0.0, 0.0, 0.0});
  const Pose on_its_neck{geometry::exp_rotation({std::numbers::pi, 0.0, 0.0}), {0.0, 0.0, 0.188}};
  const Pose on_an_edge{geometry::exp_rotation({0.8, 0.0, 0.0}), {0.0, 0.0, 0.030 * std::sin(0.8)}};
  EXPECT_EQ(log_odds(upright, upright), 0.0);
  EXPECT_LT(log_odds(on_its_neck, upright), -2.0);
  EXPECT_LT(log_odds(on_an_edge, upright), -2.0);
  EXPECT_EQ(log_odds(upright, on_its_neck), 0.0);
  // However fine its facets are, a can lies as often on one as on another.
  for (const int facets : {16, 32, 64, 128}) {
    take(geometry::make_mesh(geometry::Cylinder{0.034, 0.102}, facets));
    const Pose lying{geometry::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitX()), {0.0, 0.0, 0.034}};
    EXPECT_GT(log_odds(lying, Pose::from_translation({0.0, 0.0, 0.051})), -0.5) << facets;
  }
  // In the air nothing is said.
  EXPECT_EQ(log_odds({on_its_neck.rotation, {0.0, 0.0, 0.6}}, Pose::from_translation({0.0, 0.0, 0.4})), 0.0);
}

// By its lowest point alone, and only where that is in the support: what leans over an edge is not.
TEST_F(StandingOnATable, WhatIsDeepInASupportIsImprobableThere) {
  take(block());
  const auto sunk = [&](const Pose& X_WO) { return log_sunk(*mesh_, surfaces(), Vector3d::UnitZ(), X_WO); };
  for (const double x : {0.0, 0.1})
    for (const double depth : {0.0, 0.005, 0.02})
      EXPECT_NEAR(sunk(Pose::from_translation({x, 0.0, 0.09 - depth})), -0.5 * std::pow(depth / 0.005, 2), 0.01);
  EXPECT_EQ(sunk(Pose::from_translation({0.0, 0.0, 0.3})), 0.0);
  const Pose on_a_corner{geometry::exp_rotation({0.5, 0.4, 0.0}), Vector3d::Zero()};
  double lowest = 0.0;
  for (const auto& vertex : mesh_->vertices) lowest = std::min(lowest, (on_a_corner * vertex.cast<double>()).z());
  EXPECT_NEAR(sunk({on_a_corner.rotation, {0.0, 0.0, -lowest - 0.01}}), -2.0, 0.01);
  // Its lower corner is beside the table's edge.
  const double edge = table().collision.empty() ? 0.0 : belief::collision_mesh(table().collision).vertices.front().x();
  const Pose over_the_edge{geometry::exp_rotation({0.0, 0.6, 0.0}), {std::abs(edge) + 0.05, 0.0, 0.0}};
  EXPECT_EQ(sunk(over_the_edge), 0.0);
}

// The scene's table is 6 mm higher than where the camera shows it.
TEST(SupportHeights, AreThoseThatTheFrameShows) {
  Backends backends;
  const SimulatedSequence sequence =
      still_sequence({box_model("box", kSize)}, {Pose::from_translation({0.02, -0.03, 0.09})});
  const belief::Observation observation = sequence.observe(0, *backends.renderer);
  for (const double higher : {-0.006, 0.0, 0.006}) {
    auto scene = std::make_shared<belief::Scene>(*sequence.scene);
    scene->supports[0].X_WS.translation.z() += higher;
    const filter::FilterFrame frame = backends.frame_of(scene, observation);
    const SupportHeight height =
        support_height(frame.terms, frame.supports, frame.X_CW, {0.02, -0.03, higher}, Vector3d::UnitZ(), 0.08, 0.2);
    EXPECT_NEAR(height.offset, -higher, 0.0015) << higher;
    EXPECT_LT(height.sigma, 0.002);
  }
  // Where the frame shows nothing of it, it is known to some millimetres.
  const filter::FilterFrame frame = backends.frame_of(sequence.scene, observation);
  EXPECT_GE(
      support_height(frame.terms, frame.supports, frame.X_CW, {5.0, 0.0, 0.0}, Vector3d::UnitZ(), 0.08, 0.2).sigma,
      0.005);
}

/// What is believed of a box in the end, whose scene says where it is to 5 mm and 3 degrees.
Pose believed_at_the_end(const Pose& X_WO, double further, std::uint64_t seed) {
  Backends backends;
  belief::ObjectModel model = box_model("box", kSize);
  model.symmetry = geometry::SymmetryGroup::cuboid();
  SimulatedSequence sequence = still_sequence({model}, {X_WO}, 0.005, 0.05);
  sequence.X_WC.translation -= sequence.X_WC.rotation * Vector3d(0.0, 0.0, further);
  sequence.seed = seed;
  ParticleFilter filter = backends.make_filter();
  belief::Belief belief = filter.start(sequence.scene, seed);
  for (int frame = 0; frame < 15; ++frame)
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
  return belief::estimate(belief, belief.objects[0]).mean;
}

double tilt_of(const Pose& X_WO) { return std::acos(std::min(1.0, std::abs((X_WO.rotation * Vector3d::UnitZ()).z()))); }

TEST(Standing, ABoxFarAwayIsBelievedFlushOnTheTable) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const Pose X_WO =
        believed_at_the_end(Pose{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}}, 0.7, seed);
    EXPECT_LT(tilt_of(X_WO), 1.2 * kDegree) << seed;
    EXPECT_NEAR(X_WO.translation.z(), 0.09, 0.004) << seed;  // as far as camera and table agree
  }
}

TEST(Standing, ABoxThatLeansIsSeenToLean) {
  // On an edge of its base; what holds it up is not known.
  const double lean = 8.0 * kDegree;
  const Pose X_WO{geometry::exp_rotation({lean, 0.0, 0.0}), {0.0, 0.0, 0.09 * std::cos(lean) + 0.05 * std::sin(lean)}};
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U})
    EXPECT_NEAR(tilt_of(believed_at_the_end(X_WO, 0.0, seed)), lean, 1.5 * kDegree) << seed;
}

}  // namespace
}  // namespace prescene::filter_tests
