// SPDX-License-Identifier: Apache-2.0
#include <mujoco/mujoco.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "prescene/core/check.h"
#include "tests/peers/falling_box.h"

namespace prescene::tests {
namespace {

std::string scene_of(const FallingBox& box) {
  std::array<char, 1024> text;
  const int size = std::snprintf(
      text.data(), text.size(),
      "<mujoco><option timestep='%.9g' gravity='0 0 -9.81' cone='elliptic' impratio='10'/><worldbody>"
      "<geom type='plane' size='10 10 1' friction='%.9g 0 0' condim='3' solref='.004 1'/>"
      "<body><freejoint/><geom type='box' size='%.9g %.9g %.9g' mass='%.9g' friction='%.9g 0 0' condim='3' "
      "solref='.004 1'/>"
      "</body></worldbody></mujoco>",
      box.step, box.friction, 0.5 * box.size.x(), 0.5 * box.size.y(), 0.5 * box.size.z(), box.mass, box.friction);
  PRESCENE_CHECK(size > 0 && static_cast<std::size_t>(size) < text.size());
  return std::string(text.data(), static_cast<std::size_t>(size));
}

}  // namespace

geometry::Pose fall_by_mujoco(const FallingBox& box) {
  const std::string xml = scene_of(box);
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  PRESCENE_CHECK(mj_makeEmptyFileVFS(files.get(), "box.xml", static_cast<int>(xml.size())) == 0);
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), "box.xml")], xml.data(), xml.size());
  std::array<char, 512> error{};
  mjModel* model = mj_loadXML("box.xml", files.get(), error.data(), static_cast<int>(error.size()));
  mj_deleteVFS(files.get());
  PRESCENE_CHECK_MSG(model, error.data());
  mjData* data = mj_makeData(model);
  const geometry::Vector3d& p = box.X_WB.translation;
  const geometry::Quaterniond& q = box.X_WB.rotation;
  const double state[7] = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
  std::memcpy(data->qpos, state, sizeof state);
  // A free joint's angular velocity is in the body's frame.
  const geometry::Vector3d w_B = q.conjugate() * box.V_WB.angular;
  for (int i = 0; i < 3; ++i) {
    data->qvel[i] = box.V_WB.linear[i];
    data->qvel[3 + i] = w_B[i];
  }
  while (data->time < box.duration) mj_step(model, data);
  geometry::Pose end;
  end.translation = {data->qpos[0], data->qpos[1], data->qpos[2]};
  end.rotation = geometry::Quaterniond(data->qpos[3], data->qpos[4], data->qpos[5], data->qpos[6]).normalized();
  mj_deleteData(data);
  mj_deleteModel(model);
  return end;
}

}  // namespace prescene::tests
