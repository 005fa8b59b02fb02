// SPDX-License-Identifier: Apache-2.0
// What the contract of likelihoods does not ask: every instruction set gives the same bits.
#include "prescene/rendering/simd/simd_likelihood.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "scenes.h"
#include "tests/support/target_test.h"

namespace prescene::rendering {
namespace {

using geometry::Pose;
using geometry::Vector3d;

/// Depths of a plane with holes and steps, and hypotheses of round, flat and open things over it.
struct Setting {
  Setting() {
    camera = tests::camera_of_width(320);
    core::RandomStream stream(21, core::Purpose::kTest);
    geometry::DepthImage depth(camera.width, camera.height);
    for (std::size_t i = 0; i < depth.size(); ++i)
      depth.data()[i] = stream.uniform() < 0.1 ? 0.0f : static_cast<float>(stream.uniform(0.75, 1.0));
    FrameTermsInput input;
    input.camera = camera;
    input.depth = depth.view();
    FrameTermsOptions options;
    options.target_width = 107;  // no multiple of any vector
    EXPECT_TRUE(make_frame_terms(input, options, SensorModel{}, &frame).ok());
    meshes = {make_render_mesh(geometry::make_mesh(geometry::Sphere{0.08}, 40)),
              make_render_mesh(geometry::make_mesh(geometry::BoxShape{{0.15, 0.1, 0.2}})),
              make_render_mesh(geometry::make_open_bin({0.2, 0.15, 0.1}, 0.005))};
    for (int i = 0; i < 300; ++i) {
      const geometry::Quaterniond rotation = geometry::uniform_rotation(stream);
      const double z = stream.uniform(0.25, 1.2), y = stream.uniform(-0.2, 0.2), x = stream.uniform(-0.3, 0.3);
      const Pose X_CO{rotation, Vector3d(x, y, z)};
      hypotheses.push_back({meshes[static_cast<std::size_t>(i) % 3].get(), X_CO, &material});
    }
  }

  geometry::PinholeCamera camera;
  FrameTerms frame;
  std::vector<MeshHandle> meshes;
  SurfaceMaterial material;
  std::vector<PoseHypothesis> hypotheses;
};

std::vector<std::uint64_t> bits_of(const Setting& setting) {
  const auto batch = make_simd_likelihood_batch();
  const auto workspace = batch->make_workspace();
  LineariseOptions options;
  options.with_evidence = true;
  std::vector<PoseLinearisation> equations(setting.hypotheses.size());
  batch->linearise(setting.frame, setting.hypotheses, options, *workspace, equations);
  std::vector<std::uint64_t> bits;
  for (const PoseLinearisation& e : equations) {
    for (const double value : {e.evidence.log_ratio, e.evidence.visible_log_ratio, e.evidence.tempered, e.squares})
      bits.push_back(std::bit_cast<std::uint64_t>(value));
    for (Eigen::Index i = 0; i < 36; ++i) bits.push_back(std::bit_cast<std::uint64_t>(e.H(i / 6, i % 6)));
    for (Eigen::Index i = 0; i < 6; ++i) bits.push_back(std::bit_cast<std::uint64_t>(e.g[i]));
    bits.push_back(static_cast<std::uint64_t>(e.evidence.hits));
  }
  return bits;
}

TEST(SimdLikelihood, EveryInstructionSetGivesTheSameBits) {
  const Setting setting;
  const std::vector<std::uint64_t> expected = bits_of(setting);
  const std::vector<std::int64_t> targets = collision::all_targets();
  EXPECT_FALSE(targets.empty());
  for (const std::int64_t target : targets) {
    const collision::UseTarget use(target);
    EXPECT_TRUE(bits_of(setting) == expected) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace prescene::rendering
