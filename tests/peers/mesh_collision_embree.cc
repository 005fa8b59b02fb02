// SPDX-License-Identifier: Apache-2.0
#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <utility>
#include <vector>

#include "tests/peers/mesh_collision.h"

namespace prescene::tests {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Triangle = std::array<Vector3d, 3>;

bool separates(const Vector3d& axis, const Triangle& a, const Triangle& b) {
  const std::array<double, 3> on_a = {axis.dot(a[0]), axis.dot(a[1]), axis.dot(a[2])};
  const std::array<double, 3> on_b = {axis.dot(b[0]), axis.dot(b[1]), axis.dot(b[2])};
  const auto [low_a, high_a] = std::minmax_element(on_a.begin(), on_a.end());
  const auto [low_b, high_b] = std::minmax_element(on_b.begin(), on_b.end());
  return *high_a < *low_b || *high_b < *low_a;
}

bool triangles_touch(const Triangle& a, const Triangle& b) {
  const std::array<Vector3d, 3> edges_a = {a[1] - a[0], a[2] - a[1], a[0] - a[2]};
  const std::array<Vector3d, 3> edges_b = {b[1] - b[0], b[2] - b[1], b[0] - b[2]};
  const Vector3d normal_a = edges_a[0].cross(edges_a[1]), normal_b = edges_b[0].cross(edges_b[1]);
  if (separates(normal_a, a, b) || separates(normal_b, a, b)) return false;
  for (const Vector3d& edge_a : edges_a)
    for (const Vector3d& edge_b : edges_b)
      if (separates(edge_a.cross(edge_b), a, b)) return false;
  // Triangles in one plane.
  for (const Vector3d& edge : edges_a)
    if (separates(normal_a.cross(edge), a, b)) return false;
  for (const Vector3d& edge : edges_b)
    if (separates(normal_b.cross(edge), a, b)) return false;
  return true;
}

/// A mesh and where its vertices are now, which is what Embree's callbacks read.
struct PlacedMesh {
  CollisionMesh mesh;
  std::vector<Vector3f> vertices;
  RTCGeometry geometry = nullptr;
  RTCScene scene = nullptr;

  Triangle triangle(unsigned index) const {
    const auto& t = mesh->triangles()[index];
    return {vertices[t[0]].cast<double>(), vertices[t[1]].cast<double>(), vertices[t[2]].cast<double>()};
  }
};

void bounds_of_triangle(const RTCBoundsFunctionArguments* arguments) {
  const auto* placed = static_cast<const PlacedMesh*>(arguments->geometryUserPtr);
  const auto& t = placed->mesh->triangles()[arguments->primID];
  const Vector3f &p = placed->vertices[t[0]], &q = placed->vertices[t[1]], &r = placed->vertices[t[2]];
  const Vector3f low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
  RTCBounds* bounds = arguments->bounds_o;
  bounds->lower_x = low.x();
  bounds->lower_y = low.y();
  bounds->lower_z = low.z();
  bounds->upper_x = high.x();
  bounds->upper_y = high.y();
  bounds->upper_z = high.z();
}

struct Query {
  const PlacedMesh* a;
  const PlacedMesh* b;
  bool found = false;
};

void on_pairs(void* user, RTCCollision* pairs, unsigned count) {
  auto* query = static_cast<Query*>(user);
  for (unsigned i = 0; i < count && !query->found; ++i)
    query->found = triangles_touch(query->a->triangle(pairs[i].primID0), query->b->triangle(pairs[i].primID1));
}

bool count_bytes(void* user, ssize_t bytes, bool /*post*/) {
  *static_cast<ssize_t*>(user) += bytes;
  return true;
}

class EmbreePair : public MeshPairPeer {
 public:
  EmbreePair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) : device_(rtcNewDevice("threads=1")) {
    rtcSetDeviceMemoryMonitorFunction(device_, count_bytes, &bytes_);
    build(mesh_a, false, &a_, &cost_a_);
    build(mesh_b, true, &b_, &cost_b_);
  }
  ~EmbreePair() override {
    for (const PlacedMesh* placed : {&a_, &b_}) {
      rtcReleaseGeometry(placed->geometry);
      rtcReleaseScene(placed->scene);
    }
    rtcReleaseDevice(device_);
  }

  bool collide(const collision::Transform& X_AB) override {
    const std::vector<Vector3f>& vertices = b_.mesh->vertices();
    for (std::size_t i = 0; i < vertices.size(); ++i) b_.vertices[i] = X_AB * vertices[i];
    rtcCommitGeometry(b_.geometry);
    rtcCommitScene(b_.scene);
    Query query{&a_, &b_};
    rtcCollide(a_.scene, b_.scene, on_pairs, &query);
    return query.found;
  }

  std::optional<double> distance(const collision::Transform& /*X_AB*/) override { return std::nullopt; }

  std::string_view differs() const override {
    return "moves all vertices and refits its tree in each query; cannot be stopped at the first contact";
  }

 private:
  void build(const CollisionMesh& mesh, bool moves, PlacedMesh* placed, MeshPeerCost* cost) {
    const auto start = std::chrono::steady_clock::now();
    const ssize_t bytes_before = bytes_;
    placed->mesh = mesh;
    placed->vertices = mesh->vertices();
    placed->scene = rtcNewScene(device_);
    placed->geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(placed->geometry, mesh->triangle_count());
    rtcSetGeometryUserData(placed->geometry, placed);
    rtcSetGeometryBoundsFunction(placed->geometry, bounds_of_triangle, nullptr);
    if (moves) {
      rtcSetSceneFlags(placed->scene, RTC_SCENE_FLAG_DYNAMIC);
      rtcSetSceneBuildQuality(placed->scene, RTC_BUILD_QUALITY_LOW);
      rtcSetGeometryBuildQuality(placed->geometry, RTC_BUILD_QUALITY_REFIT);
    }
    rtcCommitGeometry(placed->geometry);
    rtcAttachGeometry(placed->scene, placed->geometry);
    rtcCommitScene(placed->scene);
    cost->build = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    cost->bytes = static_cast<std::size_t>(bytes_ - bytes_before);
  }

  ssize_t bytes_ = 0;
  RTCDevice device_;
  PlacedMesh a_, b_;
};

}  // namespace

std::unique_ptr<MeshPairPeer> make_embree_pair(const CollisionMesh& mesh_a, const CollisionMesh& mesh_b) {
  return std::make_unique<EmbreePair>(mesh_a, mesh_b);
}

}  // namespace prescene::tests
