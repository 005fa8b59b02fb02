// SPDX-License-Identifier: Apache-2.0
// Falls of a box against ODE and MuJoCo, from the same starts: which face it ends on, and where it stops.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "bullet_scenes.h"
#include "prescene/geometry/sampling.h"
#include "tests/peers/falling_box.h"

namespace prescene::tests {
namespace {

constexpr int kFalls = 150;

int long_axis_up(const Pose& X) {
  int axis = 0;
  (X.rotation.conjugate() * Vector3d::UnitZ()).cwiseAbs().maxCoeff(&axis);
  return axis;
}

struct Falls {
  std::array<int, 3> axes{};
  std::vector<Pose> ends;
};

struct Peers {
  Falls ours, ode, mujoco;
};

Peers fall_by_all() {
  const Vector3d size(0.1, 0.08, 0.06);
  Scene scene = floor_scene(primitive_model("box", geometry::BoxShape{size}));
  BulletOptions options;
  options.step = 1e-3;
  const auto simulator = simulator_of(scene, options);
  core::RandomStream stream(12, core::Purpose::kTest);
  Peers peers;
  const auto note = [](Falls& falls, const Pose& end) {
    falls.ends.push_back(end);
    ++falls.axes[static_cast<std::size_t>(long_axis_up(end))];
  };
  for (int i = 0; i < kFalls; ++i) {
    FallingBox box;
    box.size = size;
    box.X_WB = {geometry::uniform_rotation(stream), {0.0, 0.0, 0.2}};
    box.V_WB.linear = {0.5, 0.0, 0.0};
    box.V_WB.angular = 2.0 * geometry::normal_vector(stream);
    note(peers.ode, fall_by_ode(box));
    note(peers.mujoco, fall_by_mujoco(box));
    WorldState start = start_of(scene);
    start.objects[0].X_WO = box.X_WB;
    start.objects[0].V_WO = box.V_WB;
    simulation::RunRequest request;
    request.stop.duration = box.duration;
    note(peers.ours, run_one(*simulator, start, request).final().objects[0].X_WO);
  }
  return peers;
}

struct Agreement {
  double same_face = 0.0;
  double median_distance = 0.0;   // of stopping places where the face is the same, m
  double share_difference = 0.0;  // largest, of an axis being up
};

Agreement agreement(const Falls& a, const Falls& b) {
  Agreement result;
  std::vector<double> distances;
  for (std::size_t i = 0; i < kFalls; ++i) {
    if (long_axis_up(a.ends[i]) != long_axis_up(b.ends[i])) continue;
    result.same_face += 1.0 / kFalls;
    distances.push_back((a.ends[i].translation - b.ends[i].translation).head<2>().norm());
  }
  std::sort(distances.begin(), distances.end());
  result.median_distance = distances.empty() ? 1.0 : distances[distances.size() / 2];
  for (std::size_t k = 0; k < 3; ++k) {
    result.share_difference = std::max(result.share_difference, std::abs(a.axes[k] - b.axes[k]) / double(kFalls));
  }
  return result;
}

TEST(Falls, EndOnTheSameFacesAndPlacesAsInOdeAndMujoco) {
  const Peers peers = fall_by_all();
  const Agreement with_ode = agreement(peers.ours, peers.ode);
  const Agreement with_mujoco = agreement(peers.ours, peers.mujoco);
  const Agreement among_peers = agreement(peers.ode, peers.mujoco);
  for (const auto& [name, a] : {std::pair("ours, ODE", with_ode), std::pair("ours, MuJoCo", with_mujoco),
                                std::pair("ODE, MuJoCo", among_peers)}) {
    std::printf("%-14s same face %.2f, median distance %.1f mm, largest difference of a share %.3f\n", name,
                a.same_face, 1e3 * a.median_distance, a.share_difference);
  }
  // The peers differ from each other too (soft contacts, friction pyramid): we must not differ more.
  for (const Agreement& ours : {with_ode, with_mujoco}) {
    EXPECT_GE(ours.same_face, among_peers.same_face - 0.1);
    EXPECT_LE(ours.median_distance, among_peers.median_distance + 0.01);
    EXPECT_LE(ours.share_difference, 0.12);  // three deviations of a difference of shares of 150 at agreement .75
  }
  for (std::size_t i = 0; i < kFalls; ++i) {
    const double half = 0.5 * Vector3d(0.1, 0.08, 0.06)[long_axis_up(peers.ours.ends[i])];
    EXPECT_NEAR(peers.ours.ends[i].translation.z(), half, 1e-4) << i;
  }
}

}  // namespace
}  // namespace prescene::tests
