// SPDX-License-Identifier: Apache-2.0
// What goes wrong on devices, and what then happens.
#include "prescene/rendering/gpu/compute_likelihood.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "compute_scene.h"
#include "prescene/geometry/primitives.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering {
namespace {

class ComputeLikelihood : public testing::Test {
 protected:
  void SetUp() override {
    options_.device.faults = std::make_shared<GraphicsFaults>();
    auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
    if (!batch) {
      ASSERT_EQ(batch.status().code(), core::StatusCode::kUnavailable) << batch.status().message();
      GTEST_SKIP() << batch.status().message();
    }
    batch_ = *std::move(batch);
    workspace_ = batch_->make_workspace();
    expected_.resize(scene_.hypotheses.size());
    const auto simd = make_simd_likelihood_batch();
    const auto workspace = simd->make_workspace();
    simd->evaluate(scene_.frame, scene_.hypotheses, *workspace, expected_);
  }

  /// Evaluates all, which must be right whatever happens.
  void evaluate() {
    std::vector<PoseEvidence> evidences(scene_.hypotheses.size());
    batch_->evaluate(scene_.frame, scene_.hypotheses, *workspace_, evidences);
    EXPECT_TRUE(bits_of(evidences) == bits_of(expected_));
  }

  ComputeScene scene_{80, 60};
  ComputeOptions options_;
  std::unique_ptr<ComputeLikelihoodBatch> batch_;
  std::unique_ptr<LikelihoodWorkspace> workspace_;
  std::vector<PoseEvidence> expected_;
};

TEST_F(ComputeLikelihood, TellsWhatItRunsOn) {
  evaluate();
  const ComputeHealth health = batch_->health();
  EXPECT_FALSE(health.device.empty());
  EXPECT_EQ(health.dispatches, 1u);
  EXPECT_GT(health.on_device, 40u);
  EXPECT_LE(health.on_device + health.on_processor, 60u);
  EXPECT_EQ(health.lost, 0u);
  EXPECT_FALSE(health.given_up);
  EXPECT_TRUE(health.last_failure.ok());
  EXPECT_TRUE(batch_->info().deterministic_bits);
}

TEST_F(ComputeLikelihood, MakesALostContextAgain) {
  evaluate();
  const std::uint64_t on_device = batch_->health().on_device;
  for (std::atomic<int>* fault : {&options_.device.faults->losses, &options_.device.faults->resets}) {
    const std::uint64_t lost = batch_->health().lost;
    fault->store(1);
    evaluate();
    EXPECT_EQ(fault->load(), 0);
    EXPECT_EQ(batch_->health().lost, lost + 1);
    EXPECT_FALSE(batch_->health().last_failure.ok());
  }
  evaluate();
  // Everything was done on the device in the end.
  EXPECT_EQ(batch_->health().on_device, 4 * on_device);
  EXPECT_FALSE(batch_->health().given_up);
}

TEST_F(ComputeLikelihood, LeavesAllToTheProcessorAfterThreeFailures) {
  options_.device.faults->losses = 1;
  options_.device.faults->refusals = 100;
  const std::uint64_t on_device = batch_->health().on_device;
  for (int i = 0; i < 4; ++i) evaluate();
  EXPECT_TRUE(batch_->health().given_up);
  EXPECT_EQ(batch_->health().on_device, on_device);
  // It did not go on trying.
  EXPECT_EQ(options_.device.faults->refusals, 98);
}

TEST_F(ComputeLikelihood, LeavesSmallCallsAndCutMeshesToTheProcessor) {
  options_.least_hypotheses = 61;
  auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
  ASSERT_TRUE(batch.ok());
  batch_ = *std::move(batch);
  workspace_ = batch_->make_workspace();
  EXPECT_EQ(batch_->info().good_call, 61u);
  evaluate();
  EXPECT_EQ(batch_->health().dispatches, 0u);
  EXPECT_EQ(batch_->health().on_processor, 60u);
  for (PoseHypothesis& h : scene_.hypotheses) h.X_CO.translation = {0.0, 0.0, 0.3};
  scene_.hypotheses.push_back(scene_.hypotheses.back());
  expected_.resize(61);
  const auto simd = make_simd_likelihood_batch();
  simd->evaluate(scene_.frame, scene_.hypotheses, *simd->make_workspace(), expected_);
  evaluate();
  EXPECT_EQ(batch_->health().on_device, 0u);
}

TEST_F(ComputeLikelihood, KnowsAMeshByItsNumberAndNotByItsPlace) {
  // Meshes that come and go at one address.
  const auto simd = make_simd_likelihood_batch();
  const auto workspace = simd->make_workspace();
  PoseHypothesis h = scene_.hypotheses[1];
  h.X_CO.translation = {0.0, 0.0, 0.8};
  for (int i = 0; i < 20; ++i) {
    const MeshHandle mesh = make_render_mesh(geometry::make_mesh(geometry::Sphere{0.03 + 0.005 * i}, 24));
    h.mesh = mesh.get();
    PoseEvidence actual, expected;
    batch_->evaluate(scene_.frame, std::span(&h, 1), *workspace_, std::span(&actual, 1));
    simd->evaluate(scene_.frame, std::span(&h, 1), *workspace, std::span(&expected, 1));
    EXPECT_EQ(actual.log_ratio, expected.log_ratio);
    EXPECT_GT(actual.in_view, 10);
  }
  EXPECT_EQ(batch_->health().on_device, 20u);
}

TEST_F(ComputeLikelihood, RefusesADeviceThatComputesOtherwise) {
  options_.division_error = 100;
  const auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
  ASSERT_FALSE(batch.ok());
  EXPECT_EQ(batch.status().code(), core::StatusCode::kUnsupported);
  EXPECT_NE(batch.status().message().find("a quotient"), std::string::npos) << batch.status().message();
}

TEST_F(ComputeLikelihood, TakesTheDeviceThatIsChosen) {
  const std::vector<GraphicsDevice> devices = graphics_devices();
  options_.device.device = static_cast<int>(devices.size());
  const auto beyond = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.status().code(), core::StatusCode::kInvalidInput);
  for (const GraphicsDevice& device : devices) {
    options_.device.device = device.index;
    options_.device.hardware_only = false;
    const auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
    if (!batch) continue;
    EXPECT_EQ((*batch)->health().software, device.software) << device.name;
    options_.device.hardware_only = true;
    const auto hardware = make_compute_likelihood_batch(make_simd_likelihood_batch(), options_);
    EXPECT_EQ(hardware.ok(), !device.software) << device.name;
  }
}

TEST(ComputeLikelihoodWithoutDriver, NamesThePackage) {
  // libEGL looks for its drivers where this variable says; in a process of its own, since it looks once.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
        const auto batch = make_compute_likelihood_batch(make_simd_likelihood_batch(), {});
        const bool named = !batch && batch.status().code() == core::StatusCode::kUnavailable &&
                           batch.status().message().find("libegl-mesa0") != std::string::npos;
        std::exit(named ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace prescene::rendering
