// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/learned_proposals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/hash.h"

namespace prescene::filter {
namespace {

using geometry::Pose;
using geometry::Vector3d;

constexpr double kReliefReach = 3.0;     // spacings that the relief tells apart, either way
constexpr int kMostDifference = 70;      // of a cell: what hides or touches an object must not decide alone
constexpr int kUnknownDifference = 24;   // of a cell of which nothing is known
constexpr int kElevationWeight = 6;      // what a difference of elevation counts beside one of a cell's relief
constexpr double kLeastSideways = 0.05;  // sine between ray and up, below which up says nothing of the image

int difference(const SurfacePatch& seen, const SurfacePatch& learned) {
  int sum = kElevationWeight * std::abs(static_cast<int>(seen.elevation) - static_cast<int>(learned.elevation));
  for (std::size_t i = 0; i < SurfacePatch::kCells; ++i) {
    const int s = seen.relief[i], l = learned.relief[i];
    const int d = std::min(kMostDifference, std::abs(s - l));
    sum += s == SurfacePatch::kUnknown || l == SurfacePatch::kUnknown ? kUnknownDifference : d;
  }
  return sum;
}

}  // namespace

Pose patch_frame(const Vector3d& p_CQ, const Vector3d& up_C) {
  geometry::Matrix3d R;
  R.col(2) = p_CQ.normalized();
  Vector3d down = -up_C + R.col(2) * R.col(2).dot(up_C);
  if (down.norm() < kLeastSideways) down = Vector3d::UnitY() - R.col(2) * R.col(2).y();
  R.col(1) = down.normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  return {geometry::Quaterniond(R).normalized(), p_CQ};
}

SurfacePatch patch_at(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera, const Vector3d& p_CQ,
                      const Vector3d& up_C, double spacing, bool open) {
  SurfacePatch patch;
  const Pose X_CA = patch_frame(p_CQ, up_C);
  const geometry::Matrix3d R = X_CA.rotation.toRotationMatrix();
  patch.elevation = static_cast<std::uint8_t>(std::clamp(std::lround(127.5 - 127.5 * R.col(2).dot(up_C)), 0L, 255L));
  constexpr int kHalf = SurfacePatch::kSide / 2;
  std::size_t cell = 0;
  for (int row = -kHalf; row <= kHalf; ++row)
    for (int column = -kHalf; column <= kHalf; ++column, ++cell) {
      const Vector3d at = p_CQ + spacing * (column * R.col(0) + row * R.col(1));
      if (!(at.z() > 1e-3)) continue;
      const Eigen::Vector2d pixel = camera.project(at);
      if (!(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < camera.width - 0.5 && pixel.y() < camera.height - 0.5))
        continue;
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      const double z = static_cast<double>(depth(u, v));
      if (!(z > 0.0)) {
        patch.relief[cell] = open ? SurfacePatch::kOpen : SurfacePatch::kUnknown;
        continue;
      }
      const double further = R.col(2).dot(camera.unproject(u, v, z) - p_CQ) / (kReliefReach * spacing);
      patch.relief[cell] = static_cast<std::uint8_t>(1 + std::lround(126.5 * (1.0 + std::clamp(further, -1.0, 1.0))));
    }
  return patch;
}

StoredPose stored(const Pose& pose) {
  StoredPose kept;
  const geometry::Quaterniond& q = pose.rotation;
  kept.rotation = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                   static_cast<float>(q.z())};
  for (int i = 0; i < 3; ++i) kept.translation[static_cast<std::size_t>(i)] = static_cast<float>(pose.translation[i]);
  return kept;
}

Pose restored(const StoredPose& pose) {
  const auto& [w, x, y, z] = pose.rotation;
  const auto& t = pose.translation;
  return {geometry::Quaterniond(w, x, y, z).normalized(), Vector3d(t[0], t[1], t[2])};
}

std::uint64_t mesh_hash(const rendering::RenderMesh& mesh) {
  core::Hasher hasher;
  hasher.value(mesh.vertices.size()).value(mesh.triangles.size());
  for (const auto& vertex : mesh.vertices) hasher.bytes(vertex.data(), 3 * sizeof(float));
  for (const auto& triangle : mesh.triangles) hasher.bytes(triangle.data(), sizeof triangle);
  return hasher.digest();
}

const LearnedModel* find(const LearnedProposals& proposals, const rendering::RenderMesh& mesh) {
  const std::uint64_t hash = mesh_hash(mesh);
  const auto found = std::find_if(proposals.models.begin(), proposals.models.end(),
                                  [hash](const LearnedModel& model) { return model.mesh == hash; });
  return found == proposals.models.end() ? nullptr : &*found;
}

std::vector<Pose> learned_starts(const LearnedModel& model, const geometry::DepthImage& depth,
                                 const geometry::PinholeCamera& camera, std::span<const Vector3d> points_C,
                                 const Vector3d& up_C, int count, core::RandomStream stream) {
  std::vector<Pose> starts;
  if (model.patches.empty() || points_C.empty()) return starts;
  while (static_cast<int>(starts.size()) < count) {
    const Vector3d& place = points_C[stream.uniform_below(points_C.size())];
    const SurfacePatch seen = patch_at(depth, camera, place, up_C, static_cast<double>(model.spacing));
    std::array<std::size_t, 2> nearest{};
    std::array<int, 2> least{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
    for (std::size_t i = 0; i < model.patches.size(); ++i) {
      const int d = difference(seen, model.patches[i]);
      if (d >= least[1]) continue;
      if (d < least[0]) {
        nearest = {i, nearest[0]};
        least = {d, least[0]};
      } else {
        nearest[1] = i;
        least[1] = d;
      }
    }
    const Pose X_CA = patch_frame(place, up_C);
    for (std::size_t k = 0; k < 2 && static_cast<int>(starts.size()) < count; ++k)
      starts.push_back(geometry::normalized(X_CA * restored(model.X_AO[nearest[k]])));
  }
  return starts;
}

}  // namespace prescene::filter
