// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "prescene/filter/proposals/pose_search.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

constexpr double kLeastFacetCosine = 0.8660254;  // 30 degrees: sharper edges are edges
constexpr double kRidge = 1e-9;                  // of the information, so that it can be inverted
constexpr double kMostFacetCosine = 0.9998477;   // 1 degree: flatter ones are parts of one face

}  // namespace

double facet_lever(const rendering::RenderMesh& mesh) {
  using Corner = std::array<float, 3>;
  const auto corner = [&](std::uint32_t vertex) -> Corner {
    const Eigen::Vector3f& p = mesh.vertices[vertex];
    return {p.x(), p.y(), p.z()};
  };
  // The triangles at each edge; vertices that lie in one place are one.
  std::map<std::pair<Corner, Corner>, std::vector<std::size_t>> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner a = corner(mesh.triangles[t][k]), b = corner(mesh.triangles[t][(k + 1) % 3]);
      edges[std::minmax(a, b)].push_back(t);
    }
  std::vector<bool> is_facet(mesh.triangles.size(), false);
  for (const auto& [edge, at] : edges) {
    if (at.size() != 2) continue;
    const double cosine = mesh.normals[at[0]].dot(mesh.normals[at[1]]);
    if (cosine < kLeastFacetCosine || cosine > kMostFacetCosine) continue;
    is_facet[at[0]] = is_facet[at[1]] = true;
  }
  double area_sum = 0.0, square_sum = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Eigen::Vector3f& pa = mesh.vertices[a];
    const Eigen::Vector3f& pb = mesh.vertices[b];
    const Eigen::Vector3f& pc = mesh.vertices[c];
    const double area = 0.5 * static_cast<double>((pb - pa).cross(pc - pa).norm());
    const double longest = static_cast<double>(std::max({(pb - pa).norm(), (pc - pb).norm(), (pa - pc).norm()}));
    if (!is_facet[t] || !(longest > 0.0)) continue;
    area_sum += area;
    const double width = 2.0 * area / longest;
    square_sum += area * width * width / 12.0;
  }
  return area_sum > 0.0 ? std::sqrt(square_sum / area_sum) : 0.0;
}

void without_facets(double facet_lever, const geometry::Quaterniond& R_CO, const geometry::Vector3d& p_OQ,
                    geometry::Matrix6d& H, geometry::Vector6d& g) {
  if (!(facet_lever > 0.0)) return;
  const geometry::Matrix6d A = from_point_coordinates(R_CO, p_OQ);  // d_O = A d_Q
  const geometry::Matrix6d A_inverse = from_point_coordinates(R_CO, -p_OQ);
  geometry::Matrix6d H_Q = A.transpose() * H * A;
  geometry::Vector6d g_Q = A.transpose() * g;
  const double spurious = facet_lever * facet_lever * H_Q.bottomRightCorner<3, 3>().trace();
  for (int axis = 0; axis < 3; ++axis) {
    // What is known of the turn while everything else may follow it: a round part that is not centred at Q turns and
    // moves, so that the diagonal alone is mostly about where it is.
    geometry::Matrix6d ridged = H_Q;
    ridged.diagonal() *= 1.0 + kRidge;
    ridged.diagonal().array() += kRidge * H_Q.trace() / 6.0;
    const geometry::Cholesky6 cholesky(ridged);
    if (!cholesky.positive_definite()) continue;
    const geometry::Matrix6d covariance = cholesky.inverse();
    const double turn = covariance.row(axis) * g_Q;
    const double information = 1.0 / covariance(axis, axis);
    const double taken = std::min(spurious, information);
    H_Q(axis, axis) -= taken;
    g_Q[axis] -= taken * turn;  // the turn that the equations ask for stays, with less weight
    // The rest goes with what ties the turn to the place: other terms may know the place.
    const double rest = spurious - taken;
    const double kept = H_Q(axis, axis) > rest ? std::sqrt(1.0 - rest / H_Q(axis, axis)) : 0.0;
    H_Q.row(axis) *= kept;
    H_Q.col(axis) *= kept;
    g_Q[axis] *= kept;
  }
  H = A_inverse.transpose() * H_Q * A_inverse;
  g = A_inverse.transpose() * g_Q;
}

}  // namespace prescene::filter
