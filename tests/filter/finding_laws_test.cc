// SPDX-License-Identifier: Apache-2.0
// What holds of the finds of a first frame, whatever things stand on: checked through the filter, as users see it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "filter_fixture.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::filter_tests {
namespace {

using ::testing::AnyOf;
using ::testing::Each;
using ::testing::IsEmpty;

/// A level box with the middle of its upper face at top_W.
belief::Support slab(const std::string& name, const Vector3d& size, const Vector3d& top_W) {
  belief::Support support;
  support.name = name;
  support.collision = {belief::PrimitiveShape{geometry::BoxShape{size}, Pose::identity()}};
  support.X_WS = Pose::from_translation(top_W - Vector3d(0.0, 0.0, 0.5 * size.z()));
  return support;
}

Pose turned(double angle, const Vector3d& p_WO) { return {geometry::exp_rotation({0.0, 0.0, angle}), p_WO}; }
Pose laid(double angle, const Vector3d& p_WO) {
  const geometry::Quaterniond lying = geometry::exp_rotation({1.5707963, 0.0, 0.0});
  return {(geometry::exp_rotation({0.0, 0.0, angle}) * lying).normalized(), p_WO};
}

struct Thing {
  belief::ObjectModel model;
  Pose X_WO;
};

/// Things on supports, of which the scene lists some.
class Finding : public ::testing::Test {
 protected:
  void see(const std::vector<Thing>& things, const std::vector<belief::Support>& supports,
           const std::vector<belief::Support>& listed, const std::vector<Occluder>& others = {}) {
    std::vector<belief::ObjectModel> models;
    poses_.clear();
    for (const Thing& thing : things) {
      models.push_back(thing.model);
      poses_.push_back(thing.X_WO);
    }
    SimulatedSequence sequence = still_sequence(models, poses_);
    auto shown = std::make_shared<belief::Scene>(*sequence.scene);
    shown->supports = supports;
    sequence.scene = shown;
    sequence.occluders = others;
    observation_ = sequence.observe(0, *backends_.renderer);
    auto open = std::make_shared<belief::Scene>(*open_scene(models));
    open->supports = listed;
    for (belief::SceneObject& object : open->objects)
      std::get<belief::BoxPose>(object.pose).position.z = belief::UniformScalar{-1.0, 1.0};
    scene_ = open;
  }

  StepResult first_step(std::uint64_t seed) {
    ParticleFilter filter = backends_.make_filter();
    return filter.step(filter.start(scene_, seed), observation_, {});
  }

  static bool reported(const belief::ObjectBelief& object) {
    return object.state == belief::TrackState::kTracked || object.state == belief::TrackState::kDoubtful;
  }

  std::vector<Vector3d> vertices_at(std::size_t object, const Pose& X_WO) const {
    std::vector<Vector3d> points;
    for (const Vector3d& vertex : scene_->model_of(scene_->objects[object]).visual->vertices)
      points.push_back(X_WO * vertex);
    return points;
  }

  void expect_found(const StepResult& result) {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const belief::ObjectBelief& object = result.belief.objects[i];
      EXPECT_TRUE(reported(object)) << object.name;
      const Vector3d found = belief::estimate(object).mode.translation;
      EXPECT_LT((found - poses_[i].translation).norm(), 0.02) << object.name;
    }
  }

  static std::vector<std::string> names_of(const belief::Scene& scene) {
    std::vector<std::string> names;
    for (const belief::Support& support : scene.supports) names.push_back(support.name);
    return names;
  }

  Backends backends_;
  std::vector<Pose> poses_;
  belief::Observation observation_;
  std::shared_ptr<const belief::Scene> scene_;
};

std::vector<Thing> six_things() {
  return {{carton_model("carton"), turned(0.5, {-0.12, -0.24, 0.11})},
          {box_model("box", {0.06, 0.10, 0.18}), turned(-0.3, {0.12, -0.12, 0.09})},
          {can_model("can", 0.035, 0.11), laid(0.3, {-0.14, 0.02, 0.035})},
          {box_model("brick", {0.10, 0.20, 0.065}), turned(1.2, {0.12, 0.10, 0.0325})},
          {can_model("tin", 0.05, 0.14), turned(0.0, {-0.08, 0.22, 0.07})},
          {box_model("tea", {0.07, 0.075, 0.13}), turned(0.2, {-0.02, -0.06, 0.065})}};
}

TEST_F(Finding, AllThingsOnASmallDeskThoughTheFloorHasMorePoints) {
  const std::vector<belief::Support> supports = {slab("desk", {0.5, 0.68, 0.03}, Vector3d::Zero()),
                                                 slab("floor", {6.0, 6.0, 0.1}, {0.0, 0.0, -0.35})};
  see(six_things(), supports, {});
  const SegmentationOptions options;
  const SampledDepth sampled = sample_depth(*observation_.frame.depth, observation_.frame.camera, options);
  const auto near = [&](double height) {
    return std::count_if(sampled.points_C.begin(), sampled.points_C.end(), [&](const Vector3d& p) {
      return p.z() > 0.0 && std::abs((observation_.X_WC * p).z() - height) < 0.02;
    });
  };
  ASSERT_GT(near(-0.35), near(0.0));
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    expect_found(first_step(seed));
  }
}

TEST_F(Finding, OnTwoDesksOfDifferentHeightThatTheSceneDoesNotList) {
  const std::vector<belief::Support> supports = {slab("low_desk", {0.6, 0.42, 0.03}, {0.0, -0.24, 0.0}),
                                                 slab("high_desk", {0.6, 0.42, 0.03}, {0.0, 0.24, 0.12}),
                                                 slab("floor", {4.0, 4.0, 0.1}, {0.0, 0.0, -0.4})};
  see({{box_model("box", {0.06, 0.10, 0.18}), turned(-0.3, {0.0, -0.22, 0.09})},
       {can_model("can", 0.035, 0.11), turned(0.0, {0.0, 0.22, 0.175})}},
      supports, {});
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const StepResult result = first_step(seed);
    expect_found(result);
    // Each of the three is a support now, at its height.
    for (const double height : {0.0, 0.12, -0.4}) {
      EXPECT_TRUE(std::any_of(result.belief.scene->supports.begin(), result.belief.scene->supports.end(),
                              [&](const belief::Support& support) {
                                const auto& shape = std::get<belief::PrimitiveShape>(support.collision.front());
                                const auto& box = std::get<geometry::BoxShape>(shape.primitive);
                                const Vector3d top = support.X_WS * Vector3d(0.0, 0.0, 0.5 * box.size.z());
                                return std::abs(top.z() - height) < 0.01;
                              }))
          << height;
    }
  }
}

TEST_F(Finding, OnASupportOfTheSceneThatIsTooSmallToBeTakenForOne) {
  // A plinth no larger than a face of an object: only the scene says that it is not to be moved.
  const std::vector<belief::Support> supports = {slab("plinth", {0.16, 0.16, 0.25}, {0.0, 0.15, 0.25}), table()};
  see({{can_model("can", 0.035, 0.11), turned(0.0, {0.0, 0.15, 0.305})},
       {box_model("box", {0.06, 0.10, 0.18}), turned(0.4, {-0.1, -0.2, 0.09})}},
      supports, supports);
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const StepResult result = first_step(seed);
    expect_found(result);
    EXPECT_THAT(names_of(*result.belief.scene), Each(AnyOf("plinth", "table")));
  }
}

TEST_F(Finding, WhatIsFoundNeitherFloatsNorReachesIntoAnother) {
  std::vector<Thing> things = six_things();
  // One stands on another.
  things.push_back({can_model("pot", 0.03, 0.07), turned(0.0, {0.12, 0.10, 0.065 + 0.035})});
  const std::vector<belief::Support> supports = {slab("desk", {0.5, 0.68, 0.03}, Vector3d::Zero()),
                                                 slab("floor", {6.0, 6.0, 0.1}, {0.0, 0.0, -0.35})};
  see(things, supports, {});
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const StepResult result = first_step(seed);
    std::vector<std::vector<Vector3d>> points;
    std::vector<std::size_t> there;
    for (std::size_t i = 0; i < things.size(); ++i) {
      // What was not found is looked for where nothing is seen of it. The confidence of what was found may be less than
      // one half, as one frame seldom tells how a thing is turned.
      const belief::ObjectBelief& object = result.belief.objects[i];
      if (!reported(object) || object.existence < 0.5 || object.visible_share < 0.3) continue;
      there.push_back(i);
      points.push_back(vertices_at(i, belief::estimate(result.belief.objects[i]).mode));
    }
    ASSERT_GE(there.size(), 6u);
    const auto lowest = [](const std::vector<Vector3d>& p) {
      return std::min_element(p.begin(), p.end(), [](const auto& a, const auto& b) { return a.z() < b.z(); })->z();
    };
    const auto highest = [](const std::vector<Vector3d>& p) {
      return std::max_element(p.begin(), p.end(), [](const auto& a, const auto& b) { return a.z() < b.z(); })->z();
    };
    for (std::size_t i = 0; i < there.size(); ++i) {
      double off = std::min(std::abs(lowest(points[i])), std::abs(lowest(points[i]) + 0.35));
      for (std::size_t j = 0; j < there.size(); ++j)
        if (j != i) off = std::min(off, std::abs(lowest(points[i]) - highest(points[j])));
      EXPECT_LT(off, 0.03) << scene_->objects[there[i]].name;
    }
    // No object's middle is inside another: by the mesh, from the outside in any direction an odd number of faces.
    for (std::size_t i = 0; i < there.size(); ++i)
      for (std::size_t j = 0; j < there.size(); ++j) {
        if (i == j) continue;
        SupportSurfaces other;
        const belief::ObjectModel& model = scene_->model_of(scene_->objects[there[j]]);
        other.add(*backends_.meshes.get(model.visual, model.collision, MeshDetail::kLikelihood),
                  belief::estimate(result.belief.objects[there[j]]).mode);
        Vector3d middle = Vector3d::Zero();
        for (const Vector3d& p : points[i]) middle += p / static_cast<double>(points[i].size());
        EXPECT_FALSE(other.inside(middle)) << scene_->objects[there[i]].name << " in " << model.name;
      }
  }
}

TEST_F(Finding, AWallIsNoSupport) {
  const geometry::TriangleMesh wall = geometry::make_mesh(geometry::BoxShape{{0.05, 3.0, 3.0}});
  see({{box_model("box", {0.06, 0.10, 0.18}), turned(-0.3, {-0.05, -0.1, 0.09})},
       {can_model("can", 0.035, 0.11), turned(0.0, {-0.05, 0.12, 0.055})}},
      {table()}, {}, {{wall, fixed(Pose::from_translation({0.3, 0.0, 0.5}))}});
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const StepResult result = first_step(seed);
    expect_found(result);
    ASSERT_FALSE(result.belief.scene->supports.empty());
    for (const belief::Support& support : result.belief.scene->supports)
      EXPECT_GT((support.X_WS.rotation * Vector3d::UnitZ()).z(), std::cos(0.1)) << support.name;
  }
}

TEST_F(Finding, NothingIsFoundWhereNoDepthIsMeasured) {
  see(six_things(), {table()}, {});
  observation_.frame.depth = std::make_shared<const geometry::DepthImage>(observation_.frame.camera.width,
                                                                          observation_.frame.camera.height, 0.0f);
  const StepResult result = first_step(1);
  EXPECT_THAT(result.belief.scene->supports, IsEmpty());
  EXPECT_EQ(result.counters.found, 0);
  EXPECT_NE(result.degraded & kNoSupportFound, 0u);
  EXPECT_NE(result.degraded & kObjectsMissing, 0u);
  for (const belief::ObjectBelief& object : result.belief.objects) {
    EXPECT_FALSE(reported(object)) << object.name;
    EXPECT_LT(object.existence, 0.5) << object.name;
  }
}

TEST_F(Finding, NothingIsFoundInDepthWithoutAnySurface) {
  // Each pixel a depth of its own, as of a sensor that is disturbed.
  see(six_things(), {table()}, {});
  auto depth =
      std::make_shared<geometry::DepthImage>(observation_.frame.camera.width, observation_.frame.camera.height);
  core::RandomStream draws(3, core::Purpose::kTest);
  for (std::size_t i = 0; i < depth->size(); ++i) depth->data()[i] = static_cast<float>(draws.uniform(0.3, 2.4));
  observation_.frame.depth = depth;
  const StepResult result = first_step(1);
  EXPECT_THAT(result.belief.scene->supports, IsEmpty());
  EXPECT_EQ(result.counters.found, 0);
  EXPECT_NE(result.degraded & kNoSupportFound, 0u);
}

}  // namespace
}  // namespace prescene::filter_tests
