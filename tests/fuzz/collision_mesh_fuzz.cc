// SPDX-License-Identifier: Apache-2.0
// Bytes as a small mesh and a pose: refused with a reason, or built into a tree whose answers to all kinds of queries
// are those of brute force.
//
//   number of vertices, number of triangles (a byte each), quaternion w x y z and translation (7 floats), vertices
//   (3 floats each), triangles (3 bytes each); what is missing is zero.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "prescene/collision/batch_queries.h"
#include "prescene/collision/continuous_queries.h"
#include "prescene/collision/distance_queries.h"
#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/penetration.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/collision/triangle_pair_distance.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/core/check.h"

using namespace prescene;             // NOLINT(google-build-using-namespace)
using namespace prescene::collision;  // NOLINT(google-build-using-namespace)

namespace {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : left_(data, size) {}

  template <class T>
  T take() {
    T value{};
    const std::size_t size = std::min(sizeof value, left_.size());
    std::memcpy(&value, left_.data(), size);
    left_ = left_.subspan(size);
    return value;
  }

 private:
  std::span<const std::uint8_t> left_;
};

/// The mesh against itself, moved.
struct BruteForce {
  bool collides = false;
  double distance = std::numeric_limits<double>::infinity();

  BruteForce(const Mesh& mesh, const Transform& X_AB) {
    for (std::uint32_t k = 0; k < mesh.triangle_count(); ++k) {
      Triangle placed = mesh.corners(k);
      for (Vector3f& p : placed) p = X_AB * p;
      for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        collides = collides || triangles_intersect(mesh.corners(i), placed);
        distance = std::min(distance, triangle_pair_distance(mesh.corners(i), placed).distance);
      }
    }
  }
};

double translation(const Transform& X) {
  double sum = 0.0;
  for (const float t : X.translation) sum += std::abs(static_cast<double>(t));
  return sum;
}

void check_distance(const TriangleTree& tree, const Transform& X_AB, const BruteForce& expected,
                    QueryScratch& scratch) {
  const std::optional<Distance> found = distance(tree, tree, X_AB, {}, scratch);
  PRESCENE_CHECK(found.has_value());
  PRESCENE_CHECK((found->distance == 0.0) == expected.collides);
  // Of two triangles; no box about two is larger.
  const double size = 2.0 * static_cast<double>(tree.radius()) + translation(X_AB);
  PRESCENE_CHECK(found->distance >= expected.distance - 1e-12 * size);
  constexpr double kUnresolved = 1e-18;  // m; squares of less are no single-precision numbers
  PRESCENE_CHECK(found->distance <= expected.distance + 0x1p-18 * size + kUnresolved);
  PRESCENE_CHECK(std::abs((found->p_A - found->p_B).norm() - found->distance) <= 1e-12 * size);
}

/// Not for a triangle that the ray sees nearly as a line: where along it they meet is left to rounding.
bool is_at_weights(const Ray& ray, double t, const std::array<double, 3>& weights, const Triangle& corners) {
  Eigen::Vector3d p = -(ray.origin + t * ray.direction);
  for (std::size_t k = 0; k < 3; ++k) p += weights[k] * corners[k].cast<double>();
  return p.norm() <= 1e-14 * (ray.origin.norm() + t * ray.direction.norm());
}

void check_rays(const TriangleTree& tree, const Eigen::Vector3d& origin, QueryScratch& scratch) {
  const Mesh& mesh = tree.mesh();
  for (const TriangleIndices& t : mesh.triangles()) {
    Ray ray;
    ray.origin = origin;
    ray.direction = (mesh.vertices()[t[0]] + mesh.vertices()[t[1]]).cast<double>() / 2.0 - origin;
    std::optional<double> nearest;
    bool sure = true;
    double rounding = 0.0;
    if (const std::optional<ShearedRay> sheared = shear(ray)) {
      for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const Triangle corners = mesh.corners(i);
        const auto hit = meet(*sheared, corners);
        if (hit) sure = sure && is_at_weights(ray, hit->s / sheared->metres, hit->weights, corners);
        if (hit && (!nearest || hit->s < *nearest)) nearest = hit->s;
      }
      if (nearest) *nearest = std::max(*nearest / sheared->metres, ray.t_min);
      rounding = 1e-13 * (static_cast<double>(tree.radius()) + origin.norm()) / sheared->metres;
    }
    const std::optional<RayHit> found = nearest_hit(tree, ray, scratch);
    PRESCENE_CHECK(found.has_value() == nearest.has_value());
    PRESCENE_CHECK(any_hit(tree, ray, scratch) == nearest.has_value());
    if (found && sure) PRESCENE_CHECK(std::abs(found->t - *nearest) <= rounding);
  }
}

/// From where the pose is apart by a size in x to the pose.
void check_first_contact(const TriangleTree& tree, const geometry::Pose& end, QueryScratch& scratch) {
  geometry::Pose start;
  start.translation = end.translation + Eigen::Vector3d(2.5 * static_cast<double>(tree.radius()), 0.0, 0.0);
  const auto motion = ScrewMotion::make(start, end);
  if (!motion) return;
  const FirstContact found = first_contact(tree, tree, *motion, {.step_limit = 20'000}, scratch);
  PRESCENE_CHECK(found.time >= 0.0 && found.time <= 1.0);
  PRESCENE_CHECK(found.outcome != MotionOutcome::kNoContact || found.time == 1.0);
  if (found.time == 0.0) return;
  const int last = found.outcome == MotionOutcome::kNoContact ? 8 : 7;
  for (int i = 0; i <= last; ++i) {
    const auto X_AB = to_transform(motion->pose(found.time * i / 8.0));
    PRESCENE_CHECK(X_AB.ok() && !collide(tree, tree, *X_AB, scratch));
  }
}

void check_penetration(const TriangleTree& tree, const Transform& X_AB, const BruteForce& expected,
                       PenetrationScratch& scratch) {
  const std::optional<Penetration> found = penetration(tree, tree, X_AB, {}, scratch);
  PRESCENE_CHECK(found.has_value() || !expected.collides);
  if (!found) return;
  PRESCENE_CHECK(found->least >= 0.0 && found->least <= found->depth && std::isfinite(found->depth));
  PRESCENE_CHECK(!BruteForce(tree.mesh(), found->X_AB_apart).collides);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  std::vector<Vector3f> vertices(bytes.take<std::uint8_t>() % 33);
  std::vector<TriangleIndices> triangles(bytes.take<std::uint8_t>() % 49);
  std::array<float, 7> numbers{};
  for (float& number : numbers) number = bytes.take<float>();
  for (Vector3f& p : vertices) p = {bytes.take<float>(), bytes.take<float>(), bytes.take<float>()};
  for (TriangleIndices& t : triangles)
    t = {bytes.take<std::uint8_t>(), bytes.take<std::uint8_t>(), bytes.take<std::uint8_t>()};

  const auto mesh = Mesh::make(std::move(vertices), std::move(triangles), "input");
  if (!mesh) {
    PRESCENE_CHECK(!mesh.status().message().empty());
    return 0;
  }
  geometry::Pose pose;
  pose.rotation = geometry::Quaterniond(numbers[0], numbers[1], numbers[2], numbers[3]);
  pose.translation = {numbers[4], numbers[5], numbers[6]};
  auto X_AB = to_transform(pose);
  if (!X_AB) {
    PRESCENE_CHECK(!X_AB.status().message().empty());
    // Most bytes are no unit quaternion: go on without a rotation.
    pose.rotation.setIdentity();
    X_AB = to_transform(pose);
    if (!X_AB) return 0;
  }
  core::ThreadPool one(1);
  const TriangleTree tree = TriangleTree::build(*mesh, {}, one);
  PenetrationScratch penetration_scratch;
  QueryScratch& scratch = penetration_scratch.queries();
  const BruteForce expected(**mesh, *X_AB);
  PRESCENE_CHECK(collide(tree, tree, *X_AB, scratch) == expected.collides);
  const std::array<Transform, 2> batch = {*X_AB, *X_AB};
  std::array<bool, 2> answers{};
  collide(tree, tree, batch, answers, scratch);
  PRESCENE_CHECK(answers[0] == expected.collides && answers[1] == expected.collides);
  const auto loaded = TriangleTree::from_bytes(tree.bytes(), *mesh, {});
  PRESCENE_CHECK(loaded.ok() && collide(*loaded, tree, *X_AB, scratch) == expected.collides);
  check_distance(tree, *X_AB, expected, scratch);
  check_rays(tree, pose.translation, scratch);
  check_first_contact(tree, pose, scratch);
  check_penetration(tree, *X_AB, expected, penetration_scratch);
  return 0;
}
