// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/learned_proposals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "filter_fixture.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter_tests::learned_proposals_test {
namespace {

using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

/// Rows of two numbers in (0, 1); yes where exactly one of them is above 0.5, which no sum of single numbers tells.
struct Examples {
  explicit Examples(int count, std::uint64_t seed = 1) {
    core::RandomStream draws(seed, core::Purpose::kTest);
    for (int i = 0; i < count; ++i) {
      const double a = draws.uniform(), b = draws.uniform();
      values.insert(values.end(), {static_cast<float>(a), static_cast<float>(b)});
      yes.push_back((a > 0.5) != (b > 0.5) ? 1 : 0);
    }
  }
  std::span<const float> row(std::size_t i) const { return std::span(values).subspan(2 * i, 2); }

  std::vector<float> values;
  std::vector<std::uint8_t> yes;
};

TEST(BoostedTrees, LearnWhatNoSingleNumberTells) {
  const Examples seen(2000), fresh(500, 2);
  const BoostedTrees trees = fit_boosted_trees(seen.values, 2, seen.yes, {}, {});
  int right = 0;
  for (std::size_t i = 0; i < fresh.yes.size(); ++i)
    right += (trees.log_odds(fresh.row(i)) > 0.0) == (fresh.yes[i] != 0);
  EXPECT_GT(right, 475);
}

TEST(BoostedTrees, TellTheShareOfYesWhereNothingElseTells) {
  // Numbers that tell nothing: the odds are those of all examples.
  core::RandomStream draws(1, core::Purpose::kTest);
  std::vector<float> values;
  std::vector<std::uint8_t> yes;
  for (int i = 0; i < 4000; ++i) {
    values.push_back(1.0F);
    yes.push_back(draws.uniform() < 0.2 ? 1 : 0);
  }
  const BoostedTrees trees = fit_boosted_trees(values, 1, yes, {}, {});
  const double share = static_cast<double>(std::count(yes.begin(), yes.end(), 1)) / 4000.0;
  EXPECT_NEAR(trees.log_odds(std::array{1.0F}), std::log(share / (1.0 - share)), 1e-3);
}

TEST(BoostedTrees, WeightsCountAsManyExamples) {
  const Examples once(300);
  Examples twice = once;
  twice.values.insert(twice.values.end(), once.values.begin(), once.values.end());
  twice.yes.insert(twice.yes.end(), once.yes.begin(), once.yes.end());
  const std::vector<float> two(once.yes.size(), 2.0F);
  const BoostedTrees weighted = fit_boosted_trees(once.values, 2, once.yes, two, {});
  const BoostedTrees repeated = fit_boosted_trees(twice.values, 2, twice.yes, {}, {});
  for (std::size_t i = 0; i < once.yes.size(); ++i)
    EXPECT_NEAR(weighted.log_odds(once.row(i)), repeated.log_odds(once.row(i)), 0.2);
}

TEST(BoostedTrees, OfOneKindOfExampleThereAreNone) {
  EXPECT_TRUE(fit_boosted_trees(std::vector<float>{1.0F, 2.0F}, 1, std::vector<std::uint8_t>{1, 1}, {}, {}).empty());
  EXPECT_TRUE(fit_boosted_trees({}, 3, {}, {}, {}).empty());
}

/// A box on a table, seen by a camera that may be rolled.
struct SeenBox {
  explicit SeenBox(double roll, double turn = 0.4) {
    X_WO = {geometry::exp_rotation({0.0, 0.0, turn}), {0.0, 0.0, 0.09}};
    const Pose X_WC = test_camera_pose();
    X_WC_ = {(X_WC.rotation * geometry::exp_rotation({0.0, 0.0, roll})).normalized(), X_WC.translation};
    rendering::RenderScene scene;
    mesh = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.06, 0.10, 0.18}}));
    scene.instances.push_back({mesh, X_WO, {}});
    scene.instances.push_back({rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{{3.0, 3.0, 0.1}})),
                               Pose::from_translation({0.0, 0.0, -0.05}),
                               {}});
    const auto renderer = rendering::make_reference_renderer();
    PRESCENE_CHECK(renderer->render(scene, test_camera(), X_WC_, {}, &view).ok());
    up_C = X_WC_.rotation.conjugate() * Vector3d::UnitZ();
  }

  /// Measured points of the box.
  std::vector<Vector3d> points() const {
    std::vector<Vector3d> found;
    for (int y = 0; y < view.depth.height(); ++y)
      for (int x = 0; x < view.depth.width(); ++x)
        if (view.labels(x, y) == 1) found.push_back(test_camera().unproject(x, y, view.depth(x, y)));
    return found;
  }

  Pose X_WO;
  Pose X_WC_;
  Vector3d up_C;
  rendering::MeshHandle mesh;
  rendering::RenderedView view;
};

/// What is learned of the box from single pixels of this view.
LearnedModel learned_from(const SeenBox& seen, int places) {
  LearnedModel model;
  model.name = "box";
  model.mesh = mesh_hash(*seen.mesh);
  model.spacing = 0.02F;
  const std::vector<Vector3d> points = seen.points();
  for (int i = 0; i < places; ++i) {
    const Vector3d& place = points[static_cast<std::size_t>(i) * points.size() / static_cast<std::size_t>(places)];
    model.patches.push_back(patch_at(seen.view.depth, test_camera(), place, seen.up_C, 0.02));
    model.X_AO.push_back(stored(patch_frame(place, seen.up_C).inverse() * (seen.X_WC_.inverse() * seen.X_WO)));
  }
  return model;
}

TEST(SurfacePatches, DoNotChangeWithTheCamerasRoll) {
  const SeenBox upright(0.0), rolled(0.7);
  core::RandomStream draws(1, core::Purpose::kTest);
  const std::vector<Vector3d> points = upright.points();
  std::vector<double> differences;
  for (int i = 0; i < 200; ++i) {
    const Vector3d& place = points[draws.uniform_below(points.size())];
    const Vector3d same = rolled.X_WC_.inverse() * (upright.X_WC_ * place);
    const SurfacePatch a = patch_at(upright.view.depth, test_camera(), place, upright.up_C, 0.02);
    const SurfacePatch b = patch_at(rolled.view.depth, test_camera(), same, rolled.up_C, 0.02);
    EXPECT_NEAR(a.elevation, b.elevation, 1);
    for (std::size_t c = 0; c < SurfacePatch::kCells; ++c)
      differences.push_back(std::abs(static_cast<int>(a.relief[c]) - static_cast<int>(b.relief[c])));
  }
  // Pixels at an edge fall on either side of it.
  std::sort(differences.begin(), differences.end());
  EXPECT_LE(differences[differences.size() * 8 / 10], 8.0);
}

TEST(SurfacePatches, ProposeThePoseFromWhichTheyWereLearned) {
  const SeenBox upright(0.0), rolled(0.5);
  const LearnedModel model = learned_from(upright, 200);
  const Pose X_CO = rolled.X_WC_.inverse() * rolled.X_WO;
  const std::vector<Pose> starts = learned_starts(model, rolled.view.depth, test_camera(), rolled.points(), rolled.up_C,
                                                  60, core::RandomStream(1, core::Purpose::kTest));
  ASSERT_EQ(starts.size(), 60u);
  const auto near = std::count_if(starts.begin(), starts.end(), [&](const Pose& start) {
    return (start.translation - X_CO.translation).norm() < 0.04 &&
           geometry::angle_between(start.rotation, X_CO.rotation) < 0.35;
  });
  // A random rotation is that near in 1 of 200 cases.
  EXPECT_GT(near, 20);
}

TEST(SurfacePatches, WithoutPlacesNothingIsProposed) {
  const SeenBox seen(0.0);
  const core::RandomStream stream(1, core::Purpose::kTest);
  EXPECT_THAT(learned_starts(LearnedModel{}, seen.view.depth, test_camera(), seen.points(), seen.up_C, 8, stream),
              IsEmpty());
  EXPECT_THAT(learned_starts(learned_from(seen, 3), seen.view.depth, test_camera(), {}, seen.up_C, 8, stream),
              IsEmpty());
}

TEST(SurfacePatches, AtTheImagesCornerAndStraightBelowAreDefined) {
  const SeenBox seen(0.0);
  const Vector3d corner = test_camera().unproject(0.0, 0.0, 0.5);
  const SurfacePatch patch = patch_at(seen.view.depth, test_camera(), corner, seen.up_C, 0.02);
  EXPECT_EQ(patch.relief.front(), SurfacePatch::kUnknown);
  for (const Vector3d& up : {Vector3d(0.0, 0.0, -1.0), Vector3d(0.0, 0.0, 1.0)}) {
    const Pose X_CA = patch_frame({0.0, 0.0, 1.0}, up);
    EXPECT_TRUE(X_CA.is_finite());
    EXPECT_NEAR((X_CA.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-12);
  }
}

TEST(SurfacePatches, PosesAreKeptInSinglePrecision) {
  core::RandomStream draws(1, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{geometry::uniform_rotation(draws), geometry::normal_vector(draws)};
    const Pose back = restored(stored(pose));
    EXPECT_LT(geometry::angle_between(pose.rotation, back.rotation), 1e-5);
    EXPECT_LT((pose.translation - back.translation).norm(), 1e-6);
  }
}

TEST(LearnedProposals, BelongToAMeshAndToNoOther) {
  LearnedProposals proposals;
  const SeenBox seen(0.0);
  proposals.models.push_back(learned_from(seen, 1));
  EXPECT_NE(find(proposals, *seen.mesh), nullptr);
  const auto other = rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.06, 0.10, 0.181}}));
  EXPECT_EQ(find(proposals, *other), nullptr);
}

/// A first step of the filter that knows places on the box, and nothing of fits.
StepResult first_step(int threads, LearnedModels learned, const Pose& X_WO) {
  Backends backends(threads);
  const std::vector<belief::ObjectModel> models = {box_model("box", {0.06, 0.10, 0.18})};
  const SimulatedSequence sequence = still_sequence(models, {X_WO});
  FilterSettings settings;
  settings.learned = std::move(learned);
  ParticleFilter filter = backends.make_filter(settings);
  return filter.step(filter.start(open_scene(models), 1), sequence.observe(0, *backends.renderer), {});
}

TEST(LearnedProposals, FindAnObjectAndGiveTheSameBitsForAnyNumberOfThreads) {
  auto learned = std::make_shared<LearnedProposals>();
  for (int i = 0; i < 12; ++i) {
    const LearnedModel view = learned_from(SeenBox(0.0, 0.5 * i), 20);
    if (i == 0) {
      learned->models.push_back(view);
      MeshCache meshes;
      const belief::ObjectModel model = box_model("box", {0.06, 0.10, 0.18});
      learned->models.front().mesh = mesh_hash(*meshes.get(model.visual, model.collision, MeshDetail::kLikelihood));
      continue;
    }
    LearnedModel& all = learned->models.front();
    all.patches.insert(all.patches.end(), view.patches.begin(), view.patches.end());
    all.X_AO.insert(all.X_AO.end(), view.X_AO.begin(), view.X_AO.end());
  }
  const Pose X_WO{geometry::exp_rotation({0.0, 0.0, 1.1}), {0.05, -0.1, 0.09}};
  const StepResult result = first_step(1, learned, X_WO);
  EXPECT_EQ(result.counters.found, 1);
  EXPECT_LT((belief::estimate(result.belief.objects[0]).mode.translation - X_WO.translation).norm(), 0.02);
  EXPECT_EQ(belief::content_hash(first_step(2, learned, X_WO).belief), belief::content_hash(result.belief));
  // It makes a difference: other poses were tried.
  EXPECT_NE(belief::content_hash(first_step(2, nullptr, X_WO).belief), belief::content_hash(result.belief));
}

}  // namespace
}  // namespace prescene::filter_tests::learned_proposals_test
