// SPDX-License-Identifier: Apache-2.0
// The device computes the bits of rendering/simd.
#include <gtest/gtest.h>

#include "compute_scene.h"
#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering {
namespace {

/// Which hypotheses differ, and in how many of their words.
template <class Computed>
void expect_same(const std::vector<Computed>& actual, const std::vector<Computed>& expected, int width) {
  const std::vector<std::uint64_t> a = bits_of(actual), b = bits_of(expected);
  const std::size_t words = a.size() / actual.size();
  int different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    if (++different <= 5)
      ADD_FAILURE() << "width " << width << ": hypothesis " << i / words << " differs in its word " << i % words;
  }
  EXPECT_EQ(different, 0) << "of " << a.size() << " words";
}

class ComputeEquivalence : public testing::Test {
 protected:
  std::unique_ptr<ComputeLikelihoodBatch> made(const ComputeOptions& options) {
    auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options);
    if (batch) return *std::move(batch);
    EXPECT_EQ(batch.status().code(), core::StatusCode::kUnavailable) << batch.status().message();
    return nullptr;
  }

  void compare(const ComputeLikelihoodBatch& batch, const ComputeScene& scene, int width) {
    const auto workspace = batch.make_workspace();
    const auto its_workspace = simd_->make_workspace();
    std::vector<PoseEvidence> evidences(scene.hypotheses.size()), expected(scene.hypotheses.size());
    batch.evaluate(scene.frame, scene.hypotheses, *workspace, evidences);
    simd_->evaluate(scene.frame, scene.hypotheses, *its_workspace, expected);
    expect_same(evidences, expected, width);
    for (const bool with_evidence : {false, true}) {
      LineariseOptions options;
      options.with_evidence = with_evidence;
      options.gate = 0.03;
      std::vector<PoseLinearisation> equations(scene.hypotheses.size()), theirs(scene.hypotheses.size());
      batch.linearise(scene.frame, scene.hypotheses, options, *workspace, equations);
      simd_->linearise(scene.frame, scene.hypotheses, options, *its_workspace, theirs);
      expect_same(equations, theirs, width);
    }
  }

  std::unique_ptr<LikelihoodBatch> simd_ = make_simd_likelihood_batch();
};

TEST_F(ComputeEquivalence, GivesTheBitsOfTheProcessor) {
  const auto batch = made({});
  if (batch == nullptr) GTEST_SKIP() << "no OpenGL 4.3 here";
  std::uint64_t on_device = 0;
  for (const int width : {16, 40, 80, 107, 160, 320}) {
    const ComputeScene scene(width, 400);
    compare(*batch, scene, width);
    // Most of them, or the test compares the processor with itself.
    EXPECT_GT(batch->health().on_device - on_device, 3 * 280u) << width;
    on_device = batch->health().on_device;
  }
  EXPECT_EQ(batch->health().lost, 0u);
}

TEST_F(ComputeEquivalence, NeedsNoExactDivision) {
  // OpenGL allows quotients to be two or three units off.
  for (const int error : {-3, 2}) {
    ComputeOptions options;
    options.division_error = error;
    const auto batch = made(options);
    if (batch == nullptr) GTEST_SKIP() << "no OpenGL 4.3 here";
    compare(*batch, ComputeScene(80, 100), 80);
    EXPECT_GT(batch->health().on_device, 200u);
  }
}

TEST_F(ComputeEquivalence, HoldsForDispatchesInParts) {
  // Room for a few hypotheses at a time.
  ComputeOptions options;
  options.scratch_mib = 1;
  const auto batch = made(options);
  if (batch == nullptr) GTEST_SKIP() << "no OpenGL 4.3 here";
  compare(*batch, ComputeScene(80, 200), 80);
  EXPECT_GT(batch->health().dispatches, 6u);
}

}  // namespace
}  // namespace prescene::rendering
