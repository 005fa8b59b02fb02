// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/world_terms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace prescene::filter {
namespace {

using belief::Particle;

constexpr double kAlikePlace = 0.008;     // m; others that stand so near to each other, ...
constexpr double kAlikeTurned = 0.12;     // rad; ... in two worlds hide the same
constexpr std::size_t kMostViews = 12;    // of one member
constexpr double kApartInPicture = 0.03;  // rad, between the balls about two members; as far as poses differ

/// By particle, the number of the pose that stands for it; heaviest first.
std::vector<std::size_t> alike_poses(const std::vector<Particle>& particles, std::vector<std::size_t>& leaders) {
  std::vector<std::size_t> order(particles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  std::vector<std::size_t> number(particles.size());
  for (const std::size_t i : order) {
    const auto leader = std::find_if(leaders.begin(), leaders.end(), [&](std::size_t l) {
      const Vector6d d = geometry::box_minus(particles[i].X_WO, particles[l].X_WO);
      return d.tail<3>().norm() < kAlikePlace && d.head<3>().norm() < kAlikeTurned;
    });
    number[i] = static_cast<std::size_t>(leader - leaders.begin());
    if (leader == leaders.end()) leaders.push_back(i);
  }
  return number;
}

/// Whether the balls about two members are apart in the picture, in all their worlds.
bool are_apart(const FilterFrame& frame, const WorldMember& a, const WorldMember& b) {
  double nearest = M_PI;
  for (std::size_t i = 0; i < a.particles->size(); ++i) {
    const Vector3d p = frame.X_CW * ((*a.particles)[i].X_WO * a.target.centre());
    const Vector3d q = frame.X_CW * ((*b.particles)[i].X_WO * b.target.centre());
    const auto half_angle = [](const WorldMember& m, const Vector3d& at) {
      return std::asin(std::min(1.0, static_cast<double>(m.target.mesh->radius) / std::max(1e-6, at.norm())));
    };
    const double between = std::atan2(p.cross(q).norm(), p.dot(q));
    nearest = std::min(nearest, between - half_angle(a, p) - half_angle(b, q));
  }
  return nearest > kApartInPicture;
}

/// Without what is behind the member.
void keep_in_front(const geometry::DepthImage& member, geometry::DepthImage& other) {
  for (std::size_t i = 0; i < other.size(); ++i)
    if (member.data()[i] > 0.0F && other.data()[i] > member.data()[i]) other.data()[i] = 0.0F;
}

}  // namespace

WorldTerms world_terms(const FilterFrame& frame, const WorldMember& member, const std::vector<WorldMember>& others,
                       std::span<const geometry::DepthImage* const> outside, const FilterTools& tools) {
  WorldTerms result;
  const std::vector<Particle>& particles = *member.particles;
  std::vector<WorldMember> hiding;
  for (const WorldMember& other : others)
    if (!are_apart(frame, member, other)) hiding.push_back(other);
  if (hiding.empty()) return result;
  const auto depth_at = [&](const WorldMember& m, std::size_t world) {
    return depth_of(m.target, frame.X_CW * (*m.particles)[world].X_WO, frame.terms.camera, *tools.renderer);
  };
  // The member counts, too: where it is decides what it is in front of.
  std::vector<std::vector<std::size_t>> numbers, leaders;
  hiding.push_back(member);
  for (const WorldMember& m : hiding) numbers.push_back(alike_poses(*m.particles, leaders.emplace_back()));
  std::vector<std::vector<geometry::DepthImage>> depths(hiding.size());
  for (std::size_t m = 0; m < hiding.size(); ++m)
    for (const std::size_t world : leaders[m]) depths[m].push_back(depth_at(hiding[m], world));
  std::vector<std::size_t> order(particles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  std::map<std::vector<std::size_t>, const rendering::FrameTerms*> views;
  result.terms_of.resize(particles.size());
  for (const std::size_t world : order) {
    std::vector<std::size_t> key;
    for (const auto& number : numbers) key.push_back(number[world]);
    if (const auto known = views.find(key); known != views.end()) {
      result.terms_of[world] = known->second;
      continue;
    }
    if (result.views.size() < kMostViews) {
      std::vector<geometry::DepthImage> in_front;
      for (std::size_t m = 0; m + 1 < hiding.size(); ++m) {
        in_front.push_back(depths[m][key[m]]);
        keep_in_front(depths.back()[key.back()], in_front.back());
      }
      std::vector<const geometry::DepthImage*> known(outside.begin(), outside.end());
      for (const geometry::DepthImage& depth : in_front) known.push_back(&depth);
      const Pose X_CO = frame.X_CW * particles[world].X_WO;
      result.views.push_back(std::make_unique<const rendering::FrameTerms>(terms_for_object(
          frame, known, X_CO * member.target.centre(), static_cast<double>(member.target.mesh->radius))));
    }
    result.terms_of[world] = result.views.back().get();
    views.emplace(std::move(key), result.terms_of[world]);
  }
  return result;
}

}  // namespace prescene::filter
