// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "filter_fixture.h"

namespace prescene::filter_tests {
namespace {

class PrepareFrame : public ::testing::Test {
 protected:
  PrepareFrame()
      : sequence_(still_sequence({box_model("box", {0.06, 0.06, 0.1})}, {Pose::from_translation({0.0, 0.0, 0.05})})),
        observation_(sequence_.observe(0, *backends_.renderer)) {}

  core::Status prepare(const std::shared_ptr<const belief::Scene>& scene) {
    const std::vector<Pose> X_WG(scene->robot.size());
    return prepare_frame(scene, observation_, X_WG, {}, {}, backends_.tools, cache_, &frame_);
  }

  Backends backends_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
  FrameCache cache_;
  FilterFrame frame_;
};

// Supports that a frame corrects come in a new copy of the scene each time.
TEST_F(PrepareFrame, MakesAnewOnlyWhatIsOtherInANewCopyOfTheScene) {
  ASSERT_TRUE(prepare(sequence_.scene).ok());
  const auto surfaces = cache_.surfaces;
  const geometry::DepthImage supports = frame_.supports;
  auto released = std::make_shared<belief::Scene>(*sequence_.scene);
  released->objects[0].held_by = "hand";
  ASSERT_TRUE(prepare(released).ok());
  EXPECT_EQ(cache_.surfaces, surfaces);
  auto lower = std::make_shared<belief::Scene>(*released);
  lower->supports[0].X_WS.translation.z() -= 0.05;
  ASSERT_TRUE(prepare(lower).ok());
  EXPECT_NE(cache_.surfaces, surfaces);
  EXPECT_NE(frame_.supports, supports);
  ASSERT_TRUE(prepare(sequence_.scene).ok());
  EXPECT_EQ(frame_.supports, supports);
}

TEST_F(PrepareFrame, RefusesColourThatIsNotThatOfTheDepthImagesPixels) {
  observation_.frame.color = std::make_shared<const geometry::ColorImage>(observation_.frame.camera.width / 2,
                                                                          observation_.frame.camera.height / 2);
  const core::Status refused = prepare(sequence_.scene);
  EXPECT_EQ(refused.code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(refused.message().find("registered"), std::string::npos) << refused.message();
  observation_.frame.color = nullptr;
  EXPECT_TRUE(prepare(sequence_.scene).ok());
}

}  // namespace
}  // namespace prescene::filter_tests
