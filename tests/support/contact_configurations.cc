// SPDX-License-Identifier: Apache-2.0
#include "tests/support/contact_configurations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/overlap_volume.h"

namespace prescene::tests {
namespace {

using collision::Transform;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kGridCells = 8;
constexpr double kDistanceTolerance = 1e-3;  // of size()
constexpr double kVolumeTolerance = 0.1;     // of the share asked for
// Tries for each configuration that is asked for: nearly all rays of convex bodies succeed, one in five of shells.
constexpr int kTries = 40;

geometry::Box box_of(const collision::Mesh& mesh) {
  geometry::Box box;
  for (const Eigen::Vector3f& vertex : mesh.vertices()) box.extend(vertex.cast<double>());
  return box;
}

Transform transform_of(const Quaterniond& R_AB, const Vector3d& p_AB) {
  const core::Result<Transform> X_AB = collision::to_transform(geometry::Pose{R_AB, p_AB});
  PRESCENE_CHECK_MSG(X_AB.ok(), X_AB.status().message());
  return *X_AB;
}

Vector3d inside(const geometry::Box& box, core::RandomStream& stream) {
  const double x = stream.uniform(), y = stream.uniform(), z = stream.uniform();
  return box.min() + Vector3d(x, y, z).cwiseProduct(box.sizes());
}

}  // namespace

/// B in the orientation R_AB, the centre of its box at start + t direction, in metres.
struct ContactConfigurations::Ray {
  Quaterniond R_AB;
  Vector3d start;
  Vector3d direction;
  double length;
};

struct ContactConfigurations::Solids {
  SolidCells a, b;
};

ContactConfigurations::ContactConfigurations(std::shared_ptr<const collision::Mesh> mesh_a,
                                             std::shared_ptr<const collision::Mesh> mesh_b, PairOracle oracle,
                                             std::uint64_t seed)
    : mesh_a_(std::move(mesh_a)),
      mesh_b_(std::move(mesh_b)),
      oracle_(std::move(oracle)),
      stream_(seed, core::Purpose::kTest),
      box_a_(box_of(*mesh_a_)),
      box_b_(box_of(*mesh_b_)),
      size_(std::min(box_a_.diagonal().norm(), box_b_.diagonal().norm())) {}

ContactConfigurations::~ContactConfigurations() = default;

Transform ContactConfigurations::placed(const Ray& ray, double t) const {
  return transform_of(ray.R_AB, ray.start + t * ray.direction - ray.R_AB * box_b_.center());
}

ContactConfigurations::Ray ContactConfigurations::draw_ray(PlacementMethod method, double distance) {
  Ray ray;
  ray.R_AB = geometry::uniform_rotation(stream_);
  const double radius_a = box_a_.diagonal().norm() / 2.0, radius_b = box_b_.diagonal().norm() / 2.0;
  if (method == PlacementMethod::kSphere) {
    ray.direction = -geometry::uniform_direction(stream_);
    // A little more than where the spheres about the boxes are apart by the distance.
    ray.length = radius_a + radius_b + distance + 0.01 * size_;
    ray.start = box_a_.center() - ray.length * ray.direction;
    return ray;
  }
  const geometry::Box around(box_a_.min() - Vector3d::Constant(radius_b), box_a_.max() + Vector3d::Constant(radius_b));
  const double cell = around.sizes().maxCoeff() / kGridCells;
  for (int k = 0; k < 3; ++k) {
    const auto cells = static_cast<std::uint64_t>(std::ceil(around.sizes()[k] / cell));
    ray.start[k] = around.min()[k] + cell * (static_cast<double>(stream_.uniform_below(cells)) + 0.5);
  }
  const Vector3d target = inside(box_a_, stream_);
  ray.direction = (target - ray.start).normalized();
  ray.length = (target - ray.start).norm() + radius_b;
  if (oracle_.distance(placed(ray, 0.0)) > distance) return ray;
  // Out of the contact, to come back from there.
  const double step = 0.02 * size_, reach = 2.0 * (radius_a + radius_b) + distance;
  double t = step;
  ray.direction = -ray.direction;
  while (t < reach && oracle_.distance(placed(ray, t)) <= distance) t += step;
  ray.start += t * ray.direction;
  ray.direction = -ray.direction;
  ray.length = t;
  return ray;
}

std::optional<double> ContactConfigurations::place_at_distance(const Ray& ray, double distance) const {
  const auto excess = [&](double t) { return oracle_.distance(placed(ray, t)) - distance; };
  const double tolerance = 0.5 * kDistanceTolerance * std::min(size_, distance);
  double near = ray.length, far = 0.0, excess_far = excess(0.0);
  if (excess_far <= 0.0) return std::nullopt;
  // The distance shrinks by at most the way: steps that cannot pass the place, longer when it shrinks more slowly.
  double rate = 1.0;
  bool passed = false;
  while (!passed) {
    const double step = excess_far / rate;
    near = far + std::max(step, 0.5 * tolerance);
    if (near > ray.length) return std::nullopt;
    const double excess_near = excess(near);
    if (std::abs(excess_near) <= tolerance) return near;
    passed = excess_near < 0.0;
    if (passed) break;
    rate = std::clamp((excess_far - excess_near) / step, 0.2, 1.0);
    far = near;
    excess_far = excess_near;
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (near + far), excess_middle = excess(middle);
    if (std::abs(excess_middle) <= tolerance) return middle;
    (excess_middle < 0.0 ? near : far) = middle;
  }
  return std::nullopt;
}

/// {just apart, just in contact}.
std::optional<std::array<double, 2>> ContactConfigurations::bracket_contact(const Ray& ray) const {
  const double step = 2.0 * kDistanceTolerance * size_;
  const std::optional<double> close = place_at_distance(ray, step);
  if (!close || oracle_.collide(placed(ray, *close))) return std::nullopt;
  double apart = *close, touching = apart + step;
  while (!oracle_.collide(placed(ray, touching))) {
    apart = touching;
    touching += step;
    if (touching > ray.length) return std::nullopt;
  }
  while (touching - apart > 0.5 * kTouchingGap * size_) {
    const double middle = 0.5 * (apart + touching);
    (oracle_.collide(placed(ray, middle)) ? touching : apart) = middle;
  }
  return std::array<double, 2>{apart, touching};
}

std::vector<Transform> ContactConfigurations::at_distance(double share, int count, PlacementMethod method) {
  std::vector<Transform> found;
  for (int i = 0; i < kTries * count && static_cast<int>(found.size()) < count; ++i) {
    const Ray ray = draw_ray(method, share * size_);
    if (share > 0.0) {
      if (const std::optional<double> t = place_at_distance(ray, share * size_)) found.push_back(placed(ray, *t));
    } else if (const std::optional<std::array<double, 2>> t = bracket_contact(ray)) {
      found.push_back(placed(ray, (*t)[found.size() % 2]));
    }
  }
  return found;
}

std::vector<Transform> ContactConfigurations::penetrating(double volume_share, int count, PlacementMethod method) {
  if (solids_ == nullptr) solids_ = std::make_unique<Solids>(Solids{SolidCells(*mesh_a_), SolidCells(*mesh_b_)});
  const auto share = [&](const Ray& ray, double t) { return overlap_share(solids_->a, solids_->b, placed(ray, t)); };
  std::vector<Transform> found;
  if (solids_->a.inside().empty() || solids_->b.inside().empty()) return found;
  for (int i = 0; i < kTries * count && static_cast<int>(found.size()) < count; ++i) {
    const Ray ray = draw_ray(method, 0.0);
    const std::optional<std::array<double, 2>> contact = bracket_contact(ray);
    if (!contact) continue;
    double less = (*contact)[1], more = less;
    while (more < ray.length && share(ray, more) < volume_share) {
      less = more;
      more += 0.02 * size_;
    }
    double got = share(ray, more);
    for (int k = 0; k < 20 && std::abs(got - volume_share) > kVolumeTolerance * volume_share; ++k) {
      const double middle = 0.5 * (less + more);
      got = share(ray, middle);
      (got < volume_share ? less : more) = middle;
      if (std::abs(got - volume_share) <= kVolumeTolerance * volume_share) more = middle;
    }
    if (std::abs(got - volume_share) <= kVolumeTolerance * volume_share) found.push_back(placed(ray, more));
  }
  return found;
}

std::vector<Transform> ContactConfigurations::scattered(int count) {
  std::vector<Transform> found;
  for (int i = 0; i < count; ++i) {
    const Quaterniond R_AB = geometry::uniform_rotation(stream_);
    const Vector3d reach = R_AB.toRotationMatrix().cwiseAbs() * box_b_.sizes() / 2.0;
    const geometry::Box meeting(box_a_.min() - reach, box_a_.max() + reach);
    found.push_back(transform_of(R_AB, inside(meeting, stream_) - R_AB * box_b_.center()));
  }
  return found;
}

std::vector<Transform> ContactConfigurations::around(const Transform& X_AB, int count) {
  std::vector<Transform> found(static_cast<std::size_t>(count), X_AB);
  for (Transform& X : found) {
    const Vector3d direction = geometry::uniform_direction(stream_);
    const Vector3d moved = size_ * std::pow(10.0, stream_.uniform(-8.0, -2.0)) * direction;
    for (int k = 0; k < 3; ++k) X.translation[static_cast<std::size_t>(k)] += static_cast<float>(moved[k]);
  }
  return found;
}

std::array<Transform, 16> ContactConfigurations::near(const Transform& X_AB) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(i)]);
  const Quaterniond R_AB = Quaterniond(matrix).normalized();
  const Vector3d p_AB = Eigen::Map<const Eigen::Vector3f>(X_AB.translation.data()).cast<double>();
  const Vector3d centre = R_AB * box_b_.center() + p_AB;
  std::array<Transform, 16> batch;
  for (Transform& X : batch) {
    // Half the way each, so that any two are within the limit.
    const Vector3d direction = geometry::uniform_direction(stream_);
    const Vector3d moved = 0.005 * size_ * std::cbrt(stream_.uniform()) * direction;
    const double angle = 0.5 * M_PI / 180.0 * std::cbrt(stream_.uniform());
    const Quaterniond R = Quaterniond(Eigen::AngleAxisd(angle, geometry::uniform_direction(stream_))) * R_AB;
    X = transform_of(R, centre + moved - R * box_b_.center());
  }
  return batch;
}

}  // namespace prescene::tests
