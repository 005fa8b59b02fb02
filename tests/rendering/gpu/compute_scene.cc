// SPDX-License-Identifier: Apache-2.0
#include "compute_scene.h"

#include <gtest/gtest.h>

#include <bit>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"

namespace prescene::rendering {

using geometry::Vector3d;

ComputeScene::ComputeScene(int width, int count) {
  geometry::PinholeCamera camera{320, 240, 301.0, 302.0, 158.7, 121.3};
  core::RandomStream stream(31, core::Purpose::kTest);
  geometry::DepthImage depth(camera.width, camera.height);
  geometry::ColorImage color(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double plane = (x / 40 + y / 40) % 3 == 0 ? 0.8 : 1.1;
      depth(x, y) = stream.uniform() < 0.1 ? 0.0f : static_cast<float>(plane + 0.004 * stream.normal());
      for (std::uint8_t& channel : color(x, y)) channel = static_cast<std::uint8_t>(stream.uniform(0.0, 255.0));
    }
  }
  std::vector<ColorModel> colors(2);
  for (ColorModel& model : colors)
    for (float& ratio : model.log_ratio) ratio = static_cast<float>(stream.uniform(-3.0, 3.0));
  FrameTermsInput input;
  input.camera = camera;
  input.depth = depth.view();
  input.color = color.view();
  input.color_models = colors;
  SupportRegion wall;
  wall.plane_C = {Vector3d(0.0, 0.0, -1.0), 1.1};
  input.supports = std::span(&wall, 1);
  FrameTermsOptions options;
  options.target_width = width;
  EXPECT_TRUE(make_frame_terms(input, options, SensorModel{}, &frame).ok());
  geometry::DepthImage known(frame.camera.width, frame.camera.height, 0.0f);
  for (int y = 0; y < known.height() / 3; ++y)
    for (int x = 0; x < known.width() / 2; ++x) known(x, y) = 0.7f;
  with_known_surfaces(frame, known, &frame);

  meshes = {make_render_mesh(geometry::make_mesh(geometry::Sphere{0.08}, 40)),
            make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.15, 0.1, 0.2}})),
            make_render_mesh(geometry::make_open_bin({0.2, 0.15, 0.1}, 0.005)),
            make_render_mesh(geometry::make_mesh(geometry::BoxShape{{1.5, 1.0, 0.01}})),
            make_render_mesh(geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.05, 0.1}, {0.03, 0.01}}, 24))};
  materials = {SurfaceMaterial::opaque(), SurfaceMaterial::transparent(), SurfaceMaterial::mirror()};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    PoseHypothesis h;
    h.X_CO.rotation = geometry::uniform_rotation(stream);
    h.X_CO.translation = {stream.uniform(-0.35, 0.35), stream.uniform(-0.25, 0.25),
                          i % 12 == 0 ? stream.uniform(-0.3, 0.5) : stream.uniform(0.6, 1.3)};
    h.mesh = meshes[i % meshes.size()].get();
    h.material = &materials[i % materials.size()];
    h.color_model = static_cast<int>(i % 3) - 1;
    if (i % 4 == 0) h.tempering_pixels = 40.0;
    hypotheses.push_back(h);
  }
}

namespace {

void add_bits(const PoseEvidence& e, std::vector<std::uint64_t>* bits) {
  for (const double value : {e.log_ratio, e.visible_log_ratio, e.tempered})
    bits->push_back(std::bit_cast<std::uint64_t>(value));
  for (const int count : {e.in_view, e.covered, e.measured, e.visible, e.hits})
    bits->push_back(static_cast<std::uint64_t>(count));
}

}  // namespace

std::vector<std::uint64_t> bits_of(const std::vector<PoseEvidence>& evidences) {
  std::vector<std::uint64_t> bits;
  for (const PoseEvidence& e : evidences) add_bits(e, &bits);
  return bits;
}

std::vector<std::uint64_t> bits_of(const std::vector<PoseLinearisation>& linearisations) {
  std::vector<std::uint64_t> bits;
  for (const PoseLinearisation& e : linearisations) {
    add_bits(e.evidence, &bits);
    for (const double value : {e.weight, e.squares}) bits.push_back(std::bit_cast<std::uint64_t>(value));
    for (Eigen::Index i = 0; i < 36; ++i) bits.push_back(std::bit_cast<std::uint64_t>(e.H(i / 6, i % 6)));
    for (Eigen::Index i = 0; i < 6; ++i) bits.push_back(std::bit_cast<std::uint64_t>(e.g[i]));
    bits.push_back(static_cast<std::uint64_t>(e.pixels));
  }
  return bits;
}

}  // namespace prescene::rendering
