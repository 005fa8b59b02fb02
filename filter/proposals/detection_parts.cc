// SPDX-License-Identifier: Apache-2.0
// What both searches use: the parts of this header, and explained_pixels and cluster_starts of detection.h.
#include "detection_parts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

constexpr double kMostFloating = 0.03;   // m between the lowest points and what they stand on
constexpr double kStandingStarts = 0.3;  // share of the starts with a side of the model's box down
constexpr int kFloatingClusters = 3;     // clusters that are over no support and yet looked at
// Starts for each cluster and model where something was learned of it (FilterTools::learned), in place of
// DetectionOptions::starts. Chosen.
constexpr int kLearnedStarts = 36;      // poses that the learned places propose, ...
constexpr int kOtherStarts = 24;        // ... and random ones beside them
constexpr double kLowestPoints = 0.01;  // m above an object's lowest point: what it may stand on
// What is worse in any of these is hopeless.
constexpr double kHopelessLogRatio = 20.0;  // nats
constexpr double kHopelessHits = 0.5;
constexpr double kHopelessVisible = 0.15;

}  // namespace

bool hopeless(const rendering::PoseEvidence& e) {
  return e.log_ratio < kHopelessLogRatio || e.hit_share() < kHopelessHits || e.visible < kHopelessVisible * e.in_view;
}

bool stands(const SearchTarget& target, const Pose& X_WO, const Vector3d& up_W,
            std::span<const SupportSurfaces* const> surfaces, std::span<const double> shares) {
  std::vector<Vector3d> points;
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& vertex : target.mesh->vertices) {
    points.push_back(X_WO * vertex.cast<double>());
    lowest = std::min(lowest, up_W.dot(points.back()));
  }
  std::erase_if(points, [&](const Vector3d& p) { return up_W.dot(p) > lowest + kLowestPoints; });
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  return std::any_of(points.begin(), points.end(), [&](const Vector3d& corner) {
    return std::any_of(shares.begin(), shares.end(), [&](double share) {
      const Vector3d p = share == 1.0 ? corner : Vector3d(middle + share * (corner - middle));
      return std::any_of(surfaces.begin(), surfaces.end(), [&](const SupportSurfaces* surface) {
        return surface->crosses(p + kMostSinking * up_W, p - kMostFloating * up_W);
      });
    });
  });
}

std::vector<Pose> starts_in(const Cluster& cluster, const SampledDepth& sampled, const SearchTarget& target,
                            const Vector3d& up_C, int random, const core::RandomStream& stream) {
  if (target.learned == nullptr) return cluster_starts(cluster, target, up_C, kStandingStarts, random, stream);
  std::vector<Pose> starts = learned_starts(*target.learned, sampled.depth, sampled.camera, cluster.points_C, up_C,
                                            kLearnedStarts, stream.for_purpose(core::Purpose::kSurface));
  const std::vector<Pose> others = cluster_starts(cluster, target, up_C, kStandingStarts, kOtherStarts, stream);
  starts.insert(starts.end(), others.begin(), others.end());
  return starts;
}

std::vector<SearchedModel> search_clusters(const rendering::FrameTerms& terms, std::size_t clusters, std::size_t first,
                                           const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                           std::span<const int> left, const DetectionOptions& options,
                                           const FilterTools& tools, const core::RandomStream& stream,
                                           std::uint64_t round, const StartsIn& starts, const KeepCandidates& keep) {
  std::vector<SearchedModel> tasks;
  for (std::size_t cluster = first; cluster < clusters; ++cluster)
    for (std::size_t model = 0; model < wanted.size(); ++model)
      if (left[model] > 0) tasks.push_back({static_cast<int>(cluster), static_cast<int>(model), {}});
  tools.search->threads().for_each_index(tasks.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    SearchedModel& task = tasks[i];
    const SearchTarget& target = wanted[static_cast<std::size_t>(task.model)].target;
    core::RandomStream draws = stream;
    const core::RandomStream mine(draws.next_u64(), core::Purpose::kDetection, round, static_cast<std::uint32_t>(i));
    task.found = tools.search->run_serial(terms, target, starts(task, mine), options.search, mine, *workspace);
    std::erase_if(task.found, [&](const PoseCandidate& c) {
      return surroundings.solid.overlap(*target.mesh, surroundings.X_WC * c.X_CO, kMostSinking) > 0.0;
    });
    keep(target, *workspace, task.found);
  });
  return tasks;
}

SupportSurfaces surfaces_of(std::span<const Detection> found, std::span<const WantedModel> wanted, const Pose& X_WC) {
  SupportSurfaces surfaces;
  for (const Detection& detection : found)
    surfaces.add(*wanted[static_cast<std::size_t>(detection.model)].target.mesh, X_WC * detection.X_CO);
  return surfaces;
}

std::vector<geometry::DepthImage> depths_of(std::span<const Detection> found, std::span<const WantedModel> wanted,
                                            const geometry::PinholeCamera& camera, const FilterTools& tools) {
  std::vector<geometry::DepthImage> depths;
  for (const Detection& detection : found)
    depths.push_back(
        depth_of(wanted[static_cast<std::size_t>(detection.model)].target, detection.X_CO, camera, *tools.renderer));
  return depths;
}

std::vector<Cluster> clusters_over_supports(const SampledDepth& sampled, const geometry::Image<std::uint8_t>& explained,
                                            const Surroundings& surroundings, const DetectionOptions& options) {
  std::vector<Cluster> clusters;
  for (const int where : {kMainSupport, kOtherSupport, kNoSupport}) {
    auto rest = explained;
    for (std::size_t i = 0; i < explained.size(); ++i)
      if (surroundings.over_support.data()[i] != where) rest.data()[i] = 1;
    std::vector<Cluster> more = find_clusters(sampled, rest, options.segmentation);
    if (where == kNoSupport && static_cast<int>(more.size()) > kFloatingClusters) more.resize(kFloatingClusters);
    std::move(more.begin(), more.end(), std::back_inserter(clusters));
  }
  if (static_cast<int>(clusters.size()) > options.max_clusters)
    clusters.resize(static_cast<std::size_t>(options.max_clusters));
  return clusters;
}

geometry::Image<std::uint8_t> explained_pixels(const SampledDepth& sampled, const geometry::DepthImage& known,
                                               const geometry::PinholeCamera& camera, double tolerance) {
  geometry::Image<std::uint8_t> explained(sampled.camera.width, sampled.camera.height);
  if (known.empty()) return explained;
  for (int y = 0; y < explained.height(); ++y)
    for (int x = 0; x < explained.width(); ++x) {
      const double z = sampled.depth(x, y);
      if (z == 0.0) continue;
      const Eigen::Vector2d pixel =
          camera.project(sampled.points_C[static_cast<std::size_t>(y * explained.width() + x)]);
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      const double near = tolerance * tolerance_growth(z);
      // The neighbours' surfaces count too: outlines are no sharper than a reduced pixel.
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) {
          if (u + du < 0 || v + dv < 0 || u + du >= known.width() || v + dv >= known.height()) continue;
          const float surface = known(u + du, v + dv);
          if (surface > 0.0f && z > surface - near && z < surface + 2.0 * near) explained(x, y) = 1;
        }
    }
  return explained;
}

std::vector<Pose> cluster_starts(const Cluster& cluster, const SearchTarget& target, const Vector3d& up_C,
                                 double standing_share, int count, const core::RandomStream& stream) {
  core::RandomStream draws = stream;
  std::vector<Pose> starts;
  for (int i = 0; i < count; ++i) {
    const Vector3d& seen = cluster.points_C[draws.uniform_below(cluster.points_C.size())];
    // The centre lies behind the seen surface by up to the radius.
    const Vector3d centre =
        seen + draws.uniform(0.0, 0.6) * static_cast<double>(target.mesh->radius) * seen.normalized();
    Pose X_CO;
    X_CO.rotation = geometry::uniform_rotation(draws);
    if (draws.uniform() < standing_share) {
      // Turned by the least angle that brings the axis nearest to up there: which axis, and the turn about up, stay
      // uniform.
      const geometry::Matrix3d R = X_CO.rotation.toRotationMatrix();
      Eigen::Index axis = 0;
      (R.transpose() * up_C).cwiseAbs().maxCoeff(&axis);
      const Vector3d nearest = R.col(axis) * (R.col(axis).dot(up_C) < 0.0 ? -1.0 : 1.0);
      X_CO.rotation = (geometry::rotation_between(nearest, up_C) * X_CO.rotation).normalized();
    }
    X_CO.translation = centre - X_CO.rotation * target.centre();
    starts.push_back(X_CO);
  }
  return starts;
}

}  // namespace prescene::filter
