// SPDX-License-Identifier: Apache-2.0
// The colour that a surface has of itself, in linear light: what lights multiply and blends are made of. sRGB is for
// files and screens [IEC 61966-2-1].
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

/// Red, green and blue in linear light, 1 = the brightest of sRGB.
using LinearRgb = Eigen::Vector3d;

double linear_of_srgb(double value);  ///< Of one channel, both within [0, 1].
double srgb_of_linear(double value);
LinearRgb linear(const geometry::Rgb& color);
/// The nearest; brighter than the brightest is the brightest.
geometry::Rgb srgb(const LinearRgb& color);

/// The texture at a place (MeshLook), bilinear in linear light.
LinearRgb texture_at(const geometry::ColorImage& texture, const Eigen::Vector2d& place);

/// The mesh's own colour at a point (mesh frame) of a face: of its texture, else its vertices, else the material.
LinearRgb own_color(const RenderMesh& mesh, std::size_t face, const geometry::Vector3d& p_M,
                    const SurfaceMaterial& material);

}  // namespace prescene::rendering
