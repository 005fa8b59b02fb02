// SPDX-License-Identifier: Apache-2.0
// A folder of images of a table, taken while walking round it, of which nothing else is told.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "prescene/interfaces/images/png.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/session_report.h"
#include "prescene/service/recording/support_score.h"
#include "tests/support/paths.h"

namespace prescene::service::followed_support_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;

constexpr int kFrames = 8;

/// The camera of a frame, in the world of the first one (as sequences without a world of their own have it).
Pose camera_in_first(int frame) {
  const auto in_table = [](double angle) {
    const double down = 0.7;
    const Vector3d z(std::cos(down), 0.0, -std::sin(down)), x(0.0, -1.0, 0.0);
    geometry::Matrix3d R;
    R << x, z.cross(x), z;
    const Pose X_TC{geometry::Quaterniond(R), -0.7 * z};
    return Pose{geometry::exp_rotation({0.0, 0.0, angle}), Vector3d::Zero()} * X_TC;
  };
  return in_table(0.0).inverse() * in_table(0.06 * frame);
}

/// A table and a box on it, as the first camera sees them.
rendering::RenderScene table_and_box() {
  rendering::RenderScene scene;
  const Pose X_WT = [] {
    const double down = 0.7;
    const Vector3d z(std::cos(down), 0.0, -std::sin(down)), x(0.0, -1.0, 0.0);
    geometry::Matrix3d R;
    R << x, z.cross(x), z;
    return Pose{geometry::Quaterniond(R), -0.7 * z}.inverse();
  }();
  const auto add = [&](const Vector3d& size, const Vector3d& at) {
    scene.instances.push_back({rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{size})),
                               X_WT * Pose::from_translation(at), rendering::SurfaceMaterial::opaque({170, 150, 120})});
  };
  add({0.8, 0.8, 0.04}, {0.0, 0.0, -0.02});
  add({0.1, 0.08, 0.15}, {0.05, 0.02, 0.075});
  return scene;
}

void write_sequence(const std::filesystem::path& folder, Backends& backends) {
  const geometry::PinholeCamera camera{320, 240, 290.0, 290.0, 159.5, 119.5};
  std::filesystem::create_directories(folder / "frames");
  std::ofstream(folder / "intrinsics.K.txt") << "290 0 159.5\n0 290 119.5\n0 0 1\n";
  std::ofstream poses(folder / "camera_poses.csv");
  poses.precision(15);
  poses << "frame,color,depth,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,m30,m31,m32,m33\n";
  const auto renderer = backends.make_renderer();
  ASSERT_TRUE(renderer.ok());
  const rendering::SimulatedCamera simulated(rendering::SensorModel(), {});
  const rendering::RenderScene scene = table_and_box();
  for (int i = 0; i < kFrames; ++i) {
    const Pose X_WC = camera_in_first(i);
    rendering::RenderedView view;
    rendering::RenderOptions options;
    options.normals = true;
    ASSERT_TRUE((*renderer)->render(scene, camera, X_WC, options, &view).ok());
    geometry::DepthImage depth;
    geometry::ColorImage color;
    simulated.sample(scene, view, nullptr, camera, X_WC, core::RandomStream(1, core::Purpose::kSensorNoise),
                     static_cast<std::uint64_t>(i), &depth, &color);
    const std::string name = "frames/" + std::to_string(i);
    ASSERT_TRUE(interfaces::write_png(folder / (name + ".color.png"), color.view()).ok());
    ASSERT_TRUE(interfaces::write_png_depth(folder / (name + ".depth.png"), depth.view(), 0.001).ok());
    poses << i << ',' << name << ".color.png," << name << ".depth.png";
    const auto m = X_WC.matrix();
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) poses << ',' << m(row, column);
    poses << '\n';
  }
}

TEST(FollowedSupport, IsFoundInAFolderOfImagesAndStaysWhereItIs) {
  const tests::ScratchDir scratch;
  core::ThreadPool pool(2);
  Backends backends(pool);
  ASSERT_NO_FATAL_FAILURE(write_sequence(scratch.path(), backends));
  const auto folder = interfaces::FrameFolder::open(scratch.path(), {.first_stamp_ns = 1'000'000'000});
  ASSERT_TRUE(folder.ok()) << folder.status().message();
  const auto scene = unknown_scene(scratch.path(), folder->frames().front().X_WC);
  const TrackerSettings settings;
  const auto tracker = Tracker::create(scene, settings, 1, backends);
  ASSERT_TRUE(tracker.ok());
  SupportScore score;
  SessionReport report(scene, settings, backends);
  const auto summary =
      replay_folder(*folder, **tracker, {}, {}, [&](const TrackerStep& step, const Tracker& at) -> core::Status {
        score.add(step.record.stamp_ns, step.supports);
        report.set_scene(at.belief()->scene);
        report.add(summary_of(*at.belief()));
        report.add(step.observation);
        return core::ok_status();
      });
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, static_cast<std::uint64_t>(kFrames));
  const auto rows = score.rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].support, filter::kFoundSupport);
  EXPECT_EQ(rows[0].frames, kFrames);
  EXPECT_EQ(rows[0].measured, kFrames);
  EXPECT_LT(rows[0].largest_tilt, 0.015);
  EXPECT_LT(rows[0].largest_height, 0.004);
  EXPECT_GT(rows[0].median_share, 0.7);
  // Where it truly is: 0.7 m from the first camera, which looks down at 0.7 rad.
  const geometry::Plane& plane = score.frames()[0].back().measured.plane_W;
  EXPECT_NEAR(plane.offset, 0.7 * std::sin(0.7), 0.006);
  EXPECT_NEAR(plane.normal.dot(Vector3d(0.0, -std::cos(0.7), -std::sin(0.7))), 1.0, 2e-4);

  report.set_supports(score);
  const auto page = scratch.path() / "report.html";
  ASSERT_TRUE(report.write(page, TrackingScore(scene)).ok());
  std::ifstream file(page);
  const std::string html((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_NE(html.find(filter::kFoundSupport), std::string::npos);
  EXPECT_NE(html.find("Height over the first frame"), std::string::npos);
}

TEST(SupportScore, ComparesWithTheFirstMeasurementAndCountsGaps) {
  filter::SupportMeasurement flat;
  flat.support = "table";
  flat.plane_W = {Vector3d::UnitZ(), -0.1};
  flat.p_WQ = {0.2, 0.0, 0.1};
  SupportScore score;
  EXPECT_TRUE(score.add(0, {}).empty());
  score.add(1, {flat});
  score.add(2, {});
  filter::SupportMeasurement risen = flat;
  risen.plane_W = {geometry::exp_rotation({0.0, 0.1, 0.0}) * Vector3d::UnitZ(), 0.0};
  risen.plane_W.offset = -risen.plane_W.normal.dot(Vector3d(0.2, 0.0, 0.13));
  const auto frames = score.add(3, {risen});
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_NEAR(frames[0].tilt, 0.1, 1e-12);
  EXPECT_NEAR(frames[0].height, 0.03, 1e-12);
  const auto rows = score.rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].frames, 3);
  EXPECT_EQ(rows[0].measured, 2);
  EXPECT_NEAR(rows[0].median_height, 0.03, 1e-12);
}

}  // namespace
}  // namespace prescene::service::followed_support_test
