// SPDX-License-Identifier: Apache-2.0
// Continuous queries, on every instruction set of the machine: no pose before the time that is returned collides, the
// bodies are within the tolerance then, and times are those of closed forms where there are some.
#include "prescene/collision/continuous_queries.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "prescene/collision/triangle_pair_distance.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/generators.h"
#include "tests/support/target_test.h"

namespace prescene::collision::continuous_queries_laws_test {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using geometry::Twist;

TriangleTree tree_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  return TriangleTree::build(tests::collision_mesh(mesh, "mesh"), {}, pool);
}

TriangleTree box_tree(double x, double y, double z) {
  return tree_of(geometry::make_mesh(geometry::BoxShape{{x, y, z}}));
}

RigidMotion screw(const Pose& X_start, const Pose& X_end) {
  const auto motion = ScrewMotion::make(X_start, X_end);
  PRESCENE_CHECK(motion.ok());
  return *motion;
}

RigidMotion straight(const Vector3d& from, const Vector3d& to) {
  return screw(Pose::from_translation(from), Pose::from_translation(to));
}

RigidMotion thrown(const Pose& X_start, const Twist& V_AB, const Vector3d& p_BP = Vector3d::Zero()) {
  const auto motion = RigidMotion::thrown(X_start, V_AB, p_BP);
  PRESCENE_CHECK(motion.ok());
  return *motion;
}

bool collide_at(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion, double time,
                QueryScratch& scratch) {
  const auto X_AB = to_transform(motion.pose(time));
  PRESCENE_CHECK(X_AB.ok());
  return collide(a, b, *X_AB, scratch);
}

/// The first of the samples of [0, until] that collides.
std::optional<double> first_sample(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion,
                                   double until, int samples, QueryScratch& scratch) {
  for (int i = 0; i < samples; ++i) {
    const double time = until * i / samples;
    if (collide_at(a, b, motion, time, scratch)) return time;
  }
  return std::nullopt;
}

double distance_at(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion,
                   const FirstContact& contact) {
  const auto X_AB = to_transform(motion.pose(contact.time));
  PRESCENE_CHECK(X_AB.ok());
  Triangle of_b = b.mesh().corners(contact.triangles.b);
  for (Vector3f& p : of_b) p = *X_AB * p;
  return triangle_pair_distance(a.mesh().corners(contact.triangles.a), of_b).distance;
}

/// A pose of B at which a vertex of each body is about at the same place.
Pose meeting_pose(const Mesh& a, const Mesh& b) {
  const auto pick = [](const Mesh& mesh) {
    return mesh.vertices()[*rc::gen::inRange<std::size_t>(0, mesh.vertices().size())].cast<double>().eval();
  };
  Pose X_AB;
  X_AB.rotation = *tests::rotations();
  X_AB.translation = pick(a) - X_AB.rotation * pick(b) + *tests::vectors(0.05);
  return X_AB;
}

struct Seen {
  int contacts = 0;
  int free = 0;
  int at_start = 0;
  int transversal = 0;    ///< Contacts at which B moves towards A's triangle, not along it.
  int collide_after = 0;  ///< Of those, after a little more than the tolerance's way.
  std::uint64_t steps = 0;
};

void check_motion(const TriangleTree& a, const TriangleTree& b, const RigidMotion& motion, double tolerance,
                  int samples, QueryScratch& scratch, Seen* seen) {
  const FirstContact contact = first_contact(a, b, motion, {.tolerance = tolerance}, scratch);
  RC_ASSERT(contact.outcome != MotionOutcome::kStepLimit);
  seen->steps += contact.steps;
  const bool at_start = collide_at(a, b, motion, 0.0, scratch);
  if (contact.outcome == MotionOutcome::kNoContact) {
    ++seen->free;
    RC_ASSERT(contact.time == 1.0);
    RC_ASSERT(!first_sample(a, b, motion, 1.0, samples, scratch).has_value());
    RC_ASSERT(!collide_at(a, b, motion, 1.0, scratch));
    return;
  }
  ++seen->contacts;
  RC_ASSERT(contact.time >= 0.0 && contact.time <= 1.0);
  if (at_start) {
    ++seen->at_start;
    RC_ASSERT(contact.time == 0.0);
    RC_ASSERT(contact.distance == 0.0);
    return;
  }
  RC_ASSERT(!first_sample(a, b, motion, contact.time, samples, scratch).has_value());
  RC_ASSERT(contact.distance <= tolerance);
  RC_ASSERT(std::abs(distance_at(a, b, motion, contact) - contact.distance) <= 1e-6);
  RC_ASSERT(std::abs((contact.p_B - contact.p_A).norm() - contact.distance) <= 1e-12);
  const double approach = -contact.normal.dot(motion.field(contact.time).velocity(contact.p_B));
  if (approach < 0.05) return;
  ++seen->transversal;
  const double after = contact.time + 10.0 * tolerance / approach;
  if (after <= 1.0 && collide_at(a, b, motion, after, scratch)) ++seen->collide_after;
}

class ContinuousQueries : public TargetTest {
 protected:
  QueryScratch scratch_;
};

TEST_P(ContinuousQueries, MissNoContact) {
  constexpr double kTolerance = 1e-4;
  Seen seen;
  EXPECT_TRUE(tests::check_law([&] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    // Somewhere on its way or at its end, B meets A, if not before.
    const Pose X_meet = meeting_pose(a.mesh(), b.mesh());
    if (*rc::gen::arbitrary<bool>()) {
      check_motion(a, b, screw(*tests::poses(1.5), X_meet), kTolerance, 1000, scratch_, &seen);
    } else {
      const Vector3d p_BP = *tests::vectors(0.3);
      const Twist V_AB{*tests::vectors(8.0), *tests::vectors(3.0)};
      const Pose X_start = thrown(X_meet, {-V_AB.angular, -V_AB.linear}, p_BP).pose(0.6);
      check_motion(a, b, thrown(X_start, V_AB, p_BP), kTolerance, 1000, scratch_, &seen);
    }
  }));
  std::printf(
      "%d contacts, %d of them at the start, %d motions without; %.0f steps each; of %d transversal ones %d "
      "collide a little later\n",
      seen.contacts, seen.at_start, seen.free, static_cast<double>(seen.steps) / (seen.contacts + seen.free),
      seen.transversal, seen.collide_after);
  EXPECT_GT(seen.contacts - seen.at_start, 10);
  EXPECT_GT(seen.free, 10);
  // Edges that pass each other's end within the tolerance need not touch.
  EXPECT_GE(seen.collide_after, seen.transversal * 9 / 10);
}

TEST_P(ContinuousQueries, AreTimelyForBoxes) {
  const TriangleTree a = box_tree(1.0, 1.0, 1.0);
  const TriangleTree b = box_tree(0.5, 0.5, 0.5);
  for (const double tolerance : {1e-3, 1e-4}) {
    for (int axis = 0; axis < 3; ++axis) {
      // From 3 m to -1 m: faces meet after 2.25 m of 4 m.
      const RigidMotion motion = straight(3.0 * Vector3d::Unit(axis), -Vector3d::Unit(axis));
      const FirstContact contact = first_contact(a, b, motion, {.tolerance = tolerance}, scratch_);
      ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
      EXPECT_LE(contact.time, 2.25 / 4.0);
      EXPECT_GE(contact.time, (2.25 - tolerance) / 4.0);
      EXPECT_NEAR(contact.normal[axis], 1.0, 1e-6);
    }
    // Corner first, along the diagonal, turned by 45 degrees about z: edge against face.
    Pose X_start = Pose::from_translation({3.0, 0.0, 0.0});
    X_start.rotation = geometry::exp_rotation({0.0, 0.0, M_PI / 4.0});
    Pose X_end = X_start;
    X_end.translation.x() = 0.0;
    const FirstContact contact = first_contact(a, b, screw(X_start, X_end), {.tolerance = tolerance}, scratch_);
    ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
    const double way = 3.0 - 0.5 - 0.25 * std::sqrt(2.0);
    EXPECT_LE(contact.time, way / 3.0 + 1e-6);
    EXPECT_GE(contact.time, (way - tolerance) / 3.0 - 1e-6);
  }
}

TEST_P(ContinuousQueries, AreTimelyForSpheres) {
  constexpr int kSegments = 128;
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::Sphere{0.5}, kSegments));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Sphere{0.25}, kSegments));
  // Facets are this much inside the sphere at most (twice, as they are curved in two directions).
  const double inside = 2.0 * 0.75 * (1.0 - std::cos(M_PI / kSegments)) + 1e-6;
  for (const double offset : {0.0, 0.2, 0.5, 0.7}) {
    const RigidMotion motion =
        thrown(Pose::from_translation({2.0, offset, 0.1}), {{3.0, 20.0, -5.0}, {-2.0, 0.0, 0.0}});
    const FirstContact contact = first_contact(a, b, motion, {.tolerance = 1e-5}, scratch_);
    ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
    const auto time = [&](double radii) { return (2.0 - std::sqrt(radii * radii - offset * offset - 0.01)) / 2.0; };
    EXPECT_GE(contact.time, time(0.75 + 1e-5));
    EXPECT_LE(contact.time, time(0.75 - inside));
  }
  const RigidMotion beside = thrown(Pose::from_translation({2.0, 0.7501, 0.0}), {{3.0, 20.0, -5.0}, {-4.0, 0.0, 0.0}});
  EXPECT_EQ(first_contact(a, b, beside, {.tolerance = 1e-5}, scratch_).outcome, MotionOutcome::kNoContact);
}

TEST_P(ContinuousQueries, CatchThinPlatesAtHighSpeed) {
  geometry::TriangleMesh plate;
  plate.vertices = {{0, -0.1, -0.1}, {0, 0.1, -0.1}, {0, 0.1, 0.1}, {0, -0.1, 0.1}};
  plate.triangles = {{0, 1, 2}, {0, 2, 3}};
  const TriangleTree a = tree_of(plate);
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Sphere{0.005}, 16));
  for (const double far : {1.0, 100.0, 10000.0}) {
    const RigidMotion motion = straight({-far, 0.03, 0.02}, {0.5 * far, 0.03, 0.02});
    const FirstContact contact = first_contact(a, b, motion, {}, scratch_);
    ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
    EXPECT_NEAR(contact.time, (far - 0.005) / (1.5 * far), 1e-5);
    EXPECT_FALSE(first_sample(a, b, motion, contact.time, 1000, scratch_).has_value());
  }
  // The plate's own rim, from the side.
  const FirstContact rim = first_contact(a, b, straight({0.0, -50.0, 0.0}, {0.0, 50.0, 0.0}), {}, scratch_);
  ASSERT_EQ(rim.outcome, MotionOutcome::kContact);
  EXPECT_NEAR(rim.time, (50.0 - 0.105) / 100.0, 1e-5);
}

TEST_P(ContinuousQueries, FollowTurns) {
  // A beam along x, 2 m long and 0.1 m wide, turns about z; a post, 0.1 m wide, at 0.8 m on the y axis.
  const TriangleTree a = box_tree(0.1, 0.1, 1.0);
  const TriangleTree b = box_tree(2.0, 0.1, 0.1);
  const double distance = 0.8;
  const Pose X_start = Pose::from_translation({0.0, -distance, 0.0});
  // Its upper long edge, 0.05 m from the axis, meets the corner of the post at (0.05, -0.05).
  const Vector3d corner(0.05, -0.05 + distance, 0.0);
  const double angle = std::atan2(corner.y(), corner.x()) - std::asin(0.05 / corner.norm());
  for (const double turn : {0.9 * M_PI, 7.0, 100.0}) {
    const RigidMotion motion = thrown(X_start, {{0.0, 0.0, turn}, Vector3d::Zero()});
    const FirstContact contact = first_contact(a, b, motion, {.tolerance = 1e-5}, scratch_);
    ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
    EXPECT_LE(contact.time * turn, angle + 1e-5);
    EXPECT_GE(contact.time * turn, angle - 1e-4);
    EXPECT_FALSE(first_sample(a, b, motion, contact.time, 1000, scratch_).has_value());
    EXPECT_TRUE(collide_at(a, b, motion, contact.time + 1e-3 / turn, scratch_));
  }
  Pose X_end = X_start;
  X_end.rotation = geometry::exp_rotation({0.0, 0.0, 0.9 * M_PI});
  const FirstContact contact = first_contact(a, b, screw(X_start, X_end), {.tolerance = 1e-5}, scratch_);
  ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
  EXPECT_NEAR(contact.time * 0.9 * M_PI, angle, 1e-4);
  // Away from the post.
  EXPECT_EQ(first_contact(a, b, thrown(X_start, {{0.0, 0.0, -1.0}, Vector3d::Zero()}), {}, scratch_).outcome,
            MotionOutcome::kNoContact);
}

TEST_P(ContinuousQueries, StayWithinTheToleranceHoweverFastTheTurns) {
  // A bar that turns about z up to 950 times while it sinks, until its side hits the top of a post.
  const TriangleTree post = box_tree(0.1, 0.1, 1.0);
  const TriangleTree bar = box_tree(2.0, 0.1, 0.1);
  constexpr double kTolerance = 1e-4;
  for (const double turn : {100.0, 300.0, 1000.0, 2500.0, 6000.0}) {
    const RigidMotion motion = thrown(Pose::from_translation({0.0, -0.8, 1.4}), {{0.0, 0.0, turn}, {0.0, 0.0, -1.0}});
    const FirstContact contact = first_contact(post, bar, motion, {.tolerance = kTolerance}, scratch_);
    ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
    EXPECT_LE(contact.distance, kTolerance) << turn;
  }
}

TEST_P(ContinuousQueries, CountTouchingAndNotPassing) {
  const TriangleTree a = box_tree(2.0, 2.0, 1.0);
  const TriangleTree b = box_tree(0.5, 0.5, 0.5);
  const double height = 0.75;
  const auto slide = [&](double gap) {
    return first_contact(a, b, straight({-3.0, 0.0, height + gap}, {3.0, 0.0, height + gap}), {.tolerance = 1e-4},
                         scratch_);
  };
  const FirstContact touching = slide(0.0);
  ASSERT_EQ(touching.outcome, MotionOutcome::kContact);
  EXPECT_NEAR(touching.time, (3.0 - 1.25) / 6.0, 1e-4);
  const FirstContact passing = slide(2e-4);
  EXPECT_EQ(passing.outcome, MotionOutcome::kNoContact);
  // Only the pairs that pass near are taken up, and gaps that stay cost nothing.
  EXPECT_LT(passing.steps, 100U);
  // Lowered onto the other without ever being lower.
  const RigidMotion lowered = straight({0.0, 0.0, height + 0.5}, {0.0, 0.0, height});
  const FirstContact contact = first_contact(a, b, lowered, {.tolerance = 1e-4}, scratch_);
  ASSERT_EQ(contact.outcome, MotionOutcome::kContact);
  EXPECT_GE(contact.time, 1.0 - 2e-4);
  // Lifted off while nearer than the tolerance.
  EXPECT_EQ(
      first_contact(a, b, straight({0.0, 0.0, height + 5e-5}, {0.0, 0.0, height + 1.0}), {.tolerance = 1e-4}, scratch_)
          .outcome,
      MotionOutcome::kNoContact);
}

TEST_P(ContinuousQueries, AgreeWhenTheBodiesAreExchanged) {
  constexpr double kTolerance = 1e-4;
  int contacts = 0;
  EXPECT_TRUE(tests::check_law([&] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    const Pose X_start = *tests::poses(1.5);
    const Pose X_end = meeting_pose(a.mesh(), b.mesh());
    // Of the two half turns about an axis either may be taken.
    RC_PRE(geometry::angle_between(X_start.rotation, X_end.rotation) < 3.1);
    const RigidMotion there = screw(X_start, X_end);
    const RigidMotion back = screw(X_start.inverse(), X_end.inverse());
    const FirstContact one = first_contact(a, b, there, {.tolerance = kTolerance}, scratch_);
    const FirstContact other = first_contact(b, a, back, {.tolerance = kTolerance}, scratch_);
    if (one.outcome != MotionOutcome::kContact || other.outcome != MotionOutcome::kContact) {
      // One of them may call a contact what the other finds to pass within the tolerance.
      const FirstContact& contact = one.outcome == MotionOutcome::kContact ? one : other;
      if (contact.outcome == MotionOutcome::kContact) RC_ASSERT(contact.distance > 0.0);
      return;
    }
    ++contacts;
    const double approach = -one.normal.dot(there.field(one.time).velocity(one.p_B));
    if (one.time == 0.0 || approach < 0.05) return;
    RC_ASSERT(std::abs(one.time - other.time) * approach < 2.0 * kTolerance + 1e-3 * approach);
  }));
  EXPECT_GT(contacts, 10);
}

// Lengths of which single precision cannot hold the squares.
TEST_P(ContinuousQueries, FindTheSameTimesAtEveryScale) {
  const geometry::TriangleMesh mesh_a = tests::make_bumpy_sphere(0.1, 300);
  const geometry::TriangleMesh mesh_b = tests::make_knot(0.1, 300);
  core::RandomStream random(8, {});
  QueryScratch scratch;
  const auto contact_at = [&](double scale, Pose start, Pose end) {
    start.translation *= scale;
    end.translation *= scale;
    const TriangleTree a = tree_of(geometry::scaled(mesh_a, scale));
    const TriangleTree b = tree_of(geometry::scaled(mesh_b, scale));
    const RigidMotion motion = screw(start, end);
    const FirstContact found = first_contact(a, b, motion, {}, scratch);
    EXPECT_FALSE(first_sample(a, b, motion, found.time, 20, scratch).has_value()) << scale;
    return found;
  };
  for (int i = 0; i < 10; ++i) {
    const auto unit = [&] { return 2.0 * random.uniform() - 1.0; };
    const auto rotation = [&] {
      const double z = unit(), y = unit(), x = unit();
      return geometry::Quaterniond(2.0, x, y, z).normalized();
    };
    const Pose start{rotation(), {0.4, 0.05 * unit(), 0.05 * unit()}};
    const Pose end{rotation(), {-0.4, 0.05 * unit(), 0.05 * unit()}};
    const FirstContact expected = contact_at(1.0, start, end);
    EXPECT_EQ(expected.outcome, MotionOutcome::kContact);
    for (const double scale : {0x1p-98, 0x1p-70, 0x1p30}) {
      const FirstContact found = contact_at(scale, start, end);
      EXPECT_EQ(found.outcome, expected.outcome) << scale;
      EXPECT_NEAR(found.time, expected.time, 1e-3) << scale;
    }
  }
}

TEST_P(ContinuousQueries, SayWhenTheyGiveUp) {
  const TriangleTree a = tree_of(tests::make_bumpy_sphere(0.1, 2000));
  const TriangleTree b = tree_of(tests::make_knot(0.1, 2000));
  const RigidMotion motion = thrown(Pose::from_translation({0.5, 0.0, 0.0}), {{0.0, 9.0, 2.0}, {-1.0, 0.0, 0.0}});
  const FirstContact whole = first_contact(a, b, motion, {}, scratch_);
  ASSERT_EQ(whole.outcome, MotionOutcome::kContact);
  double before = 0.0;
  for (std::uint64_t limit = 0; limit < whole.steps; ++limit) {
    const FirstContact part = first_contact(a, b, motion, {.step_limit = limit}, scratch_);
    ASSERT_EQ(part.outcome, MotionOutcome::kStepLimit);
    EXPECT_EQ(part.steps, limit);
    EXPECT_LE(part.time, whole.time);
    EXPECT_GE(part.time, before);
    before = part.time;
  }
  EXPECT_EQ(first_contact(a, b, motion, {.step_limit = whole.steps}, scratch_).time, whole.time);
}

TEST_P(ContinuousQueries, FindScansOnTheirWay) {
  Seen seen;
  for (const tests::MeshPair& meshes : tests::made_mesh_pairs()) {
    core::ThreadPool pool(1);
    const TriangleTree a = TriangleTree::build(meshes.a, {}, pool);
    const TriangleTree b = TriangleTree::build(meshes.b, {}, pool);
    for (int i = 0; i < 8; ++i) {
      const double angle = 0.7 * i;
      const Vector3d from(0.4 * std::cos(angle), 0.4 * std::sin(angle), 0.05 * i - 0.2);
      const RigidMotion motion = thrown(Pose::from_translation(from), {{2.0 * i, 1.0, -0.5 * i}, -1.6 * from});
      check_motion(a, b, motion, 1e-5, 1000, scratch_, &seen);
    }
  }
  EXPECT_GT(seen.contacts, 16);
  std::printf("%d contacts, %.0f steps each\n", seen.contacts,
              static_cast<double>(seen.steps) / (seen.contacts + seen.free));
}

INSTANTIATE_TEST_SUITE_P(AllTargets, ContinuousQueries, testing::ValuesIn(all_targets()), target_name);

TEST(RigidMotions, RefuseWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Pose bad;
  bad.translation.x() = nan;
  EXPECT_FALSE(ScrewMotion::make(bad, {}).ok());
  EXPECT_FALSE(RigidMotion::thrown(bad, {}).ok());
  EXPECT_FALSE(RigidMotion::thrown({}, {{nan, 0, 0}, {0, 0, 0}}).ok());
  EXPECT_FALSE(RigidMotion::thrown({}, {{0, 0, 0}, {0, std::numeric_limits<double>::infinity(), 0}}).ok());
  EXPECT_FALSE(RigidMotion::thrown({}, {}, {nan, 0, 0}).ok());
  const auto far = RigidMotion::thrown({}, {{0, 0, 0}, {2e9, 0, 0}});
  ASSERT_FALSE(far.ok());
  EXPECT_THAT(far.status().message(), testing::HasSubstr("unit of the velocity"));
  const auto fast = RigidMotion::thrown({}, {{0, 0, 1e6}, {0, 0, 0}});
  ASSERT_FALSE(fast.ok());
  EXPECT_THAT(fast.status().message(), testing::HasSubstr("shorter ones"));
}

TEST(RigidMotions, MoveAsTheirFieldsSay) {
  EXPECT_TRUE(tests::check_law([] {
    const Pose X_start = *tests::poses();
    const bool is_screw = *rc::gen::arbitrary<bool>();
    const RigidMotion motion = is_screw ? screw(X_start, *tests::poses())
                                        : thrown(X_start, {*tests::vectors(9.0), *tests::vectors()}, *tests::vectors());
    const Vector3d p_BQ = *tests::vectors();
    const double t = *tests::numbers(0.0, 1.0);
    const double h = 1e-5;
    const auto place = [&](double at) { return Vector3d(motion.pose(at) * p_BQ); };
    const MotionField field = motion.field(t);
    const Vector3d p = place(t);
    RC_ASSERT(((place(t + h) - place(t - h)) / (2.0 * h) - field.velocity(p)).norm() < 1e-6);
    const Vector3d acceleration = (place(t + h) - 2.0 * p + place(t - h)) / (h * h);
    RC_ASSERT((acceleration - field.spin.cross(field.swirl(p))).norm() < 1e-2);
    // The swirl keeps its length.
    const MotionField start = motion.field(0.0);
    RC_ASSERT(std::abs(start.swirl(place(0.0)).norm() - field.swirl(p).norm()) < 1e-9);
  }));
}

TEST(ContinuousQueriesScratch, DoesNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const TriangleTree a = tree_of(tests::make_bumpy_sphere(0.1, 2000));
  const TriangleTree b = tree_of(tests::make_knot(0.1, 2000));
  const RigidMotion motion = thrown(Pose::from_translation({0.5, 0.0, 0.0}), {{0.0, 9.0, 2.0}, {-1.0, 0.0, 0.0}});
  QueryScratch scratch;
  QueryCounts counts;
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::allocation_count();
    EXPECT_EQ(first_contact(a, b, motion, {}, scratch, &counts).outcome, MotionOutcome::kContact);
    EXPECT_TRUE(!warm || tests::allocation_count() == before);
  }
  EXPECT_GT(counts.volume_tests, 0U);
  EXPECT_GT(counts.triangle_tests, 0U);
}

}  // namespace
}  // namespace prescene::collision::continuous_queries_laws_test
