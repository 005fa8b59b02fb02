// SPDX-License-Identifier: Apache-2.0
// Laws of where things end, through the simulator: a symmetric scene has a symmetric map, more uncertainty never makes
// it narrower, none makes it a point.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/queries/query_engine.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "sliding_scene.h"

namespace prescene::queries {
namespace {

/// A box is let fall onto a ridge that points along y: it goes down on either side. Mirror-symmetric in x and in y.
std::shared_ptr<belief::Scene> ridge(double deviation) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "ridge";
  scene->models = {tests::box_model("box", {0.06, 0.06, 0.06})};
  belief::Support floor;
  floor.name = "floor";
  floor.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{4.0, 4.0, 0.1}}, {}});
  floor.X_WS = geometry::Pose::from_translation({0.0, 0.0, -0.05});
  belief::Support edge = floor;
  edge.name = "edge";
  edge.collision = {belief::PrimitiveShape{geometry::BoxShape{{0.1, 0.6, 0.1}}, {}}};
  const double half_turn = 0.125 * std::numbers::pi;
  edge.X_WS = {geometry::Quaterniond(std::cos(half_turn), 0.0, std::sin(half_turn), 0.0), {0.0, 0.0, 0.02}};
  scene->supports = {floor, edge};
  belief::SceneObject box;
  box.name = "box";
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal().tail<3>() << deviation * deviation, deviation * deviation, 0.0;
  box.pose = belief::NormalPose{geometry::Pose::from_translation({0.0, 0.0, 0.2}), covariance};
  scene->objects.push_back(box);
  scene->duration = 4.0;
  return scene;
}

belief::FinalPoses final_poses(const std::shared_ptr<const belief::Scene>& scene, int instances, int* run = nullptr) {
  core::ThreadPool pool(2);
  simulation::ShapeStore shapes(nullptr);
  QueryContext context;
  context.pool = &pool;
  context.make_simulator = [&](const belief::Scene& asked, double) {
    return simulation::make_bullet_simulator(asked, shapes, {});
  };
  belief::PredictQuery query;
  query.detail.typical_runs = false;
  query.effort.exact_instances = instances;
  const belief::Answer answer = queries::answer(scene, 1, {"", query}, context);
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  if (run) *run = predicted.instances;
  return predicted.final_poses.at(0);
}

/// Mass of the map in a mirrored cell; coordinates are multiplied by the signs.
double mass_at(const belief::HeatMap& map, double x, double y) {
  const double ix = std::floor((x - map.x0) / map.cell), iy = std::floor((y - map.y0) / map.cell);
  if (ix < 0.0 || iy < 0.0 || ix >= map.nx || iy >= map.ny) return 0.0;
  return map.mass[static_cast<std::size_t>(iy) * static_cast<std::size_t>(map.nx) + static_cast<std::size_t>(ix)];
}

double asymmetry(const belief::HeatMap& map, double sign_x, double sign_y) {
  double sum = 0.0;
  for (int iy = 0; iy < map.ny; ++iy)
    for (int ix = 0; ix < map.nx; ++ix) {
      const double x = map.x0 + (ix + 0.5) * map.cell, y = map.y0 + (iy + 0.5) * map.cell;
      sum += std::abs(mass_at(map, x, y) - mass_at(map, sign_x * x, sign_y * y));
    }
  return 0.5 * sum;  // total variation
}

/// Area of the smallest region that holds 90 %.
double area_of(const belief::HeatMap& map) {
  std::vector<double> masses = map.mass;
  std::sort(masses.begin(), masses.end(), std::greater<>());
  double sum = 0.0;
  std::size_t cells = 0;
  while (sum < 0.9 && cells < masses.size()) sum += masses[cells++];
  return static_cast<double>(cells) * map.cell * map.cell;
}

TEST(FinalMapLaws, ASymmetricSceneHasASymmetricMap) {
  const belief::FinalPoses poses = final_poses(ridge(0.03), 2048);
  EXPECT_NEAR(poses.mean_position.x(), 0.0, 0.01);
  EXPECT_NEAR(poses.mean_position.y(), 0.0, 0.005);
  // It went down the ridge, so that the law says something.
  EXPECT_GT(std::sqrt(poses.position_covariance(0, 0)), 0.06);
  EXPECT_LT(asymmetry(poses.heat_map, -1.0, 1.0), 0.12);
  EXPECT_LT(asymmetry(poses.heat_map, 1.0, -1.0), 0.12);
  belief::HeatMap shifted = poses.heat_map;  // what the bound is worth
  shifted.x0 += 0.06;
  EXPECT_GT(asymmetry(shifted, -1.0, 1.0), 0.3);
}

TEST(FinalMapLaws, MoreUncertaintyIsNeverNarrower) {
  double spread = 0.0, area = 0.0;
  for (const double deviation : {0.01, 0.02, 0.04, 0.08}) {
    const belief::FinalPoses poses = final_poses(ridge(deviation), 512);
    EXPECT_GT(poses.position_covariance.trace(), 1.01 * spread) << deviation;
    EXPECT_GT(area_of(poses.heat_map), 1.01 * area) << deviation;
    spread = poses.position_covariance.trace();
    area = area_of(poses.heat_map);
  }
}

TEST(FinalMapLaws, NoUncertaintyIsOneInstance) {
  auto scene = ridge(0.03);
  scene->objects[0].pose = belief::FixedPose{geometry::Pose::from_translation({0.08, 0.0, 0.2})};
  int instances = 0;
  const belief::FinalPoses poses = final_poses(scene, 512, &instances);
  EXPECT_EQ(instances, 1);
  EXPECT_LT(poses.position_covariance.norm(), 1e-12);
}

}  // namespace
}  // namespace prescene::queries
