// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/unknown_objects.h"

#include <gtest/gtest.h>

#include "simulated_sequence.h"

namespace prescene::filter_tests {
namespace {

/// At x = i cm.
belief::ObjectBelief object_number(int i, const std::string& name) {
  belief::ObjectBelief object;
  object.name = name;
  object.particles.resize(1);
  object.particles[0].X_WO.translation.x() = 0.01 * i;
  return object;
}

// What moves is simulated among the others where they were when it began to.
TEST(ForgetUnknownObjects, NeighboursOfWhatMovesStayWhereTheyWere) {
  belief::Belief belief;
  const Vector3d size(0.05, 0.05, 0.05);
  auto scene = std::make_shared<belief::Scene>(
      *table_scene({box_model("a", size), box_model("b", size), box_model("c", size)},
                   {Pose::identity(), Pose::identity(), Pose::identity()}, 0.001, 0.001));
  ASSERT_EQ(scene->objects.size(), 3U);
  const std::vector<std::string> names = {"mover", "unknown_1", "neighbour"};
  for (int i = 0; i < 3; ++i) {
    scene->objects[static_cast<std::size_t>(i)].name = names[static_cast<std::size_t>(i)];
    belief.objects.push_back(object_number(i, names[static_cast<std::size_t>(i)]));
  }
  belief.scene = scene;
  for (belief::ObjectBelief& object : belief.objects) {
    object.motion.episode.emplace();
    for (const belief::ObjectBelief& other : belief.objects)
      object.motion.episode->others.push_back(other.particles[0].X_WO);
  }
  belief.objects[1].state = belief::TrackState::kLost;
  EXPECT_EQ(filter::forget_unknown_objects(belief), 1);
  ASSERT_EQ(belief.objects.size(), 2U);
  ASSERT_TRUE(belief.objects[0].motion.episode);
  const std::vector<Pose>& others = belief.objects[0].motion.episode->others;
  ASSERT_EQ(others.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(others[i], belief.objects[i].particles[0].X_WO) << i;
  EXPECT_FALSE(belief.objects[1].motion.episode) << "its runs were numbered by its number among the objects";
}

}  // namespace
}  // namespace prescene::filter_tests
