// SPDX-License-Identifier: Apache-2.0
// What is printed on things tells how they are turned where depth does not.
#include <gtest/gtest.h>

#include <numbers>

#include "filter_fixture.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/weigh_print.h"
#include "prescene/geometry/angles.h"
#include "printed_models.h"

namespace prescene::filter_tests::printed_things_test {
namespace {

using belief::Belief;
using belief::TrackState;

using geometry::kDegree;
const Vector3d kBox(0.07, 0.11, 0.15);

Pose standing(double height, double turn) {
  Pose X_WO = Pose::from_translation({0.02, -0.03, 0.5 * height});
  X_WO.rotation = geometry::exp_rotation(Vector3d(0.0, 0.0, turn));
  return X_WO;
}

/// A can with this print, turned so.
SimulatedSequence can_sequence(std::uint64_t print, double turn, std::uint64_t seed) {
  SimulatedSequence sequence = still_sequence({printed_can("can", print)}, {standing(0.11, turn)});
  sequence.seed = seed;
  sequence.frame_rate = 15.0;
  return sequence;
}

geometry::ColorImage lit(const geometry::ColorImage& color, double left, double right) {
  geometry::ColorImage out = color;
  for (int y = 0; y < color.height(); ++y)
    for (int x = 0; x < color.width(); ++x) {
      const double light = left + (right - left) * x / (color.width() - 1);
      // Light is linear; the image is stored by a power of about 1 / 2.2.
      for (std::uint8_t& channel : out(x, y))
        channel = static_cast<std::uint8_t>(std::lround(std::min(255.0, channel * std::pow(light, 1.0 / 2.2))));
    }
  return out;
}

/// The print of a model against one frame of a sequence.
struct Look {
  Look(const SimulatedSequence& sequence, const belief::ObjectModel& model, Backends& backends)
      : observation(sequence.observe(0, *backends.renderer)),
        X_CO(sequence.X_WC.inverse() * sequence.objects[0](0.0)),
        print(*backends.meshes.get(model, MeshDetail::kDisplay), {}) {}

  PrintView view(const geometry::ColorImage& color) const {
    return PrintView(print, observation.frame.camera, *observation.frame.depth, color, X_CO, 40);
  }
  /// Of 72 turns about z, the one that agrees best, rad from the truth.
  double best_turn(const PrintView& view) const {
    double best = 0.0, most = -2.0;
    for (int k = 0; k < 72; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / 72;
      const double r = view.match(turned(angle)).correlation;
      if (r > most) most = r, best = angle;
    }
    return std::remainder(best, 2.0 * std::numbers::pi);
  }
  Pose turned(double angle) const {
    return X_CO * Pose{geometry::exp_rotation(Vector3d(0.0, 0.0, angle)), Vector3d::Zero()};
  }

  belief::Observation observation;
  Pose X_CO;
  SurfacePrint print;
};

TEST(SurfacePrint, TellsTheTurnOfACanInAnyLight) {
  Backends backends;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const SimulatedSequence sequence = can_sequence(seed, 0.7 * static_cast<double>(seed), seed);
    const Look look(sequence, sequence.scene->models[0], backends);
    ASSERT_TRUE(look.print.says_anything());
    const geometry::ColorImage& color = *look.observation.frame.color;
    const double full = look.view(color).match(look.X_CO).correlation;
    EXPECT_GT(full, 0.4);
    for (const auto& [left, right] : {std::pair(1.0, 1.0), std::pair(0.5, 0.5), std::pair(0.3, 1.0)}) {
      const geometry::ColorImage changed = lit(color, left, right);
      const PrintView view = look.view(changed);
      EXPECT_NEAR(view.match(look.X_CO).correlation, full, 0.05) << left << " " << right;
      EXPECT_LT(std::abs(look.best_turn(view)), 5.1 * kDegree) << left << " " << right;
    }
  }
}

TEST(SurfacePrint, OfOneColourSaysNothing) {
  Backends backends;
  const belief::ObjectModel plain = printed_can("can", 0);
  EXPECT_FALSE(SurfacePrint(*backends.meshes.get(plain, MeshDetail::kDisplay), {}).says_anything());
  PrintCache prints;
  EXPECT_EQ(prints.get(plain, backends.meshes), nullptr);
  EXPECT_NE(prints.get(printed_can("can", 1), backends.meshes), nullptr);
  EXPECT_EQ(prints.get(can_model("can", 0.035, 0.11), backends.meshes), nullptr);
  EXPECT_EQ(PrintMatch{}.log_ratio(50.0), 0.0);
}

TEST(PrintCache, TellsModelsOfOneMeshApartBySymmetryAndColour) {
  Backends backends;
  PrintCache prints;
  const belief::ObjectModel model = printed_can("can", 1);
  belief::ObjectModel said = model, coloured = model;
  said.symmetry = geometry::SymmetryGroup::cuboid();
  coloured.color = {0.1, 0.2, 0.9};
  const PrintedModel* first = prints.get(model, backends.meshes);
  const PrintedModel* second = prints.get(said, backends.meshes);
  ASSERT_TRUE(first != nullptr && second != nullptr);
  EXPECT_EQ(second->shape_symmetry, said.symmetry);
  EXPECT_NE(first, second);
  EXPECT_NE(first, prints.get(coloured, backends.meshes));
  EXPECT_EQ(first, prints.get(model, backends.meshes));
}

TEST(SurfacePrint, OfAnotherThingRefutesNoPose) {
  Backends backends;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const SimulatedSequence sequence = can_sequence(seed, 0.0, seed);
    const Look look(sequence, printed_can("can", seed + 10), backends);
    const PrintView view = look.view(*look.observation.frame.color);
    const double share = view.independent_share(look.X_CO);
    EXPECT_GT(share, 0.02);
    for (int k = 0; k < 72; ++k) {
      const double nats = view.match(look.turned(5.0 * kDegree * k)).log_ratio(share);
      EXPECT_GE(nats, 0.0);
      EXPECT_LT(nats, std::log(1.0 / WeighPrintOptions{}.rival_prior));  // no reason to turn
    }
  }
}

TEST(RivalPoses, AreThoseOfTheShape) {
  const Pose X_WO = standing(0.1, 0.3);
  EXPECT_EQ(rival_poses(geometry::SymmetryGroup::cube(), X_WO).size(), 23U);
  EXPECT_EQ(rival_poses(geometry::SymmetryGroup::cuboid(), X_WO).size(), 3U);
  EXPECT_EQ(rival_poses(geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), true), X_WO).size(), 143U);
  EXPECT_TRUE(rival_poses(geometry::SymmetryGroup::none(), X_WO).empty());
  const auto off_centre = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), false, {0.02, 0.0, 0.0});
  for (const Pose& rival : rival_poses(off_centre, X_WO))
    EXPECT_LT((rival * off_centre.p_BoC - X_WO * off_centre.p_BoC).norm(), 1e-12);
}

/// How a thing is tracked that stands otherwise than the scene says: `X_OS` within its own shape.
struct Outcome {
  double turn_error = 0.0;  ///< rad, at the end.
  double add = 0.0;         ///< m, over the mesh's vertices (ADD, not ADD-S).
  TrackState state = TrackState::kLost;
  int turned = 0;
};

Outcome track(const belief::ObjectModel& model, const belief::ObjectModel& seen, const Pose& X_WO, const Pose& X_OS,
              std::uint64_t seed, bool use, int frames = 8) {
  Backends backends;
  SimulatedSequence sequence = still_sequence({seen}, {X_WO});
  sequence.seed = seed;
  sequence.frame_rate = 15.0;
  const auto scene = table_scene({model}, {X_WO * X_OS}, 0.005, 0.05);
  FilterSettings settings;
  settings.print.use = use;
  ParticleFilter filter = backends.make_filter(settings);
  Belief belief = filter.start(scene, seed);
  Outcome outcome;
  for (int frame = 0; frame < frames; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    outcome.turned += result.counters.turned_by_print;
    belief = std::move(result.belief);
  }
  const Pose mode = belief::estimate(belief.objects[0]).mode;
  outcome.turn_error = geometry::log_rotation(mode.rotation.conjugate() * X_WO.rotation).norm();
  for (const Vector3d& p : model.visual->vertices)
    outcome.add += (mode * p - X_WO * p).norm() / static_cast<double>(model.visual->vertices.size());
  outcome.state = belief.objects[0].state;
  return outcome;
}

Pose turn_about(const Vector3d& axis, double angle) {
  return {geometry::exp_rotation(angle * axis.normalized()), Vector3d::Zero()};
}

TEST(PrintedThings, CansAreTurnedAsTheyStand) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const belief::ObjectModel can = printed_can("can", seed);
    const Pose X_OS = turn_about(Vector3d::UnitZ(), 1.2 + 0.9 * static_cast<double>(seed));
    const Outcome with = track(can, can, standing(0.11, 0.4), X_OS, seed, true);
    EXPECT_LT(with.turn_error, 5.0 * kDegree);
    EXPECT_LT(with.add, 0.005);
    EXPECT_EQ(with.state, TrackState::kTracked);
  }
  const belief::ObjectModel can = printed_can("can", 1);
  EXPECT_GT(track(can, can, standing(0.11, 0.4), turn_about(Vector3d::UnitZ(), 2.1), 1, false).turn_error,
            60.0 * kDegree);
}

TEST(PrintedThings, BoxesStandOnTheirOwnFeet) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const belief::ObjectModel box = printed_box("box", kBox, seed);  // without a symmetry: its shape has one
    const Vector3d axis = Vector3d::Unit(static_cast<Eigen::Index>(seed % 3));
    const Outcome with = track(box, box, standing(0.15, 0.5), turn_about(axis, std::numbers::pi), seed, true);
    EXPECT_LT(with.turn_error, 5.0 * kDegree) << seed;
    EXPECT_EQ(with.state, TrackState::kTracked);
  }
}

TEST(PrintedThings, CubesShowTheirFace) {
  belief::ObjectModel cube = printed_box("cube", {0.08, 0.08, 0.08}, 5);
  cube.symmetry = geometry::SymmetryGroup::cube();
  for (const std::size_t k : {4u, 12u}) {
    const Pose X_OS{cube.symmetry.rotations[k], Vector3d::Zero()};
    EXPECT_LT(track(cube, cube, standing(0.08, 0.4), X_OS, k, true).turn_error, 5.0 * kDegree) << k;
  }
}

TEST(PrintedThings, WithAnotherPrintAreTrackedAsBefore) {
  for (const std::uint64_t seed : {1u, 2u}) {
    const Outcome other = track(printed_can("can", seed + 20), printed_can("can", seed), standing(0.11, 0.4),
                                Pose::identity(), seed, true);
    EXPECT_EQ(other.state, TrackState::kTracked);
    EXPECT_EQ(other.turned, 0);
    EXPECT_LT(other.add, 0.02);
  }
}

TEST(PrintedThings, WithoutAPrintKeepTheirBits) {
  Backends backends;
  for (const bool colored : {false, true}) {
    const belief::ObjectModel can = colored ? printed_can("can", 0) : can_model("can", 0.035, 0.11);
    const SimulatedSequence sequence = still_sequence({can}, {standing(0.11, 0.4)});
    std::uint64_t hashes[2];
    for (const bool use : {false, true}) {
      FilterSettings settings;
      settings.print.use = use;
      ParticleFilter filter = backends.make_filter(settings);
      Belief belief = filter.start(sequence.scene, 1);
      for (int frame = 0; frame < 4; ++frame)
        belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
      hashes[use ? 1 : 0] = belief::content_hash(belief);
    }
    EXPECT_EQ(hashes[0], hashes[1]);
  }
}

TEST(PrintedThings, AreTheSameForAnyNumberOfThreads) {
  const belief::ObjectModel can = printed_can("can", 1);
  const SimulatedSequence sequence = still_sequence({can}, {standing(0.11, 0.4)});
  std::uint64_t hashes[2];
  for (const int threads : {1, 2}) {
    Backends backends(threads);
    ParticleFilter filter = backends.make_filter();
    Belief belief = filter.start(sequence.scene, 1);
    for (int frame = 0; frame < 13; ++frame)
      belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    hashes[threads - 1] = belief::content_hash(belief);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace prescene::filter_tests::printed_things_test
