// SPDX-License-Identifier: Apache-2.0
// Bytes as a small mesh and a pose: refused with a reason, or built into a tree whose answers are those of brute force.
//
//   number of vertices, number of triangles (a byte each), quaternion w x y z and translation (7 floats), vertices
//   (3 floats each), triangles (3 bytes each); what is missing is zero.
#include <array>
#include <cstring>
#include <vector>

#include "prescene/collision/exact_triangles.h"
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

bool brute_force(const Mesh& mesh, const Transform& X_AB) {
  for (std::uint32_t k = 0; k < mesh.triangle_count(); ++k) {
    Triangle placed = mesh.corners(k);
    for (Vector3f& p : placed) p = X_AB * p;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
      if (triangles_intersect(mesh.corners(i), placed)) return true;
    }
  }
  return false;
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
  QueryScratch scratch;
  const bool expected = brute_force(**mesh, *X_AB);
  PRESCENE_CHECK(collide(tree, tree, *X_AB, scratch) == expected);
  const std::array<Transform, 2> batch = {*X_AB, *X_AB};
  std::array<bool, 2> answers{};
  collide(tree, tree, batch, answers, scratch);
  PRESCENE_CHECK(answers[0] == expected && answers[1] == expected);
  const auto loaded = TriangleTree::from_bytes(tree.bytes(), *mesh, {});
  PRESCENE_CHECK(loaded.ok() && collide(*loaded, tree, *X_AB, scratch) == expected);
  return 0;
}
