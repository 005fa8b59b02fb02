// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/typical_runs.h"

#include <gtest/gtest.h>

#include "sliding_scene.h"

namespace prescene::queries {
namespace {

using geometry::Pose;
using geometry::Vector3d;

TEST(Medoid, IsTheMiddleOne) {
  std::vector<Pose> poses;
  for (double x : {0.0, 0.1, 0.25, 0.3, 5.0}) poses.push_back(Pose::from_translation({x, 0.0, 0.0}));
  EXPECT_EQ(medoid(poses, 0.1), 2u);  // a mean would lie at 1.13, where nothing ended
  EXPECT_FALSE(medoid({}, 0.1).has_value());
}

TEST(Medoid, TurnsCountAsTheyMoveTheRim) {
  std::vector<Pose> poses(3);
  poses[0].rotation = geometry::exp_rotation({0.0, 0.0, -1.0});
  poses[2].rotation = geometry::exp_rotation({0.0, 0.0, 1.0});
  EXPECT_EQ(medoid(poses, 0.1), 1u);
}

TEST(Medoid, OfVeryManyIsNearTheMiddle) {
  std::vector<Pose> poses;
  for (int i = 0; i < 5000; ++i) poses.push_back(Pose::from_translation({i / 5000.0, 0.0, 0.0}));
  EXPECT_NEAR(static_cast<double>(*medoid(poses, 0.1)), 2500.0, 20.0);
}

class EventText : public testing::Test {
 protected:
  std::string after(const Pose& X_end) {
    belief::Trajectory run;
    run.states.resize(2);
    for (belief::WorldState& state : run.states) state.objects.resize(2);
    run.states[0].objects[0].X_WO = Pose::from_translation({0.0, 0.0, 0.1});
    run.states[1].objects[0].X_WO = X_end;
    run.states[1].time = 2.0;
    run.contacts = {{0, 2, 1.0, 2.0, 0.1, 1.0}};  // lies on the table at the end
    return event_text(*scene_, run, 0, 0.01, 0.0873);
  }
  std::shared_ptr<belief::Scene> scene_ = tests::sliding_scene();
};

TEST_F(EventText, NamesWhatHappened) {
  const auto turned = [](const Vector3d& rotation, const Vector3d& p) {
    return Pose{geometry::exp_rotation(rotation), p};
  };
  EXPECT_EQ(after(turned({0, 0, 0.05}, {0.005, 0.0, 0.1})), "stays");
  EXPECT_EQ(after(turned({0, 0, 0}, {0.2, 0.0, 0.1})), "slides");
  EXPECT_EQ(after(turned({0, 0, 0.5}, {0.0, 0.0, 0.1})), "turns");
  EXPECT_EQ(after(turned({M_PI / 2, 0, 0}, {0.0, -0.1, 0.035})), "tips over and comes to rest on table");
  EXPECT_EQ(after(turned({M_PI / 2, 0, 0}, {0.0, -2.0, 0.035})), "rolls");
  EXPECT_EQ(after(turned({1.0, 0, 0}, {0.5, 0.0, -0.7})), "falls and comes to rest on table");
}

}  // namespace
}  // namespace prescene::queries
