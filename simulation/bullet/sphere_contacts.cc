// SPDX-License-Identifier: Apache-2.0
#include "sphere_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "prescene/collision/point_queries.h"
#include "prescene/geometry/polygon.h"
#include "sphere_patch.h"

namespace prescene::simulation {
namespace {

using collision::SphereTree;
using collision::SurfaceSpheres;
using Eigen::Vector2d;

collision::PackedSphere lane(const SphereTree& tree, std::uint32_t node, std::size_t k) {
  const float* lanes = tree.lanes(node);
  const std::size_t n = tree.branching();
  return {collision::Vector3f(lanes[k], lanes[n + k], lanes[2 * n + k]), lanes[3 * n + k]};
}

/// Calls leaf(index of the patch, its sphere) for each sphere for which within(centre, radius) answers true, as it does
/// for all bounding spheres above it; and visit(node, level) for each node on the way, before what is below it.
template <class Within, class Visit, class Leaf>
void for_near(const SphereTree& tree, std::vector<SphereContactFinder::OnTheWay>& stack, const Within& within,
              const Visit& visit, const Leaf& leaf) {
  stack.clear();
  stack.push_back({0, 1});
  while (!stack.empty()) {
    const auto [index, level] = stack.back();
    stack.pop_back();
    visit(index, level);
    const SphereTree::Node& node = tree.nodes()[index];
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const collision::PackedSphere child = lane(tree, index, k);
      if (!within(widened(child.centre), static_cast<double>(child.radius))) continue;
      if (node.is_bottom()) {
        leaf(tree.order()[node.first + k]);
      } else {
        stack.push_back({node.first + k, level + 1});
      }
    }
  }
}

}  // namespace

void SphereContactFinder::add(const ContactPoint& point, const MovingFrame& A, const MovingFrame& B, double dt) {
  const double speed = point.normal.dot(A.motion.at(point.position) - B.motion.at(point.position));
  found_.push_back({point, point.gap + dt * std::min(0.0, speed + kSlow), 0.0});
}

void SphereContactFinder::take(std::size_t index, std::vector<ContactPoint>& contacts) {
  const ContactPoint& last = found_[index].point;
  contacts.push_back(last);
  for (Found& f : found_) {
    const double bend = (f.point.normal - last.normal).squaredNorm();
    f.spread = std::min(f.spread, (f.point.position - last.position).squaredNorm() + kTurnLength * kTurnLength * bend);
  }
}

std::size_t SphereContactFinder::take_support_polygon(std::size_t first, double bearing,
                                                      std::vector<ContactPoint>& contacts) {
  const ContactPoint from = found_[first].point;
  const Vector3d x_axis = from.normal.unitOrthogonal();
  const Vector3d y_axis = from.normal.cross(x_axis);
  flat_.clear();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const ContactPoint& point = found_[i].point;
    if (found_[i].at_end > bearing || (point.normal - from.normal).squaredNorm() > kSameWay * kSameWay) continue;
    const Vector3d to = point.position - from.position;
    flat_.push_back({{x_axis.dot(to), y_axis.dot(to)}, i, 0.0});
  }
  std::array<Vector2d, kMostBearing> places = {Vector2d::Zero()};
  std::array<Vector2d, 2 * kMostBearing> corners = {Vector2d::Zero()};
  std::span<const Vector2d> polygon(corners.data(), 1);
  take(first, contacts);
  std::size_t taken = 1;
  for (; taken < kMostBearing; ++taken) {
    const Flat* outermost = nullptr;
    double most = kSamePlace;
    // What is inside of the polygon stays there.
    std::erase_if(flat_, [&](Flat& flat) {
      return !((flat.outside = geometry::distance_outside(polygon, flat.place)) > kSamePlace);
    });
    for (const Flat& flat : flat_) {
      if (flat.outside <= most * (1.0 + 1e-6)) continue;
      most = flat.outside;
      outermost = &flat;
    }
    if (!outermost) break;
    places[taken] = outermost->place;
    polygon = {corners.data(), geometry::convex_polygon(std::span(places).first(taken + 1), corners)};
    take(outermost->index, contacts);
  }
  return taken;
}

void SphereContactFinder::reduce(const Frame& X_WA, std::vector<ContactPoint>& contacts) {
  if (found_.empty()) return;
  double least = std::numeric_limits<double>::infinity();
  for (const Found& f : found_) least = std::min(least, f.at_end);
  const Vector3d outwards = X_WA.R * Vector3d(kFirstWay[0], kFirstWay[1], kFirstWay[2]);
  double outermost = -std::numeric_limits<double>::infinity();
  std::size_t first = 0;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    found_[i].spread = std::numeric_limits<double>::infinity();
    const double out = outwards.dot(found_[i].point.position - X_WA.p);
    if (found_[i].at_end > least + kBearing || out <= outermost) continue;
    outermost = out;
    first = i;
  }
  // What the body stands on with its weight is kept to the corner; then again and again the one farthest from all that
  // were taken, a tier at a time.
  std::size_t taken = take_support_polygon(first, least + kBearing, contacts);
  struct Tier {
    double at_end;
    std::size_t most;
  };
  const Tier tiers[] = {{least + kBearing, kMostBearing},
                        {std::max(0.0, least + kNearlyBearing), kMostNearlyBearing},
                        {std::numeric_limits<double>::infinity(), kMostSphereContacts}};
  for (const Tier& tier : tiers) {
    for (; taken < tier.most; ++taken) {
      std::size_t farthest = found_.size();
      double most = kSamePlace * kSamePlace;
      for (std::size_t i = 0; i < found_.size(); ++i) {
        if (found_[i].at_end > tier.at_end || found_[i].spread <= most * (1.0 + 1e-6)) continue;
        most = found_[i].spread;
        farthest = i;
      }
      if (farthest == found_.size()) break;
      take(farthest, contacts);
    }
  }
}

void SphereContactFinder::spheres_convex(const SurfaceSpheres& a, const MovingFrame& A, const ConvexCore& b,
                                         const MovingFrame& B, double range, double dt,
                                         std::vector<ContactPoint>& contacts) {
  found_.clear();
  const Frame X_BA(B.X.R.transpose() * A.X.R, B.X.inverse_times(A.X.p));
  const double within = range + static_cast<double>(a.longest_reach);
  const auto near = [&](const Vector3d& centre_A, double radius) {
    const Vector3d centre = X_BA * centre_A;
    const Vector3d beyond = ((centre - b.box_center()).cwiseAbs() - b.box_half_size()).cwiseMax(0.0);
    const double limit = radius + within;
    return beyond.squaredNorm() <= limit * limit;
  };
  faces_.begin(a, b, X_BA);
  const auto visit = [&](std::uint32_t node, std::uint32_t level) { faces_.look_at(node, level); };
  for_near(*a.tree, stack_, near, visit, [&](std::uint32_t index) {
    // In B's frame until it is a contact.
    const PlacedPatch patch(a.patches[index], X_BA);
    const ConvexCore::Nearest nearest = faces_.nearest(b, patch.centre, b.radius() + patch.radius + within);
    const double gap = nearest.distance - b.radius() - patch.radius;
    if (gap > within) return;
    ContactPoint contact;
    double turning = 0.0;
    const Vector3d on_sphere = patch.lowest(nearest.normal);
    const bool faces = patch.is_edge() || patch.normal.dot(nearest.normal) < 0.0;
    if (!nearest.flat && !patch.is_edge()) {
      // An edge, a corner or a round side of B: its place nearest to the patch, on the side of its rounding that faces
      // the patch.
      const Vector3d core = patch.centre - nearest.distance * nearest.normal;
      const Vector3d on_b = core - b.radius() * patch.normal_at(core + b.radius() * nearest.normal);
      const auto height = patch.height_of(on_b);
      if (!height || !faces || height->gap < -2.0 * patch.radius) return;
      contact = {on_b - 0.5 * height->gap * height->normal, -height->normal, height->gap};
    } else {
      if (!faces || !patch.stands_for(on_sphere)) return;
      contact = {on_sphere - 0.5 * gap * nearest.normal, nearest.normal, gap};
      const Vector3d normal = B.X.R * nearest.normal;
      turning = normal.dot(A.motion.towards_center(B.X * patch.centre));
    }
    if (contact.gap > range) return;
    turn(contact, turning, dt);
    contact.position = B.X * contact.position;
    contact.normal = B.X.R * contact.normal;
    add(contact, A, B, dt);
  });
  reduce(A.X, contacts);
}

void SphereContactFinder::spheres_surface(const SurfaceSpheres& a, const MovingFrame& A, const SurfaceShape& b,
                                          const MovingFrame& B, double range, double dt,
                                          std::vector<ContactPoint>& contacts) {
  found_.clear();
  const Frame X_BA(B.X.R.transpose() * A.X.R, B.X.inverse_times(A.X.p));
  const double within = range + static_cast<double>(a.longest_reach);
  const auto near = [&](const Vector3d& centre_A, double radius) {
    return collision::is_within(b.tree(), X_BA * centre_A, radius + within);
  };
  const collision::Array<collision::PackedSphere>& spheres = a.tree->packing().spheres();
  const auto visit = [](std::uint32_t, std::uint32_t) {};
  for_near(*a.tree, stack_, near, visit, [&](std::uint32_t index) {
    // With the small sphere: the large one may be nearer to other parts of the surface.
    const Vector3d centre = X_BA * widened(spheres[index].centre);
    const auto radius = static_cast<double>(spheres[index].radius);
    const auto nearest = collision::nearest_point(b.tree(), centre, radius + within);
    if (!nearest || !(nearest->distance > 0.0)) return;
    const PlacedPatch patch(a.patches[index], X_BA);
    Vector3d normal = (centre - nearest->point) / nearest->distance;
    double distance = nearest->distance;
    const SurfaceShape::Place place = b.place_of(nearest->triangle, nearest->point);
    if (!place.on_ridge) {
      normal = place.normal.dot(normal) >= 0.0 ? place.normal : Vector3d(-place.normal);
      distance = normal.dot(centre - nearest->point);
    }
    const bool faces = patch.is_edge() || patch.normal.dot(normal) < 0.0;
    if (!faces) return;
    ContactPoint contact;
    double turning = 0.0;
    if (place.on_ridge && !patch.is_edge()) {
      const auto height = patch.height_of(nearest->point);
      if (!height || height->gap < -2.0 * patch.radius) return;
      contact = {nearest->point - 0.5 * height->gap * height->normal, -height->normal, height->gap};
    } else {
      const Vector3d on_sphere = centre - radius * normal;
      if (!patch.stands_for(on_sphere)) return;
      contact = {on_sphere - 0.5 * (distance - radius) * normal, normal, distance - radius};
      turning = (B.X.R * normal).dot(A.motion.towards_center(B.X * patch.centre));
    }
    if (contact.gap > range) return;
    turn(contact, turning, dt);
    contact.position = B.X * contact.position;
    contact.normal = B.X.R * contact.normal;
    add(contact, A, B, dt);
  });
  reduce(A.X, contacts);
}

}  // namespace prescene::simulation
