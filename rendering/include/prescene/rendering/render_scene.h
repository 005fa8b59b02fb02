// SPDX-License-Identifier: Apache-2.0
// What is rendered: meshes with poses in a world frame W and the look of their surfaces. Knows nothing of beliefs.
//
//   MeshHandle mesh = make_render_mesh(triangle_mesh);
//   RenderScene scene;
//   scene.instances.push_back({mesh, X_WM, SurfaceMaterial::opaque({200, 40, 40})});
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "prescene/geometry/image.h"
#include "prescene/geometry/mesh_look.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::rendering {

using Eigen::Vector3f;

/// A mesh in clusters of neighbouring triangles that look much the same way, coordinate by coordinate.
struct MeshClusters {
  static constexpr std::size_t kSize = 32;      ///< Triangles and vertices of a cluster have room for so many.
  static constexpr std::size_t kMultiple = 16;  ///< Other arrays are filled up to a multiple.

  std::size_t count = 0;
  // kSize a cluster, first come first: filled up with its last vertex, and with triangles of no plane.
  std::vector<float> x, y, z;                               ///< Vertices.
  std::vector<std::int32_t> a, b, c;                        ///< Corners of the triangles: vertices of their cluster.
  std::vector<float> normal_x, normal_y, normal_z, offset;  ///< Planes of the triangles.
  std::vector<std::uint8_t> triangles;                      ///< Of each cluster.
  /// Of each cluster: from a camera at c all of its triangles are seen from behind if
  /// (centre - c) . axis >= cutoff |centre - c| + radius.
  std::vector<float> centre_x, centre_y, centre_z, radius, axis_x, axis_y, axis_z, cutoff;
  std::vector<float> vertex_x, vertex_y, vertex_z;  ///< All vertices of the mesh once, filled up with the last.
};

/// A number that no other object of this process has or had; a copy gets one of its own.
class UniqueNumber {
 public:
  UniqueNumber();
  UniqueNumber(const UniqueNumber&) : UniqueNumber() {}
  UniqueNumber& operator=(const UniqueNumber&);
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_;
};

using geometry::MeshLook;  // for pictures; likelihoods of depth look at none of it

/// A triangle mesh in single precision as renderers want it; immutable once made, shared by handle.
struct RenderMesh {
  std::vector<Vector3f> vertices;                       ///< Metres, mesh frame M.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counter-clockwise seen from outside.
  std::vector<Vector3f> normals;                        ///< One outward unit normal a triangle, mesh frame.
  std::vector<float> offsets;                           ///< normal . p of a triangle's plane, metres.
  MeshClusters clusters;                                ///< The same once more, triangles in the same order.
  Vector3f centre = Vector3f::Zero();                   ///< Of a bounding sphere, mesh frame.
  float radius = 0.0f;                                  ///< Of that sphere, metres.
  /// Watertight and consistently oriented: faces seen from behind are never visible from outside.
  bool closed = false;
  MeshLook look;
  UniqueNumber number;  ///< By which devices know what they have already.
};
using MeshHandle = std::shared_ptr<const RenderMesh>;

/// Triangles without area are left out; indices out of range are a bug (checked), and so is a look of another size. An
/// empty mesh renders nothing.
MeshHandle make_render_mesh(const geometry::TriangleMesh& mesh, const MeshLook& look = {});

/// How depth cameras see a surface: shares of what a pixel on it returns, of the pixels that return anything.
/// hit + occluder + behind + outlier = 1.
struct SurfaceMaterial {
  double hit = 0.90;       ///< Depth of the surface itself.
  double occluder = 0.06;  ///< Of something unmodelled in front of it.
  double behind = 0.0;     ///< Of what stands behind the surface, seen through it.
  double outlier = 0.04;   ///< Anything in range.
  /// Probability that a frontal pixel far from the outline returns nothing.
  double missing = 0.03;
  geometry::Rgb color = {180, 180, 180};  ///< Diffuse, for the simulated colour camera.

  friend bool operator==(const SurfaceMaterial&, const SurfaceMaterial&) = default;

  /// Shares measured on opaque household objects (docs/reference/sensor_model.md).
  static SurfaceMaterial opaque(const geometry::Rgb& color = {180, 180, 180});
  /// Glass and clear plastic: mostly the depth behind it or none.
  static SurfaceMaterial transparent(const geometry::Rgb& color = {210, 225, 230});
  /// Polished metal: often no return, else outliers.
  static SurfaceMaterial mirror(const geometry::Rgb& color = {190, 190, 195});
};

/// One thing to draw.
struct RenderInstance {
  MeshHandle mesh;
  geometry::Pose X_WM;
  SurfaceMaterial material;
};

/// Instances in the order of their labels: the label image of a view holds 1 + index, 0 where nothing is.
/// At most 65535 instances.
struct RenderScene {
  std::vector<RenderInstance> instances;
};

}  // namespace prescene::rendering
